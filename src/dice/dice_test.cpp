#include "dice/dice.h"

#include <cstring>
#include <gtest/gtest.h>

#include "base/tasks.h"
#include "dice/test_scene.h"

using namespace kanuka;
using namespace kanuka::dice;
using namespace kanuka::dice::test;
using scene::Detail;
using scene::Type;

namespace {

scene::Primitive sphere(float radius = 1, float rate = 1) {
    return primitive(scene::Quadric{scene::Quadric::Kind::Sphere, {radius, -radius, radius, 360}}, {}, rate);
}

scene::Primitive cube(bool subdivision, std::vector<scene::SubdivisionMesh::Tag> tags = {}) {
    const std::vector<float> p{-1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1, -1, -1, 1, 1, -1, 1, 1, 1, 1, -1, 1, 1};
    const std::vector<int32_t> v{0, 3, 2, 1, 4, 5, 6, 7, 0, 1, 5, 4, 1, 2, 6, 5, 2, 3, 7, 6, 3, 0, 4, 7};
    const std::vector<int32_t> n(6, 4);
    if (subdivision) {
        scene::SubdivisionMesh m;
        m.vertices_per_face = n;
        m.vertices = v;
        m.tags = std::move(tags);
        return primitive(std::move(m), p);
    }
    scene::PolygonMesh m;
    m.vertices_per_loop = n;
    m.vertices = v;
    return primitive(std::move(m), p);
}

Diced run(const scene::Primitive& p, const DiceOptions& o, const Displace& displace = {}, DiceTarget target = {},
          Journal* journal = nullptr) {
    Journal own;
    Diced d = dice::dice(p, target, o, displace, journal ? *journal : own);
    if (!journal) {
        EXPECT_TRUE(own.entries().empty()) << own.entries()[0].message;
    }
    return d;
}

void expect_closed(const Diced& d) {
    const EdgeCount shading = shading_edges(d), traced = traced_edges(d);
    EXPECT_GT(shading.all(), 0u);
    EXPECT_EQ(shading.open(), 0u) << "of " << shading.all() << " shading edges";
    EXPECT_EQ(traced.open(), 0u) << "of " << traced.all() << " traced edges";
}

} // namespace

TEST(Dice, SphereIsClosedAndRound) {
    const Diced d = run(sphere(), looking(3, 512));
    expect_closed(d);
    for (const grid::Grid& g : d.grids)
        for (int i = 0; i < g.vertices(); i++) {
            ASSERT_NEAR(length(g.position(i)), 1, 1e-6f);
            ASSERT_GT(dot(normalize(g.normal(i)), g.position(i)), 0.99999f);
        }
    EXPECT_NEAR(grid_area(d), 4 * Pi, 0.01);
    EXPECT_LT(traced_count(d), cell_count(d) / 4);
}

TEST(Dice, DisplacedShapesStayClosed) {
    const DiceOptions o = looking(3, 512);
    expect_closed(run(sphere(), o, bumps(0.05f, 9)));
    expect_closed(run(cube(true), o, bumps(0.1f, 9)));
    expect_closed(run(cube(true, {{"crease", {0, 1, 5, 4, 0}, {4}, {}}, {"corner", {6}, {10}, {}}}), o, bumps(0.1f, 9)));
    expect_closed(run(cube(false), o, bumps(0.1f, 9)));
}

TEST(Dice, NearAndOffCentreShapesStayClosed) {
    for (const float distance : {1.01f, 1.2f, 0.5f, 0.0f}) {
        DiceOptions o = looking(distance, 256);
        o.camera.render_from_camera = Transform::translate(0.3, 0.2, -distance) * Transform::rotate(25, 1, 1, 0);
        expect_closed(run(sphere(), o));
        expect_closed(run(cube(true), o, bumps(0.02f, 20)));
        expect_closed(run(cube(false), o));
    }
}
