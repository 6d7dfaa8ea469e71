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

// Cut triangles and the grids beside them stand on one lattice.
TEST(Cracks, NoRayLeavesATrimmedSurfaceInPages) {
    constexpr uint64_t Rays = 1 << 15;
    for (uint32_t seed = 0; seed < 8; seed++) {
        const CrackScene scene = CrackScene::trimmed(seed);
        EXPECT_TRUE(scene.silent()) << "seed " << seed;
        const auto leaks = scene.leaks(Rays, seed);
        EXPECT_EQ(leaks[0] + leaks[1] + leaks[2], 0u) << "seed " << seed;
    }
}
