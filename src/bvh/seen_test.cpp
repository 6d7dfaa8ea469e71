// Shapes that some rays do not see: one-sided ones, those hidden from the camera, levels of detail.
#include "bvh/test_geometry.h"

#include <gtest/gtest.h>

namespace kanuka::bvh {
namespace {

using namespace testing;
using store::Links;

const std::vector<Vec3f> Square = {{-1, -1, 0}, {1, -1, 0}, {-1, 1, 0}, {1, 1, 0}}; // its winding: towards +z

void add_square(Shapes& shapes, bool mesh) {
    if (mesh)
        shapes.add_mesh(3, Square, {0, 1, 2, 3, 2, 1});
    else
        shapes.add_grid(1, 1, Square);
}

template <int W>
bool meets(const Scene& scene, const Ray& ray, int camera = 0, float level = 0.5f) {
    RayPacket<W> rays = packet<W>(&ray, 1);
    rays.camera = Int<W>(camera);
    rays.level = Float<W>(level);
    HitPacket<W> hits;
    scene.intersect(rays, hits);
    const bool met = hits.hit[0];
    EXPECT_EQ(scene.occluded(rays)[0], met);
    rays.coherent = true;
    scene.intersect(rays, hits);
    EXPECT_EQ(hits.hit[0], met);
    return met;
}
bool meets(const Scene& scene, const Ray& ray, int camera = 0, float level = 0.5f) {
    const bool met = meets<8>(scene, ray, camera, level);
    EXPECT_EQ((meets<1>(scene, ray, camera, level)), met);
    EXPECT_EQ((meets<16>(scene, ray, camera, level)), met);
    return met;
}

const Ray FromAbove{{0.1f, 0.2f, 3}, {0, 0, -1}}, FromBelow{{0.1f, 0.2f, -3}, {0, 0, 1}};

TEST(Seen, OneSidedShapesAreMetFromTheOutside) {
    for (bool mesh : {false, true})
        for (bool flips : {false, true})
            for (bool one_sided : {false, true}) {
                Shapes shapes;
                shapes.flips = flips;
                if (one_sided)
                    shapes.links.seen = Links::OneSided;
                add_square(shapes, mesh);
                const auto scene = shapes.flat_scene();
                EXPECT_EQ(meets(*scene, FromAbove), !one_sided || !flips) << mesh;
                EXPECT_EQ(meets(*scene, FromBelow), !one_sided || flips) << mesh;
            }
}

// The outside of an instance is where that of its group is, mirrored or not.
TEST(Seen, SidesOfInstances) {
    Shapes shapes;
    shapes.links.seen = Links::OneSided;
    add_square(shapes, false);
    for (float z : {1.0f, -1.0f})
        for (float x : {1.0f, -1.0f}) {
            const std::vector<float> place = {x, 0, 0, 0, 0, 1, 0, 0, 0, 0, z, 0};
            GroupDesc groups[2];
            groups[0].shapes.push_back({0, 1});
            groups[1].instances.push_back({0, place});
            const Scene scene(shapes.store, groups, {.pages_from = 0});
            EXPECT_EQ(meets(scene, FromAbove), z > 0);
            EXPECT_EQ(meets(scene, FromBelow), z < 0);
        }
}

TEST(Seen, WhatIsHiddenFromTheCameraIsMetByOthers) {
    Shapes shapes;
    shapes.links.seen = Links::Unseen;
    add_square(shapes, false);
    const auto scene = shapes.flat_scene();
    EXPECT_FALSE(meets(*scene, FromAbove, 1));
    EXPECT_TRUE(meets(*scene, FromAbove, 0));
}

// Of two levels with a common transition every path meets one.
TEST(Seen, LevelsInTransitionComplementEachOther) {
    Shapes shapes;
    shapes.links.level_to = 0.3f;
    add_square(shapes, false);
    shapes.links.level_from = 0.3f, shapes.links.level_to = 1;
    shapes.add_grid(1, 1, {{-1, -1, -1}, {1, -1, -1}, {-1, 1, -1}, {1, 1, -1}});
    const auto scene = shapes.flat_scene();
    Ray ray = FromAbove;
    for (float level : {0.0f, 0.1f, 0.299f, 0.3f, 0.31f, 0.999f}) {
        RayPacket<8> rays = packet<8>(&ray, 1);
        rays.level = Float<8>(level);
        HitPacket<8> hits;
        scene->intersect(rays, hits);
        ASSERT_TRUE(hits.hit[0]);
        EXPECT_EQ(hits.shape[0], level < 0.3f ? 0 : 1);
        EXPECT_TRUE(meets(*scene, FromAbove, 0, level));
    }
}

// Two groups of one place: still and moving, in a group of its own or not, by pages and by Embree.
TEST(Seen, InstancesOfTwoLevelsComplementEachOther) {
    Shapes shapes;
    add_square(shapes, false);
    add_square(shapes, true);
    const std::vector<float> apart = {1, 0, 0, 9, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
                             half = {0.5f, 0, 0, 0, 0, 0.5f, 0, 0, 0, 0, 0.5f, 0};
    const uint32_t second[] = {1};
    std::vector<MotionPath> moving;
    moving.emplace_back(std::vector<TransformKey>{{0, Transform::translate(0.5, 0, 0)},
                                                  {1, Transform::translate(-0.5, 0, 0)}});
    constexpr uint16_t Edge = 3 << 14; // 0.75
    for (const uint64_t pages_from : {uint64_t(0), ~uint64_t(0)})
        for (const bool moves : {false, true})
            for (const bool nested : {false, true}) {
                GroupDesc groups[4];
                groups[0].shapes.push_back({0, 1});
                groups[1].shapes.push_back({1, 1});
                Places there(apart);
                there.which = second;
                GroupDesc& around = groups[nested ? 2 : 3];
                for (int k = 0; k < 2; k++)
                    around.instances.push_back(
                        {.group = k,
                         .places = moves ? Places() : there,
                         .paths = moves ? std::span<const MotionPath>(moving) : std::span<const MotionPath>(),
                         .variations = {7 + k},
                         .levels = {k == 0 ? LevelRange{0, Edge - 1} : LevelRange{Edge}}});
                if (nested)
                    groups[3].instances.push_back({2, half});
                const Scene scene(shapes.store, groups, {.pages_from = pages_from});
                for (float level : {0.0f, 0.5f, 0.7499f, 0.75f, 0.9999f}) {
                    EXPECT_TRUE(meets(scene, FromAbove, 0, level)) << level;
                    RayPacket<8> rays = packet<8>(&FromAbove, 1);
                    rays.level = Float<8>(level);
                    HitPacket<8> hits;
                    scene.intersect(rays, hits);
                    ASSERT_TRUE(hits.hit[0]);
                    EXPECT_EQ(hits.shape[0], level < 0.75f ? 0 : 1);
                    EXPECT_EQ(hits.variation[0], level < 0.75f ? 7 : 8);
                }
            }
}

} // namespace
} // namespace kanuka::bvh
