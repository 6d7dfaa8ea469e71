// Light shaders as tables: what a table says is what the shader says.
#include "shade/light_table.h"

#include <gtest/gtest.h>

#include <cmath>

#include "shade/services.h"
#include "shade/test_support.h"

namespace kanuka::shade {
namespace {

struct LightTables : testing::Test {
    Journal journal;
    test::TemporaryFolder folder;
    Textures textures{{folder.str()}, 1 << 20, journal};
    scene::Scene scene;
    WorldSpaces shared{scene, {}};
    Facts facts{nullptr, &scene.options, &scene.camera};
    scene::ShaderRef ref;
    Bounds3f lit{{-2, -2, -2}, {2, 2, 2}};

    scene::Light make(const std::string& source) {
        sl::CompileOptions options;
        options.use_cache = false;
        const auto shader = sl::compile_source("light.sl", source, options, journal);
        EXPECT_TRUE(shader);
        if (!shader)
            return {};
        Spaces spaces;
        spaces.shared = &shared;
        spaces.current_from_object = spaces.current_from_shader = ref.world_from_shader;
        MaterialServices services(spaces, facts, textures, journal, ref.where);
        const auto instance = shader->instantiate({}, services);
        return shade_light(*instance, ref, lit, services);
    }
};

void expect_color(const Rgb& a, const Rgb& b, float tolerance = 1e-4f) {
    for (int k = 0; k < 3; k++)
        EXPECT_NEAR(a[k], b[k], tolerance * std::max(1.0f, std::abs(b[k])));
}

TEST_F(LightTables, PlainPointLightsNeedNoTable) {
    const auto l = make("light p() { illuminate (point (1, 2, 3)) Cl = 2 * color(1, .5, .25) / (L . L); }");
    EXPECT_EQ(l.kind, scene::Light::Kind::Point);
    EXPECT_FALSE(l.table);
    expect_color(l.amount, Rgb(2, 1, 0.5f) * Pi);
    expect_color(l.world_from_light.point({0, 0, 0}), {1, 2, 3});
}

TEST_F(LightTables, FalloffIsFound) {
    for (int power : {0, 1, 3}) {
        const auto l = make("light p() { illuminate (point (0, 0, 5)) Cl = pow(length(L), -" +
                            std::to_string(power) + "); }");
        ASSERT_TRUE(l.table);
        EXPECT_EQ(l.table->falloff, power);
        EXPECT_EQ(l.table->layers, 1);
        expect_color(l.amount, Rgb(Pi), 1e-3f);
    }
}

// BMRT's windowlight: parallel light through a pane, from a place beside what it lights.
TEST_F(LightTables, APlaceThatFollowsWhatIsLitMakesDistantLight) {
    const auto l = make("light w() { vector path = normalize(vector (1, -1, 0));"
                        " float d = 3 - ycomp(Ps); point PL = Ps - path * (d * sqrt(2));"
                        " illuminate (PL, path, .01)"
                        "  Cl = 2 * step(-1, xcomp(PL)) * (1 - step(1, xcomp(PL))) * step(-1, zcomp(PL)) * "
                        "(1 - step(1, zcomp(PL))); }");
    EXPECT_EQ(l.kind, scene::Light::Kind::Distant);
    EXPECT_EQ(l.angle, 0);
    ASSERT_TRUE(l.table);
    expect_color(l.amount, Rgb(2 * Pi));
    expect_color(l.world_from_light.vector({0, 0, 1}), normalize(Vec3f(1, -1, 0)));
    // The pane about (0, 3, 0): 1.41 by 2 across the light; the plane is 2 sqrt(12) wide.
    double bright = 0;
    for (size_t i = 0; i < l.table->rgb.size(); i += 3)
        bright += l.table->rgb[i] > 0.5f;
    const double side = 2 * std::sqrt(12.0) / l.table->width;
    EXPECT_NEAR(bright * side * side, 2 * std::sqrt(2.0), 0.1);
    EXPECT_TRUE(journal.entries().empty());
}

TEST_F(LightTables, APlaceThatMovesOtherwiseIsTold) {
    const auto l = make("light w() { illuminate (point (0.5 * xcomp(Ps), 5, 0)) Cl = 1; }");
    EXPECT_EQ(l.kind, scene::Light::Kind::Point);
    ASSERT_EQ(journal.entries().size(), 1u);
    EXPECT_NE(journal.entries()[0].message.find("differs from point to point"), std::string::npos);
}

TEST_F(LightTables, ConesKeepTheirProfile) {
    ref.world_from_shader = Transform::translate(0, 4, 0);
    const auto l =
        make("light s() { vector axis = vector (0, -1, 0); illuminate (P, axis, PI / 6) {"
             " float c = (L . axis) / length(L); Cl = smoothstep(cos(PI / 6), 1, c) / (L . L); } }");
    ASSERT_TRUE(l.table);
    EXPECT_NEAR(l.table->angle, Pi / 6, 1e-5f);
    EXPECT_EQ(l.table->width, 1); // round about its axis
    expect_color(l.world_from_light.point({0, 0, 0}), {0, 4, 0});
    expect_color(l.world_from_light.vector({0, 0, 1}), {0, -1, 0});
    for (int row : {0, 40, 100}) {
        const float c = std::cos(Pi / 6 * (float(row) + 0.5f) / float(l.table->height)), e = std::cos(Pi / 6),
                    x = (c - e) / (1 - e);
        EXPECT_NEAR(l.table->at(0, row, 0)[0] * l.amount.x, Pi * x * x * (3 - 2 * x), 1e-3f) << row;
    }
}

TEST_F(LightTables, DistancesThatNoPowerTellsHaveLayers) {
    const auto l =
        make("light far() { illuminate (point (0, 0, 0)) Cl = smoothstep(1, 3, length(L)) / (L . L); }");
    ASSERT_TRUE(l.table);
    EXPECT_GT(l.table->layers, 4);
    for (int k = 0; k < l.table->layers; k++) {
        const float d = l.table->nearest * float(1 << k), x = std::clamp((d - 1) / 2, 0.0f, 1.0f);
        const float sent = l.table->at(k, 5, 0)[1] * l.amount.y * std::pow(d, -float(l.table->falloff));
        EXPECT_NEAR(sent, Pi * x * x * (3 - 2 * x) / (d * d), 1e-3f) << d;
    }
}

TEST_F(LightTables, SlidesAreProjectedAlongTheAxis) {
    const auto l =
        make("light slide() { solar (vector (0, 0, 1), 0.05) Cl = color(step(0, xcomp(Ps)), 1, 0.5); }");
    EXPECT_EQ(l.kind, scene::Light::Kind::Distant);
    EXPECT_NEAR(l.angle, 2 * 0.05f * 180 / Pi, 1e-4f);
    ASSERT_TRUE(l.table);
    const int n = l.table->width;
    for (int i : {5, n / 2 - 3, n / 2 + 3, n - 5}) {
        const float at = (2 * (float(i) + 0.5f) / float(n) - 1) * l.table->extent;
        const Vec3f world = l.world_from_light.point({at, 0, 0});
        const float* t = l.table->at(0, n / 2, i);
        expect_color(Rgb(t[0], t[1], t[2]) * l.amount, Rgb(world.x >= 0 ? Pi : 0, Pi, Pi / 2), 1e-3f);
    }
}

TEST_F(LightTables, SkiesAndAmbientLight) {
    // Bright where light comes from above, +z: L leads downwards from there.
    const auto sky = make("light sky() { solar () Cl = max(0, -zcomp(normalize(L))); }");
    EXPECT_EQ(sky.kind, scene::Light::Kind::Environment);
    ASSERT_TRUE(sky.table);
    EXPECT_GT(sky.table->at(0, 0, 3)[0], 0.99f);
    EXPECT_EQ(sky.table->at(0, sky.table->height - 1, 3)[0], 0);
    const auto ambient = make("light a() { Cl = color(1, 2, 3); }");
    EXPECT_EQ(ambient.kind, scene::Light::Kind::Ambient);
    expect_color(ambient.amount, {1, 2, 3});
    EXPECT_TRUE(journal.entries().empty());
    make("light a() { Cl = xcomp(Ps); }");
    EXPECT_EQ(journal.entries().size(), 1u);
}

} // namespace
} // namespace kanuka::shade
