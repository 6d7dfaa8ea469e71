// Round trips of uplift in each space; more of Rec.709's in color_test.cpp.
#include <gtest/gtest.h>
#include <random>

#include "color/illuminants.h"
#include "color/spaces.h"

namespace kanuka::color {
namespace {

Rgb round_trip(const Rgb& rgb, Space space) {
    const auto c = uplift(rgb, uplift_table(space));
    Table t;
    for (int i = 0; i < LambdaCount; i++)
        t[i] = uplift_eval(c, LambdaMin + float(i)) * white_illuminant(space)[i];
    const Vector3 xyz = observe(t);
    return transform(space_from_xyz(space), {float(xyz[0]), float(xyz[1]), float(xyz[2])});
}

float difference(const Rgb& a, const Rgb& b) {
    return std::max({std::abs(a.x - b.x), std::abs(a.y - b.y), std::abs(a.z - b.z)});
}

struct Errors {
    double largest = 0, mean = 0, beyond = 0; // beyond: share off by more than 0.01
};

// Colours uniform in the cube of `from`, as colours of `space`.
Errors errors(Space space, Space from) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> u(0, 1);
    const Matrix3 m = convert(from, space);
    Errors e;
    constexpr int N = 20000;
    for (int i = 0; i < N; i++) {
        const Rgb c{u(random), u(random), u(random)};
        const Rgb wanted = transform(m, c);
        if (std::min({wanted.x, wanted.y, wanted.z}) < 0 || std::max({wanted.x, wanted.y, wanted.z}) > 1)
            continue;
        const double d = difference(round_trip(wanted, space), wanted);
        e.largest = std::max(e.largest, d);
        e.mean += d / N;
        e.beyond += d > 0.01 ? 1.0 / N : 0;
    }
    return e;
}

} // namespace

TEST(UpliftOfSpaces, RoundTrips) {
    struct Case {
        Space space, from;
        double largest, mean, beyond; // what is allowed; measured values are in docs/color.md
    };
    // The corners of the wide spaces hold colours that no reflectance has: those come out as the most
    // saturated of their mean. All colours of Rec.709 are met.
    for (const Case& c : {Case{Space::Rec709, Space::Rec709, 1e-3, 2e-4, 0},
                          Case{Space::Rec2020, Space::Rec709, 4e-3, 6e-4, 0},
                          Case{Space::AcesCg, Space::Rec709, 4e-3, 6e-4, 0},
                          Case{Space::Rec2020, Space::Rec2020, 0.25, 6e-3, 0.09},
                          Case{Space::AcesCg, Space::AcesCg, 0.25, 7e-3, 0.11}}) {
        const Errors e = errors(c.space, c.from);
        EXPECT_LT(e.largest, c.largest) << info(c.space).name << " from " << info(c.from).name;
        EXPECT_LT(e.mean, c.mean) << info(c.space).name << " from " << info(c.from).name;
        EXPECT_LE(e.beyond, c.beyond) << info(c.space).name << " from " << info(c.from).name;
    }
}

// White is the flat spectrum in every space, greys are flat, and black is black.
TEST(UpliftOfSpaces, GreysAreFlat) {
    for (const Space space : {Space::Rec709, Space::Rec2020, Space::AcesCg})
        for (const float v : {0.0f, 0.02f, 0.5f, 0.8f, 1.0f}) {
            const auto c = uplift(Rgb(v), uplift_table(space));
            for (float l = 360; l <= 830; l += 10)
                EXPECT_NEAR(uplift_eval(c, l), v, 1e-6f);
        }
}

// Dark colours are as saturated as bright ones, to two hundredths of themselves.
TEST(UpliftOfSpaces, DarkColoursKeepTheirSaturation) {
    for (const Space space : {Space::Rec709, Space::Rec2020, Space::AcesCg}) {
        const Matrix3 m = convert(Space::Rec709, space);
        for (const Rgb& c : {Rgb(1, 0.05f, 0.05f), Rgb(0.05f, 1, 0.05f), Rgb(0, 1, 0), Rgb(0.05f, 0.05f, 1),
                             Rgb(1, 0.05f, 1), Rgb(1, 1, 0), Rgb(0, 1, 1)})
            for (const float scale : {0.5f, 0.1f, 0.03f, 0.009f, 0.003f, 0.001f}) {
                const Rgb wanted = transform(m, {c.x * scale, c.y * scale, c.z * scale});
                EXPECT_LT(difference(round_trip(wanted, space), wanted), 0.02f * scale)
                    << info(space).name << ": " << c.x << ' ' << c.y << ' ' << c.z << " times " << scale;
            }
    }
}

} // namespace kanuka::color
