// Smooth thin walls: light behind a pane, by next-event estimation and by BSDF hits, against Fresnel's law.
#include "transport/test_floor.h"

namespace kanuka::transport {
namespace {

using namespace testing;
using Kind = scene::Light::Kind;
constexpr double DoublePi = 3.14159265358979323846;

Lobe pane(const Rgb& passes = Rgb(1), float roughness = 0, float ior = 1.5f) {
    return {grid::LobeId::ThinWalledDielectricBsdf, {Rgb(1), passes, Vec3f(ior), Vec3f(roughness)}};
}

// What a pane lets through: 1 - R', R' = 2 R / (1 + R), R by Fresnel's equations for unpolarised light.
double passes(double cosine, double n = 1.5) {
    const double sine = std::sqrt(std::max(1 - cosine * cosine, 0.0)) / n, t = std::sqrt(1 - sine * sine);
    const double s = (cosine - n * t) / (cosine + n * t), p = (n * cosine - t) / (n * cosine + t);
    const double R = 0.5 * (s * s + p * p);
    return 1 - 2 * R / (1 + R);
}

// A pane over the camera, above the floor and below all emitters.
void add_pane(TestScene& s, const Lobe& lobe, float y = 0.25f) {
    s.add_quad({0, y, 0}, {0, 0, 30}, {30, 0, 0}, {lobe});
}

scene::Light lamp(Kind kind) {
    scene::Light l;
    l.kind = kind;
    l.amount = Rgb(3);
    l.world_from_light = Transform::translate(0.2, 0.8, -0.1) * Transform::rotate(90, 1, 0, 0);
    if (kind == Kind::Distant)
        l.world_from_light = Transform::rotate(50, 0, 0, 1) * Transform::rotate(90, 1, 0, 0);
    l.width = 0.6f, l.height = 0.4f;
    l.visible_camera = false;
    return l;
}

} // namespace

TEST(ThinWalls, LampsBehindAPane) {
    for (const char* integrator : {"path", "reference"})
        for (double angle : {-1.0, 0.0, 10.0, -2.0}) { // a point, suns by their angle, a quad
            FloorScene s;
            auto l = lamp(angle == -1 ? Kind::Point : angle == -2 ? Kind::Quad : Kind::Distant);
            l.angle = float(std::max(angle, 0.0));
            s.inputs.lights.push_back(l);
            add_pane(s, pane());
            s.finish();
            s.view.settings.integrator = IntegratorChoice::parse(integrator);
            const auto irradiance = [&](const Vec3f& p) {
                const Vec3f at(0.2f, 0.8f, -0.1f);
                if (l.kind == Kind::Distant)
                    return 3 * std::cos(50 * DoublePi / 180) * passes(std::cos(50 * DoublePi / 180));
                constexpr int N = 24;
                double sum = 0;
                for (int j = 0; j < N; j++)
                    for (int i = 0; i < N; i++) {
                        Vec3f to = at - p;
                        if (l.kind == Kind::Quad)
                            to += l.world_from_light.vector({0.6f * ((float(i) + 0.5f) / N - 0.5f),
                                                             0.4f * ((float(j) + 0.5f) / N - 0.5f), 0});
                        const double d2 = dot(to, to), cosine = double(to.y) / std::sqrt(d2);
                        sum += 3 * cosine / d2 * passes(cosine) * (l.kind == Kind::Quad ? 0.24 * cosine : 1);
                    }
                return sum / (N * N);
            };
            double expected = 0;
            for (int y = 0; y < Size; y++)
                for (int x = 0; x < Size; x++)
                    expected += irradiance(s.point(x, y)) * double(Reflectance) / DoublePi / (Size * Size);
            const bool plain = s.view.settings.integrator.name == "reference";
            const auto e = s.estimate(plain ? 256 : 48, 8);
            EXPECT_EQ(e.nan_samples, 0u);
            EXPECT_NEAR(e.channel[1].mean(), expected, 0.006 * expected + 4.5 * e.channel[1].error())
                << integrator << angle;
            if (!plain) {
                EXPECT_LT(e.channel[1].error(), 0.01 * expected) << angle;
            }
        }
}

// Both techniques are weighed with the pane between: with directions alone the mean is the same.
TEST(ThinWalls, DirectionsAloneFindTheSame) {
    for (bool two : {false, true})
        for (bool emitter : {false, true}) {
            double mean[2], error[2];
            for (int mode = 0; mode < 2; mode++) {
                FloorScene s({metal(0.4f), matte(Rgb(0.3f))});
                if (emitter)
                    s.add_quad({0.2f, 0.8f, 0}, {0.5f, 0, 0}, {0, 0, 0.4f}, {emission(Rgb(5))});
                else {
                    auto l = lamp(Kind::Quad);
                    l.width = 1, l.height = 0.8f;
                    s.inputs.lights.push_back(l);
                }
                // A sky's picture, with a sun.
                s.inputs.map = LatLong{32, 16, {}};
                for (int j = 0; j < 16; j++)
                    for (int i = 0; i < 32; i++)
                        s.inputs.map.rgb.insert(s.inputs.map.rgb.end(), 3, j == 5 && i == 9 ? 40.0f : 0.2f);
                scene::Light sky = constant_sky(Rgb(1));
                sky.texture = "a picture", sky.visible_camera = false;
                sky.world_from_light = Transform::rotate(-90, 1, 0, 0);
                s.inputs.lights.push_back(sky);
                add_pane(s, pane(Rgb(0.9f, 0.6f, 0.3f)));
                if (two)
                    add_pane(s, pane(Rgb(0.8f), 0, 1.8f), 0.35f);
                s.inputs.max_depth = 2;
                s.finish();
                EXPECT_EQ(s.view.lights.samples, 2);
                if (mode == 1)
                    s.view.lights.choices = 0, s.view.lights.samples = 0;
                const auto e = s.estimate(mode ? 256 : 64, 10);
                mean[mode] = e.channel[1].mean(), error[mode] = e.channel[1].error();
            }
            EXPECT_NEAR(mean[1], mean[0], 0.004 * mean[0] + 4.5 * std::hypot(error[0], error[1]))
                << two << emitter;
            EXPECT_LT(error[0], error[1]);
        }
}

// Colour and Fresnel's part of each pane count, through instances that mirror and of any side.
TEST(ThinWalls, ColouredPanesOfInstances) {
    const Rgb tint(0.9f, 0.5f, 0.2f);
    for (int panes : {1, 2, 3}) {
        FloorScene s;
        s.inputs.lights.push_back(lamp(Kind::Distant));
        const int first = int(s.store.shapes().size());
        for (int k = 0; k < panes; k++)
            s.add_quad({0, 0.1f * float(k), 0}, {k % 2 ? 30.0f : 0, 0, k % 2 ? 0 : 30.0f},
                       {k % 2 ? 0 : 30.0f, 0, k % 2 ? 30.0f : 0}, {pane(tint)});
        s.finish(first, Transform::translate(0, 0.2, 0) * Transform::scale(-1, 2, 1));
        const double c = std::cos(50 * DoublePi / 180);
        const auto e = s.estimate(32, 8);
        // The power of a tint is that of its spectrum nearly.
        const double expected = 3 * c * std::pow(passes(c), panes) * double(Reflectance) / DoublePi;
        for (int k = 0; k < 3; k++)
            EXPECT_NEAR(e.channel[k].mean(), expected * std::pow(double(tint[k]), panes),
                        0.12 * panes * expected * double(tint[k]))
                << panes << " " << k;
    }
    FloorScene s;
    s.inputs.lights.push_back(lamp(Kind::Distant));
    add_pane(s, pane(Rgb(0.5f)));
    s.finish();
    const double c = std::cos(50 * DoublePi / 180);
    const double expected = 3 * c * passes(c) * 0.5 * double(Reflectance) / DoublePi;
    EXPECT_NEAR(s.estimate(32, 8).channel[1].mean(), expected, 0.003 * expected);
}

// Panes use up no depth, and rough ones let no shadow ray pass: there directions alone find the light.
TEST(ThinWalls, RoughOnesAndDepth) {
    double mean[3];
    for (int k = 0; k < 3; k++) {
        FloorScene s;
        auto l = lamp(Kind::Quad);
        l.width = l.height = 1.5f;
        s.inputs.lights.push_back(l);
        add_pane(s, pane(Rgb(1), k == 0 ? 0.0f : 0.04f));
        s.inputs.max_depth = k == 0 ? 1 : 2;
        if (k == 2)
            s.view.lights.choices = 0;
        s.finish();
        const auto e = s.estimate(k ? 512 : 32, 6);
        mean[k] = e.channel[1].mean();
    }
    // Hardly rough, it lets through what a smooth one does.
    EXPECT_NEAR(mean[1], mean[0], 0.03 * mean[0]);
    EXPECT_NEAR(mean[2], mean[0], 0.03 * mean[0]);
}

// The camera looks through: the floor behind a pane, the lamp that it does not see itself, the pane in the
// AOVs.
TEST(ThinWalls, SeenThrough) {
    for (const char* integrator : {"path", "direct", "reference"}) {
        TestScene s;
        s.add_quad({0, 0, 3}, {0, 9, 0}, {9, 0, 0}, {matte(Rgb(0.6f))});
        s.add_quad({0, 0, 1}, {0, 9, 0}, {9, 0, 0}, {pane()});
        scene::Light l = lamp(Kind::Distant);
        l.world_from_light = Transform::rotate(50, 0, 1, 0); // travels to +z, and through the pane
        s.inputs.lights.push_back(l);
        s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.01f, Size, Size);
        s.inputs.max_depth = 1;
        s.finish();
        s.view.settings.integrator = IntegratorChoice::parse(integrator);
        const double c = std::cos(50 * DoublePi / 180);
        const double expected = 3 * c * passes(c) * passes(1) * 0.6 / DoublePi;
        const auto e = s.estimate(256, 4);
        EXPECT_NEAR(e.channel[1].mean(), expected, 0.006 * expected + 4.5 * e.channel[1].error())
            << integrator;
        EXPECT_FLOAT_EQ(s.render(1, 8)[0].position[2], 1); // the pane is what AOVs show
    }
}

} // namespace kanuka::transport
