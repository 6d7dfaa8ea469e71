// Facets that stand for a curved surface: light falls on them as on that surface.
#include <gtest/gtest.h>

#include "transport/test_scene.h"

namespace kanuka::transport {
namespace {

using namespace testing;

constexpr int Size = 48, Progressions = 64;
constexpr float Albedo = 0.8f, Irradiance = 2;

// A ball of 12 by 6 facets with the sphere's own normals, alone under a sun from the left.
struct Ball : TestScene {
    Ball(float turn, bool rounded, const Transform& placed) {
        add_sphere({0, 0, 0}, 1, 6, {matte(Rgb(Albedo))}, -1, rounded);
        scene::Light sun;
        sun.kind = scene::Light::Kind::Distant;
        sun.amount = Rgb(Irradiance);
        sun.world_from_light = Transform::rotate(double(turn), 0, 1, 0);
        inputs.lights.push_back(sun);
        inputs.max_depth = 1;
        camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.3f, Size, Size);
        finish(0, placed);
    }
    // What a smooth sphere with these normals, which shades nothing of itself, sends to the camera; and what
    // the picture has.
    std::array<double, 3> light(float turn) {
        const double a = double(turn) * 3.141592653589793 / 180;
        double expected = 0, found = 0, off = 0;
        for (const PixelSums& p : render(Progressions, 8)) {
            found += double(p.rgb[1]);
            if (p.hits == 0)
                continue;
            // The sun shines along (sin a, 0, cos a).
            const Vec3f n = p.normal[0] == 0 && p.normal[1] == 0 && p.normal[2] == 0
                                ? Vec3f(0.0f)
                                : normalize(Vec3f(p.normal[0], p.normal[1], p.normal[2]));
            const double cosine = -(double(n.x) * std::sin(a) + double(n.z) * std::cos(a));
            const double truth = double(p.hits) / Progressions * double(Albedo) * double(Irradiance) /
                                 3.141592653589793 * std::max(cosine, 0.0);
            expected += truth;
            off += std::abs(truth - double(p.rgb[1]));
        }
        return {expected, found, off};
    }
};

} // namespace

TEST(ShadowTerminator, CoarseBallIsLitAsASphere) {
    const Transform ahead = Transform::translate(0, 0, 4);
    for (const float turn : {0.0f, 40.0f, 75.0f, 100.0f, 130.0f}) {
        const auto [expected, found, off] = Ball(turn, true, ahead).light(turn);
        EXPECT_NEAR(found / expected, 1, 0.015) << "sun at " << turn;
        const auto [same, facets, parts] = Ball(turn, false, ahead).light(turn);
        EXPECT_LT(off, (turn < 120 ? 0.005 : 0.03) * expected) << "sun at " << turn;
        if (turn > 60) { // what facets look like
            EXPECT_GT(parts / same, 8 * off / expected) << "sun at " << turn;
        }
        EXPECT_NEAR(facets / same, 1, 0.08); // what is below them comes back, if elsewhere
    }
}

// Nothing leaks in: a closed ball is dark inside. At 75 degrees the sun shines along facets of it.
TEST(ShadowTerminator, NothingShinesThrough) {
    for (const float turn : {0.0f, 75.0f, 160.0f}) {
        for (const bool rounded : {true, false}) {
            Ball inside(turn, rounded, Transform());
            double sum = 0;
            for (const PixelSums& p : inside.render(16, 8))
                sum += double(p.rgb[1]);
            EXPECT_EQ(sum, 0) << "sun at " << turn << (rounded ? " rounded" : "");
        }
    }
}

} // namespace kanuka::transport
