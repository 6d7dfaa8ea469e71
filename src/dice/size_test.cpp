// How much room a primitive is said to take before anything is made of it, against what is made.
#include <gtest/gtest.h>

#include "dice/test_scene.h"

using namespace kanuka;
using namespace kanuka::dice;
using namespace kanuka::dice::test;

namespace {

struct Size {
    uint64_t bytes = 0, vertices = 0;
};

struct Sizes {
    Size said, made;
    size_t grids = 0;
    bool is_mesh = false;

    Sizes(const scene::Primitive& p, const DiceOptions& o, std::span<const scene::Primitive> later = {}) {
        DiceTarget target;
        target.later = later;
        target.keep_density = true; // all of the lattice is traced, which is the most there is
        target.fits = [&](uint64_t bytes, uint64_t vertices) {
            said = {bytes, vertices};
            return true;
        };
        Journal journal;
        const Diced d = dice::dice(p, target, o, {}, journal);
        EXPECT_TRUE(journal.entries().empty());
        grids = d.grids.size(), is_mesh = d.is_mesh;
        for (const grid::Grid& g : d.grids)
            count(g);
        for (const grid::TracedGrid& t : d.traced) {
            add(t.P);
            for (const auto& P : t.later)
                add(P);
        }
        if (d.is_mesh)
            count(d.mesh_vertices);
        made.bytes += 4 * d.mesh.indices.size();
    }

  private:
    void add(const std::vector<float>& a) { made.bytes += 4 * a.size(); }
    void count(const grid::Grid& g) {
        made.vertices += uint64_t(g.vertices());
        for (const auto* a : {&g.P, &g.N, &g.Ng, &g.dPdu, &g.dPdv, &g.u, &g.v, &g.s, &g.t})
            add(*a);
        for (const grid::Channel& c : g.primvars)
            made.bytes += 4 * uint64_t(c.components) * uint64_t(g.stride);
        for (const grid::Grid::Step& step : g.later)
            add(step.P), add(step.N);
    }
};

// z = 0, of n x n points; a colour at each if asked for.
scene::Primitive sheet(int n, bool coloured, float height = 0) {
    scene::PatchMesh m;
    m.cubic = false;
    m.nu = m.nv = n;
    std::vector<float> p, colors;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            const float x = 2 * float(i) / float(n - 1) - 1, y = 2 * float(j) / float(n - 1) - 1;
            p.insert(p.end(), {x, y, height * x * y});
            colors.insert(colors.end(), {x, y, 0.5f});
        }
    scene::Primitive out = primitive(m, p);
    if (coloured)
        out.primvars.set(floats("tint", scene::Type::Color, scene::Detail::Vertex, std::move(colors)));
    return out;
}

} // namespace

// Arrays of grids and of what is traced; beside them each grid has some two kilobytes, each vertex at a side
// some bytes where seams are joined.
TEST(Size, OfGrids) {
    const scene::Primitive still = sheet(3, false), tinted = sheet(3, true),
                           later[] = {sheet(3, true, 0.5f), sheet(3, true, 1)};
    const Sizes all[] = {
        {still, looking(2, 256)},
        {tinted, looking(2, 256)},
        {tinted, looking(2, 256), later},
        {tinted, looking(2, 256), std::span(later, 1)},
        {primitive(scene::Quadric{scene::Quadric::Kind::Sphere, {1, -1, 1, 360}}), looking(2, 256)}};
    for (const Sizes& s : all) {
        ASSERT_GE(s.grids, 8u);
        EXPECT_EQ(s.said.vertices, s.made.vertices);
        EXPECT_GE(s.said.bytes, s.made.bytes);
        EXPECT_LT(double(s.said.bytes), 1.05 * double(s.made.bytes) + 5000.0 * double(s.grids));
    }
    EXPECT_GT(all[1].made.bytes, all[0].made.bytes); // else this tells nothing
    EXPECT_GT(all[2].made.bytes, all[3].made.bytes);
}

// Cells finer than micropolygons are one mesh, in which they share their vertices.
TEST(Size, OfAMesh) {
    const scene::Primitive still = sheet(65, true), later[] = {sheet(65, true, 0.5f)};
    for (const Sizes& s : {Sizes(still, looking(2, 64)), Sizes(still, looking(2, 64), later)}) {
        ASSERT_TRUE(s.is_mesh);
        EXPECT_EQ(s.made.vertices, 65u * 65);
        EXPECT_EQ(s.said.vertices, s.made.vertices);
        EXPECT_GE(s.said.bytes, s.made.bytes * 0.99);
        EXPECT_LT(double(s.said.bytes), 1.1 * double(s.made.bytes));
    }
}
