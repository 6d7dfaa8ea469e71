// Lights with an area against closed forms and sums over their surface.
#include "transport/test_lights.h"

namespace kanuka::transport {

using namespace testing;

// On a floor that sees all of it, the irradiance of a ball is pi R^2 L cos / d^2; that of the others comes
// from sums over their surface.
TEST(AreaLights, IrradianceOfShapes) {
    const Vec3f at(0.15f, 0.3f, 0.1f);
    for (Kind kind : {Kind::Quad, Kind::Disk, Kind::Sphere, Kind::Cylinder}) {
        FloorScene s;
        auto l = light(kind, Rgb(4),
                       Transform::translate(at.x, at.y, at.z) * Transform::rotate(25, 0, 0, 1) * Downwards);
        l.width = 0.5f, l.height = 0.7f, l.radius = 0.3f;
        l.visible_camera = false;
        s.inputs.lights.push_back(l);
        s.finish();
        const Transform t = l.world_from_light;
        const auto irradiance = [&](const Vec3f& p) {
            if (kind == Kind::Sphere) {
                const Vec3f to = at - p;
                return 4 * 3.141592653589793 * 0.09 * double(to.y) / std::pow(double(dot(to, to)), 1.5);
            }
            constexpr int N = 64;
            double sum = 0;
            for (int i = 0; i < N; i++)
                for (int j = 0; j < N; j++) {
                    const float a = (float(i) + 0.5f) / N, b = (float(j) + 0.5f) / N;
                    Vec3f q(0.5f * (a - 0.5f), 0.7f * (b - 0.5f), 0), n(0, 0, 1);
                    double area = 0.35 / (N * N);
                    if (kind != Kind::Quad) {
                        const float r = kind == Kind::Disk ? 0.3f * std::sqrt(a) : 0.3f;
                        n = {std::cos(2 * Pi * b), std::sin(2 * Pi * b), 0};
                        q = {r * n.x, r * n.y, kind == Kind::Disk ? 0 : 0.7f * (a - 0.5f)};
                        area = 3.141592653589793 * 0.09 / (N * N);
                        if (kind == Kind::Disk)
                            n = {0, 0, 1};
                        else
                            area = 2 * 3.141592653589793 * 0.3 * 0.7 / (N * N);
                    }
                    const Vec3f to = t.point(q) - p;
                    const double d2 = dot(to, to), shines = -dot(to, t.vector(n));
                    if (shines > 0 && to.y > 0)
                        sum += 4 * area * shines * double(to.y) / (d2 * d2);
                }
            return sum;
        };
        expect_irradiance(s, irradiance, 0.004);
    }
}

// The irradiance of a ball of a point's intensity is the point's, a spot's inside its cone too.
TEST(AreaLights, SoftPointsAndSpots) {
    for (Kind kind : {Kind::Point, Kind::Spot}) {
        FloorScene s;
        auto l = light(kind, Rgb(3), Transform::translate(0.2, 0.5, -0.1) * Downwards);
        l.radius = 0.2f;
        l.cone_angle = 60, l.cone_delta_angle = 20, l.beam_distribution = 3;
        s.inputs.lights.push_back(l);
        s.finish();
        expect_irradiance(
            s,
            [&](const Vec3f& x) {
                const Vec3f to = Vec3f(0.2f, 0.5f, -0.1f) - x;
                const double d2 = dot(to, to), cosine = to.y / std::sqrt(d2);
                const double t =
                    std::clamp((cosine - 0.5) / (std::cos(40 * 3.14159265 / 180) - 0.5), 0.0, 1.0);
                const double cone = kind == Kind::Spot ? t * t * (3 - 2 * t) * cosine * cosine * cosine : 1;
                return 3 * cone * cosine / d2;
            },
            0.004);
    }
}

// A picture on a quad: each half has its own irradiance; the camera sees it in place.
TEST(AreaLights, PicturesOnQuads) {
    TestScene s;
    auto l = light(Kind::Quad, Rgb(2), Transform::translate(0, 0, 2) * Transform::rotate(180, 0, 1, 0));
    l.width = l.height = 2;
    auto table = std::make_shared<scene::LightTable>();
    table->width = table->height = 2;
    table->rgb = {1, 1, 1, 0.5f, 0.5f, 0.5f, 0.25f, 0.25f, 0.25f, 0.125f, 0.125f, 0.125f};
    l.table = table;
    s.inputs.lights.push_back(l);
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.49f, 8, 8);
    s.finish();
    const auto pixels = s.render(64, 8);
    // The light's +x is the picture's left, since it is turned to the camera; rows run down from +y.
    EXPECT_NEAR(pixels[7].rgb[1], 2, 0.02);
    EXPECT_NEAR(pixels[0].rgb[1], 1, 0.02);
    EXPECT_NEAR(pixels[63].rgb[1], 0.5, 0.01);
    EXPECT_NEAR(pixels[56].rgb[1], 0.25, 0.01);
    for (const PixelSums& p : pixels)
        EXPECT_EQ(p.alpha, 64);
    s.inputs.lights[0].visible_camera = false;
    s.finish();
    EXPECT_EQ(s.render(4, 8)[0].rgb[1], 0);
}

// Next-event estimation and BSDF hits agree: glossy floors under lights in the hierarchy, and by choice.
TEST(AreaLights, GlossyFloorsSeeTheSameByEitherTechnique) {
    double expected[3] = {}, error[3] = {};
    for (int mode = 0; mode < 3; mode++) {
        TestScene s;
        s.add_quad({0, -1, 0}, {0, 0, 8}, {8, 0, 0}, {metal(0.3f)});
        s.camera({1, 0, 0}, {0, 0.8f, 0.6f}, {0, -0.6f, 0.8f}, 0.5f, 20, 20);
        s.inputs.max_depth = 1;
        // By choice, in the hierarchy, and by directions alone.
        const int copies = mode == 1 ? 6 : 1;
        for (int k = 0; k < copies; k++)
            for (Kind kind : {Kind::Quad, Kind::Sphere, Kind::Disk}) {
                auto l = light(kind, Rgb(6.0f / float(copies)),
                               Transform::translate(0.5f * float(int(kind) % 3) - 0.5f, 0.5f, 3) * Downwards);
                l.width = 0.5f, l.height = 0.3f, l.radius = 0.2f;
                l.visible_camera = false;
                s.inputs.lights.push_back(l);
            }
        s.finish();
        EXPECT_EQ(s.view.lights.tree.empty(), mode != 1);
        if (mode == 2)
            s.view.lights.choices = 0; // no next-event estimation
        const auto e = s.estimate(mode == 2 ? 256 : 64, 12);
        expected[mode] = e.channel[1].mean(), error[mode] = e.channel[1].error();
    }
    EXPECT_NEAR(expected[1], expected[0], 0.004 * expected[0] + 4.5 * std::hypot(error[0], error[1]));
    EXPECT_NEAR(expected[2], expected[0], 0.004 * expected[0] + 4.5 * std::hypot(error[0], error[2]));
    EXPECT_LT(error[0], error[2]);
}

// Lights that shine through everything are sampled alone: BSDF hits would count them a second time.
TEST(AreaLights, WithoutShadowsAreCountedOnce) {
    for (Kind kind : {Kind::Quad, Kind::Disk, Kind::Sphere, Kind::Cylinder, Kind::Distant}) {
        double mean[2], error[2];
        for (int k = 0; k < 2; k++) {
            FloorScene s;
            auto l = light(kind, Rgb(3), Transform::translate(0.1f, 0.5f, 0) * Downwards);
            l.radius = 0.4f;
            l.angle = 40;
            l.shadows = k == 0;
            l.visible_camera = false;
            s.inputs.lights.push_back(l);
            if (k == 1)
                s.add_quad({0, 0.01f, 0}, {0, 0, 9}, {9, 0, 0},
                           {matte(Rgb(0))}); // an occluder of other lights
            s.finish();
            const auto e = s.estimate(64, 10);
            mean[k] = e.channel[1].mean(), error[k] = e.channel[1].error();
        }
        EXPECT_NEAR(mean[1], mean[0], 0.003 * mean[0] + 4.5 * std::hypot(error[0], error[1])) << int(kind);
    }
}

TEST(AreaLights, OfNoAreaAreReported) {
    FloorScene s;
    auto l = light(Kind::Quad, Rgb(3), Transform());
    l.width = 0;
    s.inputs.lights = {l, light(Kind::Sphere, Rgb(3), Transform()), constant_sky(Rgb(1))};
    s.inputs.lights[1].radius = 0;
    s.finish();
    for (const auto& c : s.estimate(4, 1).channel)
        EXPECT_NEAR(c.mean(), Reflectance, 0.01);
    ASSERT_FALSE(s.journal.entries().empty());
    EXPECT_NE(s.journal.entries()[0].message.find("no area"), std::string::npos);
}

} // namespace kanuka::transport
