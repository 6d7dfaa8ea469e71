#include "film/ztest.h"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <random>

namespace kanuka::film {
namespace {

constexpr int W = 60, H = 40;
constexpr double Sigma = 0.2;

Picture constant(float value) {
    Picture p;
    p.width = W;
    p.height = H;
    for (const char* name : {"R", "G", "B"})
        p.channels.push_back({name, false, std::vector<float>(size_t(W) * H, value)});
    return p;
}

// A rendering of 0.5 everywhere, whose mean of `samples` has variance Sigma^2 / samples.
Picture noisy(int samples, uint32_t seed, double mean = 0.5) {
    std::mt19937 generator(seed);
    std::normal_distribution<double> n(mean, Sigma / std::sqrt(samples));
    Picture p = constant(0);
    for (auto& channel : p.channels)
        for (float& v : channel.data)
            v = float(n(generator));
    return p;
}

} // namespace

TEST(ZTest, KeepsItsSignificance) {
    // Right pictures fail as often as asked for.
    const Picture variance = constant(float(Sigma * Sigma / 1024)),
                  test_variance = constant(float(Sigma * Sigma / 16));
    int failures = 0;
    constexpr int Runs = 200;
    for (int i = 0; i < Runs; i++) {
        const ZTestResult r =
            z_test(noisy(1024, 2 * i), variance, noisy(16, 2 * i + 1), &test_variance, {.significance = 0.2});
        failures += !r.passed();
        EXPECT_EQ(r.tests, size_t(W) * H * 3);
    }
    EXPECT_NEAR(failures, 0.2 * Runs, 4 * std::sqrt(0.2 * 0.8 * Runs));
}

TEST(ZTest, FindsOneWrongPixel) {
    const Picture variance = constant(float(Sigma * Sigma / 4096));
    Picture test = noisy(256, 12);
    test.find("G")->data[7 * W + 33] += 0.3f; // 24 sigma
    const ZTestResult r =
        z_test(noisy(4096, 11), variance, test, nullptr, {.reference_samples = 4096, .test_samples = 256});
    EXPECT_FALSE(r.passed());
    ASSERT_EQ(r.rejected_pixels.size(), 1u);
    EXPECT_EQ(r.rejected_pixels[0].x, 33);
    EXPECT_EQ(r.rejected_pixels[0].y, 7);
    EXPECT_EQ(r.worst_x, 33);
    EXPECT_EQ(r.worst_y, 7);
    EXPECT_EQ(r.worst_channel, "G");
    EXPECT_LT(r.p_values.find("G")->data[7 * W + 33], r.level);
    EXPECT_GT(r.p_values.find("R")->data[7 * W + 33], r.level);
}

TEST(ZTest, FindsABiasOfAFewSigma) {
    const Picture variance = constant(float(Sigma * Sigma / 4096));
    const ZTestOptions options{.reference_samples = 4096, .test_samples = 256};
    EXPECT_TRUE(z_test(noisy(4096, 21), variance, noisy(256, 22), nullptr, options).passed());
    EXPECT_FALSE(
        z_test(noisy(4096, 21), variance, noisy(256, 22, 0.5 + 4 * Sigma / 16), nullptr, options).passed());
}

TEST(ZTest, PValuesAreThoseOfTheNormal) {
    Picture test = constant(0.5f);
    test.find("R")->data[0] = 0.5f + 1.959964f * 0.01f;
    const Picture none = constant(0);
    const ZTestResult r = z_test(constant(0.5f), constant(1e-4f), test, &none);
    EXPECT_NEAR(r.p_values.find("R")->data[0], 0.05, 1e-4);
    EXPECT_EQ(r.p_values.find("R")->data[1], 1);
    EXPECT_NEAR(r.level, 0.01 / (W * H * 3), 0.01 / (W * H * 3) * 0.01);
    EXPECT_LE(1 - std::pow(1 - r.level, double(r.tests)), 0.01 + 1e-9);
}

TEST(ZTest, PixelsWithoutNoise) {
    const Picture none = constant(0);
    Picture test = constant(0.5f);
    EXPECT_TRUE(z_test(constant(0.5f), none, test, &none).passed());
    test.find("B")->data[5] = 0.501f;
    EXPECT_EQ(z_test(constant(0.5f), none, test, &none).rejected, 1u);
    // A picture stored as half may be off by its rounding, no more.
    for (auto& channel : test.channels)
        channel.half = true;
    test.find("B")->data[5] = 0.5f + 0x1p-12f;
    EXPECT_TRUE(z_test(constant(0.5f), none, test, &none).passed());
    test.find("B")->data[5] = 0.501f;
    EXPECT_FALSE(z_test(constant(0.5f), none, test, &none).passed());
}

TEST(ZTest, NonFiniteIsRejected) {
    const Picture variance = constant(1e-4f);
    Picture test = constant(0.5f);
    test.find("R")->data[1] = std::numeric_limits<float>::quiet_NaN();
    test.find("R")->data[2] = std::numeric_limits<float>::infinity();
    const ZTestResult r = z_test(constant(0.5f), variance, test, nullptr);
    EXPECT_EQ(r.rejected, 2u);
    Picture bad_variance = variance;
    bad_variance.find("G")->data[9] = std::numeric_limits<float>::quiet_NaN();
    test = constant(0.51f);
    EXPECT_EQ(z_test(constant(0.5f), bad_variance, test, nullptr).rejected, 1u);
}

TEST(ZTest, MisfitsAreErrors) {
    Picture small = constant(0);
    small.height--;
    for (auto& channel : small.channels)
        channel.data.resize(size_t(W) * (H - 1));
    EXPECT_THROW(z_test(constant(0), constant(0), small, nullptr), Error);
    EXPECT_THROW(z_test(constant(0), small, constant(0), nullptr), Error);
    EXPECT_THROW(z_test(constant(0), constant(0), constant(0), nullptr, {.channels = {"Z"}}), Error);
    EXPECT_THROW(z_test(constant(0), constant(0), constant(0), nullptr, {.significance = 0}), Error);
}

} // namespace kanuka::film
