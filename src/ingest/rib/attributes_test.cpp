// Attributes, lights and blocks: what a text makes of the scene.
#include "ingest/rib/test_support.h"

namespace kanuka::ingest::test {

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

// A frame's light of a handle that was there before it goes with the frame; the one before is meant again.
TEST(RibLights, HandlesOfAFrameGoWithIt) {
    const std::string again = "LightSource \"spotlight\" 1\n";
    const Parsed r("LightSource \"pointlight\" 1\nIlluminate 1 0\n"
                   "FrameBegin 1\nDisplay \"a.z\" \"zfile\" \"z\"\n" + // passed over
                   again +
                   "WorldBegin Sphere 1 -1 1 360 WorldEnd FrameEnd\n"
                   "FrameBegin 2\nDisplay \"a.tif\" \"file\" \"rgb\"\nIlluminate 1 1\nWorldBegin " +
                   again + "Sphere 1 -1 1 360 WorldEnd FrameEnd\n");
    EXPECT_FALSE(r.says("no light source has this handle")) << r.all_messages();
    ASSERT_EQ(r.scene.light_shaders.size(), 2u) << r.all_messages();
    EXPECT_EQ(r.scene.light_shaders[0].name, "pointlight");
    EXPECT_EQ(r.scene.light_shaders[1].handle, "1#2");
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

} // namespace kanuka::ingest::test
