// Requests of later renderers: Bxdf, Light, layers, resources, edits, error handlers.

#include <filesystem>

#include "ingest/rib/test_support.h"
#include "scene/layers.h"

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
    EXPECT_TRUE(surface(p).coshaders.empty());
    EXPECT_EQ(surface(p, 1).parameters.get_string(":roughness", ""), "noise");
    ASSERT_EQ(surface(p, 1).coshaders.size(), 1u);
    EXPECT_EQ(surface(p, 1).coshaders[0].name, "PxrNoise");
    EXPECT_SILENT(p);

    // Patterns feed Patterns; those that feed others come first, circles end.
    const Parsed chain(
        world("Pattern \"A\" \"a\" \"reference float x\" [\"c:resultF\"] \"string file\" [\"b:c\"]\n"
              "Pattern \"B\" \"b\" \"reference color y\" [\"a:resultRGB\"]\n"
              "Pattern \"C\" \"c\" \"reference color z\" [\"b:resultRGB\"]\n"
              "Bxdf \"PxrDisney\" \"d\" \"reference color baseColor\" [\"b:resultRGB\"] "
              "\"reference float metallic\" [\"nobody:resultF\"]" +
              Ball));
    EXPECT_EQ(scene::layers(surface(chain)), (std::vector<std::string>{"c", "a", "b"}));
    EXPECT_TRUE(chain.says("fed by \"nobody:resultF\", which is no output of a Pattern"));
}

TEST(Ris, LightsBecomeOurs) {
    const Parsed p(
        world("AttributeBegin Scale 2 3 1 Light \"PxrRectLight\" \"key\" \"float intensity\" 6 \"float "
              "exposure\" 1 \"color lightColor\" [1 1 .5] \"int areaNormalize\" [1] AttributeEnd "
              "Illuminate \"key\" 1\nLight \"PxrDomeLight\" \"sky\" \"string lightColorMap\" "
              "[\"sky.exr\"]\nLight \"PxrDistantLight\" \"sun\" \"float angleExtent\" 2\n"
              "Light \"PxrNoLight\" \"no\"\n" +
              Ball));
    ASSERT_EQ(p.scene.light_shaders.size(), 3u);
    const auto& key = p.scene.light_shaders[0];
    EXPECT_EQ(key.name, "quadlight");
    EXPECT_EQ(key.handle, "key");
    EXPECT_FLOAT_EQ(key.parameters.get_float("intensity", 0), 2); // 12 over an area of 6
    EXPECT_EQ(key.parameters.get_color("lightcolor", Rgb(0)), Rgb(1, 1, .5f));
    EXPECT_EQ(p.scene.light_shaders[1].parameters.get_string("texture", ""), "sky.exr");
    EXPECT_EQ(p.scene.light_shaders[2].parameters.get_float("angle", 0), 2);
    EXPECT_TRUE(p.says("Light \"PxrNoLight\" has no counterpart"));
}

// They have a place and a size; what light comes through is the dome's.
TEST(Ris, PortalsHaveNoLightOfTheirOwn) {
    const Parsed p(
        world("AttributeBegin Translate 0 0 2 Light \"PxrPortalLight\" \"window\" \"float intensity\" 6 "
              "AttributeEnd" +
              Ball));
    EXPECT_SILENT(p);
    ASSERT_EQ(p.scene.light_shaders.size(), 1u);
    EXPECT_EQ(p.scene.light_shaders[0].name, "portallight");
    EXPECT_TRUE(p.scene.light_shaders[0].parameters.values.empty());
    EXPECT_EQ(p.scene.light_shaders[0].world_from_shader.m[2][3], 2);
}

TEST(Ris, MeshLightsShine) {
    const Parsed p(world("Light \"PxrMeshLight\" \"m\" \"float intensity\" 3" + Ball));
    ASSERT_TRUE(p.primitive(0).attributes->area_light);
    EXPECT_EQ(p.primitive(0).attributes->area_light->parameters.get_float("intensity", 0), 3);
}

TEST(Ris, IntegratorsSayHowDeep) {
    const Parsed p("Integrator \"PxrPathTracer\" \"i\" \"int maxPathLength\" [5]\n" + world(Ball));
    EXPECT_EQ(p.scene.options.max_depth, 5);
    EXPECT_EQ(Parsed("Integrator \"PxrOcclusion\" \"i\"\n" + world(Ball)).scene.options.integrator, "ao");
    EXPECT_EQ(Parsed("Integrator \"PxrVisualizer\" \"i\"\n" + world(Ball)).scene.options.integrator,
              "facing");
    EXPECT_TRUE(Parsed("Integrator \"PxrOwn\" \"i\"\n" + world(Ball)).says("paths are traced"));
}

TEST(Ris, LightsShineOutsideOfTheirBlocks) {
    const Parsed p(world(Ball + "AttributeBegin AttributeBegin Light \"PxrRectLight\" \"key\" AttributeEnd" +
                         Ball + "AttributeEnd" + Ball +
                         "AttributeBegin Illuminate \"key\" 0 Sphere 1 -1 1 360 AttributeEnd"));
    EXPECT_SILENT(p);
    ASSERT_EQ(p.scene.light_shaders.size(), 1u);
    for (size_t i = 0; i < 3; i++)
        EXPECT_TRUE(p.primitive(i).attributes->lights_on->contains("key")) << i;
    EXPECT_FALSE(p.primitive(3).attributes->lights_on->contains("key"));
    // A frame's light ends with it.
    const Parsed frames("FrameBegin 1 WorldBegin Light \"PxrDomeLight\" \"d\"" + Ball +
                            "WorldEnd FrameEnd FrameBegin 2 WorldBegin" + Ball + "WorldEnd FrameEnd",
                        {.frame = 2});
    EXPECT_TRUE(frames.scene.light_shaders.empty());
}

TEST(Ris, AreaLightsOfShapes) {
    const Parsed p(
        world("AttributeBegin Scale 2 2 2 AreaLightSource \"PxrStdAreaLight\" \"a\" \"float "
              "intensity\" 3 \"float exposure\" 1 \"color lightColor\" [1 .5 0] Bxdf "
              "\"PxrLightEmission\" \"e\" Geometry \"rectlight\" AttributeEnd\n"
              "AttributeBegin AreaLightSource \"x/own_env\" \"b\" \"color envTint\" [0 0 1] \"string "
              "rman__EnvMap\" [\"sky.tx\"] Geometry \"envsphere\" \"constant float[2] resolution\" [9 "
              "9] AttributeEnd Illuminate \"a\" 1 Illuminate \"b\" 1 Geometry \"envsphere\"\n"
              "AreaLightSource \"PxrAreaLight\" \"c\" \"float intensity\" 7" +
              Ball));
    EXPECT_SILENT(p);
    ASSERT_EQ(p.scene.light_shaders.size(), 2u);
    EXPECT_EQ(p.scene.light_shaders[0].name, "quadlight");
    EXPECT_EQ(p.scene.light_shaders[0].parameters.get_float("intensity", 0), 6);
    EXPECT_EQ(p.scene.light_shaders[0].parameters.get_color("lightcolor", Rgb(0)), Rgb(1, .5f, 0));
    EXPECT_EQ(p.scene.light_shaders[1].name, "environmentlight");
    EXPECT_EQ(p.scene.light_shaders[1].parameters.get_string("texture", ""), "sky.tx");
    ASSERT_EQ(p.scene.primitives.size(), 1u);
    EXPECT_EQ(p.primitive(0).attributes->area_light->name, "arealight");
    EXPECT_EQ(p.primitive(0).attributes->area_light->parameters.get_float("intensity", 0), 7);
}

TEST(Ris, OpenArrays) {
    const Parsed p(world("Bxdf \"PxrDisney\" \"a\" \"int[] utilityPattern\" [] \"color[] baseColor\" [1 0 0] "
                         "\"string __instanceid\" [\"x\"] \"__instanceid\" [\"a_0\"]" +
                         Ball));
    EXPECT_SILENT(p);
    EXPECT_EQ(surface(p).parameters.get_color("baseColor", Rgb(0)), Rgb(1, 0, 0));
}

TEST(Ris, BackgroundsAreImagers) {
    const Parsed p("DisplayFilter \"PxrBackgroundDisplayFilter\" \"b\" \"color backgroundColor\" [1 .5 0]\n"
                   "DisplayFilter \"PxrGradeDisplayFilter\" \"g\"\n" +
                   world(Ball));
    ASSERT_TRUE(p.scene.options.imager);
    EXPECT_EQ(p.scene.options.imager->parameters.get_color("bgcolor", Rgb(0)), Rgb(1, .5f, 0));
    EXPECT_TRUE(p.says("PxrGradeDisplayFilter\" is not supported"));
}

TEST(Ris, MatricesWithRoundingErrorsAreAffine) {
    const Parsed p(world("ConcatTransform [1 0 0 9.8e-9 0 1 0 -2e-9 0 0 1 3e-9 0 0 3.3 1]" + Ball));
    EXPECT_SILENT(p);
    const auto& last = p.primitive(0).world_from_object->m[3];
    EXPECT_EQ(last[0], 0);
    EXPECT_EQ(last[3], 1);
    EXPECT_TRUE(
        Parsed(world("ConcatTransform [1 0 0 .01 0 1 0 0 0 0 1 0 0 0 3 1]" + Ball)).says("projective"));
}

TEST(Ris, DisplaceIsADisplacement) {
    const Parsed p(
        world("Pattern \"PxrFractal\" \"f\"\n"
              "Displace \"PxrDisplace\" \"d\" \"float dispAmount\" .1 \"reference float dispScalar\" "
              "[\"f:resultF\"] \"reference vector dispVector\" [\"none:resultXYZ\"] \"int trace\" 1" +
              Ball +
              "Displace \"own\" \"d\" \"string file\" [\"a:b.tx\"] \"reference float k\" "
              "[\"f:resultF\"]" +
              Ball + "Displace \"null\" \"d\"" + Ball));
    const scene::ShaderRef& d = *p.primitive(0).attributes->displacement;
    EXPECT_EQ(d.name, "PxrDisplace");
    EXPECT_FLOAT_EQ(d.parameters.get_float("dispAmount", 0), .1f);
    EXPECT_EQ(scene::layers(d), (std::vector<std::string>{"f"}));
    ASSERT_TRUE(d.parameters.find(":dispScalar"));
    EXPECT_TRUE(scene::is_connection(*d.parameters.find(":dispScalar")));
    EXPECT_FALSE(d.parameters.find("dispScalar"));
    EXPECT_FALSE(d.parameters.find("dispVector"));
    EXPECT_TRUE(p.says("\"dispVector\" is fed by \"none:resultXYZ\""));
    EXPECT_TRUE(p.says("Displace \"PxrDisplace\" has no \"trace\" here"));
    const scene::ShaderRef& own = *p.primitive(1).attributes->displacement;
    EXPECT_EQ(own.parameters.get_string("file", ""), "a:b.tx");
    EXPECT_TRUE(own.parameters.find(":k"));
    EXPECT_FALSE(p.primitive(2).attributes->displacement);
}

TEST(Deformations, RunBeforeTheDisplacement) {
    const auto order = [](const Parsed& p, size_t i) { // all that run, in order
        std::string names;
        const auto& d = p.primitive(i).attributes->displacement;
        if (!d)
            return names;
        for (const std::string& handle : scene::layers(*d))
            for (const scene::ShaderRef& layer : d->coshaders)
                if (layer.handle == handle)
                    names += layer.name + " ";
        return names + d->name;
    };
    const Parsed p(world("Deformation \"twist\"" + Ball + "Displacement \"bumpy\"" + Ball +
                         "Deformation \"bend\"" + Ball + "Displacement \"dented\"" + Ball +
                         "ShaderLayer \"displacement\" \"low\" \"l\" "
                         "ShaderLayer \"displacement\" \"high\" \"h\"" +
                         Ball + "Displacement \"null\"" + Ball + "Deformation \"roll\"" + Ball +
                         "Deformation \"null\"" + Ball));
    EXPECT_SILENT(p);
    EXPECT_EQ(order(p, 0), "twist");
    EXPECT_EQ(order(p, 1), "twist bumpy");
    EXPECT_EQ(order(p, 2), "bend twist bumpy"); // the newest is nearest to the object
    EXPECT_EQ(order(p, 3), "bend twist dented");
    EXPECT_EQ(order(p, 4), "bend twist low high");
    EXPECT_EQ(order(p, 5), "bend twist");
    EXPECT_EQ(order(p, 6), "roll bend twist");
    EXPECT_EQ(order(p, 7), "");
    std::string many;
    for (int i = 0; i < 70; i++)
        many += "Deformation \"twist\" ";
    const Parsed deep(world(many + Ball));
    EXPECT_EQ(scene::layers(*deep.primitive(0).attributes->displacement).size(), 63u);
    EXPECT_TRUE(deep.says("was left out: 64 are in force"));
}

TEST(LightFilters, FactorsAreOnTheirLights) {
    const Parsed p(
        world("LightFilter \"PxrIntMultLightFilter\" \"half\" \"float intensity\" 2 \"float exposure\" -2 "
              "\"float density\" 1\n"
              "LightFilter \"PxrIntMultLightFilter\" \"red\" \"color tint\" [1 0 0]\n"
              "LightFilter \"PxrBarnLightFilter\" \"barn\"\n"
              "Light \"PxrRectLight\" \"a\" \"color lightColor\" [1 1 .5] Light \"PxrDomeLight\" \"b\"\n"
              "EnableLightFilter \"a\" \"half\" 1 EnableLightFilter \"a\" \"half\" 1 EnableLightFilter \"a\" "
              "\"red\" 1 "
              "EnableLightFilter \"a\" \"barn\" 1 EnableLightFilter \"b\" \"half\" 1 EnableLightFilter \"b\" "
              "\"half\" 0\n"
              "EnableLightFilter \"c\" \"half\" 1 EnableLightFilter \"a\" \"gone\" 1\n"
              "Light \"PxrMeshLight\" \"m\" EnableLightFilter \"m\" \"half\" 1" +
              Ball));
    ASSERT_EQ(p.scene.light_shaders.size(), 2u);
    EXPECT_EQ(p.scene.light_shaders[0].parameters.get_color("lightcolor", Rgb(0)), Rgb(.5f, 0, 0));
    EXPECT_EQ(p.scene.light_shaders[1].parameters.get_color("lightcolor", Rgb(0)), Rgb(1, 1, 1));
    EXPECT_EQ(p.primitive(0).attributes->area_light->parameters.get_color("lightcolor", Rgb(0)), Rgb(.5f));
    EXPECT_TRUE(p.says("there is no counterpart of density")) << p.all_messages();
    EXPECT_TRUE(p.says("LightFilter \"PxrBarnLightFilter\" has no counterpart, its lights shine without it"));
    EXPECT_TRUE(p.says("EnableLightFilter \"c\": no light in force has this handle"));
    EXPECT_TRUE(p.says("there is no LightFilter \"gone\" before it"));
    EXPECT_EQ(p.messages().size(), 4u) << p.all_messages();
}

TEST(Ris, ShadersOfVolumePrimitivesAreOurs) {
    const Parsed p(world("VPSurface \"metal\" VPAtmosphere \"fog\" VPInterior \"smoke\"" + Ball));
    EXPECT_EQ(surface(p).name, "metal");
    EXPECT_EQ(p.primitive(0).attributes->atmosphere->name, "fog");
    EXPECT_EQ(p.primitive(0).attributes->interior->name, "smoke");
}

TEST(Cameras, TheStateAtWorldBeginUnlessADisplayNamesAnother) {
    const std::string two = "TransformBegin Projection \"perspective\" \"fov\" 30 Translate -1 0 5 "
                            "Camera \"left\" \"float[2] shutteropening\" [.2 .8] TransformEnd\n"
                            "Projection \"orthographic\" Translate 1 0 5 CoordinateSystem \"rig\" "
                            "Camera \"right\" \"float[2] shutteropening\" [0 1] \"float zoom\" 2\n";
    const auto at = [](const Parsed& p) { return p.scene.camera.camera_from_world.point({0, 0, 0}); };
    const Parsed plain(two + "WorldBegin" + Ball + "WorldEnd");
    expect_point(at(plain), 1, 0, 5);
    EXPECT_EQ(plain.scene.camera.projection, scene::Camera::Projection::Orthographic);
    EXPECT_TRUE(plain.says("Camera: \"zoom\" has no counterpart"));

    for (const std::string choice : {"Display \"a.exr\" \"openexr\" \"rgb\" \"string camera\" [\"left\"]\n",
                                     "Hider \"raytrace\" \"string camera\" [\"left\"]\n"}) {
        const Parsed p(two + choice + "WorldBegin" + Ball + "WorldEnd");
        expect_point(at(p), -1, 0, 5);
        EXPECT_EQ(p.scene.camera.projection, scene::Camera::Projection::Perspective);
        EXPECT_EQ(p.scene.camera.fov, 30);
        EXPECT_EQ(p.scene.options.shutter_opening, (std::vector<float>{.2f, .8f}));
        // What was declared before the world stays where it was declared.
        expect_point(p.scene.coordinate_systems.at("rig").point({0, 0, 0}), 0, 0, 0);
        expect_point(p.scene.coordinate_systems.at("camera").point({0, 0, 0}), 1, 0, -5);
    }
    const Parsed none(two +
                      "Display \"a.exr\" \"openexr\" \"rgb\" \"string camera\" [\"top\"]\n"
                      "Display \"+b.exr\" \"openexr\" \"z\" \"string camera\" [\"left\"]\n" +
                      "WorldBegin" + Ball + "WorldEnd");
    expect_point(at(none), 1, 0, 5);
    EXPECT_TRUE(none.says("there is no Camera \"top\", which a display names; there are left, right"));
    EXPECT_TRUE(none.says("the display \"b.exr\" names the camera \"left\""));
}

TEST(Commands, RunWhereTheyAreAllowed) {
    const std::string file = testing::TempDir() + "/kanuka_system_ran";
    const std::string scene = "System \"touch '" + file + "'\"\nSystem \"exit 3\"\n" + world(Ball);
    std::filesystem::remove(file);
    const Parsed no(scene);
    EXPECT_FALSE(std::filesystem::exists(file));
    EXPECT_TRUE(no.says("was not run: a scene may run commands only if who reads it allows it"));
    const Parsed yes(scene, {.run_system = true});
    EXPECT_TRUE(std::filesystem::exists(file));
    EXPECT_EQ(yes.messages().size(), 1u) << yes.all_messages();
    EXPECT_TRUE(yes.says("System \"exit 3\" ended with status 3"));
    std::filesystem::remove(file);
}

TEST(Layers, AllRunBeforeTheLast) {
    const Parsed one(world("ShaderLayer \"surface\" \"matte\" \"base\" \"Kd\" .5" + Ball));
    EXPECT_SILENT(one);
    EXPECT_EQ(surface(one).name, "matte");
    EXPECT_TRUE(scene::layers(surface(one)).empty());
    const Parsed p(world("Surface \"metal\" ShaderLayer \"surface\" \"dots\" \"a\" ShaderLayer \"surface\" "
                         "\"mixer\" \"b\" \"float gain\" 2 ShaderLayer \"surface\" \"matte\" \"c\"\n"
                         "ConnectShaderLayers \"surface\" \"a\" \"out\" \"b\" \"in\"\n"
                         "ConnectShaderLayers \"surface\" \"b\" \"mixed\" \"c\" \"Kd\"" +
                         Ball));
    EXPECT_SILENT(p);
    EXPECT_EQ(surface(p).name, "matte");
    EXPECT_EQ(scene::layers(surface(p)), (std::vector<std::string>{"a", "b"}));
    const scene::Value* kd = surface(p).parameters.find(":Kd");
    ASSERT_TRUE(kd && scene::is_connection(*kd));
    EXPECT_EQ(kd->strings[0] + "." + kd->strings[1], "b.mixed");
    EXPECT_EQ(kd->where.line, 5);
    ASSERT_EQ(surface(p).coshaders.size(), 2u);
    EXPECT_EQ(surface(p).coshaders[1].parameters.get_float("gain", 0), 2);
    EXPECT_EQ(surface(p).coshaders[1].parameters.get_string(":in", ""), "a");
}

TEST(Layers, OfOneNameTheLastCountsAndWhatIsNotThereIsSaid) {
    const std::string layer = "ShaderLayer \"surface\" ";
    const Parsed p(world(layer + "\"dots\" \"a\" " + layer + "\"matte\" \"b\" " + layer + "\"lines\" \"a\" " +
                         layer +
                         "\"metal\" \"c\" ConnectShaderLayers \"surface\" \"x\" \"o\" \"b\" \"Kd\"\n"
                         "ConnectShaderLayers \"surface\" \"b\" \"o\" \"b\" \"Kd\" "
                         "ConnectShaderLayers \"displacement\" \"a\" \"o\" \"b\" \"Kd\" "
                         "ConnectShaderLayers \"light\" \"a\" \"o\" \"b\" \"Kd\"" +
                         Ball));
    EXPECT_EQ(scene::layers(surface(p)), (std::vector<std::string>{"b", "a"}));
    EXPECT_EQ(surface(p).coshaders.back().name, "lines");
    EXPECT_TRUE(p.says("there is no surface layer \"x\"; there are b, a, c")) << p.all_messages();
    EXPECT_TRUE(p.says("layer \"b\" cannot feed itself"));
    EXPECT_TRUE(p.says("there are none: ShaderLayer makes them"));
    EXPECT_TRUE(p.says("layers are of surface, displacement"));
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
    expect_point(p.primitive(0).world_from_object->point({0, 0, 0}), 0, 0, 0);
    expect_point(p.primitive(1).world_from_object->point({0, 0, 0}), 1, 2, 3);
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
    EXPECT_NO_THROW(Parsed(world("ErrorHandler \"abort\" System \"ls\"" + Ball))); // well written
    EXPECT_TRUE(Parsed(world("ErrorHandler \"shout\"")).says("must be print, ignore or abort"));
}

// What RenderMan 22 and later say by options; a camera's own window and clipping.
TEST(Ris, PictureAndCameraByOptions) {
    const Parsed r("Option \"Ri\" \"int[2] FormatResolution\" [587 392] \"float FormatPixelAspectRatio\" 1.5 "
                   "\"float[4] CropWindow\" [0 0.5 0.25 1] \"float[2] Shutter\" [0 0.5] \"float[4] "
                   "ScreenWindow\" [-2 1 -1 1]\nWorldBegin Sphere 1 -1 1 360 WorldEnd");
    EXPECT_TRUE(r.messages().empty()) << r.all_messages();
    const scene::Options& o = r.scene.options;
    EXPECT_EQ(o.width, 587);
    EXPECT_EQ(o.height, 392);
    EXPECT_EQ(o.pixel_aspect, 1.5f);
    EXPECT_EQ(o.crop, (std::array<float, 4>{0, 0.5f, 0.25f, 1}));
    EXPECT_EQ(o.shutter_close, 0.5f);
    EXPECT_EQ(r.scene.camera.screen_window, (std::array<float, 4>{-2, 1, -1, 1}));
    const Parsed c("Display \"a\" \"file\" \"rgb\" \"string camera\" \"main\"\nProjection \"perspective\"\n"
                   "Camera \"main\" \"float[4] Ri:ScreenWindow\" [-1 2 -1 1] \"float nearClip\" 0.5 \"float "
                   "farClip\" 90\nWorldBegin Sphere 1 -1 1 360 WorldEnd");
    EXPECT_TRUE(c.messages().empty()) << c.all_messages();
    EXPECT_EQ(c.scene.camera.screen_window, (std::array<float, 4>{-1, 2, -1, 1}));
    EXPECT_EQ(c.scene.camera.near_clip, 0.5f);
    EXPECT_EQ(c.scene.camera.far_clip, 90);
}

TEST(Ris, PlugInsOfAnyCaseAndWhatTheyHandOn) {
    const Parsed r("WorldBegin\nPattern \"PxrManifold2D\" \"m\"\nBxdf \"PXRDisney\" \"b\" \"reference struct "
                   "manifold\" [\"m:result\"] \"color baseColor\" [1 0 0]\nSphere 1 -1 1 360\nWorldEnd");
    ASSERT_TRUE(r.scene.primitives.at(0).attributes->surface.has_value());
    EXPECT_EQ(r.scene.primitives[0].attributes->surface->name, "principled");
    EXPECT_FALSE(r.says("error")) << r.all_messages();
}

} // namespace kanuka::ingest::test
