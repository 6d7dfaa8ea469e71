#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

#include "film/film.h"
#include "film/flip.h"

namespace kanuka::film {
namespace {

Picture make(int width, int height) {
    Picture p;
    p.width = width;
    p.height = height;
    for (const char* name : {"R", "G", "B"})
        p.channels.push_back({name, false, std::vector<float>(size_t(width) * height)});
    return p;
}

template <class F>
Picture fill(int width, int height, const F& f) {
    Picture p = make(width, height);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            const Rgb c = f(x, y);
            for (int k = 0; k < 3; k++)
                p.channels[k].data[size_t(y) * width + x] = c[k];
        }
    return p;
}

constexpr int W = 64, H = 48;
Rgb pattern(int x, int y) {
    return {(float(x) + 0.5f) / W, (float(y) + 0.5f) / H,
            0.5f + 0.5f * std::sin(0.3f * float(x) + 0.2f * float(y))};
}

struct FlipCase {
    const char* name;
    Rgb (*reference)(int, int);
    Rgb (*test)(int, int);
    double mean;
    double at_20_16, at_50_5, at_28_16;
};

} // namespace

// Expected values: the authors' own evaluator, flip-evaluator 1.7, LDR, linear input, 67.0206 pixels a
// degree.
TEST(Flip, AgreesWithTheAuthorsEvaluator) {
    const FlipCase cases[] = {
        {"darker", pattern, [](int x, int y) { return pattern(x, y) * 0.9f; }, 0.209987, 0.173574, 0.211306,
         0.166344},
        {"disk", pattern,
         [](int x, int y) {
             return (x - 20) * (x - 20) + (y - 16) * (y - 16) < 64 ? Rgb(0.9f, 0.1f, 0.2f) : pattern(x, y);
         },
         0.0744644, 0.856582, 0, 0.442522},
        {"ripple", pattern,
         [](int x, int y) {
             const float d = 0.1f * std::sin(2.0f * float(x)) * std::cos(1.7f * float(y));
             Rgb c = pattern(x, y) + Rgb(d);
             for (int k = 0; k < 3; k++)
                 c[k] = std::clamp(c[k], 0.0f, 1.0f);
             return c;
         },
         0.0357352, 0.0145321, 0.0168897, 0.0382223},
        {"green against blue", [](int, int) { return Rgb(0, 1, 0); }, [](int, int) { return Rgb(0, 0, 1); },
         1, 1, 1, 1},
    };
    for (const FlipCase& c : cases) {
        const Comparison result = compare(fill(W, H, c.test), fill(W, H, c.reference));
        const auto& map = result.difference.find("flip")->data;
        EXPECT_NEAR(result.flip, c.mean, 2e-4) << c.name;
        EXPECT_NEAR(map[16 * W + 20], c.at_20_16, 1e-3) << c.name;
        EXPECT_NEAR(map[5 * W + 50], c.at_50_5, 1e-3) << c.name;
        EXPECT_NEAR(map[16 * W + 28], c.at_28_16, 1e-3) << c.name;
    }
}

TEST(Flip, EqualPicturesDifferByNothing) {
    const Picture p = fill(W, H, pattern);
    const Comparison result = compare(p, p);
    EXPECT_EQ(result.flip, 0);
    EXPECT_EQ(result.relative_mse, 0);
    EXPECT_EQ(result.max_error, 0);
    EXPECT_EQ(result.mean_ratio, 1);
}

TEST(Flip, SeesBrightPicturesThroughTheGain) {
    const auto bright = [](int x, int y) { return pattern(x, y) * 100.0f; };
    const auto brighter = [](int x, int y) { return pattern(x, y) * 80.0f; };
    const Comparison blown = compare(fill(W, H, brighter), fill(W, H, bright));
    const Comparison exposed = compare(fill(W, H, brighter), fill(W, H, bright), 0.01f);
    EXPECT_GT(exposed.flip, 0.2);
    EXPECT_LT(blown.flip, 0.25 * exposed.flip); // both are white nearly everywhere
}

TEST(Compare, MeansAndLargestError) {
    Picture a = fill(5, 4, [](int, int) { return Rgb(0.5f); });
    const Picture b = fill(5, 4, [](int, int) { return Rgb(0.4f); });
    a.find("G")->data[2 * 5 + 3] = 2.4f;
    const Comparison c = compare(a, b);
    EXPECT_NEAR(c.mean_b, 0.4, 1e-6);
    EXPECT_NEAR(c.mean_a, (59 * 0.5 + 2.4) / 60, 1e-6);
    EXPECT_NEAR(c.mean_ratio, c.mean_a / c.mean_b, 1e-12);
    EXPECT_NEAR(c.max_error, 2.0, 1e-6);
    EXPECT_EQ(c.max_x, 3);
    EXPECT_EQ(c.max_y, 2);
    EXPECT_NEAR(c.relative_mse, (59 * 0.01 + 4) / 60 / (0.16 + 0.01), 1e-5);
    EXPECT_EQ(c.difference.width, 5);
    EXPECT_EQ(c.difference.find("R")->data.size(), 20u);
}

TEST(Compare, NonFinitePixelsAreCountedAndSpoilNothing) {
    Picture a = fill(8, 8, pattern);
    const Picture b = a;
    a.find("R")->data[10] = std::numeric_limits<float>::quiet_NaN();
    a.find("B")->data[20] = std::numeric_limits<float>::infinity();
    const Comparison c = compare(a, b);
    EXPECT_EQ(c.nonfinite_a, 2u);
    EXPECT_EQ(c.nonfinite_b, 0u);
    EXPECT_EQ(c.relative_mse, 0);
    EXPECT_TRUE(std::isfinite(c.flip) && c.flip > 0);
}

TEST(Compare, MisfitsAreErrors) {
    const Picture a = fill(8, 8, pattern), b = fill(8, 9, pattern);
    try {
        compare(a, b);
        FAIL();
    } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find("8 x 8 and 8 x 9"), std::string::npos) << e.what();
    }
    Picture grey = a;
    grey.channels.pop_back();
    EXPECT_THROW(compare(grey, a), Error);
    EXPECT_THROW(compare(a, grey), Error);
    EXPECT_THROW(compare(Picture(), Picture()), Error);
}

TEST(Compare, TinyPictures) {
    const Picture a = fill(1, 1, [](int, int) { return Rgb(1.0f); }),
                  b = fill(1, 1, [](int, int) { return Rgb(0.0f); });
    const Comparison c = compare(a, b);
    EXPECT_GT(c.flip, 0.5);
    EXPECT_LE(c.flip, 1);
}

TEST(Heat, RunsFromDarkToLight) {
    const auto lightness = [](const Rgb& c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; };
    float last = -1;
    for (int i = 0; i <= 32; i++) {
        const Rgb c = heat(float(i) / 32);
        EXPECT_GT(lightness(c), last) << i;
        last = lightness(c);
    }
    EXPECT_LT(lightness(heat(0)), 0.001f);
    EXPECT_GT(lightness(heat(1)), 0.9f);
    EXPECT_GT(heat(0.25f).z, heat(0.25f).y); // violet
    EXPECT_GT(heat(0.7f).x, heat(0.7f).z);   // orange
}

} // namespace kanuka::film
