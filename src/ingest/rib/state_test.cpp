// Options, attributes, transformations, blocks, lights, objects: what a text makes of the scene.

#include <cmath>

#include "ingest/rib/test_support.h"

namespace kanuka::ingest::test {

using scene::Camera;

// ---- transformations --------------------------------------------------------------------------------

static Vec3f place(const std::string& transform, const Vec3f& p) {
    const Parsed r(world(transform + "\nSphere 1 -1 1 360"));
    EXPECT_SILENT(r);
    return r.primitive(0).world_from_object->point(p);
}

TEST(RibTransform, RotationSense) {
    // RISpec: about z, x goes towards y; about x, y towards z; about y, z towards x.
    expect_point(place("Rotate 90 0 0 1", {1, 0, 0}), 0, 1, 0);
    expect_point(place("Rotate 90 1 0 0", {0, 1, 0}), 0, 0, 1);
    expect_point(place("Rotate 90 0 1 0", {0, 0, 1}), 1, 0, 0);
    expect_point(place("Rotate -90 0 0 2", {1, 0, 0}), 0, -1, 0);
}

TEST(RibTransform, LastGivenIsAppliedFirst) {
    expect_point(place("Translate 1 0 0 Scale 2 2 2", {1, 1, 1}), 3, 2, 2);
    expect_point(place("Scale 2 2 2 Translate 1 0 0", {1, 1, 1}), 4, 2, 2);
}

TEST(RibTransform, MatricesAreRowVectors) {
    expect_point(place("ConcatTransform [1 0 0 0  0 1 0 0  0 0 1 0  5 6 7 1]", {1, 0, 0}), 6, 6, 7);
    expect_point(place("Transform [0 1 0 0  -1 0 0 0  0 0 1 0  0 0 0 1]", {1, 0, 0}), 0, 1,
                 0); // Rotate 90 0 0 1
    expect_point(place("Translate 9 9 9 Transform 1 0 0 0  0 1 0 0  0 0 1 0  5 6 7 1", {0, 0, 0}), 5, 6, 7);
    expect_point(place("Translate 9 9 9 Identity", {1, 2, 3}), 1, 2, 3);
    // A matrix and its multiple mean the same.
    expect_point(place("ConcatTransform [2 0 0 0  0 2 0 0  0 0 2 0  10 0 0 2]", {1, 0, 0}), 6, 0, 0);
}

TEST(RibTransform, SkewTurnsTheFirstDirectionTowardsTheSecond) {
    const float s = std::sqrt(0.5f);
    const Vec3f p = place("Skew 45 0 1 0 1 0 0", {0, 1, 0});
    expect_point(p / length(p), s, s, 0);
    EXPECT_NEAR(p.y, 1, 1e-6f); // shear keeps the height
    expect_point(place("Skew 45 0 1 0 1 0 0", {1, 0, 0}), 1, 0, 0);
    const Vec3f q = place("Skew 20 0 1 0 1 1 0", {0, 1, 0}); // directions that are not perpendicular
    EXPECT_NEAR(std::atan2(q.x, q.y) * 180 / Pi, 20, 1e-4f);
    EXPECT_TRUE(Parsed(world("Skew 90 0 1 0 1 0 0 Sphere 1 -1 1 360")).says("Skew was left out"));
    EXPECT_TRUE(Parsed(world("Skew 10 0 1 0 0 0 0 Sphere 1 -1 1 360")).says("Skew was left out"));
}

TEST(RibTransform, NamedSpaces) {
    const Parsed r(world("TransformBegin Translate 1 2 3 CoordinateSystem \"here\" TransformEnd "
                         "Translate 7 7 7 CoordSysTransform \"here\" Sphere 1 -1 1 360"));
    EXPECT_SILENT(r);
    expect_point(r.primitive(0).world_from_object->point({0, 0, 0}), 1, 2, 3);
    expect_point(r.scene.coordinate_systems.at("here").point({0, 0, 0}), 1, 2, 3);
    EXPECT_TRUE(Parsed(world("CoordSysTransform \"nowhere\" Sphere 1 -1 1 360"))
                    .says("there is no coordinate system"));
}

TEST(RibTransform, SingularOnesDropPrimitives) {
    const Parsed r(world("Scale 1 0 1\nSphere 1 -1 1 360\nObjectBegin 1 ObjectEnd ObjectInstance 1"));
    EXPECT_EQ(r.scene.primitives.size(), 0u);
    EXPECT_EQ(r.scene.instances.size(), 0u);
    EXPECT_TRUE(r.says("error 4:1 Sphere was left out: the current transformation flattens it"));
}

// ---- camera, lights before the world ----------------------------------------------------------------

TEST(RibCamera, IsWhatStandsBeforeTheWorld) {
    const Parsed r("Projection \"perspective\" \"fov\" [30]\nRotate 90 0 0 1\nTranslate 0 0 5\n"
                   "CoordinateSystem \"rig\"\nLightSource \"pointlight\" 1 \"from\" [1 2 3]\n"
                   "WorldBegin Sphere 1 -1 1 360 WorldEnd");
    EXPECT_SILENT(r);
    EXPECT_EQ(r.scene.camera.projection, Camera::Projection::Perspective);
    EXPECT_EQ(r.scene.camera.fov, 30);
    expect_point(r.scene.camera.camera_from_world.point({1, 0, 0}), 0, 1, 5);
    // Declared where the world is: nothing between them.
    ASSERT_EQ(r.scene.light_shaders.size(), 1u);
    expect_point(r.scene.light_shaders[0].world_from_shader.point({1, 2, 3}), 1, 2, 3);
    expect_point(r.scene.coordinate_systems.at("rig").point({1, 2, 3}), 1, 2, 3);
    expect_point(r.scene.coordinate_systems.at("camera").point({0, 1, 5}), 1, 0, 0);
}

TEST(RibCamera, LightOnTheCamera) {
    const Parsed r("Projection \"perspective\"\nLightSource \"spotlight\" \"lamp\"\nTranslate 0 0 5\n"
                   "WorldBegin Sphere 1 -1 1 360 WorldEnd");
    expect_point(r.scene.light_shaders.at(0).world_from_shader.point({0, 0, 0}), 0, 0, -5);
    EXPECT_EQ(r.scene.light_shaders[0].handle, "lamp");
}

TEST(RibCamera, DefaultsAndOptions) {
    const Parsed plain("WorldBegin Sphere 1 -1 1 360 WorldEnd");
    EXPECT_EQ(plain.scene.camera.projection, Camera::Projection::Orthographic);
    EXPECT_FALSE(plain.scene.camera.screen_window);

    const Parsed r(
        "Format 320 200 1.5 PixelSamples 3 2 PixelFilter \"catmull-rom\" 3 4 Exposure 2 2.2\n"
        "CropWindow 0.25 0.5 0 1 Clipping 0.1 100 DepthOfField 5.6 0.05 3 Shutter 0 0.5\n"
        "FrameAspectRatio 2 Projection \"orthographic\" Display \"a.exr\" \"openexr\" \"rgba\"\n"
        "Display \"b.exr\" \"openexr\" \"rgb\" Display \"+c.exr\" \"openexr\" \"z\" \"integer tile\" 5\n"
        "ShadingRate [0.5] Option \"limits\" \"bucketsize\" [16 16] Quantize \"rgba\" 255 0 255 0.5\n"
        "WorldBegin Sphere 1 -1 1 360 WorldEnd");
    EXPECT_SILENT(r);
    const scene::Options& o = r.scene.options;
    EXPECT_EQ(o.width, 320);
    EXPECT_EQ(o.height, 200);
    EXPECT_EQ(o.pixel_aspect, 1.5f);
    EXPECT_EQ(o.samples, 6);
    EXPECT_EQ(o.filter, "catmull-rom");
    EXPECT_EQ(o.filter_width[1], 4);
    EXPECT_EQ(o.exposure_gain, 2);
    EXPECT_EQ(o.crop, (std::array<float, 4>{0.25f, 0.5f, 0, 1}));
    EXPECT_EQ(o.shutter_close, 0.5f);
    ASSERT_EQ(o.displays.size(), 2u); // b replaced a, c was added
    EXPECT_EQ(o.displays[0].file, "b.exr");
    EXPECT_EQ(o.displays[1].file, "c.exr");
    EXPECT_EQ(o.displays[1].parameters.get_int("tile", 0), 5);
    EXPECT_EQ(r.scene.camera.near_clip, 0.1f);
    EXPECT_EQ(r.scene.camera.focal_distance, 3);
    EXPECT_EQ(*r.scene.camera.screen_window, (std::array<float, 4>{-2, 2, -1, 1}));
    EXPECT_EQ(r.primitive(0).attributes->shading_rate, 0.5f);
    EXPECT_EQ(o.user.find("limits:bucketsize")->ints[1], 16);
    EXPECT_EQ(o.user.find("quantize:rgba")->floats[2], 255);
}

TEST(RibOptions, Kanuka) {
    const Parsed r(
        "Option \"kanuka\" \"float geometrytolerance\" 0.5 \"normaltolerance\" [7] \"integer maxdepth\" 3 "
        "\"progressions\" [64] \"string integrator\" \"volpath\" \"seed\" 9 "
        "\"integer watertight\" 0\n" +
        world("Sphere 1 -1 1 360"));
    EXPECT_SILENT(r);
    EXPECT_EQ(r.scene.options.geometry_tolerance, 0.5f);
    EXPECT_EQ(r.scene.options.normal_tolerance, 7);
    EXPECT_EQ(r.scene.options.max_depth, 3);
    EXPECT_EQ(r.scene.options.samples, 64);
    EXPECT_FALSE(r.scene.options.watertight);
    EXPECT_EQ(r.scene.options.integrator, "volpath");
    EXPECT_EQ(r.scene.options.seed, 9u);
    const Parsed bad("Option \"kanuka\" \"float geometrytolerance\" -1 \"string integrater\" \"x\" \"string "
                     "maxdepth\" \"deep\"\n" +
                     world("Sphere 1 -1 1 360"));
    EXPECT_TRUE(bad.says("\"geometrytolerance\" must be a number of pixels"));
    EXPECT_TRUE(bad.says("there is no \"integrater\""));
    EXPECT_TRUE(bad.says("\"maxdepth\" must be"));
}

TEST(RibOptions, MadeTexturesStandForTheirPictures) {
    const Parsed r("MakeTexture \"a.tif\" \"a.tex\" \"periodic\" \"clamp\" \"gaussian\" 2 2\n" +
                   world("Sphere 1 -1 1 360"));
    EXPECT_EQ(r.scene.options.user.get_string("maketexture:a.tex", ""), "a.tif");
}

TEST(RibOptions, OutOfRangeStaysAsItWas) {
    const Parsed r(
        "Format 0 100 1\nPixelSamples 0 4\nPixelFilter \"hat\" 1 1\nCropWindow 0.5 0.2 0 1\nClipping 5 1\n"
        "DepthOfField -1 1 1\nExposure 1 0\nScreenWindow 1 1 0 1\nShadingRate -2\nFrameAspectRatio 0\n" +
        world("Sphere 1 -1 1 360"));
    EXPECT_EQ(r.messages(Severity::Error).size(), 10u) << r.all_messages();
    EXPECT_EQ(r.scene.options.width, 640);
    EXPECT_EQ(r.scene.options.filter, "gaussian");
    EXPECT_EQ(r.scene.camera.f_stop, 0);
    EXPECT_EQ(r.primitive(0).attributes->shading_rate, 1);
}

// ---- attributes -------------------------------------------------------------------------------------

TEST(RibAttributes, StackAndValues) {
    const Parsed r(world(
        "Color 1 0 0 Surface \"matte\" \"Kd\" 0.5\nAttributeBegin Color [0 1 0] Opacity [.5 .5 .5] Sides 1 "
        "Matte 1\nAttribute \"identifier\" \"name\" [\"ball\"] \"uniform string shadinggroup\" \"a\"\n"
        "Attribute \"displacementbound\" \"sphere\" [0.25] \"coordinatesystem\" [\"shader\"]\n"
        "Attribute \"visibility\" \"integer camera\" [0] Attribute \"dice\" \"integer flatness\" 0\n"
        "TextureCoordinates 0 0 2 0 0 2 2 2 Translate 1 0 0 Displacement \"bumpy\" Atmosphere \"fog\"\n"
        "Sphere 1 -1 1 360 AttributeEnd\nTransformBegin Translate 5 0 0 Color 0 0 1 TransformEnd "
        "Sphere 1 -1 1 360"));
    EXPECT_SILENT(r);
    const scene::Attributes& a = *r.primitive(0).attributes;
    EXPECT_EQ(a.color, Rgb(0, 1, 0));
    EXPECT_EQ(a.opacity, Rgb(.5f, .5f, .5f));
    EXPECT_EQ(a.sides, 1);
    EXPECT_TRUE(a.matte);
    EXPECT_EQ(a.name, "ball");
    EXPECT_EQ(a.user.get_string("identifier:shadinggroup", ""), "a");
    EXPECT_EQ(a.displacement_bound, 0.25f);
    EXPECT_EQ(a.displacement_bound_space, "shader");
    EXPECT_FALSE(a.visible_camera);
    EXPECT_FALSE(a.dice_flatness);
    EXPECT_EQ(a.texture_coordinates[2], 2);
    EXPECT_EQ(a.surface->name, "matte");
    EXPECT_EQ(a.surface->parameters.get_float("Kd", 0), 0.5f);
    EXPECT_EQ(a.displacement->name, "bumpy");
    expect_point(a.displacement->world_from_shader.point({0, 0, 0}), 1, 0, 0);
    EXPECT_EQ(a.atmosphere->name, "fog");
    const scene::Attributes& b = *r.primitive(1).attributes;
    EXPECT_EQ(b.color, Rgb(0, 0, 1)); // TransformEnd restores the transformation alone
    EXPECT_EQ(b.name, "");
    EXPECT_TRUE(b.visible_camera);
    expect_point(r.primitive(1).world_from_object->point({0, 0, 0}), 0, 0, 0);
    EXPECT_EQ(r.primitive(0).id, 1);
    EXPECT_EQ(r.primitive(1).id, 2);
}

TEST(RibAttributes, PrimitivesShareStates) {
    const Parsed r(world(
        "Sphere 1 -1 1 360 Translate 1 0 0 Sphere 1 -1 1 360 AttributeBegin Sphere 1 -1 1 360 AttributeEnd"));
    EXPECT_EQ(r.primitive(0).attributes.get(), r.primitive(1).attributes.get());
    EXPECT_EQ(r.primitive(0).attributes.get(), r.primitive(2).attributes.get());
}

static bool reversed(const std::string& before_world, const std::string& in_world) {
    const Parsed r("Projection \"perspective\"\n" + before_world + "\nWorldBegin\n" + in_world +
                   " Sphere 1 -1 1 360\nWorldEnd");
    EXPECT_SILENT(r);
    return r.primitive(0).attributes->reverse_orientation;
}

TEST(RibAttributes, OrientationIsRelativeToHandedness) {
    EXPECT_FALSE(reversed("", ""));
    EXPECT_TRUE(reversed("", "Orientation \"inside\""));
    EXPECT_TRUE(reversed("", "ReverseOrientation"));
    EXPECT_FALSE(reversed("", "ReverseOrientation ReverseOrientation"));
    // The camera is left-handed, and so is a world without a mirror.
    EXPECT_FALSE(reversed("", "Orientation \"lh\""));
    EXPECT_TRUE(reversed("", "Orientation \"rh\""));
    EXPECT_TRUE(reversed("Orientation \"rh\"", ""));
    // Mirrors count wherever they stand, if before the request.
    EXPECT_TRUE(reversed("", "Scale -1 1 1 Orientation \"lh\""));
    EXPECT_FALSE(reversed("", "Scale -1 1 1 Orientation \"rh\""));
    EXPECT_FALSE(reversed("Scale 1 1 -1", "Orientation \"rh\""));
    EXPECT_FALSE(reversed("", "Orientation \"lh\" Scale -1 1 1"));
    EXPECT_FALSE(reversed("", "Scale -1 1 1 Orientation \"outside\""));
}

TEST(RibAttributes, ColorSamples) {
    const Parsed r("ColorSamples [.3 .6 .1] [1 1 1]\n" +
                   world("Color [2] Sphere 1 -1 1 360 Color [1 1 1] Sphere 1 -1 1 360"));
    EXPECT_NEAR(r.primitive(0).attributes->color.y, 1.2f, 1e-6f);
    EXPECT_TRUE(r.says("Color: expected 1 numbers, found 3"));
    EXPECT_EQ(r.primitive(1).attributes.get(), r.primitive(0).attributes.get());
}

TEST(RibAttributes, LevelOfDetail) {
    // 480 pixels a unit at distance 1 (fov 90, 960 x 960): at z = 10 a side of 1 is 48 pixels, the bound
    // 2304.
    const auto shown = [](const std::string& range) {
        const Parsed r("Format 960 960 1 " +
                       world("Translate 0 0 10 Detail [-.5 .5 -.5 .5 0 0]\nDetailRange " + range +
                             " Sphere 1 -1 1 360\nDetailRange 0 0 1e38 1e38 Disk 0 1 360"));
        EXPECT_SILENT(r);
        return r.scene.primitives.size() == 2;
    };
    EXPECT_TRUE(shown("0 0 3000 3000"));
    EXPECT_FALSE(shown("0 0 2000 2200"));
    EXPECT_TRUE(shown("2200 2250 9000 9000"));
    EXPECT_TRUE(shown("2300 2500 1e38 1e38"));
    EXPECT_FALSE(shown("2310 2500 1e38 1e38"));
    EXPECT_TRUE(shown("0 0 2300 2500"));
    EXPECT_TRUE(shown("0 0 1000 1e38"));
}

// What other renderers write is read into the fields that it means.
TEST(RibAttributes, ShadowsInEveryDialect) {
    const auto casts = [](const std::string& attributes) {
        return Parsed(world(attributes + "\nSphere 1 -1 1 360")).primitive(0).attributes->casts_shadows;
    };
    EXPECT_TRUE(casts(""));
    EXPECT_FALSE(casts("Attribute \"render\" \"string casts_shadows\" \"none\""));
    EXPECT_FALSE(casts("Attribute \"visibility\" \"string transmission\" \"transparent\""));
    EXPECT_FALSE(casts("Attribute \"visibility\" \"int transmission\" 0"));
    EXPECT_FALSE(casts("Attribute \"shade\" \"string transmissionhitmode\" \"transparent\""));
    EXPECT_FALSE(casts("Attribute \"kanuka\" \"int castsshadows\" 0"));
    EXPECT_TRUE(casts("Attribute \"render\" \"string casts_shadows\" \"opaque\""));
    EXPECT_TRUE(casts("Attribute \"visibility\" \"int transmission\" 0\n"
                      "Attribute \"visibility\" \"int transmission\" 1"));
    EXPECT_FALSE(casts("Attribute \"visibility\" \"int transmission\" 0\n"
                       "Attribute \"shade\" \"string transmissionhitmode\" \"shader\""));
}

TEST(RibAttributes, NamesOfLightsArePartedByBlanksAndCommas) {
    const Parsed r(world("Attribute \"lighting\" \"string excludesubset\" \"key, rim  fill\"\n"
                         "Attribute \"lighting\" \"string[2] subset\" [\"a\" \"b\"]\nSphere 1 -1 1 360"));
    EXPECT_EQ(r.primitive(0).attributes->lights_off, (std::vector<std::string>{"key", "rim", "fill"}));
    EXPECT_EQ(r.primitive(0).attributes->lights_only, (std::vector<std::string>{"a", "b"}));
}

TEST(RibAttributes, OutOfRangeStaysAsItWas) {
    const Parsed r(world("Attribute \"kanuka\" \"string diceflatness\" \"no\" \"int flat\" 1\n"
                         "Attribute \"displacementbound\" \"float sphere\" -0.5\nSphere 1 -1 1 360"));
    EXPECT_TRUE(r.says("\"diceflatness\" must be true or false (1 or 0)"));
    EXPECT_TRUE(r.says("there is no \"flat\"; there are diceflatness, shadowterminator, densityprimvar"));
    EXPECT_TRUE(r.primitive(0).attributes->dice_flatness);
    EXPECT_EQ(r.primitive(0).attributes->displacement_bound, 0.5f);
}

// Two levels share a transition from 2204 to 2404, of which 2304 is the middle; half the paths meet each.
TEST(RibAttributes, LevelsInTransition) {
    const Parsed r("Format 960 960 1 " + world("Translate 0 0 10 Detail [-.5 .5 -.5 .5 0 0]\n"
                                               "DetailRange 0 0 2204 2404 Sphere 1 -1 1 360\n"
                                               "DetailRange 2204 2404 1e38 1e38 Sphere 1 -1 1 360\n"
                                               "DetailRange 0 0 1e38 1e38 Sphere 1 -1 1 360"));
    const auto level = [&](size_t i) {
        const scene::Attributes& a = *r.primitive(i).attributes;
        return std::vector<float>{a.level_from, a.level_to};
    };
    ASSERT_EQ(r.scene.primitives.size(), 3u);
    EXPECT_NEAR(level(0)[0], 0.5f, 1e-3f);
    EXPECT_EQ(level(0)[1], 1);
    EXPECT_EQ(level(1)[0], 0);
    EXPECT_EQ(level(1)[1], level(0)[0]) << "bit for bit: no path meets both or none";
    EXPECT_EQ(level(2), (std::vector<float>{0, 1}));

    const Parsed scaled("Format 960 960 1 RelativeDetail 0.5 " +
                        world("Translate 0 0 10 Detail [-.5 .5 -.5 .5 0 0]\n"
                              "DetailRange 0 0 1150 1250 Sphere 1 -1 1 360\n"
                              "DetailRange 1150 1250 1e38 1e38 Sphere 1 -1 1 360"));
    ASSERT_EQ(scaled.scene.primitives.size(), 2u);
    EXPECT_NEAR(scaled.primitive(0).attributes->level_from, 0.02f, 1e-3f);
}

// ---- lights -----------------------------------------------------------------------------------------

TEST(RibLights, WhatIsOnForNothingIsLeftOut) {
    const Parsed r(
        world("LightSource \"ambientlight\" 1\nLightSource \"pointlight\" \"off\"\nIlluminate \"off\" 0\n"
              "AttributeBegin LightSource \"distantlight\" 3 AttributeEnd\n"
              "AttributeBegin LightSource \"spotlight\" 4 AttributeEnd Illuminate 4 1\n"
              "Sphere 1 -1 1 360\nIlluminate 1.0 0\nSphere 1 -1 1 360"));
    ASSERT_EQ(r.scene.light_shaders.size(), 2u);
    EXPECT_EQ(r.scene.light_shaders[0].name, "ambientlight");
    EXPECT_EQ(r.scene.light_shaders[1].name, "spotlight");
    EXPECT_FALSE(r.says("\"pointlight\" \"off\"")) << "who switches a light off means it";
    EXPECT_TRUE(r.says("\"distantlight\" \"3\" is on for no primitive"));
    EXPECT_EQ(*r.primitive(0).attributes->lights_on, (std::set<std::string>{"1", "4"}));
    EXPECT_EQ(*r.primitive(1).attributes->lights_on, (std::set<std::string>{"4"}));
    EXPECT_TRUE(Parsed(world("Illuminate 9 1 Sphere 1 -1 1 360")).says("no light source has this handle"));
}

TEST(RibLights, HandlesMayBeUsedAgain) {
    const Parsed r(world(
        "LightSource \"distantlight\" 1 \"intensity\" 1\nLightSource \"distantlight\" 1 \"intensity\" 2\n"
        "Sphere 1 -1 1 360"));
    EXPECT_SILENT(r);
    ASSERT_EQ(r.scene.light_shaders.size(), 2u);
    EXPECT_EQ(r.primitive(0).attributes->lights_on->size(), 2u);
    EXPECT_NE(r.scene.light_shaders[0].handle, r.scene.light_shaders[1].handle);
}

TEST(RibLights, AreaLightsAreAttributes) {
    const Parsed r(
        world("AttributeBegin AreaLightSource \"arealight\" 7 \"intensity\" 3 Sphere 1 -1 1 360 AttributeEnd "
              "Sphere 1 -1 1 360"));
    EXPECT_SILENT(r);
    EXPECT_EQ(r.primitive(0).attributes->area_light->name, "arealight");
    EXPECT_EQ(r.primitive(0).attributes->area_light->handle, "7");
    EXPECT_FALSE(r.primitive(1).attributes->area_light);
    EXPECT_TRUE(r.scene.light_shaders.empty());
}

// ---- motion, solids ---------------------------------------------------------------------------------

TEST(RibMotion, TransformationsAndShapes) {
    const Parsed r(
        world("MotionBegin [0 1] Translate 1 0 0 Translate 2 0 0 MotionEnd Scale 2 2 2\n"
              "MotionBegin [0 0.5 1] Sphere 1 -1 1 360 Sphere 2 -2 2 360 Sphere 1 -1 1 360 MotionEnd"));
    EXPECT_SILENT(r);
    ASSERT_EQ(r.scene.primitives.size(), 1u);
    const scene::Primitive& p = r.primitive(0);
    EXPECT_EQ(std::get<scene::Quadric>(p.geometry).arguments[0], 1);
    expect_point(p.world_from_object->point({0.5f, 0, 0}), 2, 0, 0);
    ASSERT_TRUE(p.motion);
    ASSERT_EQ(p.motion->places.size(), 2u);
    EXPECT_EQ(p.motion->places[1].time, 1);
    expect_point(p.motion->places[1].transform.point({0.5f, 0, 0}), 3, 0, 0);
    ASSERT_EQ(p.motion->shapes.size(), 3u);
    EXPECT_EQ(p.motion->shapes[1].time, 0.5);
    EXPECT_EQ(std::get<scene::Quadric>(p.motion->shapes[1].geometry).arguments[0], 2);
}

TEST(RibMotion, EndsWithItsBlock) {
    const Parsed r(
        world("AttributeBegin MotionBegin [0 1] Translate 1 0 0 Translate 2 0 0 MotionEnd AttributeEnd "
              "Sphere 1 -1 1 360 MotionBegin [0 1] Identity Identity MotionEnd Sphere 1 -1 1 360\n"
              "MotionBegin [2] Translate 1 0 0 MotionEnd Sphere 1 -1 1 360"));
    EXPECT_SILENT(r);
    EXPECT_FALSE(r.primitive(0).motion);
    EXPECT_TRUE(r.primitive(1).motion); // two samples that are the same: the renderer finds that out
    expect_point(r.primitive(2).world_from_object->point({0, 0, 0}), 1, 0, 0);
}

// Matrices alone would have it stand still.
TEST(RibMotion, WholeTurnsAreKept) {
    const Parsed r(world(
        "MotionBegin [0 1] Rotate 0 0 0 1 Rotate 360 0 0 1 MotionEnd Translate 3 0 0 Sphere 1 -1 1 360"));
    EXPECT_SILENT(r);
    const auto& keys = r.primitive(0).motion->places;
    ASSERT_GE(keys.size(), 36u);
    const MotionPath path(keys);
    for (const double t : {0.1, 0.25, 0.613}) {
        const Vec3f p = path.at(t).point({0, 0, 0});
        const double a = 2 * 3.14159265358979 * t;
        EXPECT_NEAR(p.x, 3 * std::cos(a), 5e-3);
        EXPECT_NEAR(p.y, 3 * std::sin(a), 5e-3);
    }
}

TEST(RibMotion, BlocksMultiply) {
    const Parsed r(world("MotionBegin [0 1] Translate 0 0 0 Translate 4 0 0 MotionEnd\n"
                         "MotionBegin [0.5 1] Translate 0 0 0 Translate 0 1 0 MotionEnd Sphere 1 -1 1 360"));
    EXPECT_SILENT(r);
    const auto& keys = r.primitive(0).motion->places;
    ASSERT_EQ(keys.size(), 3u);
    expect_point(keys[1].transform.point({0, 0, 0}), 2, 0, 0);
    expect_point(keys[2].transform.point({0, 0, 0}), 4, 1, 0);
}

TEST(RibMotion, CamerasAndInstancesMove) {
    const Parsed r(
        "Shutter 0 0.5 Option \"camera\" \"float[2] shutteropening\" [0.2 0.8]\n"
        "Projection \"perspective\" MotionBegin [0 1] Translate 0 0 5 Translate 1 0 5 MotionEnd\n"
        "ObjectBegin 1 MotionBegin [0 1] Translate 0 0 0 Translate 0 1 0 MotionEnd Sphere 1 -1 1 360 "
        "ObjectEnd\n"
        "WorldBegin AttributeBegin MotionBegin [0 1] Translate 0 0 0 Translate 0 0 1 MotionEnd\n"
        "ObjectInstance 1 AttributeEnd ObjectInstance 1 Translate 1 0 0 ObjectInstance 1 WorldEnd");
    EXPECT_SILENT(r);
    EXPECT_EQ(r.scene.options.shutter_opening, (std::vector<float>{0.2f, 0.8f}));
    ASSERT_EQ(r.scene.camera.motion.size(), 2u);
    expect_point(r.scene.camera.motion[1].transform.point({0, 0, 0}), 1, 0, 5);
    ASSERT_EQ(r.scene.groups.size(), 1u);
    EXPECT_EQ(r.scene.groups[0].primitives[0].motion->places.size(), 2u);
    ASSERT_EQ(r.scene.instances.size(), 2u);
    EXPECT_EQ(r.scene.instances[0].count(), 2u); // still
    EXPECT_EQ(r.scene.instances[1].count(), 1u);
    EXPECT_EQ(r.scene.instances[1].times, (std::vector<double>{0, 1}));
    EXPECT_EQ(r.scene.instances[1].transforms[12 + 11], 1);
}

TEST(RibMotion, SaysWhatDoesNotFit) {
    const Parsed other(world("MotionBegin [0 1] Polygon \"P\" [0 0 0 1 0 0 0 1 0] "
                             "Polygon \"P\" [0 0 0 1 0 0 1 1 0 0 1 0] MotionEnd"));
    EXPECT_TRUE(other.says("must have the faces and vertices of the first"));
    EXPECT_FALSE(other.primitive(0).motion);
    EXPECT_TRUE(Parsed(world("MotionBegin [0 1] Translate 0 0 0 Translate 1 0 0 Translate 2 0 0 MotionEnd "
                             "Sphere 1 -1 1 360"))
                    .says("more samples than the 2 times"));
    const Parsed backwards(
        world("MotionBegin [1 0] Translate 3 0 0 Translate 1 0 0 MotionEnd Sphere 1 -1 1 360"));
    EXPECT_TRUE(backwards.says("the times must rise"));
    EXPECT_FALSE(backwards.says("more samples"));
    expect_point(backwards.primitive(0).world_from_object->point({0, 0, 0}), 3, 0, 0);
    EXPECT_FALSE(backwards.primitive(0).motion);
    const Parsed color(world("MotionBegin [0 1] Color 1 0 0 Color 0 1 0 MotionEnd Sphere 1 -1 1 360"));
    EXPECT_TRUE(color.says("Color does not change while the shutter is open"));
    EXPECT_EQ(color.primitive(0).attributes->color, Rgb(1, 0, 0)); // no shutter: an instant
}

TEST(RibMotion, NumbersHaveTheirMeanOverTheShutter) {
    const auto intensity = [](const std::string& before, const std::string& times,
                              const std::string& after = "") {
        const Parsed p(
            before + "MotionBegin [" + times + "] LightSource \"pointlight\" 1 \"intensity\" 1 " +
            "\"string __note\" \"a\" LightSource \"pointlight\" 1 \"intensity\" 5 \"string __note\" \"b\" "
            "MotionEnd\n" +
            after + world("Sphere 1 -1 1 360"));
        EXPECT_EQ(p.scene.light_shaders.size(), 1u) << p.all_messages();
        if (p.scene.light_shaders.empty())
            return NAN;
        EXPECT_EQ(p.scene.light_shaders[0].parameters.get_string("__note", ""), "a");
        return p.scene.light_shaders[0].parameters.get_float("intensity", 0);
    };
    EXPECT_FLOAT_EQ(intensity("Shutter 0 1 ", "0 1"), 3);
    EXPECT_FLOAT_EQ(intensity("Shutter 0 .5 ", "0 1"), 2);
    // It stands still before the first sample and after the last.
    EXPECT_FLOAT_EQ(intensity("Shutter -1 1 ", "0 1"), 2);
    EXPECT_FLOAT_EQ(intensity("Shutter 0 4 ", "0 1"), (3 + 3 * 5) / 4.f);
    EXPECT_FLOAT_EQ(intensity("Shutter 2 3 ", "0 1"), 5);
    EXPECT_FLOAT_EQ(intensity("Shutter -2 -1 ", "0 1"), 1);
    // An instant, and Shutter after the block
    EXPECT_FLOAT_EQ(intensity("Shutter .25 .25 ", "0 1"), 2);
    EXPECT_FLOAT_EQ(intensity("", "0 1", "Shutter 0 1\n"), 3);
    EXPECT_FLOAT_EQ(intensity("Shutter 0 1 ", "0 1", "Shutter .5 1\n"), 4);
    // One that opens slowly sees more of the end: the mean of t under the openness 2t.
    EXPECT_NEAR(intensity("Shutter 0 1 Option \"camera\" \"float[2] shutteropening\" [1 1] ", "0 1"),
                1 + 4 * 2 / 3.0, 1e-4);
}

TEST(RibMotion, ColoursAndShadersToo) {
    const Parsed p(
        "Shutter 0 1\nMotionBegin [0 1] Opacity 1 1 1 Opacity 0 0 .5 MotionEnd "
        "MotionBegin [0 1] Surface \"plastic\" \"Kd\" 1 Surface \"plastic\" \"Kd\" 0 MotionEnd\n"
        "Shutter 0 .5\n" +
        world("MotionBegin [0 .5 1] Color 1 0 0 Color 0 1 0 Color 0 0 1 MotionEnd Sphere 1 -1 1 360\n"
              "MotionBegin [0 1] Surface \"matte\" Surface \"metal\" MotionEnd Sphere 1 -1 1 360\n"
              "MotionBegin [0 1] Displacement \"bumpy\" \"Km\" 0 \"string texturename\" \"a\" "
              "Displacement \"bumpy\" \"Km\" 8 MotionEnd Sphere 1 -1 1 360"));
    ASSERT_EQ(p.scene.primitives.size(), 3u);
    const scene::Attributes& a = *p.primitive(0).attributes;
    EXPECT_EQ(a.color, Rgb(.5f, .5f, 0)); // the shutter closes at the second
    EXPECT_EQ(a.opacity, Rgb(.75f, .75f, .875f));
    EXPECT_FLOAT_EQ(a.surface->parameters.get_float("Kd", 9), .75f);
    EXPECT_EQ(p.primitive(1).attributes->surface->name, "matte");
    EXPECT_TRUE(p.says("a shader cannot become another"));
    const scene::ShaderRef& bump = *p.primitive(2).attributes->displacement;
    EXPECT_FLOAT_EQ(bump.parameters.get_float("Km", 9), 2);
    EXPECT_EQ(bump.parameters.get_string("texturename", ""), "a");
}

TEST(RibOptions, ColourSamplesOfParameters) {
    // Two samples: the first is red, the second blue.
    const Parsed p("ColorSamples [1 0 0  0 0 1] [1 0  0 0  0 1]\n" +
                   world("Color [.5 .25] LightSource \"pointlight\" 1 \"lightcolor\" [1 .5]\n"
                         "Surface \"plastic\" \"specularcolor\" [.25 .5] \"color[2] ramp\" [1 0 0 1]\n"
                         "Polygon \"P\" [0 0 1 1 0 1 0 1 1] \"Cs\" [1 0 .5 .5 0 1]\n"
                         "Surface \"plastic\" \"specularcolor\" [1 1 1] Sphere 1 -1 1 360"));
    const auto floats = [](const scene::Value* v) {
        return v ? std::vector<float>(v->floats.begin(), v->floats.end()) : std::vector<float>();
    };
    using V = std::vector<float>;
    EXPECT_EQ(p.primitive(0).attributes->color, Rgb(.5f, 0, .25f));
    EXPECT_EQ(p.scene.light_shaders.at(0).parameters.get_color("lightcolor", Rgb(0)), Rgb(1, 0, .5f));
    const auto& surface = p.primitive(0).attributes->surface->parameters;
    EXPECT_EQ(floats(surface.find("specularcolor")), (V{.25f, 0, .5f}));
    EXPECT_EQ(floats(surface.find("ramp")), (V{1, 0, 0, 0, 0, 1}));
    EXPECT_EQ(floats(p.primitive(0).primvars.find("Cs")), (V{1, 0, 0, .5f, 0, .5f, 0, 0, 1}));
    EXPECT_FALSE(p.primitive(1).attributes->surface->parameters.find("specularcolor"));
    EXPECT_TRUE(p.says("colors have 2 numbers since ColorSamples, found 3")) << p.all_messages();
    EXPECT_EQ(p.messages().size(), 1u) << p.all_messages();
}

TEST(RibTransform, ScopedCoordinateSystemsEndWithTheirBlock) {
    const Parsed p(
        "Projection \"perspective\" Translate 0 0 5 ScopedCoordinateSystem \"rig\"\nWorldBegin\n"
        "AttributeBegin Translate 1 0 0 ScopedCoordinateSystem \"lamp\" Identity "
        "CoordSysTransform \"lamp\" Sphere 1 -1 1 360 CoordSysTransform \"rig\" Sphere 1 -1 1 360\n"
        "AttributeEnd Sphere 1 -1 1 360 CoordSysTransform \"lamp\"\nWorldEnd");
    expect_point(p.primitive(0).world_from_object->point({0, 0, 0}), 1, 0, 0);
    expect_point(p.primitive(1).world_from_object->point({0, 0, 0}), 0, 0,
                 0); // the camera's translation undone
    EXPECT_TRUE(p.primitive(0).attributes->user.find("coordinatesystem:lamp"));
    EXPECT_FALSE(p.primitive(2).attributes->user.find("coordinatesystem:lamp"));
    EXPECT_TRUE(p.says("there is no coordinate system \"lamp\"; there are: rig, camera, world"))
        << p.all_messages();
}

TEST(RibOptions, ProjectionsAndLenses) {
    const Parsed r(
        "Projection \"fisheye\" DepthOfField 2 1 5 Hider \"raytrace\" \"float[4] aperture\" [6 30 0 0] "
        "\"float dofaspect\" 0.5 WorldBegin Sphere 1 -1 1 360 WorldEnd");
    EXPECT_SILENT(r);
    EXPECT_EQ(r.scene.camera.projection, Projection::Fisheye);
    EXPECT_EQ(r.scene.camera.fov, 180);
    EXPECT_EQ(r.scene.camera.blades, 6);
    EXPECT_EQ(r.scene.camera.blade_rotation, 30);
    EXPECT_EQ(r.scene.camera.squeeze, 2);
    const Parsed wide("Projection \"equisolid\" \"fov\" [300] Projection \"cube\" Option \"camera\" "
                      "\"float[2] shutteropening\" [0.8 0.2] WorldBegin Sphere 1 -1 1 360 WorldEnd");
    EXPECT_EQ(wide.scene.camera.fov, 300);
    EXPECT_TRUE(wide.says("there are perspective, orthographic, fisheye, equisolid, spherical"));
    EXPECT_TRUE(wide.says("must be open before it closes"));
    EXPECT_TRUE(wide.scene.options.shutter_opening.empty());
}

TEST(RibBlocks, MotionBlocksHoldOneRequest) {
    EXPECT_TRUE(Parsed(world("MotionBegin [0 1] Translate 1 0 0 Rotate 1 0 0 1 MotionEnd Sphere 1 -1 1 360"))
                    .says("Rotate in a motion block of Translate"));
    const Parsed open(
        world("MotionBegin [0 1]\nTranslate 1 0 0\nAttributeBegin\nSphere 1 -1 1 360 AttributeEnd"));
    EXPECT_TRUE(open.says("AttributeBegin is not legal between MotionBegin and MotionEnd"));
    EXPECT_EQ(open.scene.primitives.size(), 1u);
}

TEST(RibBlocks, SolidsSaveAttributesAndPassThrough) {
    const Parsed r(world(
        "SolidBegin \"difference\" Rotate 90 0 0 1 SolidBegin \"primitive\" Color 1 0 0 Sphere 1 -1 1 360 "
        "SolidEnd SolidBegin \"primitive\" Sphere 1 -1 1 360 SolidEnd SolidEnd Sphere 1 -1 1 360"));
    ASSERT_EQ(r.scene.primitives.size(), 3u);
    EXPECT_EQ(r.primitive(1).attributes->color, Rgb(1, 1, 1));
    expect_point(r.primitive(1).world_from_object->point({1, 0, 0}), 0, 1, 0);
    expect_point(r.primitive(2).world_from_object->point({1, 0, 0}), 1, 0, 0);
    EXPECT_TRUE(r.messages().empty()) << r.all_messages();
}

TEST(RibTransform, CoShadersBelongToTheAttributes) {
    const Parsed p(world("Shader \"tint\" \"a\" \"color c\" [1 0 0]\n"
                         "AttributeBegin Translate 1 0 0 Shader \"noise\" \"b\" \"shader next\" [\"a\"]\n"
                         "Shader \"grain\" \"a\" Surface \"layered\" \"shader[2] layers\" [\"b\" \"a\"]\n"
                         "LightSource \"lamp\" 1 \"shader filter\" \"b\" Sphere 1 -1 1 360 AttributeEnd\n"
                         "Sphere 1 -1 1 360"));
    EXPECT_SILENT(p);
    const auto& inner = p.primitive(0).attributes->coshaders;
    ASSERT_EQ(inner.size(), 2u);
    EXPECT_EQ(inner[0].handle + " " + inner[0].name, "b noise");
    EXPECT_EQ(inner[0].parameters.find("next")->strings[0], "a");
    EXPECT_EQ(inner[0].world_from_shader.m[0][3], 1);
    EXPECT_EQ(inner[1].handle + " " + inner[1].name, "a grain"); // the last of a handle
    EXPECT_EQ(p.primitive(0).attributes->surface->parameters.find("layers")->strings.size(), 2u);
    const auto& outer = p.primitive(1).attributes->coshaders;
    ASSERT_EQ(outer.size(), 1u);
    EXPECT_EQ(outer[0].handle + " " + outer[0].name, "a tint");
    ASSERT_EQ(p.scene.light_shaders.size(), 1u);
    EXPECT_EQ(p.scene.light_shaders[0].coshaders.size(), 2u);
    EXPECT_TRUE(Parsed(world("Shader \"tint\" \"\"")).says("nothing can call it without a handle"));
    const Parsed o("Option \"kanuka\" \"strictdirections\" 1 \"arrayroom\" 128\n" +
                   world("Sphere 1 -1 1 360"));
    EXPECT_TRUE(o.scene.options.strict_directions);
    EXPECT_EQ(o.scene.options.array_room, 128);
}

// PRMan and BMRT count the rays that go on, Kanuka the surfaces.
TEST(RibOptions, DepthOfRays) {
    EXPECT_EQ(Parsed("Option \"trace\" \"int maxdepth\" [0]\n" + world("")).scene.options.max_depth, 1);
    EXPECT_EQ(Parsed("Option \"trace\" \"maxdepth\" [4]\n" + world("")).scene.options.max_depth, 5);
    EXPECT_EQ(Parsed("Option \"render\" \"integer max_raylevel\" [4]\n" + world("")).scene.options.max_depth,
              5);
    const Parsed bad("Option \"trace\" \"int maxdepth\" [-1]\n" + world(""));
    EXPECT_EQ(bad.scene.options.max_depth, scene::Options{}.max_depth);
    EXPECT_TRUE(bad.says("must be a whole number of 0 or more")) << bad.all_messages();
}

} // namespace kanuka::ingest::test
