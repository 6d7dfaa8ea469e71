#include "scene/shutter.h"

#include <cmath>
#include <gtest/gtest.h>

namespace kanuka::scene {
namespace {

// The share of light that has come before a time, integrated plainly.
double light_before(std::span<const float> opening, double time) {
    constexpr int N = 200000;
    double before = 0, all = 0;
    for (int i = 0; i < N; i++) {
        const double t = (i + 0.5) / N, w = double(shutter_openness(opening, float(t)));
        all += w;
        before += t < time ? w : 0;
    }
    return before / all;
}

} // namespace

TEST(Shutter, OpensAsItSays) {
    const float trapezoid[] = {0.25f, 0.5f};
    EXPECT_FLOAT_EQ(shutter_openness(trapezoid, 0.125f), 0.5f);
    EXPECT_FLOAT_EQ(shutter_openness(trapezoid, 0.3f), 1);
    EXPECT_FLOAT_EQ(shutter_openness(trapezoid, 0.75f), 0.5f);
    EXPECT_FLOAT_EQ(shutter_openness(trapezoid, 1), 0);
    EXPECT_FLOAT_EQ(shutter_openness({}, 0.01f), 1);
    // Inner points on the straight lines: the same trapezoid. Then one that rises late, at one half to 1/8 +
    // 3/8 y.
    const float straight[] = {0.3f,     0.6f,       0.1f,     1 / 3.0f,   0.2f,
                              2 / 3.0f, 0.7333333f, 2 / 3.0f, 0.8666667f, 1 / 3.0f};
    for (const float t : {0.05f, 0.15f, 0.29f, 0.5f, 0.7f, 0.99f})
        EXPECT_NEAR(shutter_openness(straight, t), shutter_openness(std::span(straight, 2), t), 1e-5f);
    const float late[] = {0.3f, 0.6f, 0.1f, 0, 0.2f, 0, 0.7333333f, 0, 0.8666667f, 0};
    EXPECT_NEAR(shutter_openness(late, 0.15f), 0.125f, 1e-5f);
    EXPECT_NEAR(shutter_openness(late, 0.8f), 0.125f, 1e-5f);
}

TEST(Shutter, QuantilesFollowTheLight) {
    const std::vector<std::vector<float>> openings = {
        {0.25f, 0.5f}, {0, 0.3f}, {1, 1},
        {0.5f, 0.5f},  {0, 1},    {0.3f, 0.6f, 0.1f, 0, 0.2f, 0, 0.7f, 1, 0.8f, 1}};
    for (const auto& opening : openings) {
        const std::vector<float> q = shutter_quantiles(opening);
        ASSERT_EQ(q.size(), size_t(ShutterSegments) + 1);
        for (int k = 0; k < ShutterSegments; k++)
            EXPECT_LE(q[size_t(k)], q[size_t(k) + 1]);
        for (int k = 1; k < ShutterSegments; k += 17)
            EXPECT_NEAR(light_before(opening, double(q[size_t(k)])), double(k) / ShutterSegments, 1e-4);
    }
    EXPECT_TRUE(shutter_quantiles({}).empty());
}

TEST(Shutter, SaysWhatIsWrong) {
    EXPECT_FALSE(fault_of_opening({}));
    const std::vector<std::vector<float>> wrong = {
        {0.5f}, {0.6f, 0.4f}, {-0.1f, 0.5f},
        {0, 2}, {0, NAN},     {0.3f, 0.6f, 0.5f, 0, 0.2f, 0, 0.7f, 1, 0.8f, 1}};
    for (const auto& bad : wrong)
        EXPECT_TRUE(fault_of_opening(bad)) << bad[0];
}

} // namespace kanuka::scene
