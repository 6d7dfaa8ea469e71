// What a vertex word loses.
#include "store/quantize.h"

#include <gtest/gtest.h>
#include <random>

namespace kanuka::store {
namespace {

constexpr float Inf = std::numeric_limits<float>::infinity(), NaN = std::numeric_limits<float>::quiet_NaN();

float largest(const Rgb& c) {
    return std::max({c.x, c.y, c.z});
}

} // namespace

TEST(Quantize, Halves) {
    std::mt19937 g(1);
    std::uniform_real_distribution<float> exponent(-14, 15.9f);
    for (int i = 0; i < 100000; i++) {
        const float x = std::exp2(exponent(g)) * (i & 1 ? 1.0f : -1.0f);
        EXPECT_LE(std::abs(from_half(to_half(x)) - x), std::abs(x) * 0x1p-11f);
    }
    for (float exact : {0.0f, 1.0f, 0.5f, -2.0f, 1024.0f, 65504.0f, 0x1p-24f})
        EXPECT_EQ(from_half(to_half(exact)), exact);
    EXPECT_EQ(from_half(to_half(1e9f)), 65504.0f); // never infinite
    EXPECT_EQ(from_half(to_half(-Inf)), -65504.0f);
}

// Colours of surfaces, however dark: a word keeps them within 0.2 % of their largest component.
TEST(Quantize, DarkColors) {
    std::mt19937 g(2);
    std::uniform_real_distribution<double> u(0, 1), decades(-4, 0);
    double worst = 0;
    for (int i = 0; i < 100000; i++) {
        const double most = std::pow(10, decades(g));
        Rgb c;
        for (int k = 0; k < 3; k++)
            c[k] = float(most * (k == i % 3 ? 1 : u(g)));
        const Rgb d = from_rgb9e5(to_rgb9e5(c));
        for (int k = 0; k < 3; k++)
            worst = std::max(worst, std::abs(double(d[k]) - double(c[k])) / most);
    }
    EXPECT_LT(worst, 0.002);
}

TEST(Quantize, Rgb9e5) {
    std::mt19937 g(3);
    std::uniform_real_distribution<float> u(0, 1), exponent(-14, 15.9f);
    for (int i = 0; i < 100000; i++) {
        const Rgb c = Rgb(u(g), u(g), u(g)) * std::exp2(exponent(g));
        if (largest(c) > 65408)
            continue;
        const Rgb d = from_rgb9e5(to_rgb9e5(c));
        for (int k = 0; k < 3; k++)
            EXPECT_LE(std::abs(d[k] - c[k]),
                      std::max(largest(c) / 511, 0x1p-25f)) // the smallest step is 2^-24
                << c.x << " " << c.y << " " << c.z;
    }
    // Just below and at the powers of two, where the exponent changes.
    for (int e = -14; e <= 15; e++)
        for (float f : {1.0f, 0.9999999f, 0.9995f, 0.999f}) {
            const float x = std::exp2(float(e)) * f;
            EXPECT_NEAR(from_rgb9e5(to_rgb9e5(Rgb(x, 0, x / 2))).x, x, x / 511);
        }
    for (float exact : {0.0f, 1.0f, 0.5f, 100.0f, 65408.0f})
        EXPECT_EQ(from_rgb9e5(to_rgb9e5(Rgb(exact))), Rgb(exact));
    EXPECT_EQ(from_rgb9e5(to_rgb9e5(Rgb(NaN, -1, 1))), Rgb(0, 0, 1));
    EXPECT_EQ(from_rgb9e5(to_rgb9e5(Rgb(Inf, 1e9f, 0))), Rgb(65408, 65408, 0));
    EXPECT_EQ(from_rgb9e5(to_rgb9e5(Rgb(1e-20f))), Rgb(0));
}

TEST(Quantize, Octahedral) {
    std::mt19937 g(4);
    std::normal_distribution<float> normal;
    float worst = 0;
    for (int i = 0; i < 200000; i++) {
        const Vec3f n = normalize(Vec3f(normal(g), normal(g), i % 3 ? normal(g) : normal(g) * 1e-4f));
        const Vec3f m = from_oct32(to_oct32(n));
        EXPECT_NEAR(length(m), 1, 1e-6f);
        worst = std::max(worst, length(cross(n, m)));
    }
    EXPECT_LT(worst * 180 / Pi, 0.004f); // degrees
    for (const Vec3f& axis :
         {Vec3f(1, 0, 0), Vec3f(-1, 0, 0), Vec3f(0, 1, 0), Vec3f(0, -1, 0), Vec3f(0, 0, 1), Vec3f(0, 0, -1)})
        EXPECT_EQ(from_oct32(to_oct32(axis)), axis);
}

} // namespace kanuka::store
