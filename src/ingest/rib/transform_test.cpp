// Transformations and named spaces: what a text makes of the scene.
#include <cmath>

#include "ingest/rib/test_support.h"

namespace kanuka::ingest::test {

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

} // namespace kanuka::ingest::test
