// What other renderers' and exporters' names come to.
#include "ingest/rib/dialects/lights.h"
#include "ingest/rib/test_support.h"

namespace kanuka::ingest {
namespace {

using test::Parsed;

struct StandIns : testing::Test {
    scene::ShaderRef light;

    void set(const char* name, float number) {
        scene::Value v;
        v.name = name;
        v.floats = std::vector<float>{number};
        light.parameters.set(std::move(v));
    }
    std::string name_for(const std::string& name) {
        light.name = name;
        const auto stand_in = dialects::stand_in_for_light(light);
        return stand_in ? stand_in->name : "";
    }
    float parameter(const char* name, float otherwise) {
        return dialects::stand_in_for_light(light)->parameters.get_float(name, otherwise);
    }
};

TEST_F(StandIns, AreChosenByNameAndParameters) {
    set("intensity", 3);
    set("lighttype", 2);
    set("shadows", 1);
    EXPECT_EQ(name_for("theirs/MyAmbient"), "ambientlight");
    EXPECT_EQ(name_for("envlight"), "environmentlight");
    EXPECT_EQ(parameter("visible", 1), 0) << "light shaders are seen by surfaces alone";
    EXPECT_EQ(name_for("exporterDirectionalLight"), "distantlight");
    EXPECT_EQ(name_for("point_nofall"), "pointlight");
    EXPECT_EQ(name_for("nofalloff"), "distantlight");
    EXPECT_EQ(name_for("mypoint"), "pointlight");
    EXPECT_EQ(name_for("uber"), "distantlight");
    EXPECT_EQ(dialects::stand_in_for_light(light)->parameters.values.size(), 1u) << "intensity";
    set("coneangle", 0.5f);
    EXPECT_EQ(name_for("uber"), "spotlight");
    EXPECT_EQ(name_for("indirectlight"), "") << "traced";
    EXPECT_TRUE(dialects::stand_in_for_light(light)) << "and known to be";
    EXPECT_EQ(name_for("spotlight"), "") << "its own";
    EXPECT_EQ(name_for("shadowspot"), "") << "its own, with a map";
}

TEST_F(StandIns, FallOffAsTheirShadersSay) {
    const auto falloff_of = [&](const char* name) {
        EXPECT_NE(name_for(name), "");
        return parameter("decay", 2);
    };
    EXPECT_EQ(falloff_of("liquidpoint"), 2);
    EXPECT_EQ(falloff_of("pointnofalloff"), 0);
    set("decay", 0);
    EXPECT_EQ(falloff_of("liquidpoint"), 0);
    set("decay", 1);
    set("coneangle", 0.5f);
    set("penumbraangle", 0.1f);
    set("dropoff", 0);
    EXPECT_EQ(falloff_of("liquidspot"), 1);
    EXPECT_NEAR(parameter("coneangle", 0), 0.6f, 1e-6f);
    EXPECT_NEAR(parameter("conedeltaangle", 0), 0.1f, 1e-6f);
    EXPECT_EQ(parameter("beamdistribution", 2), 0);
    EXPECT_EQ(name_for("liquidpoint"), "pointlight");
    EXPECT_FALSE(dialects::stand_in_for_light(light)->parameters.find("coneangle")) << "points have no cone";
}

TEST(Dialects, LightsOfAFileHaveTheirStandIns) {
    const Parsed p(test::world("LightSource \"liquidpoint\" \"a\" \"float intensity\" 5\n"
                               "LightSource \"pointlight\" \"b\"\nSphere 1 -1 1 360"));
    ASSERT_EQ(p.scene.light_shaders.size(), 2u);
    ASSERT_TRUE(p.scene.light_shaders[0].stand_in);
    EXPECT_EQ(p.scene.light_shaders[0].stand_in->name, "pointlight");
    EXPECT_EQ(p.scene.light_shaders[0].stand_in->parameters.get_float("intensity", 1), 5);
    EXPECT_FALSE(p.scene.light_shaders[1].stand_in);
}

TEST(Dialects, OptionsAreReadIntoTheirFields) {
    const Parsed p("Option \"limits\" \"int proceduralmemory\" [64] \"int[2] bucketsize\" [16 16]\n"
                   "Option \"trace\" \"int maxdepth\" [2]\n"
                   "Option \"pixelfilter\" \"float[4] values\" [1 2 3 4] \"integer[2] cells\" [2 2]\n" +
                   test::world("Sphere 1 -1 1 360"));
    EXPECT_SILENT(p);
    EXPECT_EQ(p.scene.options.procedural_memory, 64);
    EXPECT_EQ(p.scene.options.max_depth, 3);
    EXPECT_EQ(p.scene.options.filter_values, (std::vector<float>{1, 2, 3, 4}));
    EXPECT_EQ(p.scene.options.filter_cells, (std::array<int, 2>{2, 2}));
    EXPECT_EQ(p.scene.options.filter_where.line, 3);
    EXPECT_TRUE(p.scene.options.user.find("limits:bucketsize")) << "shaders may ask for what nothing reads";
    const Parsed wrong("Option \"trace\" \"string maxdepth\" \"deep\"\n"
                       "Option \"limits\" \"int proceduralmemory\" [-7]\n" +
                       test::world("Sphere 1 -1 1 360"));
    EXPECT_TRUE(wrong.says("error 1:")) << wrong.all_messages();
    EXPECT_TRUE(wrong.says("\"maxdepth\" must be a whole number of 0 or more; it stays as it was"));
    EXPECT_TRUE(wrong.says("\"proceduralmemory\" must be")) << wrong.all_messages();
    EXPECT_EQ(wrong.scene.options.max_depth, 8);
}

TEST(Dialects, NsamplesTellsBmrtsAreaLights) {
    const Parsed p(test::world("AreaLightSource \"arealight\" \"a\"\nSphere 1 -1 1 360\n"
                               "Attribute \"light\" \"nsamples\" [4]\nSphere 1 -1 1 360"));
    EXPECT_FALSE(p.primitive(0).attributes->area_light_by_intensity);
    EXPECT_TRUE(p.primitive(1).attributes->area_light_by_intensity);
}

} // namespace
} // namespace kanuka::ingest
