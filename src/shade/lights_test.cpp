#include "shade/lights.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "shade/test_support.h"

namespace kanuka::shade {
namespace {

using test::value;

struct Lights : testing::Test {
    Journal journal;
    test::TemporaryFolder folder;
    Textures textures{{folder.str()}, 1 << 20, journal};
    scene::ShaderRef ref;

    Lights() { ref.where = {"scene.rib", 3, 1}; }
    std::optional<scene::Light> make(const std::string& name) {
        ref.name = name;
        return make_light(ref, textures, journal);
    }
};

void expect_near(const Vec3f& a, const Vec3f& b) {
    EXPECT_NEAR(a.x, b.x, 1e-5f);
    EXPECT_NEAR(a.y, b.y, 1e-5f);
    EXPECT_NEAR(a.z, b.z, 1e-5f);
}

TEST_F(Lights, ClassicIntensitiesBecomeRadiometricAmounts) {
    ref.parameters.set(value("intensity", scene::Type::Float, {2}));
    ref.parameters.set(value("lightcolor", scene::Type::Color, {1, 0.5f, 0}));
    expect_near(make("distantlight")->amount, {2 * Pi, Pi, 0});
    expect_near(make("pointlight")->amount, {2 * Pi, Pi, 0});
    expect_near(make("spotlight")->amount, {2 * Pi, Pi, 0});
    expect_near(make("ambientlight")->amount, {2, 1, 0});
    expect_near(make("environmentlight")->amount, {2, 1, 0});
    EXPECT_FALSE(make("ambientlight")->visible_camera);
    EXPECT_TRUE(journal.entries().empty());
}

TEST_F(Lights, PlacedInShaderSpaceWithoutItsScale) {
    ref.parameters.set(value("from", scene::Type::Point, {1, 0, 0}));
    ref.parameters.set(value("to", scene::Type::Point, {1, -2, 0}));
    ref.world_from_shader = Transform::translate(0, 0, 7) * Transform::scale(3, 3, -3);
    const Transform t = make("spotlight")->world_from_light;
    expect_near(t.point({0, 0, 0}), {3, 0, 7});
    expect_near(t.vector({0, 0, 1}), {0, -1, 0});
    EXPECT_NEAR(t.determinant3(), 1, 1e-5);
    ref.parameters.values.clear();
    expect_near(make("spotlight")->world_from_light.vector({0, 0, 1}), {0, 0, -1}); // RISpec: to (0, 0, 1)
}

TEST_F(Lights, SpotAnglesAreRadiansInDegreesOut) {
    ref.parameters.set(value("coneangle", scene::Type::Float, {0.5f}));
    const auto spot = make("spotlight");
    EXPECT_NEAR(spot->cone_angle, 28.6479f, 1e-3f);
    EXPECT_NEAR(spot->cone_delta_angle, 5, 1e-4f); // RISpec's default
    EXPECT_EQ(spot->beam_distribution, 2);
}

TEST_F(Lights, UnknownShadersAndParametersAreReported) {
    ref.parameters.set(value("shadows", scene::Type::Float, {1}));
    EXPECT_FALSE(make("uberlight"));
    EXPECT_FALSE(is_standard_light("uberlight"));
    ref.stand_in = std::make_shared<scene::ShaderRef::StandIn>("distantlight");
    EXPECT_TRUE(make_stand_in(ref, "here", textures, journal));
    EXPECT_TRUE(make("pointlight"));
    const auto entries = journal.entries();
    ASSERT_EQ(entries.size(), 2u);
    EXPECT_NE(entries[0].message.find("no parameter \"shadows\"; it has intensity, lightcolor"),
              std::string::npos);
    EXPECT_NE(entries[1].message.find("light shader \"uberlight\" is not found"), std::string::npos);
    EXPECT_NE(entries[1].message.find("distantlight, pointlight, spotlight, environmentlight, ambientlight"),
              std::string::npos);
}

TEST_F(Lights, WhatIsOutOfRangeIsToldAndTheDefaultStands) {
    ref.parameters.set(value("radius", scene::Type::Float, {-2}));
    ref.parameters.set(test::text("unit", "horsepower"));
    const auto light = make("spherelight");
    EXPECT_EQ(light->radius, 0.5f);
    EXPECT_EQ(light->unit, "");
    std::string all;
    for (const Journal::Entry& e : journal.entries())
        all += e.message + "\n";
    EXPECT_EQ(journal.entries().size(), 2u) << all;
    for (const char* words :
         {"\"unit\": expected lumen, candela, lux, nit or watt, got \"horsepower\"; it stays",
          "\"radius\": expected a number of scene units, 0 or more, got -2; it stays"})
        EXPECT_NE(all.find(words), std::string::npos) << all;
}

TEST_F(Lights, FallOffByTheirDecay) {
    const auto falloff = [&] {
        const auto light = make("pointlight");
        return light->table ? light->table->falloff : 2;
    };
    EXPECT_EQ(falloff(), 2);
    for (const int power : {0, 1, 2, 3}) {
        ref.parameters.set(value("decay", scene::Type::Float, {float(power)}));
        EXPECT_EQ(falloff(), power);
    }
    ref.parameters.set(value("decay", scene::Type::Float, {NAN}));
    EXPECT_EQ(falloff(), 2);
}

TEST_F(Lights, StandInsKeepPlaceHandleAndShadows) {
    ref.name = "theirs";
    ref.handle = "key";
    ref.parameters.set(test::text("shadowname", "key.shad"));
    ref.world_from_shader = Transform::translate(0, 7, 0);
    auto stand_in = std::make_shared<scene::ShaderRef::StandIn>("spotlight");
    stand_in->parameters.set(value("intensity", scene::Type::Float, {3}));
    ref.stand_in = std::move(stand_in);
    const auto light = make_stand_in(ref, "here", textures, journal);
    ASSERT_TRUE(light);
    EXPECT_EQ(light->kind, scene::Light::Kind::Spot);
    EXPECT_EQ(light->name, "key");
    EXPECT_TRUE(light->shadows) << "theirs named a map";
    EXPECT_NEAR(light->amount.x, 3 * Pi, 1e-5f);
    expect_near(light->world_from_light.point({0, 0, 0}), {0, 7, 0});
    ASSERT_EQ(journal.entries().size(), 1u);
    EXPECT_NE(journal.entries()[0].message.find("\"spotlight\" with what parameters"), std::string::npos);
    ref.stand_in = std::make_shared<scene::ShaderRef::StandIn>();
    EXPECT_FALSE(make_stand_in(ref, "here", textures, journal));
    EXPECT_EQ(journal.entries().back().severity, Severity::Info) << "indirect light is traced";
    // Nobody said anything.
    ref.stand_in = nullptr;
    ref.parameters.set(value("intensity", scene::Type::Float, {5}));
    ref.parameters.set(value("softness", scene::Type::Float, {1}));
    const auto neutral = make_stand_in(ref, "here", textures, journal);
    ASSERT_TRUE(neutral);
    EXPECT_EQ(neutral->kind, scene::Light::Kind::Distant);
    EXPECT_NEAR(neutral->amount.x, 5 * Pi, 1e-4f);
    const auto entries = journal.entries();
    EXPECT_EQ(entries.size(), 3u) << "and nothing of softness";
    EXPECT_TRUE(std::ranges::any_of(entries, [](const Journal::Entry& e) {
        return e.severity == Severity::Error && e.message.find("searched in here") != std::string::npos &&
               e.message.find("\"distantlight\" with what parameters") != std::string::npos;
    }));
}

TEST_F(Lights, ShadowMapLightsAreTheirStandardOnes) {
    ref.parameters.set(test::text("shadowname", "spot.shad"));
    ref.parameters.set(value("coneangle", scene::Type::Float, {0.35f}));
    const auto light = make("shadowspot");
    ASSERT_TRUE(light);
    EXPECT_EQ(light->kind, scene::Light::Kind::Spot);
    EXPECT_NEAR(light->cone_angle, 20.0535f, 1e-3f);
    EXPECT_TRUE(journal.entries().empty());
    EXPECT_TRUE(make("spotlight"));
    EXPECT_EQ(journal.entries().size(), 1u) << "but a plain spotlight has no shadow map";
}

// The classic shaders look a map up only where one is named: shadowname = "" casts none.
TEST_F(Lights, ShadowLightsWithoutAMapCastNone) {
    EXPECT_FALSE(make("shadowspot")->shadows);
    EXPECT_FALSE(make("shadowdistant")->shadows);
    ref.parameters.set(test::text("shadowname", ""));
    EXPECT_FALSE(make("shadowspot")->shadows);
    ref.parameters.set(test::text("shadowname", "spot.shad"));
    EXPECT_TRUE(make("shadowspot")->shadows);
    ref.parameters.values.clear();
    ref.parameters.set(test::text("sfnz", "back.shad"));
    EXPECT_TRUE(make("shadowpoint")->shadows);
    // A shader of the scene's own: its defaults count, unless the scene says otherwise.
    sl::Parameter map = test::parameter("shadowmap", sl::Type::String);
    map.strings = {"raytrace"};
    const test::FakeShader own("own", sl::ShaderKind::Light, {map});
    ref.parameters.values.clear();
    ref.name = "own";
    EXPECT_TRUE(casts_shadows(ref, &own));
    ref.parameters.set(test::text("shadowmap", ""));
    EXPECT_FALSE(casts_shadows(ref, &own));
}

// RISpec's spotlight: smoothstep(cos(coneangle), cos(coneangle - conedeltaangle), cosine).
TEST_F(Lights, ConesBeyondPiAreWhatTheirCosinesSay) {
    for (const double angle : {30.0, 40.0, 45.0, 60.0, 4.0, 3.5}) { // "degrees", too
        ref.parameters.set(value("coneangle", scene::Type::Float, {float(angle)}));
        ref.parameters.set(value("conedeltaangle", scene::Type::Float, {0.2f}));
        const auto light = make("spotlight");
        const double outer = std::cos(angle), inner = std::max(outer, std::cos(angle - 0.2));
        const auto cosine = [](double degrees) { return std::cos(degrees * std::numbers::pi / 180); };
        EXPECT_NEAR(cosine(double(light->cone_angle)), outer, 2e-5) << angle;
        EXPECT_NEAR(cosine(double(light->cone_angle - light->cone_delta_angle)), inner, 2e-5) << angle;
    }
    ref.parameters.set(value("coneangle", scene::Type::Float, {3}));
    EXPECT_NEAR(make("spotlight")->cone_angle, 3 * 180 / std::numbers::pi, 1e-3);
}

TEST_F(Lights, EnvironmentPictureIsLookedFor) {
    const std::string sky = folder.write("sky.exr", "");
    ref.parameters.set(test::text("mapname", "sky.exr"));
    EXPECT_EQ(make("environmentlight")->texture, sky);
    EXPECT_TRUE(journal.entries().empty());
    ref.parameters.set(test::text("texture", "night.exr"));
    EXPECT_EQ(make("environmentlight")->texture, "");
    ASSERT_EQ(journal.entries().size(), 1u);
    EXPECT_NE(journal.entries()[0].message.find("\"night.exr\" is not found; searched in \"" + folder.str()),
              std::string::npos);
}

TEST_F(Lights, AreaLightsOfOtherNamesShineAlike) {
    ref.name = "finite";
    ref.parameters.set(value("intensity", scene::Type::Float, {5}));
    check_area_light(ref, journal);
    EXPECT_EQ(journal.entries().size(), 1u);
    expect_near(light_amount(ref), {5, 5, 5});
    ref.name = "arealight";
    check_area_light(ref, journal);
    EXPECT_EQ(journal.entries().size(), 1u);
    ref.parameters.set(value("intensity", scene::Type::Float, {150000})); // cornell.rib of BMRT
    check_area_light(ref, journal);
    ASSERT_EQ(journal.entries().size(), 2u);
    EXPECT_NE((journal.entries()[0].message + journal.entries()[1].message).find("over the area"),
              std::string::npos);
}

} // namespace
} // namespace kanuka::shade
