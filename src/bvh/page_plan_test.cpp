// What lies in pages by default: how much of what it takes.
#include "bvh/test_geometry.h"

#include <gtest/gtest.h>

namespace kanuka::bvh {
namespace {

using namespace testing;

// A grid, or two triangles a cell, of so many cells to a side.
bool is_in_pages(int side, bool as_mesh, const PagesFrom& from) {
    Shapes shapes;
    std::vector<Vec3f> points;
    for (int j = 0; j <= side; j++)
        for (int i = 0; i <= side; i++)
            points.push_back({float(i), float(j), 0});
    if (as_mesh) {
        std::vector<uint32_t> corners;
        for (uint32_t j = 0; j < uint32_t(side); j++)
            for (uint32_t i = 0; i < uint32_t(side); i++) {
                const uint32_t a = j * uint32_t(side + 1) + i, b = a + uint32_t(side) + 1;
                corners.insert(corners.end(), {a, a + 1, b + 1, a, b + 1, b});
            }
        shapes.add_mesh(3, points, corners);
    } else {
        shapes.add_grid(side, side, points);
    }
    GroupDesc world;
    world.shapes.push_back({0, 1});
    const Scene scene(shapes.store, std::span(&world, 1), {.pages_from = from});
    return scene.page_bytes().built > 0;
}

} // namespace

TEST(PagePlan, ManyCellsOrTrianglesLieInPages) {
    PagesFrom from;
    from.cells = 900, from.triangles = 1800;
    EXPECT_FALSE(is_in_pages(29, false, from));
    EXPECT_TRUE(is_in_pages(30, false, from));
    EXPECT_FALSE(is_in_pages(29, true, from));
    EXPECT_TRUE(is_in_pages(30, true, from));
    EXPECT_FALSE(is_in_pages(30, true, {}));
    EXPECT_FALSE(is_in_pages(600, false, {})); // 360 000
    EXPECT_TRUE(is_in_pages(730, false, {}));  // 532 900
}

} // namespace kanuka::bvh
