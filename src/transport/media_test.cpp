// Media: transmittance, single scattering and furnaces against what is known; boundaries that overlap against
// the same scene with its real interfaces.
#include "transport/media.h"

#include <gtest/gtest.h>

#include "transport/roulette.h"
#include "transport/test_media.h"

namespace kanuka::transport {
namespace {

using namespace testing;

TEST(MediaStack, HighestPriorityThenLatest) {
    SceneView scene;
    std::vector<float> rows(16 * 5, 0.0f);
    const float priorities[] = {-1e30f, 0, 2, 0, 1}; // nothing, then media 0 to 3
    for (int k = 0; k < 5; k++)
        rows[size_t(16 * k + MediumRow::Priority)] = priorities[k];
    scene.media.rows = rows;
    using I = Int<1>;
    const Mask<1> all(true);
    MediaStack<1> s{{I(-1), I(-1), I(-1), I(-1)}};
    const auto is = [&](std::array<int, 4> want) {
        for (size_t k = 0; k < 4; k++)
            EXPECT_EQ(s.at[k][0], want[k]) << k;
    };
    s.enter(scene, I(0), all), is({0, -1, -1, -1});
    s.enter(scene, I(2), all), is({2, 0, -1, -1}); // equals: the latest
    s.enter(scene, I(1), all), is({1, 2, 0, -1});
    s.enter(scene, I(3), all), is({1, 3, 2, 0});
    s.leave(I(2), all), is({1, 3, 0, -1});
    s.leave(I(2), all), is({1, 3, 0, -1}); // is not there
    s.leave(I(1), Mask<1>(false)), is({1, 3, 0, -1});
    s.enter(scene, I(3), all), is({1, 3, 3, 0});
    s.enter(scene, I(1), all), is({1, 1, 3, 3}); // full: the lowest is forgotten
    const Crossing<1> inner(scene, s, I(1), Mask<1>(false));
    EXPECT_TRUE(inner.nothing[0]); // one body with the other
    const Crossing<1> lower(scene, s, I(0), all);
    EXPECT_TRUE(lower.nothing[0]);
    const Crossing<1> out(scene, {{I(0), I(-1), I(-1), I(-1)}}, I(0), Mask<1>(false));
    EXPECT_FALSE(out.nothing[0]);
    EXPECT_EQ(out.after.at[0][0], -1);
    const Crossing<1> unknown(scene, {{I(-1), I(-1), I(-1), I(-1)}}, I(0), Mask<1>(false));
    EXPECT_FALSE(unknown.nothing[0]);
    EXPECT_EQ(unknown.before.at[0][0], 0);
    EXPECT_EQ(unknown.after.at[0][0], -1);
}

// ---- transmittance

// A box without lobes that only absorbs, in colours.
TEST(Media, ClearBoundariesLetLightThrough) {
    TestScene s;
    const Rgb sigma(0.2f, 0.6f, 1.1f);
    const int interior = s.store.add_interior(medium(sigma, Rgb(0)));
    add_box(s, {0, 0, 4}, 1, {}, interior);
    look_along_z(s, 0.01f);
    s.inputs.lights.push_back(visible_sky(Rgb(2)));
    s.inputs.max_depth = 1; // passing is no surface event
    s.finish();
    ASSERT_TRUE(s.view.media.tracked && s.view.media.clear_boundaries && !s.view.media.scatters);
    const auto a = amount(sigma);
    expect_mean(s.estimate(16, 8), seen([&](int i) { return 2 * std::exp(-2 * amount_at(a, i)); }), 0.003,
                "clear box");
    const auto pixels = s.render(1, 8);
    EXPECT_FLOAT_EQ(pixels[0].alpha, 1); // the sky is seen through it
    EXPECT_EQ(pixels[0].hits, 0);
}

// What passes a scattering medium without meeting a particle: how far paths go, wavelength by wavelength.
TEST(Media, FreePathsFollowTheirLaw) {
    const Rgb absorption(0.3f, 0.1f, 0.05f), scattering(0.1f, 0.4f, 1.5f);
    const auto a = amount(absorption), b = amount(scattering);
    for (float half : {0.2f, 1.0f, 2.5f}) {
        TestScene s;
        const int interior = s.store.add_interior(medium(absorption, scattering));
        add_box(s, {0, 0, 4}, half, {}, interior);
        look_along_z(s, 0.001f);
        s.inputs.lights.push_back(visible_sky(Rgb(1)));
        s.inputs.volume_depth = 2; // in and out, or in and one particle
        s.finish();
        s.view.settings.volume_depth = 2;
        // One particle's light is taken away: what is left once the sky is seen straight alone.
        const auto straight = [&](int i) {
            return std::exp(-2 * double(half) * (amount_at(a, i) + amount_at(b, i)));
        };
        s.view.lights.constant.present = true;
        const auto pixels = s.estimate(64, 16);
        // A path that scattered at a particle ends at the boundary: it has had two events by then.
        expect_mean(pixels, seen(straight), 0.004, "half a side of " + std::to_string(half));
    }
}

// Shadow rays lose light to what they pass.
TEST(Media, ShadowsOfMedia) {
    TestScene s;
    const float sigma = 0.8f;
    const int interior = s.store.add_interior(medium(Rgb(sigma), Rgb(0)));
    s.add_quad({0, 0, 4}, {0, 4, 0}, {4, 0, 0}, {matte(Rgb(0.5f))});
    s.add_quad({0, 2, 3.5f}, {2, 0, 0}, {0, 0, 1}, {}, interior); // a slab between light and wall
    s.add_quad({0, 2.5f, 3.5f}, {0, 0, 1}, {2, 0, 0}, {}, interior);
    look_along_z(s, 0.05f);
    scene::Light lamp;
    lamp.kind = scene::Light::Kind::Point;
    lamp.amount = Rgb(10);
    lamp.world_from_light = Transform::translate(0, 4, 3);
    s.inputs.lights.push_back(lamp);
    s.finish();
    const auto pixels = s.render(64, 8);
    for (int y = 0; y < Size; y += 5)
        for (int x = 0; x < Size; x += 5) {
            const Vec3f P = s.pixel_direction(x, y) * 4, to = Vec3f(0, 4, 3) - P;
            const double d = double(length(to)), slab = 0.5 * d / double(to.y);
            const double expected =
                10 / (d * d) * (1 / d) * 0.5 / 3.14159265 * std::exp(-double(sigma) * slab);
            EXPECT_NEAR(double(pixels[size_t(y * Size + x)].rgb[1]), expected, 0.03 * expected);
        }
}

// Rayleigh's law: the coefficient goes with the inverse fourth power of the wavelength, and so do free paths.
TEST(Media, RayleighGoesWithTheFourthPower) {
    const float sigma = 0.5f;
    store::Interior air = medium(Rgb(0), Rgb(sigma));
    air.phase = grid::LobeId::RayleighPfrgb;
    const auto white = amount(Rgb(sigma));
    for (float power : {0.0f, 1.3f, 4.0f}) {
        air.phase_inputs[0] = power;
        const auto law = [&](int i) {
            return amount_at(white, i) * std::pow(550.0 / (double(color::LambdaMin) + i), double(power));
        };
        for (float half : {0.5f, 1.5f}) {
            TestScene s;
            add_box(s, {0, 0, 4}, half, {}, s.store.add_interior(air));
            look_along_z(s, 0.001f);
            s.inputs.lights.push_back(visible_sky(Rgb(1)));
            s.finish();
            for (int nm : {400, 450, 550, 650, 800}) {
                Float<8> l[Wavelengths];
                for (auto& x : l)
                    x = Float<8>((float(nm) - 360) / 470);
                const MediumLanes<8> lanes(s.view, Int<8>(0), l);
                const double expected = law(nm - int(color::LambdaMin));
                EXPECT_NEAR(double(lanes.scattering[1][3]), expected, 1e-4 * expected) << nm;
            }
            s.view.settings.volume_depth = 2; // in and out, or in and one particle
            s.view.lights.constant.present = true;
            expect_mean(s.estimate(64, 16), seen([&](int i) { return std::exp(-2 * double(half) * law(i)); }),
                        0.004, "exponent " + std::to_string(power));
        }
    }
}

// ---- scattering

// Sunlight that scatters at one particle in a box: the integral along the eye's ray.
TEST(Media, SingleScattering) {
    const Rgb absorption(0.3f, 0.15f, 0.1f), scattering(0.3f, 0.6f, 1.2f);
    const auto a = amount(absorption), b = amount(scattering);
    for (float g : {0.0f, 0.5f, -0.4f}) {
        TestScene s;
        const int interior = s.store.add_interior(medium(absorption, scattering, g));
        add_box(s, {0, 0, 4}, 1, {}, interior);
        look_along_z(s, 0.002f);
        scene::Light sun;
        sun.kind = scene::Light::Kind::Distant;
        sun.amount = Rgb(5);
        const double tilt = 40 * 3.14159265 / 180; // against the eye's ray
        sun.world_from_light = Transform::rotate(40, 1, 0, 0);
        s.inputs.lights.push_back(sun);
        s.inputs.volume_depth = 2;
        s.finish();
        // Light travels along (0, -sin, cos) or (0, sin, cos): either way the box is left at one of two
        // walls.
        const auto value = [&](int i) {
            const double st = amount_at(a, i) + amount_at(b, i), ss = amount_at(b, i);
            const double cosine =
                std::cos(tilt); // between the sun's direction and the one to the eye's, turned
            const double gg = double(g);
            // The eye looks along +z: light goes on along -z.
            const double phase =
                (1 - gg * gg) / (4 * 3.14159265358979) / std::pow(1 + gg * gg - 2 * gg * -cosine, 1.5);
            double sum = 0;
            constexpr int N = 400;
            for (int k = 0; k < N; k++) {
                const double t = 2 * (k + 0.5) / N;
                const double distance = std::min(t / std::cos(tilt), 1 / std::sin(tilt));
                sum += ss * phase * std::exp(-st * (t + distance)) * 2 / N;
            }
            return 5 * sum;
        };
        expect_mean(s.estimate(256, 16), seen(value), 0.005, "g " + std::to_string(g));
    }
}

// What scatters all light vanishes under an even sky, whatever it is made of and however many bounces it
// takes.
TEST(Media, FurnaceOfWhiteMedia) {
    const auto ball = [](const store::Interior& in, const std::vector<Lobe>& lobes) {
        TestScene s;
        const int interior = s.store.add_interior(in);
        s.add_sphere({0, 0, 3}, 1, 48, lobes, interior);
        look_along_z(s, 0.24f);
        s.inputs.lights.push_back(visible_sky(Rgb(1)));
        s.inputs.max_depth = 64;
        s.finish();
        return s.estimate(16, 10);
    };
    const Rgb one(1);
    expect_mean(ball(medium(Rgb(0), Rgb(0.5f)), {}), one, 0.005, "thin");
    expect_mean(ball(medium(Rgb(0), Rgb(6)), {}), one, 0.005, "thick");
    expect_mean(ball(medium(Rgb(0), Rgb(4), 0.8f), {}), one, 0.005, "forwards");
    expect_mean(ball(medium(Rgb(0), Rgb(0.5f, 2, 4)), {}), one, 0.008, "coloured");
    expect_mean(ball(medium(Rgb(0), Rgb(3), 0, 1.4f), {glass(0, 1.4f)}), one, 0.01, "within glass");
    expect_mean(ball(medium(Rgb(0), Rgb(3), 0, 1.4f), {glass(0.5f, 1.4f)}), one, 0.02, "within rough glass");
    using L = grid::LobeId;
    for (const auto& [lobe, inputs] :
         {std::pair{L::DoubleHenyeyGreensteinPfrgb, std::array{0.8f, -0.3f, 0.3f, 0.0f}},
          {L::RayleighPfrgb, std::array{0.0f, 0.0f, 0.0f, 0.0f}},
          {L::RayleighPfrgb, std::array{4.0f, 0.0f, 0.0f, 0.0f}},
          {L::DrainePfrgb, std::array{0.5f, 10.0f, 0.0f, 0.0f}},
          {L::MiePfrgb, std::array{12.0f, 0.0f, 0.0f, 0.0f}}}) {
        store::Interior in = medium(Rgb(0), Rgb(2));
        in.phase = lobe, in.phase_inputs = inputs;
        expect_mean(ball(in, {}), one, 0.006, std::string(grid::lobe(lobe).name));
    }
}

// A room of albedo 1/2 that emits 1 has radiance 2 in it, with white fog or without: next-event
// estimation at surfaces and at particles, and hits from both. The camera stands in the fog, and knows.
TEST(Media, FogInARoomThatShines) {
    for (float g : {0.0f, 0.7f}) {
        TestScene s;
        const int fog = s.store.add_interior(medium(Rgb(0), Rgb(0.4f, 0.8f, 1.5f), g));
        const std::vector<Lobe> wall{matte(Rgb(0.5f)), emission(Rgb(1))};
        const Vec3f x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
        s.add_quad(-z, x, y, wall), s.add_quad(z, y, x, wall), s.add_quad(-x, y, z, wall);
        s.add_quad(x, z, y, wall), s.add_quad(-y, z, x, wall), s.add_quad(y, x, z, wall);
        s.add_sphere({0.2f, 0.1f, 0.5f}, 0.25f, 16, wall);
        add_box(s, {0, 0, 0}, 3, {}, fog);
        look_along_z(s, 1);
        s.inputs.max_depth = 48;
        s.finish();
        EXPECT_EQ(s.view.media.around_camera[0], fog);
        EXPECT_EQ(s.view.media.around_camera[1], -1);
        EXPECT_TRUE(s.journal.entries().empty());
        expect_mean(s.estimate(16, 10), Rgb(2), 0.003, "g " + std::to_string(g));
    }
}

// Next-event estimation through boundaries and media agrees with BSDF hits.
TEST(Media, NextEventEstimationAndHitsAgree) {
    const auto scene = [](bool next_event, bool analytic) {
        auto s = std::make_unique<TestScene>();
        const int fog = s->store.add_interior(medium(Rgb(0.1f, 0.2f, 0.3f), Rgb(2, 1, 0.5f), 0.3f));
        add_box(*s, {0, 0, 4}, 1, {}, fog);
        s->add_quad({0, -1.5f, 4}, {0, 0, 3}, {3, 0, 0}, {matte(Rgb(0.7f))});
        s->add_quad({0.3f, 0, 4.2f}, {0, 0.2f, 0}, {0.3f, 0, 0}, {matte(Rgb(0.5f))}); // in the fog
        if (analytic) {
            scene::Light ball;
            ball.kind = scene::Light::Kind::Sphere;
            ball.radius = 0.6f;
            ball.amount = Rgb(8);
            ball.world_from_light = Transform::translate(0.5, 0.9, 3.6); // in part within the fog
            ball.visible_camera = true;
            s->inputs.lights.push_back(ball);
        } else
            s->add_quad({0, 2.5f, 4}, {1, 0, 0}, {0, 0, 1}, {emission(Rgb(8))});
        look_along_z(*s, 0.5f);
        s->inputs.max_depth = 5;
        s->finish();
        if (!next_event)
            s->view.lights.choices = 0, s->view.lights.emitter_choice = -1;
        return s->estimate(next_event ? 128 : 256, 16);
    };
    expect_same(scene(true, false), scene(false, false), 0.01, "a quad that shines");
    expect_same(scene(true, true), scene(false, true), 0.01, "a ball that rays pass");
}

// Extinction differs between wavelengths; each alone must have the mean of the four together.
TEST(Media, WavelengthsTogetherAndAlone) {
    const auto cloud = [](bool together) {
        TestScene s;
        const int fog = s.store.add_interior(medium(Rgb(0.5f, 0.1f, 0.02f), Rgb(0.5f, 1.5f, 4)));
        add_box(s, {0, 0, 4}, 1, {}, fog);
        look_along_z(s, 0.2f);
        // A pane that neither bends nor reflects: where it disperses, the hero alone goes on, and counts four
        // times.
        s.add_quad({0, 0, 1}, {0, 1, 0}, {1, 0, 0}, {together ? glass(0, 1.0002f) : prism(0, 1.0002f, 20)});
        s.inputs.lights.push_back(visible_sky(Rgb(1)));
        s.finish();
        return s.estimate(128, 16);
    };
    expect_same(cloud(true), cloud(false), 0.004, "cloud");
}

// ---- boundaries that overlap

// A glass shell full of absorbing water, modelled three times: the water as a ball inside of a solid ball of
// glass; the water's boundary somewhere in the shell's wall; and as real interfaces.
TEST(NestedDielectrics, GlassOfWater) {
    enum Model { Within, Overlapping, Explicit };
    const auto scene = [](Model model, bool absorbs) {
        TestScene s;
        const Rgb red(0.1f, 1, 2);
        const auto ball = [&](float radius, float ior, int interior, bool inwards) {
            const int n = 64;
            std::vector<Vec3f> points, normals;
            for (int j = 0; j <= n; j++)
                for (int i = 0; i <= 2 * n; i++) {
                    const float a = Pi * float(i % (2 * n)) / float(n), b = Pi * float(j) / float(n);
                    Vec3f d{std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b)};
                    if (j == 0 || j == n)
                        d = {0, 0, j == 0 ? 1.0f : -1.0f};
                    normals.push_back(inwards ? -d : d);
                    points.push_back(Vec3f(0, 0, 4) + d * radius);
                }
            s.add_lattice(2 * n, n, points, normals, {glass(0, ior)}, interior);
        };
        const int glass_inside = s.store.add_interior(medium(Rgb(0), Rgb(0), 0, 1.5f, 1));
        const int water = s.store.add_interior(
            medium(absorbs ? red : Rgb(0), Rgb(0), 0, 1.33f, model == Within ? 2.0f : 0.0f));
        if (model == Explicit) {
            ball(1, 1.5f, -1, false);
            ball(0.7f, 1.5f / 1.33f, -1, true);
        } else {
            ball(1, 1.5f, glass_inside, false);
            if (model == Overlapping)
                ball(0.7f, 1.5f, glass_inside, true); // the shell's inner wall
            ball(model == Within ? 0.7f : 0.85f, 1.33f, water, false);
        }
        s.add_quad({0, 0, 8}, {0, 6, 0}, {6, 0, 0}, {emission(Rgb(1))});
        s.add_quad({0.5f, 0.2f, 7.9f}, {0, 0.5f, 0}, {0.5f, 0, 0}, {matte(Rgb(0))}); // something to be bent
        look_along_z(s, 0.3f);
        s.inputs.max_depth = 24;
        s.finish();
        return s.estimate(64, 12);
    };
    expect_same(scene(Within, false), scene(Explicit, false), 0.003, "within");
    expect_same(scene(Overlapping, false), scene(Explicit, false), 0.003, "overlapping");
    expect_same(scene(Overlapping, true), scene(Within, true), 0.003, "with absorption");
}

// The camera stands in what absorbs, and below an open surface. What it leaves last it entered first, in
// whatever order things are listed.
TEST(NestedDielectrics, CameraInside) {
    for (const auto& [larger_first, priority] : {std::pair{true, 1}, {false, 1}, {true, 0}, {false, 0}}) {
        TestScene s;
        const auto add = [&, priority = priority](bool larger) {
            const int medium = s.store.add_interior(
                testing::medium(Rgb(larger ? 0.5f : 0.1f), Rgb(0), 0, 1, larger ? 0.0f : float(priority)));
            add_box(s, {0, 0, 0}, larger ? 4 : 2, {}, medium); // the smaller one takes the other's place
            return medium;
        };
        const int one = add(larger_first), other = add(!larger_first);
        look_along_z(s, 0.01f);
        s.inputs.lights.push_back(visible_sky(Rgb(1)));
        s.finish();
        EXPECT_EQ(s.view.media.around_camera[0], larger_first ? other : one);
        EXPECT_EQ(s.view.media.around_camera[1], larger_first ? one : other);
        expect_mean(s.estimate(4, 4), Rgb(std::exp(-0.1f * 2 - 0.5f * 2)), 0.002, "two boxes");
        EXPECT_TRUE(s.journal.entries().empty());
    }

    TestScene open;
    const int sea = open.store.add_interior(medium(Rgb(0.5f), Rgb(0.1f)));
    open.add_quad({0, 1, 0}, {0, 0, 50}, {50, 0, 0}, {}, sea); // a surface of water overhead
    look_along_z(open, 0.01f);
    open.inputs.lights.push_back(visible_sky(Rgb(1)));
    open.finish();
    EXPECT_FALSE(open.journal.entries().empty());
    open.render(4, 8); // and no way out of it
    EXPECT_EQ(open.nan_samples, 0u);
}

// The plain estimator sees the same: it shares the particles, and knows no light sampling at surfaces. Its
// half of paths for smooth lobes is doubled at each, so one ball of glass is what its noise allows.
TEST(Media, AgreesWithTheReference) {
    const auto picture = [](const char* integrator, bool ball, int progressions,
                            const RouletteFactors* factors = nullptr) {
        TestScene s;
        const int fog = s.store.add_interior(medium(Rgb(0.1f), Rgb(0.3f, 0.6f, 1), 0.4f, 1, -1)),
                  milk = s.store.add_interior(medium(Rgb(0.05f, 0.1f, 0.3f), Rgb(1, 2, 3), 0.4f, 1.33f, 0));
        if (ball)
            s.add_sphere({0, 0, 4}, 1, 32, {glass(0, 1.33f)}, milk);
        add_box(s, {0, 0.2f, 4}, 1.4f, {}, fog);
        s.add_quad({0, -1.1f, 4}, {0, 0, 3}, {3, 0, 0}, {matte(Rgb(0.7f))});
        s.add_quad({0, 3, 4}, {2, 0, 0}, {0, 0, 2}, {emission(Rgb(2))});
        s.inputs.lights.push_back(constant_sky(Rgb(0.5f)));
        look_along_z(s, 0.4f);
        s.inputs.max_depth = ball ? 4 : 8;
        s.inputs.integrator = IntegratorChoice::parse(integrator);
        s.finish();
        s.view.settings.roulette_depth = 1000;
        s.view.settings.roulette = factors;
        return s.estimate(progressions, 12);
    };
    const RouletteFactors factors{{1, 0.5f, 0.3f, 2, 0.5f, 0.7f, 1, 1}};
    const auto fog = picture("reference", false, 64);
    expect_same(picture("path", false, 32), fog, 0.01, "fog");
    expect_same(picture("path", false, 32, &factors), fog, 0.01, "fog, by roulette");
    expect_same(picture("path", true, 32), picture("reference", true, 256), 0.01, "milk in fog");
}

// The same for every lane count, but for the last digits of hits.
TEST(Media, LanesAgree) {
    TestScene s;
    const int milk = s.store.add_interior(medium(Rgb(0.1f, 0.2f, 0.4f), Rgb(3, 4, 5), 0.5f, 1.33f, 0)),
              cup = s.store.add_interior(medium(Rgb(0.2f), Rgb(0), 0, 1.5f, 1));
    s.add_sphere({0, 0, 4}, 1, 32, {glass(0, 1.33f)}, milk);
    s.add_sphere({0.5f, 0.3f, 3.5f}, 0.8f, 32, {glass(0, 1.5f)}, cup);
    s.add_quad({0, -1.2f, 4}, {0, 0, 3}, {3, 0, 0}, {matte(Rgb(0.7f))});
    s.add_quad({0, 2.5f, 4}, {1, 0, 0}, {0, 0, 1}, {emission(Rgb(8))});
    s.inputs.lights.push_back(constant_sky(Rgb(0.5f)));
    look_along_z(s, 0.5f);
    s.inputs.max_depth = 12;
    s.finish();
    std::vector<double> means;
    std::vector<std::vector<PixelSums>> all;
    for (int lanes : {1, 8, 16}) {
        all.push_back(s.render(16, lanes));
        EXPECT_EQ(s.nan_samples, 0u);
        double sum = 0;
        for (const auto& p : all.back())
            sum += double(p.rgb[1]) / (Size * Size);
        means.push_back(sum);
    }
    for (size_t k = 1; k < means.size(); k++) {
        EXPECT_NEAR(means[k], means[0], 0.01 * means[0]);
        int same = 0;
        for (size_t i = 0; i < all[0].size(); i++)
            same += std::abs(all[k][i].rgb[1] - all[0][i].rgb[1]) < 1e-3f * all[0][i].rgb[1];
        EXPECT_GT(same, int(all[0].size()) * 3 / 4) << k;
    }
}

} // namespace
} // namespace kanuka::transport
