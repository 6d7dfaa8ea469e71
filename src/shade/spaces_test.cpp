#include "shade/spaces.h"

#include <gtest/gtest.h>

namespace kanuka::shade {
namespace {

void expect_near(const Vec3f& a, const Vec3f& b, float tolerance = 1e-5f) {
    EXPECT_NEAR(a.x, b.x, tolerance);
    EXPECT_NEAR(a.y, b.y, tolerance);
    EXPECT_NEAR(a.z, b.z, tolerance);
}

struct Fixture : testing::Test {
    scene::Scene scene;
    Fixture() {
        scene.options.width = 200;
        scene.options.height = 100;
        scene.camera.fov = 90;
        scene.camera.near_clip = 1;
        scene.camera.far_clip = 11;
        scene.coordinate_systems["lamp"] = Transform::translate(0, 5, 0);
    }
};

TEST_F(Fixture, NamedSpacesComposeThroughCurrent) {
    const WorldSpaces world(scene, Transform::translate(0, 0, 10)); // the camera stands at z = -10
    Spaces s;
    s.shared = &world;
    s.current_from_world = Transform::translate(1, 0, 0);
    s.current_from_object = Transform::translate(1, 2, 0) * Transform::scale(2, 2, 2);
    s.current_from_shader = Transform::translate(0, 0, 3);
    expect_near(s.to_from("current", "object")->point({1, 1, 1}), {3, 4, 2});
    expect_near(s.to_from("object", "current")->point({3, 4, 2}), {1, 1, 1});
    expect_near(s.to_from("camera", "world")->point({0, 0, 0}), {0, 0, 10});
    expect_near(s.to_from("world", "lamp")->point({0, 0, 0}), {0, 5, 0});
    expect_near(s.to_from("shader", "object")->point({0, 0, 0}), {1, 2, -3});
    expect_near(s.eye(), {1, 0, -10});
    EXPECT_FALSE(s.to_from("current", "nowhere"));
}

TEST_F(Fixture, ScreenNdcAndRasterAreRispecs) {
    const WorldSpaces world(scene, Transform{});
    Spaces s;
    s.shared = &world;
    // 45 degrees up at z = 5 is the top edge; the longer side reaches twice as far.
    expect_near(s.to_from("screen", "camera")->point({10, 5, 5}), {2, 1, 0.88f});
    expect_near(s.to_from("NDC", "camera")->point({10, 5, 5}), {1, 0, 0.88f});
    expect_near(s.to_from("raster", "camera")->point({-10, -5, 5}), {0, 100, 0.88f}, 1e-4f);
    expect_near(s.to_from("screen", "camera")->point({0, 0, 1}), {0, 0, 0});
    expect_near(s.to_from("screen", "camera")->point({0, 0, 11}), {0, 0, 1});
    expect_near(s.to_from("camera", "raster")->point({100, 50, 0.88f}), {0, 0, 5}, 1e-3f);
}

TEST_F(Fixture, FlatSpacesAreUnknownNotFatal) {
    const WorldSpaces world(scene, Transform{});
    Spaces s;
    s.shared = &world;
    s.current_from_object = Transform::scale(1, 0, 1);
    EXPECT_TRUE(s.to_from("current", "object"));
    EXPECT_FALSE(s.to_from("object", "current"));
}

} // namespace
} // namespace kanuka::shade
