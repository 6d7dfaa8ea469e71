// Furnaces: where light is the same everywhere, everything that loses none of it must vanish, or shine as a
// closed form says. What single scattering loses is held to docs/transport.md.
#include <gtest/gtest.h>

#include <random>

#include "transport/test_scene.h"

namespace kanuka::transport {
namespace {

using namespace testing;

constexpr int Size = 24;

// Six walls facing inwards.
void add_room(TestScene& s, const std::vector<Lobe>& lobes) {
    const Vec3f x(1, 0, 0), y(0, 1, 0), z(0, 0, 1), c(0.1f, -0.2f, 0.05f);
    s.add_quad(c - z, x, y, lobes);
    s.add_quad(c + z, y, x, lobes);
    s.add_quad(c - x, y, z, lobes);
    s.add_quad(c + x, z, y, lobes);
    s.add_quad(c - y, z, x, lobes);
    s.add_quad(c + y, x, z, lobes);
}

void expect_grey(const TestScene::Estimate& e, double value, double relative, const std::string& what) {
    EXPECT_EQ(e.nan_samples, 0u) << what;
    for (const auto& c : e.channel)
        EXPECT_NEAR(c.mean(), value, relative * value + 4.5 * c.error()) << what;
}

// A sphere of one material, all of the picture, in a sky of radiance 1.
TestScene::Estimate sphere_in_sky(const std::vector<Lobe>& lobes, float half_width = 0.24f,
                                  int progressions = 24, int seeds = 10) {
    TestScene s;
    s.add_sphere({0, 0, 3}, 1, 96, lobes);
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, half_width, Size, Size);
    s.inputs.lights.push_back(constant_sky(Rgb(1)));
    s.inputs.max_depth = 64;
    s.finish();
    return s.estimate(progressions, seeds);
}

} // namespace

// A closed room of walls with albedo r that shine with radiance E: E / (1 - r) in every direction.
TEST(Furnace, ClosedRoom) {
    const std::pair<Lobe, std::string> walls[] = {
        {matte(Rgb(0.5f)), "matte"},
        {metal(0, Rgb(0.5f), Rgb(0.5f)), "mirror"},
        {{grid::LobeId::LambertBrdf, {Rgb(1)}, 0.5f}, "half weight"}};
    for (const auto& [lobe, name] : walls) {
        TestScene s;
        add_room(s, {lobe, emission(Rgb(1))});
        s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, Size, Size);
        s.inputs.max_depth = 48;
        s.finish();
        expect_grey(s.estimate(32, 12), 2, 0.002, name);
    }
}

TEST(Furnace, ColouredRoom) {
    TestScene s;
    const Rgb r(0.6f, 0.3f, 0.45f);
    add_room(s, {matte(r), emission(Rgb(1))});
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, Size, Size);
    s.inputs.max_depth = 48;
    s.finish();
    const auto e = s.estimate(32, 12);
    // The series of the spectra's powers, made colours, is the truth; in RGB it is 1 / (1 - r) only nearly.
    double xyz[3] = {0, 0, 0};
    const auto c = color::uplift(r);
    for (int i = 0; i < color::LambdaCount; i++) {
        const double light = color::illuminant_d65()[size_t(i)] /
                             (1 - double(color::uplift_eval(c, color::LambdaMin + float(i))));
        xyz[0] += light * color::cie_x()[size_t(i)], xyz[1] += light * color::cie_y()[size_t(i)],
            xyz[2] += light * color::cie_z()[size_t(i)];
    }
    const double n = color::cie_y_integral();
    const Rgb expected = color::xyz_to_rgb({float(xyz[0] / n), float(xyz[1] / n), float(xyz[2] / n)});
    for (int k = 0; k < 3; k++)
        EXPECT_NEAR(e.channel[k].mean(), expected[k], 0.003 * expected[k] + 4.5 * e.channel[k].error());
}

TEST(Furnace, LosslessSpheresVanish) {
    expect_grey(sphere_in_sky({matte(Rgb(1))}), 1, 0.005, "matte");
    expect_grey(sphere_in_sky({{grid::LobeId::LambertBtdf, {Rgb(1)}}}), 1, 0.005, "translucent");
    expect_grey(sphere_in_sky({{grid::LobeId::LambertBtdf, {Rgb(1)}, 0.5f}, matte(Rgb(1), 0.5f)}), 1, 0.005,
                "half translucent");
    expect_grey(sphere_in_sky({metal(0)}), 1, 0.005, "mirror");
    expect_grey(sphere_in_sky({glass(0)}), 1, 0.005, "glass");
    expect_grey(sphere_in_sky({prism(0, 1.5f, 20)}), 1, 0.005, "dispersive glass");
}

// Out to the limb, where shading normals part from flat facets: no more than one part in a hundred is lost.
TEST(Furnace, Limbs) {
    for (const auto& [lobe, name] :
         {std::pair{matte(Rgb(1)), "matte"}, {metal(0), "mirror"}, {glass(0), "glass"}})
        expect_grey(sphere_in_sky({lobe}, 0.34f), 1, 0.01, name);
}

// Multiple scattering between microfacets: light that hits several is not lost: rough metal balls vanish as
// smooth ones do.
TEST(Furnace, RoughMetalVanishes) {
    for (float roughness : {0.2f, 0.4f, 0.6f, 0.8f, 1.0f}) {
        const auto e = sphere_in_sky({metal(roughness)});
        expect_grey(e, 1, 0.006, "roughness " + std::to_string(roughness));
        RecordProperty("roughness_" + std::to_string(int(roughness * 10)),
                       std::to_string(e.channel[1].mean()));
    }
}

// Rough glass crosses several interfaces on each path; with dispersion as well.
TEST(Furnace, RoughGlassVanishes) {
    for (float roughness : {0.3f, 0.6f, 1.0f}) {
        const auto e = sphere_in_sky({glass(roughness)}, 0.24f, 16, 8);
        expect_grey(e, 1, 0.02, "roughness " + std::to_string(roughness));
        RecordProperty("roughness_" + std::to_string(int(roughness * 10)),
                       std::to_string(e.channel[1].mean()));
    }
    const auto plain = sphere_in_sky({glass(0.3f)}, 0.24f, 16, 8),
               dispersed = sphere_in_sky({prism(0.3f, 1.5f, 30)}, 0.24f, 16, 8);
    for (int k = 0; k < 3; k++)
        EXPECT_NEAR(dispersed.channel[k].mean(), plain.channel[k].mean(),
                    0.01 + 4.5 * std::hypot(plain.channel[k].error(), dispersed.channel[k].error()));
}

// Every lobe of the table that claims to lose nothing, as it comes but rough.
TEST(Furnace, LosslessLobesVanish) {
    for (const grid::LobeDecl& decl : grid::lobe_table()) {
        if (!decl.lossless)
            continue;
        Lobe lobe{decl.id, {}};
        for (const grid::LobeInput& input : decl.inputs) { // inputs before roughness have their defaults
            lobe.inputs.push_back(input.name == "roughness" ? Vec3f(0.45f) : input.fallback);
            if (input.name == "roughness")
                break;
        }
        if (grid::find_input(decl, "roughness") < 0)
            lobe.inputs.clear();
        expect_grey(sphere_in_sky({lobe}, 0.24f, 16, 6), 1, 0.015, std::string(decl.name));
    }
}

// A stretched, mirrored instance: normals and sides survive the transform.
TEST(Furnace, InstancesVanishToo) {
    const Transform t =
        Transform::translate(0, 0, 3) * Transform::rotate(35, 1, 2, 0) * Transform::scale(1.4, -0.9, 1.1);
    for (const auto& [lobe, name] : {std::pair{matte(Rgb(1)), "matte"}, {glass(0), "glass"}}) {
        TestScene s;
        s.add_sphere({0, 0, 0}, 1, 96, {lobe});
        s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.2f, Size, Size);
        s.inputs.lights.push_back(constant_sky(Rgb(1)));
        s.inputs.max_depth = 64;
        s.finish(0, t);
        expect_grey(s.estimate(32, 12), 1, 0.005, name);
        const auto pixels = s.render(1, 8); // and outward normals face the camera
        for (const PixelSums& p : pixels) {
            ASSERT_EQ(p.hits, 1);
            EXPECT_LT(p.normal[2], 0);
        }
    }
}

// Shading normals that lean every way, as bumps make them, over a plane: what a lobe sends to the wrong side
// of the surface comes back, whichever the lobe. Slopes of 0.6 and 1; a tenth of the view's normals face away
// from it.
TEST(Furnace, BumpedPlanesVanish) {
    const std::pair<Lobe, std::string> lobes[] = {{metal(0), "mirror"},
                                                  {metal(0.3f), "glossy"},
                                                  {metal(1), "rough"},
                                                  {matte(Rgb(1)), "matte"},
                                                  {{grid::LobeId::LambertBtdf, {Rgb(1)}}, "translucent"},
                                                  {glass(0), "glass"},
                                                  {glass(0.5f), "rough glass"},
                                                  {prism(0.3f, 1.6f, 20), "prism"}};
    constexpr int N = 16;
    for (const float slope : {0.6f, 1.0f})
        for (const auto& [lobe, name] : lobes) {
            TestScene s;
            std::mt19937 g(7);
            std::uniform_real_distribution<float> u(-1, 1);
            const Vec3f n = normalize(Vec3f(0, 1, -0.6f)), x(1, 0, 0), y = cross(x, n);
            std::vector<Vec3f> points, normals;
            for (int j = 0; j <= N; j++)
                for (int i = 0; i <= N; i++) {
                    points.push_back(Vec3f(0, 0, 4) + x * (8.0f * float(i) / N - 4) +
                                     y * (8.0f * float(j) / N - 4));
                    normals.push_back(normalize(n + x * (slope * u(g)) + y * (slope * u(g))));
                }
            s.add_lattice(N, N, points, normals, {lobe});
            s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.5f, Size, Size);
            s.inputs.lights.push_back(constant_sky(Rgb(1)));
            s.inputs.max_depth = 16;
            s.finish();
            expect_grey(s.estimate(16, 8), 1, 0.01, name + " at slope " + std::to_string(slope));
        }
}

// An emitting ball in a white room: BSDF hits and next-event estimation agree on which side emits.
TEST(Furnace, EmittingSphereLightsARoom) {
    TestScene s;
    add_room(s, {matte(Rgb(0.5f)), emission(Rgb(1))});
    s.add_sphere({0.2f, 0.1f, 0.5f}, 0.3f, 24,
                 {matte(Rgb(0.5f)), emission(Rgb(1))}); // same as the walls: nothing changes
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, Size, Size);
    s.inputs.max_depth = 48;
    s.finish();
    expect_grey(s.estimate(32, 12), 2, 0.002, "room with a ball");
}

} // namespace kanuka::transport
