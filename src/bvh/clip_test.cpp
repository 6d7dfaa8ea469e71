// Planes that cut away what lies beyond them.
#include "bvh/test_geometry.h"

#include <gtest/gtest.h>

namespace kanuka::bvh {
namespace {

using namespace testing;

TEST(Clip, PlanesCutEveryRayAndLeaveItsReach) {
    Shapes shapes;
    shapes.add_sphere({0, 0, 0}, 1, 64);
    const auto scene = shapes.flat_scene();
    scene->clip(std::vector<Scene::Plane>{{{0, 0, -0.5f}, {0, 0, -2}}, {{0, 0, 0.25f}, {0, 0, 1}}});
    const std::vector<Ray> rays{{{0.1f, 0, -3}, {0, 0, 1}},  // the front is off, and so is the back
                                {{0.9f, 0, -3}, {0, 0, 1}},  // the wall is seen between
                                {{-3, 0, 0}, {1, 0, 0}},     // along the planes: within
                                {{-3, 0, 0.5f}, {1, 0, 0}}}; // beyond
    const auto eight = intersect<8>(*scene, rays);
    const auto one = intersect<1>(*scene, rays);
    const auto shadow = occluded<8>(*scene, rays);
    const bool expected[] = {false, true, true, false};
    for (size_t i = 0; i < 4; i++) {
        EXPECT_EQ(eight[i].hit, expected[i]) << i;
        EXPECT_EQ(one[i].hit, expected[i]) << i;
        EXPECT_EQ(shadow[i], expected[i]) << i;
    }
    EXPECT_EQ(eight[0].t, 1e30f); // what misses reaches as far as without planes
    EXPECT_NEAR(eight[1].t, 3 - std::sqrt(1 - 0.81), 5e-3);
    EXPECT_NEAR(eight[2].t, 2, 5e-3);
}

TEST(Clip, PlanesMove) {
    Shapes shapes;
    shapes.add_sphere({0, 0, 0}, 1, 64);
    const auto scene = shapes.flat_scene();
    // What lies right of x is gone; it goes from -2 by 0 to 1. Another stays, above everything.
    scene->clip(std::vector<Scene::Plane>{{{-2, 0, 0}, {1, 0, 0}},
                                          {{0, 5, 0}, {0, 1, 0}},
                                          {{0, 0, 0}, {1, 0, 0}},
                                          {{0, 5, 0}, {0, 1, 0}},
                                          {{1, 0, 0}, {1, 0, 0}},
                                          {{0, 5, 0}, {0, 1, 0}}},
                3);
    std::vector<Ray> rays;
    for (const float time : {0.0f, 0.2f, 0.5f, 0.7f, 0.8f, 1.0f})
        for (const float x : {-0.5f, 0.5f})
            rays.push_back({{x, 0.1f, -3}, {0, 0, 1}, time});
    const auto eight = intersect<8>(*scene, rays);
    const auto one = intersect<1>(*scene, rays);
    const auto shadow = occluded<8>(*scene, rays);
    const bool expected[] = {false, false, false, false, true, false, true, false, true, true, true, true};
    for (size_t i = 0; i < rays.size(); i++) {
        EXPECT_EQ(eight[i].hit, expected[i]) << i;
        EXPECT_EQ(one[i].hit, expected[i]) << i;
        EXPECT_EQ(shadow[i], expected[i]) << i;
    }
}

} // namespace
} // namespace kanuka::bvh
