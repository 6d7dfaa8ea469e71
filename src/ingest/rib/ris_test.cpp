// Requests of later renderers: Bxdf, Light, layers, resources, edits, error handlers.

#include "ingest/rib/test_support.h"

namespace kanuka::ingest::test {

static const scene::ShaderRef& surface(const Parsed& p, size_t i = 0) {
    return *p.primitive(i).attributes->surface;
}
static const std::string Ball = " Sphere 1 -1 1 360 ";

TEST(Ris, BxdfsBecomeStandardShaders) {
    const Parsed disney(
        world("Bxdf \"PxrDisney\" \"a\" \"color baseColor\" [1 .5 .25] \"float metallic\" [.5] "
              "\"float clearcoat\" [1] \"float specular\" [.25]" +
              Ball));
    EXPECT_SILENT(disney);
    EXPECT_EQ(surface(disney).name, "principled");
    EXPECT_EQ(surface(disney).parameters.get_color("baseColor", Rgb(0)), Rgb(1, .5f, .25f));
    EXPECT_EQ(surface(disney).parameters.get_float("metallic", 0), .5f);
    EXPECT_EQ(surface(disney).parameters.get_float("coat", 0), 1);
    EXPECT_EQ(surface(disney).parameters.get_float("specular", 0), .5f);

    const Parsed metal(
        world("Bxdf \"PxrSurface\" \"a\" \"float diffuseGain\" 0 \"color specularFaceColor\" [.9 "
              ".8 .7] \"float specularRoughness\" .3" +
              Ball));
    EXPECT_EQ(surface(metal).parameters.get_float("metallic", 0), 1);
    EXPECT_EQ(surface(metal).parameters.get_color("baseColor", Rgb(0)), Rgb(.9f, .8f, .7f));
    EXPECT_EQ(surface(metal).parameters.get_float("roughness", 0), .3f);

    const Parsed glass(
        world("Bxdf \"PxrSurface\" \"a\" \"float refractionGain\" 1 \"float glassIor\" 1.33" + Ball));
    EXPECT_EQ(surface(glass).name, "glass");
    EXPECT_EQ(surface(glass).parameters.get_float("ior", 0), 1.33f);

    const Parsed other(world("Bxdf \"MyOwn\" \"a\" \"color diffuseColor\" [1 0 0] \"float fuzz\" 1" + Ball));
    EXPECT_TRUE(other.says("Bxdf \"MyOwn\" is not known"));
    EXPECT_TRUE(other.says("no counterpart of fuzz"));
    EXPECT_EQ(surface(other).parameters.get_color("baseColor", Rgb(0)), Rgb(1, 0, 0));
}

TEST(Ris, PatternsFeedBxdfs) {
    const Parsed p(world("Pattern \"PxrTexture\" \"tex\" \"string filename\" [\"wood.tx\"]\n"
                         "Pattern \"PxrNoise\" \"noise\"\n"
                         "Bxdf \"PxrDiffuse\" \"a\" \"reference color diffuseColor\" [\"tex:resultRGB\"]" +
                         Ball + "Bxdf \"PxrDisney\" \"b\" \"reference float roughness\" [\"noise:resultF\"]" +
                         Ball));
    EXPECT_EQ(surface(p).parameters.get_string("texturename", ""), "wood.tx");
    EXPECT_EQ(surface(p).parameters.get_float("specular", 1), 0);
    EXPECT_EQ(surface(p, 1).parameters.find("roughness"), nullptr);
    EXPECT_TRUE(p.says("Pattern \"PxrNoise\", which has no counterpart"));
}

TEST(Ris, LightsBecomeOurs) {
    const Parsed p(
        world("AttributeBegin Scale 2 3 1 Light \"PxrRectLight\" \"key\" \"float intensity\" 6 \"float "
              "exposure\" 1 \"color lightColor\" [1 1 .5] \"int areaNormalize\" [1] AttributeEnd "
              "Illuminate \"key\" 1\nLight \"PxrDomeLight\" \"sky\" \"string lightColorMap\" "
              "[\"sky.exr\"]\nLight \"PxrDistantLight\" \"sun\" \"float angleExtent\" 2\n"
              "Light \"PxrPortalLight\" \"no\"\n" +
              Ball));
    ASSERT_EQ(p.scene.light_shaders.size(), 3u);
    const auto& key = p.scene.light_shaders[0];
    EXPECT_EQ(key.name, "quadlight");
    EXPECT_EQ(key.handle, "key");
    EXPECT_FLOAT_EQ(key.parameters.get_float("intensity", 0), 2); // 12 over an area of 6
    EXPECT_EQ(key.parameters.get_color("lightcolor", Rgb(0)), Rgb(1, 1, .5f));
    EXPECT_EQ(p.scene.light_shaders[1].parameters.get_string("texture", ""), "sky.exr");
    EXPECT_EQ(p.scene.light_shaders[2].parameters.get_float("angle", 0), 2);
    EXPECT_TRUE(p.says("Light \"PxrPortalLight\" has no counterpart"));
}

TEST(Ris, MeshLightsShine) {
    const Parsed p(world("Light \"PxrMeshLight\" \"m\" \"float intensity\" 3" + Ball));
    ASSERT_TRUE(p.primitive(0).attributes->area_light);
    EXPECT_EQ(p.primitive(0).attributes->area_light->parameters.get_float("intensity", 0), 3);
}

TEST(Ris, IntegratorsSayHowDeep) {
    const Parsed p("Integrator \"PxrPathTracer\" \"i\" \"int maxPathLength\" [5]\n" + world(Ball));
    EXPECT_EQ(p.scene.options.max_depth, 5);
    EXPECT_TRUE(Parsed("Integrator \"PxrOcclusion\" \"i\"\n" + world(Ball)).says("paths are traced"));
}

TEST(Layers, TheLastCounts) {
    const Parsed one(world("ShaderLayer \"surface\" \"matte\" \"base\" \"Kd\" .5" + Ball));
    EXPECT_SILENT(one);
    EXPECT_EQ(surface(one).name, "matte");
    const Parsed two(world("ShaderLayer \"surface\" \"dots\" \"a\" ShaderLayer \"surface\" \"matte\" \"b\" "
                           "ConnectShaderLayers \"surface\" \"a\" \"c\" \"b\" \"Kd\"" +
                           Ball));
    EXPECT_EQ(surface(two).name, "matte");
    EXPECT_TRUE(two.says("the last is the shader"));
}

TEST(Resources, SaveAndRestore) {
    const Parsed p(
        world("ResourceBegin AttributeBegin Color 1 0 0 Surface \"metal\" Translate 1 2 3 Resource \"r\" "
              "\"attributes\" \"string operation\" \"save\" AttributeEnd\n"
              "AttributeBegin Resource \"r\" \"attributes\" \"string operation\" \"restore\" \"string "
              "subset\" \"shading\"" +
              Ball + "Resource \"r\" \"attributes\" \"string operation\" \"restore\"" + Ball +
              "AttributeEnd ResourceEnd\nResource \"r\" \"attributes\" \"string operation\" "
              "\"restore\""));
    EXPECT_EQ(surface(p).name, "metal");
    expect_point(p.primitive(0).world_from_object.point({0, 0, 0}), 0, 0, 0);
    expect_point(p.primitive(1).world_from_object.point({0, 0, 0}), 1, 2, 3);
    EXPECT_TRUE(p.says("nothing was saved under this name"));
}

TEST(Edits, ArePassedOver) {
    const Parsed p(world("EditBegin \"attribute\" \"string id\" [\"x\"] Sphere 1 -1 1 360 EditEnd" + Ball));
    EXPECT_EQ(p.scene.primitives.size(), 1u);
    EXPECT_TRUE(p.says("EditBegin … EditEnd was passed over"));
}

TEST(ErrorHandler, Modes) {
    EXPECT_EQ(Parsed(world("ErrorHandler \"ignore\" Sphere 1" + Ball)).journal.error_count(), 0u);
    EXPECT_EQ(Parsed(world("ErrorHandler \"print\" Sphere 1" + Ball)).journal.error_count(), 1u);
    EXPECT_THROW(Parsed(world("ErrorHandler \"abort\" Sphere 1" + Ball)), Error);
    EXPECT_NO_THROW(Parsed(world("ErrorHandler \"abort\" Deformation \"x\"" + Ball))); // well written
    EXPECT_TRUE(Parsed(world("ErrorHandler \"shout\"")).says("must be print, ignore or abort"));
}

} // namespace kanuka::ingest::test
