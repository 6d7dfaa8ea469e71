#include <gtest/gtest.h>

#include "store/test_pages.h"

using namespace kanuka;
using namespace kanuka::store;
using namespace kanuka::store::testing;

namespace {

constexpr std::array<double, 3> By{1000.1, -3.0e-3, 77.7};

Vec3f moved(const Vec3f& p) {
    return {float(double(p.x) + By[0]), float(double(p.y) + By[1]), float(double(p.z) + By[2])};
}

Vec3f position(const Store& store, int shape, int vertex, int stride = 3, int step = 0) {
    const ShapeRecord& s = store.shapes()[size_t(shape)];
    const float* p = store.floats(0) + s.positions + step * s.motion_stride + vertex * stride;
    return {p[0], p[1], p[2]};
}

} // namespace

TEST(Translate, GridsTheirMotionAndTheirEmitters) {
    const auto program = lamp_program();
    HandMade made(3, 2, program);
    made.grid.later.push_back({made.grid.P, made.grid.N});
    made.traced.later.push_back(made.traced.P);
    for (float& x : made.traced.later[0])
        x += 0.25f;
    Page page = encode_one(made, program);
    Store before, after;
    before.add_page(page, program, -1);
    translate(page, By);
    after.add_page(page, program, -1);
    for (int step = 0; step < 2; step++)
        for (int v = 0; v < 12; v++)
            EXPECT_EQ(position(after, 0, v, 3, step), moved(position(before, 0, v, 3, step)))
                << v << " " << step;
    ASSERT_EQ(after.emitters().size(), 12u);
    for (size_t i = 0; i < 12; i++) {
        EXPECT_EQ(after.emitters()[i].p0, moved(before.emitters()[i].p0));
        EXPECT_EQ(after.emitters()[i].e1, before.emitters()[i].e1);
        EXPECT_EQ(after.emitters()[i].power, before.emitters()[i].power);
    }
}

TEST(Translate, MeshesAndFibresWithTheirRadii) {
    const auto program = lamp_program();
    HandMade made(3, 0, program);
    made.is_mesh = true;
    made.mesh.vertices_per_face = 1;
    made.mesh.indices = {0, 1, 2};
    made.mesh.radius = std::vector<float>(size_t(made.grid.stride), 0.125f);
    grid::LayeringProgram dark = program;
    dark.nodes = {dark.nodes[0]};
    Page page = encode_one(made, dark);
    Store before, after;
    before.add_page(page, dark, -1);
    translate(page, By);
    after.add_page(page, dark, -1);
    for (int v = 0; v < 4; v++) {
        EXPECT_EQ(position(after, 0, v, 4), moved(position(before, 0, v, 4)));
        EXPECT_EQ(after.floats(0)[after.shapes()[0].positions + 4 * v + 3], 0.125f);
    }
}

TEST(Translate, NothingAtAllLeavesTheBits) {
    const auto program = lamp_program();
    HandMade made(2, 2, program);
    made.traced.P[0] = -0.0f;
    Page page = encode_one(made, program);
    const std::vector<uint32_t> before = page.words;
    translate(page, {0, 0, 0});
    EXPECT_EQ(page.words, before);
}
