#include <gtest/gtest.h>

#include "render/test_cracks.h"

using namespace kanuka::render::testing;

TEST(Cracks, NoRayLeavesAClosedSurface) {
    constexpr uint32_t Scenes = 16;
    constexpr uint64_t Rays = 1 << 15; // each
    for (uint32_t seed = 0; seed < Scenes; seed++) {
        const CrackScene scene(seed);
        EXPECT_TRUE(scene.silent()) << scene.kind << ", seed " << seed;
        EXPECT_GT(scene.micropolygons, 20u) << scene.kind << ", seed " << seed;
        EXPECT_EQ(scene.open_edges, 0u) << scene.kind << ", seed " << seed;
        const auto leaks = scene.leaks(Rays, seed);
        EXPECT_EQ(leaks[0], 0u) << scene.kind << ", seed " << seed;
        EXPECT_EQ(leaks[1], 0u) << scene.kind << ", seed " << seed;
        EXPECT_LT(leaks[2], Rays / 16 / 50) << scene.kind << ", seed " << seed;
    }
}
