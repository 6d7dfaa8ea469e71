// How many cells shapes are given: by their size in the picture, where they are seen, and where shape alone
// counts.
#include "dice/test_dicing.h"

using namespace kanuka;
using namespace kanuka::dice;
using namespace kanuka::dice::test;

namespace {

scene::Primitive square(float half, float z = 0, float rate = 1) {
    scene::PolygonMesh m;
    m.vertices_per_loop = std::vector<int32_t>{4};
    return primitive(m, {-half, -half, z, half, -half, z, half, half, z, -half, half, z}, rate);
}

} // namespace

TEST(Rates, RatesFollowSizeDistanceTiltAndShadingRate) {
    // Two units seen from two units away are 128 pixels of a 256 pixel picture of 90 degrees.
    const DiceOptions o = looking(2, 256);
    EXPECT_EQ(cell_count(run(square(1), o)), 128u * 128);
    EXPECT_EQ(cell_count(run(square(1, 0, 4), o)), 64u * 64);
    EXPECT_EQ(cell_count(run(square(1), looking(4, 256))), 64u * 64);
    DiceOptions coarse = o;
    coarse.shading_rate_scale = 16;
    EXPECT_EQ(cell_count(run(square(1), coarse)), 32u * 32);
    coarse.max_grid_cells = 8;
    for (const grid::Grid& g : run(square(1), coarse).grids)
        EXPECT_EQ(g.nu, 8);
    // Tilted by 60 degrees, at a distance that makes perspective small: half as many cells across the tilt.
    DiceTarget tilted;
    tilted.page_from_object = Transform::rotate(60, 1, 0, 0) * Transform::scale(0.1, 0.1, 0.1);
    EXPECT_EQ(cell_count(run(square(1), looking(6.4f, 4096), {}, tilted)), 64u * 32);
    // Orthographic: no effect of distance.
    DiceOptions flat = looking(50, 256);
    flat.camera.projection = Projection::Orthographic;
    flat.camera.pixels_per_tangent = 64;
    EXPECT_EQ(cell_count(run(square(1), flat)), 128u * 128);
    // Pixels half as high as they are wide: twice as many cells up, in perspective and not, for a square that
    // is turned by a right angle across.
    for (DiceOptions wide : {o, flat}) {
        const size_t seen = cell_count(run(square(1), wide));
        wide.camera.pixel_stretch = 2;
        wide.camera.height *= 2;
        for (const float turn : {0.0f, 90.0f}) {
            DiceTarget turned;
            turned.page_from_object = Transform::rotate(double(turn), 0, 0, 1);
            const Diced d = run(square(1), wide, {}, turned);
            EXPECT_EQ(cell_count(d), 2 * seen);
            const grid::Grid& g = d.grids[0];
            const Vec3f across = g.position(1) - g.position(0), up = g.position(g.nu + 1) - g.position(0);
            EXPECT_NEAR(length(turn > 0 ? across : up) * 2, length(turn > 0 ? up : across), 1e-5f);
        }
    }
    // Instances: uniform, and no camera.
    DiceTarget uniform;
    uniform.pixels_per_unit = 16;
    EXPECT_EQ(cell_count(run(square(1), o, {}, uniform)), 32u * 32);
}

TEST(Rates, CoarserOutsideThePicture) {
    DiceOptions o = looking(0, 256);
    size_t last = std::numeric_limits<size_t>::max(), seen = 0;
    for (const float angle : {0.0f, 60.0f, 90.0f, 180.0f}) {
        DiceTarget t;
        t.page_from_object = Transform::rotate(angle, 0, 1, 0) * Transform::translate(0, 0, 4);
        const size_t n = cell_count(run(square(1), o, {}, t));
        EXPECT_LE(n, last) << angle;
        EXPECT_GT(n, 0u);
        if (angle > 0) {
            EXPECT_LT(n, seen / 8) << angle; // edges up to nine times as long
        } else {
            seen = n;
        }
        last = n;
    }
}

TEST(Rates, FlatWallIsTracedAsOneCellAGrid) {
    const Diced d = run(square(1), looking(2, 256));
    EXPECT_EQ(d.grids.size(), 16u);
    EXPECT_EQ(traced_count(d), 16u);
    EXPECT_NEAR(traced_area(d), 4, 1e-5);
    DiceTarget uniform;
    uniform.shade_uniform = true;
    const Diced one = run(square(1000), looking(2, 2048), {}, uniform);
    EXPECT_EQ(one.grids.size(), 1u);
    EXPECT_EQ(cell_count(one), 1u);
    // Where nothing may be lost, everything is traced.
    DiceOptions exact = looking(2, 256);
    exact.geometry_tolerance = 0;
    EXPECT_EQ(traced_count(run(square(1), exact)), 128u * 128);
    // A flat concave polygon with a hole too.
    scene::PolygonMesh m;
    m.loops_per_face = std::vector<int32_t>{2};
    m.vertices_per_loop = std::vector<int32_t>{5, 4};
    const Diced holed = run(primitive(m, {0, 0, 0, 4, 0, 0,    4, 4,    0,    2, 2.5f, 0, 0, 4,
                                          0, 1, 1, 0, 1, 1.5f, 0, 1.5f, 1.5f, 0, 1.5f, 1, 0}),
                            looking(8, 400));
    EXPECT_NEAR(traced_area(holed), 16 - 3 - 0.25, 1e-4);
    EXPECT_NEAR(grid_area(holed), 16 - 3 - 0.25, 1e-4);
}
