// Motion: what a text makes of the scene.
#include <cmath>

#include "ingest/rib/test_support.h"

namespace kanuka::ingest::test {

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

} // namespace kanuka::ingest::test
