// Retained objects become groups; attributes that an object does not set come from the instance.

#include "ingest/rib/test_support.h"
#include "scene/schema/attributes.h"

namespace kanuka::ingest::test {

TEST(RibObjects, InstancesShareOneGroup) {
    const Parsed r(world("ObjectBegin 1 Translate 0 0 1 Sphere 1 -1 1 360 ObjectEnd\nSurface \"plastic\"\n"
                         "AttributeBegin Attribute \"identifier\" \"name\" \"a\" Translate 5 0 0 "
                         "ObjectInstance 1 AttributeEnd\n"
                         "AttributeBegin Attribute \"identifier\" \"name\" \"b\" Rotate 90 0 0 1 "
                         "ObjectInstance 1.0 AttributeEnd"));
    EXPECT_SILENT(r);
    EXPECT_TRUE(r.scene.primitives.empty());
    ASSERT_EQ(r.scene.groups.size(), 1u); // names alone make no difference
    ASSERT_EQ(r.scene.instances.size(), 1u);
    ASSERT_EQ(r.scene.instances[0].transforms.size(), 24u);
    const float first[12] = {1, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1, 0};
    for (size_t i = 0; i < 12; i++)
        EXPECT_EQ(r.scene.instances[0].transforms[i], first[i]);
    EXPECT_NEAR(r.scene.instances[0].transforms[13], -1, 1e-6f);
    const scene::Primitive& p = r.scene.groups[0].primitives.at(0);
    EXPECT_EQ(p.attributes->surface->name, "plastic");
    expect_point(p.world_from_object->point({0, 0, 0}), 0, 0, 1);
    EXPECT_GT(r.scene.instances[0].first_id, p.id);
}

TEST(RibObjects, AttributesComeFromTheInstance) {
    const Parsed r(world(
        "Color 0 0 1\nObjectBegin \"thing\" Sphere 1 -1 1 360 AttributeBegin Color 0 1 0 Sphere 1 -1 1 360 "
        "AttributeEnd ReverseOrientation Sphere 1 -1 1 360 ObjectEnd\n"
        "Color 1 0 0 ObjectInstance \"thing\" Color 1 1 0 Orientation \"inside\" ObjectInstance \"thing\""));
    EXPECT_SILENT(r);
    ASSERT_EQ(r.scene.groups.size(), 2u);
    const auto& one = r.scene.groups[0].primitives;
    const auto& two = r.scene.groups[1].primitives;
    EXPECT_EQ(one[0].attributes->color, Rgb(1, 0, 0)); // not what held at ObjectBegin
    EXPECT_EQ(one[1].attributes->color, Rgb(0, 1, 0));
    EXPECT_EQ(two[0].attributes->color, Rgb(1, 1, 0));
    EXPECT_EQ(two[1].attributes->color, Rgb(0, 1, 0));
    EXPECT_FALSE(one[0].attributes->reverse_orientation);
    EXPECT_TRUE(one[2].attributes->reverse_orientation);
    EXPECT_TRUE(two[0].attributes->reverse_orientation);
    EXPECT_FALSE(two[2].attributes->reverse_orientation);
}

TEST(RibObjects, ObjectsInObjects) {
    const Parsed r(world("ObjectBegin \"leaf\" Sphere 1 -1 1 360 ObjectEnd\n"
                         "ObjectBegin \"tree\" Translate 1 0 0 ObjectInstance \"leaf\" Translate 1 0 0 "
                         "ObjectInstance \"leaf\" "
                         "Disk 0 1 360 ObjectEnd\nTranslate 0 9 0 ObjectInstance \"tree\""));
    EXPECT_SILENT(r);
    ASSERT_EQ(r.scene.groups.size(), 2u);
    const scene::Group& tree = r.scene.groups[1];
    ASSERT_EQ(tree.instances.size(), 1u);
    EXPECT_EQ(tree.instances[0].group, 0);
    EXPECT_EQ(tree.instances[0].transforms.size(), 24u);
    EXPECT_EQ(tree.instances[0].transforms[15], 2);
    EXPECT_EQ(tree.primitives.size(), 1u);
    EXPECT_EQ(r.scene.instances.at(0).group, 1);
}

TEST(RibObjects, ShadersAreSeenFromTheGroup) {
    const Parsed r(world(
        "ObjectBegin 1 Sphere 1 -1 1 360 ObjectEnd\nTranslate 5 0 0 Surface \"marble\" ObjectInstance 1"));
    expect_point(
        r.scene.groups.at(0).primitives.at(0).attributes->surface->world_from_shader.point({0, 0, 0}), 0, 0,
        0);
}

// Katana and RenderMan 24 instance lights as they do geometry.
TEST(RibObjects, LightsComeWithEveryInstance) {
    const Parsed r(
        world("ObjectBegin \"lamp\" Translate 0 0 1 Light \"PxrSphereLight\" \"lamp\" ObjectEnd\n"
              "ObjectBegin \"pair\" ObjectInstance \"lamp\" Translate 5 0 0 ObjectInstance \"lamp\" "
              "ObjectEnd\n"
              "Translate 0 7 0 ObjectInstance \"lamp\" ObjectInstance \"pair\" Sphere 1 -1 1 360"));
    EXPECT_TRUE(r.messages().empty()) << r.all_messages();
    ASSERT_EQ(r.scene.light_shaders.size(), 3u);
    for (size_t i = 0; i < 3; i++) {
        const Vec3f p = r.scene.light_shaders[i].world_from_shader.point({0, 0, 0});
        EXPECT_EQ(p.x, i == 2 ? 5 : 0);
        EXPECT_EQ(p.y, 7);
        EXPECT_EQ(p.z, 1);
    }
}

TEST(RibObjects, Mistakes) {
    EXPECT_TRUE(Parsed(world("ObjectInstance 5 Sphere 1 -1 1 360")).says("there is no such object"));
    EXPECT_TRUE(Parsed(world("ObjectBegin 1 ObjectInstance 1 ObjectEnd Sphere 1 -1 1 360"))
                    .says("there is no such object"));
    const Parsed nested(
        world("ObjectBegin 1 Sphere 1 -1 1 360 ObjectBegin 2 Sphere 1 -1 1 360 ObjectEnd ObjectInstance 1"));
    EXPECT_TRUE(nested.says("ObjectBegin inside ObjectBegin"));
    EXPECT_EQ(nested.scene.groups.size(), 1u);
    const Parsed open(world("ObjectBegin 1 AttributeBegin Sphere 1 -1 1 360"));
    EXPECT_TRUE(open.says("ObjectEnd is missing"));
    EXPECT_TRUE(Parsed(world("ObjectBegin 1 LightSource \"pointlight\" 1 ObjectEnd Sphere 1 -1 1 360"))
                    .says("lights cannot be instanced"));
    std::string deep = "ObjectBegin 0 Sphere 1 -1 1 360 ObjectEnd\n";
    for (int i = 1; i < 1000; i++)
        deep +=
            "ObjectBegin " + std::to_string(i) + " ObjectInstance " + std::to_string(i - 1) + " ObjectEnd\n";
    const Parsed r(world(deep + "ObjectInstance 999"));
    EXPECT_TRUE(r.says("levels deep at most"));
}

// Whatever an object inherits makes a look of its own.
TEST(RibObjects, EveryAttributeMakesALook) {
    size_t rows = 0;
    for (const std::string attribute :
         {"Color 1 0 0",
          "Opacity .5 .5 .5",
          "ShadingRate 4",
          "Sides 1",
          "ReverseOrientation",
          "Matte 1",
          "Surface \"plastic\"",
          "Displacement \"dented\"",
          "Interior \"fog\"",
          "Exterior \"fog\"",
          "Atmosphere \"fog\"",
          "AreaLightSource \"arealight\" 2",
          "TextureCoordinates 0 0 2 0 0 2 2 2",
          "Illuminate 1 0",
          "Attribute \"visibility\" \"int camera\" 0",
          "Attribute \"displacementbound\" \"float sphere\" 2",
          "Attribute \"displacementbound\" \"string coordinatesystem\" \"world\"",
          "Attribute \"kanuka\" \"int diceflatness\" 0",
          "Attribute \"kanuka\" \"int shadowterminator\" 0",
          "Attribute \"kanuka\" \"string densityprimvar\" \"smoke\"",
          "Attribute \"color\" \"string spectrum\" \"D65\"",
          "Attribute \"lighting\" \"string subset\" \"1\"",
          "Attribute \"lighting\" \"string excludesubset\" \"1\"",
          "Attribute \"shadow\" \"string excludesubset\" \"1\"",
          "Attribute \"kanuka\" \"int castsshadows\" 0",
          "Attribute \"kanuka\" \"int arealightbyintensity\" 1",
          "Attribute \"instance\" \"int variants\" 2",
          "Attribute \"mine\" \"int one\" 1"}) {
        rows += attribute.starts_with("Attribute ");
        const Parsed r(world("LightSource \"pointlight\" 1\nObjectBegin 1 Sphere 1 -1 1 360 ObjectEnd\n"
                             "ObjectInstance 1 " +
                             attribute + " ObjectInstance 1"));
        EXPECT_EQ(r.scene.groups.size(), 2u) << attribute << "\n" << r.all_messages();
    }
    // But for the name, level, which Detail says, and the one more that is the user's.
    EXPECT_EQ(rows, scene::attribute_parameters().size() - 2 + 1);
}

TEST(RibObjects, WhatInstancesCannotDifferByIsTold) {
    for (const auto& [attribute, text] :
         {std::pair{"float variant\" -2", "variant: expected numbers from 0 to a million"},
          std::pair{"color tint\" [1 -1 0]", "tint: expected numbers from 0 to a million"},
          std::pair{"float[2] roughness\" [0 0]", "roughness: expected a number"},
          std::pair{"string variant\" \"red\"", "variant: expected numbers"}}) {
        const Parsed r(world("ObjectBegin 1 Sphere 1 -1 1 360 ObjectEnd Attribute \"instance\" \"" +
                             std::string(attribute) + " ObjectInstance 1"));
        EXPECT_TRUE(r.says(text)) << attribute << "\n" << r.all_messages();
        ASSERT_EQ(r.scene.instances.size(), 1u);
        EXPECT_TRUE(r.scene.instances[0].variation.empty());
    }
}

TEST(RibObjects, VariablesOfInstancesAreTold) {
    for (const auto& [attribute, text] :
         {std::pair{"hpoint wetness\" [1 2 3 4]", "primvars: wetness: expected a float, color, point"},
          std::pair{"color tint\" [0 0 1]", "primvars: tint: instances have a value of that name"}}) {
        const Parsed r(world("ObjectBegin 1 Sphere 1 -1 1 360 ObjectEnd Attribute \"instance:primvar\" \"" +
                             std::string(attribute) + " ObjectInstance 1"));
        EXPECT_TRUE(r.says(text)) << attribute << "\n" << r.all_messages();
        ASSERT_EQ(r.scene.instances.size(), 1u);
        EXPECT_TRUE(r.scene.instances[0].variation.empty());
    }
}

// Instances that say the same variables are a list, whatever else they say.
TEST(RibObjects, VariablesOfInstancesMakeNoLook) {
    const Parsed r(world(
        "ObjectBegin 1 Sphere 1 -1 1 360 ObjectEnd\nObjectInstance 1\nAttributeBegin\n"
        "Attribute \"instance:primvar\" \"uniform float wetness\" .25 \"color leaf\" [.1 .2 .3] "
        "ObjectInstance 1\n"
        "Attribute \"instance\" \"float roughness\" .5 Attribute \"instance:primvar\" \"int wetness\" 1 "
        "ObjectInstance 1\nAttributeEnd\n"
        "Attribute \"instance:primvar\" \"vector wind\" [1 2 3] ObjectInstance 1"));
    ASSERT_EQ(r.scene.groups.size(), 1u) << r.all_messages();
    ASSERT_EQ(r.scene.instances.size(), 3u);
    for (const scene::Group::Instances& in : r.scene.instances) {
        const auto& said = in.variation.primvars;
        if (said.values.empty())
            continue;
        if (const scene::Value* wind = said.find("wind")) {
            EXPECT_EQ(wind->type, scene::Type::Vector);
            EXPECT_EQ(wind->detail, scene::Detail::Constant);
            EXPECT_EQ(said.values.size(), 1u);
            continue;
        }
        ASSERT_EQ(in.count(), 2u);
        const scene::Value *wetness = said.find("wetness"), *leaf = said.find("leaf");
        ASSERT_TRUE(wetness && leaf);
        EXPECT_EQ(std::vector<float>(wetness->floats.begin(), wetness->floats.end()),
                  (std::vector<float>{.25f, 1}));
        EXPECT_EQ(std::vector<float>(leaf->floats.begin(), leaf->floats.end()),
                  (std::vector<float>{.1f, .2f, .3f, .1f, .2f, .3f}));
        EXPECT_EQ(leaf->type, scene::Type::Color);
        EXPECT_EQ(leaf->detail, scene::Detail::Uniform);
        EXPECT_EQ(std::vector<float>(in.variation.roughness.begin(), in.variation.roughness.end()),
                  (std::vector<float>{0, .5f}));
    }
}

// Texts are kept once, however many instances say them.
TEST(RibObjects, TextsAndMatricesOfInstances) {
    std::string text = "ObjectBegin 1 Sphere 1 -1 1 360 ObjectEnd\n";
    for (const char* tex : {"a", "b", "a", "a", "b"})
        text += "Attribute \"instance:primvar\" \"uniform string tex\" [\"" + std::string(tex) +
                "\"] \"string[2] pair\" [\"x\" \"" + tex +
                "\"] \"matrix frame\" [1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16] ObjectInstance 1\n";
    const Parsed r(world(text));
    ASSERT_EQ(r.scene.instances.size(), 1u) << r.all_messages();
    const auto& said = r.scene.instances[0].variation.primvars;
    const scene::Value *tex = said.find("tex"), *pair = said.find("pair"), *frame = said.find("frame");
    ASSERT_TRUE(tex && pair && frame);
    const auto texts = [](const scene::Value& v) {
        return std::vector<std::string>(v.strings.begin(), v.strings.end());
    };
    const auto numbers = [](const scene::Value& v) {
        return std::vector<int32_t>(v.ints.begin(), v.ints.end());
    };
    EXPECT_EQ(texts(*tex), (std::vector<std::string>{"a", "b"}));
    EXPECT_EQ(numbers(*tex), (std::vector<int32_t>{0, 1, 0, 0, 1}));
    EXPECT_EQ(tex->detail, scene::Detail::Uniform);
    EXPECT_EQ(texts(*pair), (std::vector<std::string>{"x", "a", "x", "b"}));
    EXPECT_EQ(numbers(*pair), numbers(*tex));
    EXPECT_EQ(pair->array_size, 2);
    ASSERT_EQ(frame->floats.size(), 80u);
    for (size_t i = 0; i < 80; i++)
        EXPECT_EQ(frame->floats[i], float(1 + i % 16));
}

// Nor does what instances of one look differ by: those that say any of it are a list, the others one more.
TEST(RibObjects, WhatInstancesDifferByMakesNoLook) {
    const Parsed r(world("ObjectBegin 1 Sphere 1 -1 1 360 ObjectEnd\nObjectInstance 1\n"
                         "Attribute \"instance\" \"float variant\" 2 ObjectInstance 1\n"
                         "Attribute \"instance\" \"color tint\" [.5 .6 .7] \"float roughness\" -.1 "
                         "ObjectInstance 1\n"
                         "Attribute \"instance\" \"int unique\" 1 ObjectInstance 1"));
    ASSERT_EQ(r.scene.groups.size(), 1u) << r.all_messages();
    ASSERT_EQ(r.scene.instances.size(), 3u);
    size_t plain = 0, unique = 0;
    for (const scene::Group::Instances& in : r.scene.instances) {
        plain += in.variation.empty() ? in.count() : 0;
        unique += in.unique ? in.count() : 0;
        if (in.variation.empty() || in.unique)
            continue;
        ASSERT_EQ(in.count(), 2u);
        EXPECT_EQ(std::vector<float>(in.variation.variant.begin(), in.variation.variant.end()),
                  (std::vector<float>{2, 2}));
        EXPECT_EQ(std::vector<float>(in.variation.tint.begin(), in.variation.tint.end()),
                  (std::vector<float>{1, 1, 1, .5f, .6f, .7f}));
        EXPECT_EQ(std::vector<float>(in.variation.roughness.begin(), in.variation.roughness.end()),
                  (std::vector<float>{0, -.1f}));
    }
    EXPECT_EQ(plain, 1u);
    EXPECT_EQ(unique, 1u);
}

} // namespace kanuka::ingest::test
