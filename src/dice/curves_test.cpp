// Curves, and points, as meshes.
#include <gtest/gtest.h>

#include "dice/test_meshes.h"

using namespace kanuka;
using namespace kanuka::dice;
using namespace kanuka::dice::test;
using scene::Detail;
using scene::Type;

namespace {

// Area of the outlines of fibres, seen from the side, with half balls at their ends.
double outline(const Diced& d) {
    double sum = 0;
    const std::set<uint32_t> begins(d.mesh.indices.begin(), d.mesh.indices.end());
    for (const uint32_t i : d.mesh.indices) {
        const float a = d.mesh.radius[i], b = d.mesh.radius[i + 1];
        sum += double(length(vertex(d, i + 1) - vertex(d, i)) * (a + b));
        if (i == 0 || !begins.contains(i - 1))
            sum += Pi / 2 * double(a * a);
        if (!begins.contains(i + 1))
            sum += Pi / 2 * double(b * b);
    }
    return sum;
}

Vec3f vector_at(const std::vector<float>& v, size_t i, size_t stride) {
    return {v[i], v[i + stride], v[i + 2 * stride]};
}

} // namespace

TEST(Curves, FibresAndTubes) {
    scene::Curves c;
    c.basis = scene::basis_by_name("bezier");
    c.vertices_per_curve = std::vector<int32_t>{7, 4};
    scene::Primitive p = primitive(c, {0, 0, 0, 0, 1,  0, 1, 1,  0, 1, 2,  0, 1, 3,  0, 2, 3,
                                       1, 3, 3, 1, -1, 0, 0, -1, 1, 0, -1, 2, 0, -1, 3, 0});
    p.primvars.set(floats("width", Type::Float, Detail::Varying, {0.1f, 0.1f, 0.1f, 0.2f, 0.05f}));
    p.primvars.set(floats("id", Type::Float, Detail::Uniform, {5, 6}));
    const Diced d = run(p, looking(5, 60)); // thin: a vertex a ring
    ASSERT_TRUE(d.is_mesh);
    const grid::Grid& g = d.mesh_vertices;
    ASSERT_EQ(d.mesh.radius.size(), size_t(g.vertices()));
    ASSERT_EQ(d.mesh.indices.size(), size_t(g.vertices()) - 2); // of two curves
    for (const uint32_t i : d.mesh.indices) { // what shaders see faces the camera, across the fibre
        const Vec3f to_eye = Vec3f(0, 0, -5) - vertex(d, i);
        EXPECT_GT(dot(g.normal(int(i)), to_eye), 0);
        EXPECT_NEAR(dot(g.normal(int(i)), vector_at(g.dPdv, i, size_t(g.stride))), 0, 1e-4f);
        EXPECT_EQ(g.u[i], 0.5f);
    }
    // The straight one is cut along its length only for the sake of shading, and narrows. Its end is drawn in
    // by as much as the half ball that is added there has area.
    int last = g.vertices() - 1;
    EXPECT_EQ(g.primvars[0].data[last], 6);
    EXPECT_NEAR(d.mesh.radius[last], 0.025f, 1e-6f);
    EXPECT_NEAR(g.position(last).y, 3 - 0.025f * Pi / 4, 1e-5f);
    EXPECT_EQ(g.v[last], 1);
    EXPECT_EQ(g.primvars[0].data[0], 5);
    // Near enough to be a surface, it is a tube, shaded at the full rate: the same shape, more vertices both
    // ways, wound to the outside.
    const Diced wide = run(p, looking(5, 800));
    EXPECT_TRUE(wide.mesh.radius.empty());
    for (const auto& t : triangles(wide.mesh)) {
        const Vec3f n =
            cross(vertex(wide, t[1]) - vertex(wide, t[0]), vertex(wide, t[2]) - vertex(wide, t[0]));
        EXPECT_GE(dot(n, wide.mesh_vertices.normal(int(t[0]))), 0);
    }
    // As a ribbon that is turned to the camera has it: u across what is seen of it, the same behind.
    const grid::Grid& w = wide.mesh_vertices;
    for (size_t i = 0; i < size_t(w.vertices()); i++) {
        const Vec3f side =
            normalize(cross(Vec3f(0, 0, -5) - w.position(int(i)), vector_at(w.dPdv, i, size_t(w.stride))));
        EXPECT_NEAR(2 * w.u[i] - 1, dot(w.normal(int(i)), side), 0.03f);
    }
    const auto area = [](const Diced& x) {
        double sum = 0;
        for (const auto& t : triangles(x.mesh))
            sum += 0.5 * length(cross(vertex(x, t[1]) - vertex(x, t[0]), vertex(x, t[2]) - vertex(x, t[0])));
        return sum;
    };
    EXPECT_GT(wide.mesh_vertices.vertices(), 20 * g.vertices());
    EXPECT_NEAR(area(wide) / (Pi * outline(d)), 1, 0.02);
}

TEST(Curves, PolygonsAndOrientedRibbons) {
    scene::Curves c;
    c.cubic = false;
    c.vertices_per_curve = std::vector<int32_t>{3};
    scene::Primitive p = primitive(c, {0, 0, 0, 0, 0, 1, 0, 1, 2});
    p.primvars.set(floats("constantwidth", Type::Float, Detail::Constant, {0.2f}));
    DiceTarget t;
    t.pixels_per_unit = 5;
    EXPECT_EQ(run(p, looking(5), {}, t).mesh.radius.size(), 3u); // instanced: the same
    t.polygons = true;
    const Diced tube = run(p, looking(5), {}, t);
    ASSERT_TRUE(tube.is_mesh);
    ASSERT_TRUE(tube.mesh.radius.empty());
    for (int i = 0; i < 3; i++) // Cauchy: the outline is pi times the mean width
        EXPECT_NEAR(length(vertex(tube, i) - vertex(tube, (i + 1) % 3)), 0.2f * Pi / 3, 1e-5f);
    // Seen from the camera, it is as wide as said.
    scene::Curves line = c;
    line.vertices_per_curve = std::vector<int32_t>{2};
    scene::Primitive rod = primitive(line, {0, -1, 0, 0, 1, 0});
    rod.primvars.set(floats("constantwidth", Type::Float, Detail::Constant, {0.2f}));
    t = {};
    t.polygons = true;
    const Diced seen = run(rod, looking(5, 30), {}, t);
    const auto [low, high] = std::minmax({vertex(seen, 0).x, vertex(seen, 1).x, vertex(seen, 2).x});
    EXPECT_NEAR(high - low, 0.2f, 1e-5f);
    p.primvars.set(floats("N", Type::Normal, Detail::Varying, {0, 1, 0, 0, 1, 0, 0, 1, 0}));
    const Diced ribbon = run(p, looking(5, 40)); // thin: two vertices a ring
    EXPECT_NEAR(abs(vertex(ribbon, 1).x - vertex(ribbon, 0).x), 0.2f, 1e-5f);
    EXPECT_NEAR(ribbon.mesh_vertices.normal(0).y, 1, 1e-5f);
}

TEST(Points, SpheresOfEqualSilhouette) {
    std::vector<float> p, w;
    for (int i = 0; i < 100; i++) {
        p.insert(p.end(), {float(i % 10) - 5, float(i / 10) - 5, 0});
        w.push_back(0.02f + 0.004f * float(i));
    }
    p[30] = NAN;
    scene::Primitive prim = primitive(scene::Points{}, p);
    prim.primvars.set(floats("width", Type::Float, Detail::Varying, w));
    Journal journal;
    const Diced d = dice::dice(prim, {}, looking(10, 500), {}, journal);
    EXPECT_EQ(journal.entries().size(), 1u);
    ASSERT_TRUE(d.is_mesh);
    double area = 0, expected = 0;
    for (const auto& t : triangles(d.mesh)) {
        const Vec3f n = cross(vertex(d, t[1]) - vertex(d, t[0]), vertex(d, t[2]) - vertex(d, t[0]));
        EXPECT_GT(dot(n, d.mesh_vertices.normal(int(t[0]))), 0); // wound to the outside
        area += 0.5 * length(n);
    }
    for (int i = 0; i < 100; i++)
        expected += i == 10 ? 0 : Pi * w[i] * w[i];
    EXPECT_NEAR(area / expected, 1, 1e-4);
    // Larger in the picture, rounder.
    EXPECT_GT(dice::dice(prim, {}, looking(10, 20000), {}, journal).mesh.indices.size(),
              4 * d.mesh.indices.size());
}
