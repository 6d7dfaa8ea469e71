#include "color/color.h"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <random>

namespace kanuka::color {
namespace {

// XYZ of reflectance(i) * light under the observer, in double.
template <class F>
std::array<double, 3> integrate(const F& power) {
    std::array<double, 3> xyz{};
    for (int i = 0; i < LambdaCount; i++) {
        xyz[0] += double(cie_x()[i]) * power(i);
        xyz[1] += double(cie_y()[i]) * power(i);
        xyz[2] += double(cie_z()[i]) * power(i);
    }
    for (double& v : xyz)
        v /= cie_y_integral();
    return xyz;
}

Rgb to_rgb(const std::array<double, 3>& xyz) {
    return xyz_to_rgb({float(xyz[0]), float(xyz[1]), float(xyz[2])});
}

// The colour of an uplifted reflectance under D65.
Rgb round_trip(const Rgb& rgb) {
    const auto c = uplift(rgb);
    return to_rgb(
        integrate([&](int i) { return double(uplift_eval(c, LambdaMin + i)) * illuminant_d65()[i]; }));
}

float largest_difference(const Rgb& a, const Rgb& b) {
    return std::max({std::abs(a.x - b.x), std::abs(a.y - b.y), std::abs(a.z - b.z)});
}

double sum(const Table& table) {
    double s = 0;
    for (const float v : table)
        s += v;
    return s;
}

} // namespace

TEST(Observer, IntegralsAndPeaks) {
    // Sums of the 1 nm table, ISO/CIE 11664-1: an equal-energy spectrum is white in all three.
    EXPECT_NEAR(sum(cie_x()), 106.865469, 1e-4);
    EXPECT_NEAR(sum(cie_y()), 106.856917, 1e-4);
    EXPECT_NEAR(sum(cie_z()), 106.892251, 1e-4);
    EXPECT_NEAR(cie_y_integral(), 106.856917, 1e-4);
    EXPECT_FLOAT_EQ(cie_y()[555 - 360], 1.0f);
    EXPECT_FLOAT_EQ(cie_x()[600 - 360], 1.0622f);
    EXPECT_FLOAT_EQ(cie_z()[445 - 360], 1.78260f);
}

TEST(Illuminant, D65IsWhite) {
    const auto xyz = integrate([](int i) { return double(illuminant_d65()[i]); });
    EXPECT_NEAR(xyz[1], 1, 1e-6);
    const double s = xyz[0] + xyz[1] + xyz[2];
    EXPECT_NEAR(xyz[0] / s, 0.31272, 2e-5); // CIE 15 table T.3
    EXPECT_NEAR(xyz[1] / s, 0.32903, 2e-5);
    EXPECT_LT(largest_difference(to_rgb(xyz), Rgb(1.0f)), 1e-5f);
    // The shape: CIE 15 table T.1, and the linear rule between its entries.
    const Table& d65 = illuminant_d65();
    EXPECT_NEAR(d65[100] / d65[200], 1.17812, 1e-5);
    EXPECT_NEAR(d65[101] / d65[200], 0.01 * (117.812 + (116.337 - 117.812) / 5), 1e-5);
    EXPECT_NEAR(d65[470] / d65[200], 0.603125, 1e-5);
}

TEST(Illuminant, BlackbodyChromaticity) {
    // Illuminant A is Planck's law at 2855.54 K on the present scale: x = 0.44758, y = 0.40745 (CIE 15).
    const Table a = blackbody(2855.54f);
    const auto xyz = integrate([&](int i) { return double(a[i]); });
    const double s = xyz[0] + xyz[1] + xyz[2];
    EXPECT_NEAR(xyz[1], 1, 1e-5);
    EXPECT_NEAR(xyz[0] / s, 0.44758, 1e-4);
    EXPECT_NEAR(xyz[1] / s, 0.40745, 1e-4);
    for (const float kelvin : {0.0f, -5.0f, 1.0f, 1e6f, 1e30f, std::numeric_limits<float>::infinity(),
                               std::numeric_limits<float>::quiet_NaN()}) {
        const Table t = blackbody(kelvin);
        for (const float v : t)
            ASSERT_TRUE(std::isfinite(v) && v >= 0) << kelvin;
        EXPECT_NEAR(integrate([&](int i) { return double(t[i]); })[1], 1, 1e-4) << kelvin;
    }
}

TEST(Space, MatricesInvertEachOther) {
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double s = 0;
            for (int k = 0; k < 3; k++)
                s += double(rgb_from_xyz[i][k]) * xyz_from_rgb[k][j];
            EXPECT_NEAR(s, i == j, 1e-6);
        }
    // Rec.709's own luminance weights, for a white that differs in the fifth digit.
    EXPECT_NEAR(luminance({1, 0, 0}), 0.2126, 2e-4);
    EXPECT_NEAR(luminance({0, 1, 0}), 0.7152, 2e-4);
    EXPECT_NEAR(luminance({0, 0, 1}), 0.0722, 2e-4);
    EXPECT_NEAR(luminance({1, 1, 1}), 1, 1e-6);
}

TEST(Space, SrgbCodec) {
    EXPECT_FLOAT_EQ(srgb_encode(0), 0);
    EXPECT_NEAR(srgb_encode(1), 1, 1e-6);
    EXPECT_NEAR(srgb_encode(0.214041f), 0.5, 1e-5);
    EXPECT_NEAR(srgb_encode(0.001f), 0.01292, 1e-6);
    EXPECT_NEAR(srgb_decode(0.04045f), 0.0031308f, 1e-7);
    for (int i = -300; i <= 300; i++)
        EXPECT_NEAR(srgb_decode(srgb_encode(i / 100.0f)), i / 100.0f, 2e-6f);
}

TEST(Uplift, RoundTripOfRandomColours) {
    std::mt19937 generator(7);
    std::uniform_real_distribution<float> u;
    double worst = 0, total = 0;
    constexpr int Count = 6000;
    for (int i = 0; i < Count; i++) {
        Rgb c{u(generator), u(generator), u(generator)};
        if (i % 4 == 1)
            c[i % 3] = 0;
        if (i % 4 == 2)
            c[i % 3] = 1;
        const double e = largest_difference(round_trip(c), c);
        worst = std::max(worst, e);
        total += e;
    }
    EXPECT_LT(worst, 1e-3);
    EXPECT_LT(total / Count, 2e-4);
}

TEST(Uplift, DarkColoursKeepTheirHue) {
    // Measured: 1.9 % at most.
    std::mt19937 generator(8);
    std::uniform_real_distribution<float> u(0.1f, 1.0f);
    for (int i = 0; i < 1000; i++) {
        const Rgb c = Rgb{u(generator), u(generator), u(generator)} * (i % 2 ? 0.04f : 0.004f);
        ASSERT_LT(largest_difference(round_trip(c), c), 0.03f * std::max({c.x, c.y, c.z}))
            << c.x << ' ' << c.y << ' ' << c.z;
    }
}

TEST(Uplift, GreysAreConstant) {
    std::mt19937 generator(9);
    std::uniform_real_distribution<float> u;
    for (int i = 0; i < 2000; i++) {
        const float v = i < 1000 ? u(generator) : std::pow(u(generator), 6.0f);
        const auto c = uplift(Rgb(v));
        ASSERT_EQ(c[0], 0);
        ASSERT_EQ(c[1], 0);
        ASSERT_NEAR(uplift_eval(c, 555), v, 2e-6f * v + 2e-7f * (v > 0.4f)) << v;
    }
    for (const float lambda : {360.0f, 555.5f, 830.0f}) {
        EXPECT_EQ(uplift_eval(uplift({1, 1, 1}), lambda), 1);
        EXPECT_LT(uplift_eval(uplift({0, 0, 0}), lambda), 1e-20f);
        EXPECT_GE(uplift_eval(uplift({0, 0, 0}), lambda), 0);
    }
}

TEST(Uplift, StaysBetweenZeroAndOne) {
    for (int corner = 0; corner < 8; corner++) {
        const Rgb rgb(corner & 1 ? 1.0f : 0.0f, corner & 2 ? 1.0f : 0.0f, corner & 4 ? 1.0f : 0.0f);
        EXPECT_LT(largest_difference(round_trip(rgb), rgb), 1e-3f) << corner;
        const auto c = uplift(rgb);
        for (float lambda = LambdaMin; lambda <= LambdaMax; lambda += 0.5f) {
            const float s = uplift_eval(c, lambda);
            ASSERT_TRUE(s >= 0 && s <= 1) << corner << ' ' << lambda << ' ' << s;
        }
    }
}

TEST(Uplift, ClampsAndSurvivesNonsense) {
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    EXPECT_EQ(uplift({2, -1, nan}), uplift({1, 0, 0}));
    EXPECT_EQ(uplift({inf, inf, inf}), uplift({1, 1, 1}));
    EXPECT_EQ(uplift({nan, -inf, -0.0f}), uplift({0, 0, 0}));
    for (const float tiny : {1e-45f, 1e-38f, 1e-20f, 1e-9f}) {
        const auto c = uplift({tiny, tiny * 0.5f, 0});
        const float s = uplift_eval(c, 600);
        EXPECT_TRUE(s >= 0 && s < 1e-6f) << tiny << ' ' << s;
    }
}

TEST(Uplift, IsContinuous) {
    // Across the switches of table (r = g), of complement (mean = 1/2), and off the grey axis.
    constexpr float h = 1e-5f;
    const Rgb places[] = {{0.4f, 0.4f, 0.1f}, {0.9f, 0.9f, 0.2f},    {0.5f, 0.5f, 0.5f},
                          {0.7f, 0.5f, 0.3f}, {0.02f, 0.02f, 0.02f}, {0.97f, 0.97f, 0.97f}};
    for (const Rgb& p : places)
        for (int k = 0; k < 3; k++) {
            Rgb lo = p, hi = p;
            lo[k] -= h;
            hi[k] += h;
            const auto a = uplift(lo), b = uplift(hi);
            for (float lambda = 400; lambda <= 700; lambda += 10)
                ASSERT_NEAR(uplift_eval(a, lambda), uplift_eval(b, lambda), 5e-3f)
                    << p.x << ' ' << p.y << ' ' << p.z;
        }
}

TEST(Uplift, LayoutIsAsDescribed) {
    const UpliftTable& table = uplift_table();
    const int n = table.resolution;
    ASSERT_EQ(table.scale.size(), size_t(n));
    ASSERT_EQ(table.coefficients.size(), size_t(3) * n * n * n * 3);
    EXPECT_LT(table.scale.front(), 1e-3);
    EXPECT_EQ(table.scale.back(), 1);
    for (int z = 1; z < n; z++) {
        EXPECT_GT(table.scale[z], table.scale[z - 1]);
        const double v = table.scale[z];
        EXPECT_NEAR((std::pow(v, 0.25) - std::sqrt(1 - v)) * table.z_factor + table.z_offset, z, 2e-3);
    }
    // A knot: largest component blue (m = 2), x is red, y is green.
    const int m = 2, z = n / 2, y = n / 3, x = n / 4;
    const auto ratio = [&](int i) { return float(i) * float(i) / (float(n - 1) * float(n - 1)); };
    const float v = table.scale[z];
    const Rgb rgb(v * ratio(x), v * ratio(y), v);
    const float mean = (rgb.x + rgb.y + rgb.z) / 3;
    ASSERT_LT(mean, 0.5f);
    const float* q = &table.coefficients[((size_t(m * n + z) * n + y) * n + x) * 3];
    const float k = 1 / std::sqrt(mean * (1 - mean));
    const auto c = uplift(rgb);
    EXPECT_NEAR(c[0], q[0] * k, 2e-3f * std::abs(c[0]));
    EXPECT_NEAR(c[1], q[1] * k, 2e-3f * std::abs(c[1]));
    EXPECT_NEAR(c[2], (q[2] + mean - 0.5f) * k, 2e-3f * std::abs(c[2]));
    EXPECT_LT(largest_difference(round_trip(rgb), rgb),
              2e-5f); // no interpolation: the optimiser's own accuracy
}

} // namespace kanuka::color
