// Many small faces of a uniform material become one mesh: what is traced of it is what their grids would be.
#include <gtest/gtest.h>

#include "base/tasks.h"
#include "dice/test_coverage.h"
#include "dice/test_meshes.h"

using namespace kanuka;
using namespace kanuka::dice;
using namespace kanuka::dice::test;
using scene::Detail;
using scene::Type;

namespace {

constexpr int Around = 15, Across = 16; // of a torus: too few faces for a mesh

struct Case {
    const char* name;
    bool open = false, crease = false;
};

// A torus of radii 1 and 0.4; and `more` quads far behind the camera, which make a mesh of it.
scene::Primitive torus(const Case& c, int more, float lift = 0) {
    scene::SubdivisionMesh m;
    std::vector<float> p, st;
    std::vector<int32_t> v, sizes;
    for (int j = 0; j < Across; j++)
        for (int i = 0; i < Around; i++) {
            const double a = 2 * double(Pi) * i / Around, b = 2 * double(Pi) * j / Across,
                         r = 1 + 0.4 * std::cos(b);
            p.insert(p.end(),
                     {float(r * std::cos(a)), float(r * std::sin(a)), float(0.4 * std::sin(b)) + lift});
        }
    for (int j = 0; j < Across; j++)
        for (int i = 0; i < Around - (c.open ? 1 : 0); i++) {
            const int i1 = (i + 1) % Around, j1 = (j + 1) % Across;
            v.insert(v.end(), {j * Around + i, j * Around + i1, j1 * Around + i1, j1 * Around + i});
        }
    const int first = int(p.size() / 3);
    for (int i = 0; i <= more; i++)
        for (const float y : {0.0f, 1.0f})
            p.insert(p.end(), {float(i), y, -50 + lift});
    for (int i = 0; i < more; i++)
        v.insert(v.end(), {first + 2 * i, first + 2 * i + 2, first + 2 * i + 3, first + 2 * i + 1});
    for (size_t i = 0; i < v.size(); i++)
        st.insert(st.end(), {float(i % 4), float(i / 4)}); // no two faces' agree
    m.vertices_per_face = std::vector<int32_t>(v.size() / 4, 4);
    m.vertices = v;
    m.tags = {{"interpolateboundary", {1}, {}, {}}};
    if (c.crease) {
        scene::SubdivisionMesh::Tag tag{"crease", {}, {10}, {}};
        for (int i = 0; i <= Around - (c.open ? 1 : 0); i++)
            tag.ints.push_back(i % Around);
        m.tags.push_back(tag);
    }
    scene::Primitive out = primitive(m, p);
    out.primvars.set(floats("st", Type::Float, Detail::FaceVarying, st, 2));
    return out;
}

Diced diced(const scene::Primitive& p, std::span<const scene::Primitive> later = {}) {
    DiceTarget target;
    target.shade_uniform = true;
    target.later = later;
    return run(p, looking(4, 8), {}, target); // one cell a face
}

std::vector<D3> corners(const Diced& d, size_t step = 0) {
    std::vector<D3> out;
    for (const auto& t : traced_triangles(d, step))
        for (const D3& q : t)
            if (q.z > -10)
                out.push_back(q);
    return out;
}

double distance(const D3& p, const std::vector<D3>& points) {
    double nearest = 1e9;
    for (const D3& q : points)
        nearest = std::min(nearest, length(p - q));
    return nearest;
}

} // namespace

TEST(MergeOutline, MeshesStandOffAsGridsDo) {
    for (const Case& c :
         {Case{"closed"}, Case{"open", true}, Case{"creased", false, true}, Case{"both", true, true}}) {
        const Diced few = diced(torus(c, 0)), many = diced(torus(c, 64));
        ASSERT_FALSE(few.is_mesh);
        ASSERT_TRUE(many.is_mesh);
        ASSERT_FALSE(many.mesh.P.empty());
        const std::vector<D3> grids = corners(few), mesh = corners(many);
        EXPECT_EQ(grids.size(), mesh.size()) << c.name;
        double moved = 0, off = 0;
        for (const grid::Grid& g : few.grids)
            for (int i = 0; i < g.vertices(); i++) {
                const Vec3f p = g.position(i);
                moved = std::max(moved, distance({p.x, p.y, p.z}, grids));
            }
        for (const D3& p : grids)
            off = std::max(off, distance(p, mesh));
        EXPECT_GT(moved, 0.004) << "the test would see nothing, " << c.name;
        // Where a crease ends at a border both bend unevenly.
        EXPECT_LT(off, (c.open && c.crease ? 0.1 : 0.025) * moved) << c.name;
        // Vertices of one place stay in one: the closed one has no open edge, the others have their borders.
        EdgeCount edges;
        for (const auto& t : traced_triangles(many, 0)) {
            std::array<Key, 3> k;
            for (size_t i = 0; i < 3; i++)
                k[i] = positive_zero({float(t[i].x), float(t[i].y), float(t[i].z)});
            if (k[0][2] > -10)
                edges.triangle(k[0], k[1], k[2]);
        }
        EXPECT_EQ(edges.open(), c.open ? 2u * Across : 0u) << c.name;
    }
}

TEST(MergeOutline, NobodyReadsTextureCoordinates) {
    const Diced d = diced(torus({"closed"}, 64));
    EXPECT_TRUE(d.mesh_vertices.primvars.empty());
    EXPECT_EQ(d.mesh_vertices.vertices(), Around * Across + 2 * 65); // one for all faces that meet there
    for (int i = 0; i < d.mesh_vertices.vertices(); i++)
        EXPECT_NEAR(length(d.mesh_vertices.normal(i)), 1, 1e-5f);
}

TEST(MergeOutline, LaterShapesStandOffToo) {
    const Case c{"both", true, true};
    const std::vector<scene::Primitive> later{torus(c, 64, 0.25f)};
    Diced by_threads[2];
    for (const int threads : {1, 3})
        tasks::with_threads(threads, [&] { by_threads[threads / 3] = diced(torus(c, 64), later); });
    const Diced &one = by_threads[0], &three = by_threads[1];
    EXPECT_EQ(one.mesh.P, three.mesh.P);
    ASSERT_EQ(one.mesh_vertices.later.size(), 1u);
    EXPECT_EQ(one.mesh_vertices.later[0].P, three.mesh_vertices.later[0].P);
    const std::vector<D3> first = corners(one, 0), second = corners(one, 1);
    ASSERT_EQ(first.size(), second.size());
    for (size_t i = 0; i < first.size(); i++)
        EXPECT_LT(length(second[i] - first[i] - D3{0, 0, 0.25}), 1e-5);
}

// Few points tell how many cells a short edge gets: as many as its bend asks for, and one where it is a
// pixel.
TEST(MergeOutline, ShortEdgesAreOneCell) {
    for (const int pixels : {4, 8, 16, 32, 64}) {
        DiceTarget target;
        target.shade_uniform = true;
        const Diced d = run(torus({"closed"}, 64), looking(4, pixels), {}, target);
        ASSERT_TRUE(d.is_mesh);
        // An edge between points of a torus is at most so far from it; no point is nearer than 3.5.
        double worst = 0;
        const std::vector<uint32_t>& x = d.mesh.indices;
        for (size_t i = 0; i < x.size(); i++) {
            const Vec3f a = vertex(d, x[i]), b = vertex(d, x[i % 4 == 3 ? i - 3 : i + 1]);
            if (a.z > -10)
                worst = std::max(worst, double(length_squared(b - a)) / (8 * 0.38) * pixels / 2 / 3.5);
        }
        EXPECT_LT(worst, 0.25) << pixels;
        if (pixels <= 8) {
            EXPECT_EQ(x.size(), 4u * (Around * Across + 64)) << pixels;
        }
    }
}
