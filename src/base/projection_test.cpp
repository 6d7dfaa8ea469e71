#include <gtest/gtest.h>

#include "base/projection.h"

namespace kanuka {
namespace {

constexpr double Degree = 3.14159265358979323846 / 180;

// From a direction back to the film, in double, as a lens maker would write it.
std::array<double, 2> film_of(Projection p, double half_angle, double x, double y, double z) {
    const double r = std::hypot(x, y), a = std::atan2(r, z);
    switch (p) {
    case Projection::Fisheye:
        return r > 0 ? std::array{x / r * a / half_angle, y / r * a / half_angle} : std::array{0.0, 0.0};
    case Projection::Equisolid: {
        const double s = std::sin(a / 2) / std::sin(half_angle / 2);
        return r > 0 ? std::array{x / r * s, y / r * s} : std::array{0.0, 0.0};
    }
    case Projection::Spherical:
        return {std::atan2(x, z) / 3.14159265358979323846, std::asin(y / std::hypot(r, z)) / (90 * Degree)};
    default:
        return {x / z, y / z};
    }
}

} // namespace

TEST(Projection, FilmAndDirectionAgree) {
    for (const ProjectionKind& kind : Projections) {
        if (kind.projection == Projection::Orthographic)
            continue;
        for (const double degrees : {60.0, 180.0, 350.0}) {
            const float half = float(degrees / 2 * Degree);
            for (float x = -0.95f; x < 1; x += 0.19f)
                for (float y = -0.95f; y < 1; y += 0.19f) {
                    Vec3<Float<1>> d;
                    const bool seen =
                        all(direction_of_film<1>(kind.projection, half, Float<1>(x), Float<1>(y), d));
                    EXPECT_EQ(seen, !is_fisheye(kind.projection) || std::hypot(x, y) <= 1);
                    if (!seen)
                        continue;
                    const double l = std::sqrt(double(dot(d, d)[0]));
                    EXPECT_TRUE(kind.projection == Projection::Perspective || std::abs(l - 1) < 1e-6)
                        << kind.name;
                    const auto film = film_of(kind.projection, double(half), double(d.x[0]), double(d.y[0]),
                                              double(d.z[0]));
                    EXPECT_NEAR(film[0], double(x), 2e-5) << kind.name << " " << degrees;
                    EXPECT_NEAR(film[1], double(y), 2e-5) << kind.name << " " << degrees;
                }
        }
    }
}

TEST(Projection, AllLanesHaveTheSameBits) {
    for (const ProjectionKind& kind : Projections)
        for (int i = 0; i < 64; i++) {
            const float x = float(i % 8) * 0.27f - 1, y = float(i / 8) * 0.27f - 1;
            Vec3<Float<1>> one;
            Vec3<Float<8>> eight;
            Vec3<Float<16>> sixteen;
            direction_of_film<1>(kind.projection, 1.3f, Float<1>(x), Float<1>(y), one);
            direction_of_film<8>(kind.projection, 1.3f, Float<8>(x), Float<8>(y), eight);
            direction_of_film<16>(kind.projection, 1.3f, Float<16>(x), Float<16>(y), sixteen);
            for (int c = 0; c < 3; c++) {
                EXPECT_EQ(one[c][0], eight[c][5]);
                EXPECT_EQ(one[c][0], sixteen[c][11]);
            }
        }
}

// A pixel's solid angle, by differences: equal everywhere for the equisolid one.
TEST(Projection, EquisolidMeansIt) {
    const auto direction = [](float x, float y) {
        Vec3<Float<1>> d;
        direction_of_film<1>(Projection::Equisolid, float(80 * Degree), Float<1>(x), Float<1>(y), d);
        return Vec3<double>(double(d.x[0]), double(d.y[0]), double(d.z[0]));
    };
    const auto solid_angle = [&](float x, float y) {
        const float h = 0.02f;
        const auto du = direction(x + h, y) - direction(x - h, y),
                   dv = direction(x, y + h) - direction(x, y - h);
        const Vec3<double> c{du.y * dv.z - du.z * dv.y, du.z * dv.x - du.x * dv.z, du.x * dv.y - du.y * dv.x};
        return std::sqrt(c.x * c.x + c.y * c.y + c.z * c.z);
    };
    const double centre = solid_angle(0, 0);
    for (float r = 0.1f; r < 0.95f; r += 0.1f)
        EXPECT_NEAR(solid_angle(r * 0.6f, r * 0.8f) / centre, 1, 2e-3) << r;
}

TEST(Projection, ScaleAtTheCentre) {
    for (const Projection p : {Projection::Perspective, Projection::Fisheye, Projection::Equisolid}) {
        Vec3<Float<1>> d;
        direction_of_film<1>(p, 1.2f, Float<1>(1e-3f), Float<1>(0.0f), d);
        EXPECT_NEAR(1e-3f / std::atan2(d.x[0], d.z[0]), film_per_radian(p, 1.2f), 2e-4f);
    }
}

TEST(Projection, HasNames) {
    EXPECT_EQ(projection_by_name("equisolid"), Projection::Equisolid);
    EXPECT_FALSE(projection_by_name("fish"));
    EXPECT_EQ(projection_names<std::string>(", "),
              "perspective, orthographic, fisheye, equisolid, spherical");
}

} // namespace kanuka
