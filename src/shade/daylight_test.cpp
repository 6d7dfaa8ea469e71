// Photometric files, taken apart and broken; the model of the sky.
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "color/color.h"
#include "shade/ies.h"
#include "shade/sky.h"

namespace kanuka::shade {
namespace {

// cos(theta) in the lower half, in five steps; the same all round.
const std::string Downlight = "IESNA:LM-63-2002\r\n[TEST] none\r\n[MANUFAC] nobody\r\nTILT=NONE\r\n"
                              "1 1000 2.0 7 1 1 2 0.1 0.1 0\r\n1.0 1.0 20\r\n0 15 30 45 60 75 90\r\n0\r\n"
                              "100 96.6 86.6 70.7 50\r\n 25.9, 0\r\n";

std::string quarter() { // brighter across (90) than along (0)
    return "TILT=INCLUDE\n1\n2\n0 90\n1.0 0.8\n1 -1 1 3 3 1 1 0 0 0\n1 1 10\n0 90 180\n0 45 90\n"
           "10 10 10\n15 15 15\n20 20 20\n";
}

float at(const scene::LightTable& t, float theta, float phi) { // degrees
    const int row = std::min(int(theta / 180 * float(t.height)), t.height - 1),
              column = std::min(int(phi / 360 * float(t.width)), t.width - 1);
    return t.at(0, row, column)[1];
}

std::string error_of(const std::string& text) {
    try {
        parse_ies(text, "lamp.ies");
    } catch (const Error& e) {
        return e.what();
    }
    return "";
}

} // namespace

TEST(Ies, RotationallySymmetric) {
    const auto t = parse_ies(Downlight, "lamp.ies");
    EXPECT_EQ(t->width, 1);
    EXPECT_NEAR(t->angle, Pi, 1e-6f);
    for (float theta : {0.5f, 20.0f, 45.0f, 80.0f})
        EXPECT_NEAR(at(*t, theta, 0), std::cos(theta * Pi / 180), 0.02f);
    EXPECT_EQ(at(*t, 120, 0), 0); // not given
}

TEST(Ies, QuadrantsAreMirrored) {
    const auto t = parse_ies(quarter(), "lamp.ies");
    for (float phi : {0.0f, 180.0f, 359.0f})
        EXPECT_NEAR(at(*t, 50, phi), 0.5f, 0.01f) << phi;
    for (float phi : {90.0f, 270.0f})
        EXPECT_NEAR(at(*t, 50, phi), 1, 0.01f) << phi;
    for (float phi : {45.0f, 135.0f, 225.0f, 315.0f})
        EXPECT_NEAR(at(*t, 50, phi), 0.75f, 0.01f) << phi;
}

TEST(Ies, ErrorsSayWhere) {
    EXPECT_EQ(error_of("a letter\nto nobody\n"),
              "lamp.ies:2: no line starts with TILT=; is this an IES LM-63 photometric file?");
    EXPECT_NE(error_of("TILT=lamp.tlt\n").find("lamp.ies:1: TILT=lamp.tlt"), std::string::npos);
    EXPECT_NE(error_of("TILT=NONE\n1 1000 x")
                  .find("lamp.ies:2: the candela multiplier should be a number; found \"x\""),
              std::string::npos);
    EXPECT_NE(error_of("TILT=NONE\n1 1 1 0 1 1 1 1 1 1").find("vertical angles should be a whole number"),
              std::string::npos);
    EXPECT_NE(error_of("TILT=NONE\n1 1 1 1e9 1e9 1 1 1 1 1").find("from 1 to 4096"), std::string::npos);
    EXPECT_NE(error_of("TILT=NONE\n1 1 1 2 1 3 1 1 1 1").find("photometric type 3"), std::string::npos);
    EXPECT_NE(error_of("TILT=NONE\n1 1 1 2 1 1 1 1 1 1\n1 1 1\n90 0").find("must rise"), std::string::npos);
    EXPECT_NE(error_of("TILT=NONE\n1 1 1 2 1 1 1 1 1 1\n1 1 1\n0 90\n0\n5").find("the file ends"),
              std::string::npos);
    EXPECT_NE(error_of("TILT=NONE\n1 1 1 2 1 1 1 1 1 1\n1 1 1\n0 90\n0\n0 0").find("no candela value"),
              std::string::npos);
}

// Any change of bytes is read or reported.
TEST(Ies, BrokenFilesAreHarmless) {
    std::mt19937 g(1);
    for (const std::string& whole : {Downlight, quarter()})
        for (int i = 0; i < 3000; i++) {
            std::string text = whole.substr(0, g() % 3 ? whole.size() : g() % whole.size());
            for (uint32_t k = g() % 4; k > 0 && !text.empty(); k--)
                text[g() % text.size()] = char(g() % 2 ? g() % 256 : "0123456789.-+eE \n"[g() % 17]);
            try {
                const auto t = parse_ies(text, "lamp.ies");
                for (float v : t->rgb)
                    ASSERT_TRUE(v >= 0 && v <= 1.0001f);
            } catch (const Error& e) {
                EXPECT_EQ(std::string(e.what()).substr(0, 9), "lamp.ies:");
            }
        }
}

// Figures for a clear day with a high sun: about 100 klx from the sun and 10 to 20 klx from the sky; the
// zenith is bluer and darker than the horizon, the sun sinks into red.
TEST(Daylight, IsAsBrightAsDaylight) {
    const float altitude = 60 * Pi / 180;
    const Vec3f high(std::cos(altitude), 0, std::sin(altitude));
    const float sun = color::luminance(preetham_sun(high, 2.5f));
    EXPECT_GT(sun, 80);
    EXPECT_LT(sun, 120);
    const auto sky = preetham_sky(high, 2.5f);
    double illuminance = 0;
    for (int j = 0; j < sky->height; j++)
        for (int i = 0; i < sky->width; i++) {
            const double theta = 3.141592653589793 * (j + 0.5) / sky->height;
            const float* c = sky->at(0, j, i);
            ASSERT_TRUE(c[0] >= 0 && c[1] >= 0 && c[2] >= 0 && std::isfinite(c[0] + c[1] + c[2]));
            illuminance += double(color::luminance({c[0], c[1], c[2]})) * std::max(std::cos(theta), 0.0) *
                           std::sin(theta) * 2 * 3.141592653589793 * 3.141592653589793 /
                           (sky->width * sky->height);
        }
    EXPECT_GT(illuminance, 6);
    EXPECT_LT(illuminance, 30);
    const float *zenith = sky->at(0, 0, 0), *horizon = sky->at(0, sky->height / 2 - 2, sky->width / 2);
    EXPECT_GT(zenith[2] / zenith[0], horizon[2] / horizon[0]);
    EXPECT_GT(zenith[2], zenith[0]);
    EXPECT_EQ(sky->at(0, sky->height - 1, 0)[0], 0);
    const Rgb low = preetham_sun({1, 0, 0.05f}, 3), top = preetham_sun({0, 0, 1}, 3);
    EXPECT_GT(low.x / low.z, 3 * top.x / top.z);
    EXPECT_LT(color::luminance(low), 0.3f * color::luminance(top));
    // Bad input: clamped.
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (const Vec3f& d : {Vec3f(0, 0, 0), Vec3f(nan, 0, 0), Vec3f(0, 0, -1), Vec3f(1, 0, -0.5f)})
        for (float t : {nan, -1.0f, 1e9f}) {
            const auto clamped = preetham_sky(d, t);
            for (float v : clamped->rgb)
                ASSERT_TRUE(v >= 0 && std::isfinite(v));
            EXPECT_TRUE(std::isfinite(color::luminance(preetham_sun(d, t))));
        }
}

} // namespace kanuka::shade
