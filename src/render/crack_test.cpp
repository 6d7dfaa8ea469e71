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
        EXPECT_EQ(scene.leaks(Rays, seed), 0u) << scene.kind << ", seed " << seed;
    }
}
