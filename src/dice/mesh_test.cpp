// Meshes finer than the rate.
#include <gtest/gtest.h>

#include "base/tasks.h"
#include "dice/test_meshes.h"

using namespace kanuka;
using namespace kanuka::dice;
using namespace kanuka::dice::test;
using scene::Detail;
using scene::Type;

namespace {

// n x n squares over [-1, 1]^2, wavy in z; as triangle pairs or quads.
scene::Primitive field(int n, int sides, bool shuffled = false) {
    std::vector<float> p;
    std::vector<int32_t> v, sizes;
    for (int j = 0; j <= n; j++)
        for (int i = 0; i <= n; i++) {
            const float x = 2 * float(i) / float(n) - 1, y = 2 * float(j) / float(n) - 1;
            p.insert(p.end(), {x, y, 0.2f * std::sin(5 * x) * std::cos(7 * y)});
        }
    std::vector<std::array<int, 3>> triangles;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            const int a = j * (n + 1) + i, b = a + 1, c = b + n + 1, d = a + n + 1;
            if (sides == 4) {
                v.insert(v.end(), {a, b, c, d});
                sizes.push_back(4);
            } else if ((i + j) % 2) {
                triangles.push_back({b, c, a}); // any rotation, either diagonal
                triangles.push_back({d, a, c});
            } else {
                triangles.push_back({a, b, d});
                triangles.push_back({c, d, b});
            }
        }
    if (shuffled) // no two neighbours in a row
        for (size_t i = 0; i + 7 < triangles.size(); i += 2)
            std::swap(triangles[i], triangles[(i * 7919) % triangles.size()]);
    for (const auto& t : triangles) {
        v.insert(v.end(), t.begin(), t.end());
        sizes.push_back(3);
    }
    scene::PolygonMesh m;
    m.vertices_per_loop = sizes;
    m.vertices = v;
    return primitive(m, p);
}

} // namespace

TEST(Mesh, TakenOnlyWhereFinerThanTheRate) {
    EXPECT_TRUE(run(field(100, 4), looking(2, 128)).is_mesh);
    EXPECT_FALSE(run(field(100, 4), looking(2, 1024)).is_mesh);
    EXPECT_TRUE(run(field(100, 3), looking(2, 128)).is_mesh);
    // A uniform material needs no dicing of flat faces, however large.
    DiceTarget uniform;
    uniform.shade_uniform = true;
    EXPECT_TRUE(run(field(10, 3), looking(2, 1024), {}, uniform).is_mesh);
}

TEST(Mesh, PairingKeepsEveryTriangle) {
    const scene::Primitive p = field(60, 3);
    const auto& source = std::get<scene::PolygonMesh>(p.geometry).vertices;
    grid::TracedMesh expected;
    expected.indices.assign(source.begin(), source.end());
    const Diced d = run(p, looking(2, 64));
    ASSERT_TRUE(d.is_mesh);
    EXPECT_EQ(d.mesh.vertices_per_face, 4);
    EXPECT_EQ(d.mesh.indices.size(), 60u * 60 * 4);
    EXPECT_TRUE(triangles(d.mesh) == triangles(expected));
    // Where few pair up they stay triangles.
    const Diced s = run(field(60, 3, true), looking(2, 64));
    EXPECT_EQ(s.mesh.vertices_per_face, 3);
    EXPECT_EQ(s.mesh.indices.size(), 60u * 60 * 6);
    // An odd triangle out repeats its last vertex.
    scene::Primitive odd = p;
    auto m = std::get<scene::PolygonMesh>(p.geometry);
    std::vector<int32_t> v(m.vertices.begin(), m.vertices.end() - 3),
        n(m.vertices_per_loop.begin(), m.vertices_per_loop.end() - 1);
    m.vertices = v, m.vertices_per_loop = n;
    odd.geometry = m;
    expected.indices.assign(v.begin(), v.end());
    const Diced o = run(odd, looking(2, 64));
    EXPECT_EQ(o.mesh.vertices_per_face, 4);
    EXPECT_EQ(o.mesh.indices.end()[-1], o.mesh.indices.end()[-2]);
    EXPECT_TRUE(triangles(o.mesh) == triangles(expected));
}

TEST(Mesh, VerticesSplitOnlyWhereDataDiffer) {
    scene::Primitive p = field(20, 4);
    const auto& m = std::get<scene::PolygonMesh>(p.geometry);
    const size_t corners = m.vertices.size();
    // Continuous face-varying data: no more vertices than points.
    std::vector<float> st;
    const auto& points = p.primvars.find("P")->floats;
    for (const int32_t v : m.vertices)
        st.insert(st.end(), {points[3 * v], points[3 * v + 1]});
    p.primvars.set(floats("st", Type::Float, Detail::FaceVarying, st, 2));
    const Diced whole = run(p, looking(2, 32));
    ASSERT_TRUE(whole.is_mesh);
    EXPECT_EQ(whole.mesh_vertices.vertices(), 21 * 21);
    for (int i = 0; i < whole.mesh_vertices.vertices(); i++) {
        EXPECT_EQ(whole.mesh_vertices.s[i], whole.mesh_vertices.position(i).x);
        EXPECT_EQ(whole.mesh_vertices.t[i], whole.mesh_vertices.position(i).y);
    }
    // A seam along the middle column: its 21 points are there twice.
    for (size_t c = 0; c < corners; c++)
        if ((c / 4) % 20 >= 10)
            st[2 * c] += 5;
    p.primvars.set(floats("st", Type::Float, Detail::FaceVarying, st, 2));
    EXPECT_EQ(run(p, looking(2, 32)).mesh_vertices.vertices(), 22 * 21);
    // A value for every face: nothing is shared.
    std::vector<float> id(400);
    for (size_t i = 0; i < id.size(); i++)
        id[i] = float(i);
    p.primvars.set(floats("id", Type::Float, Detail::Uniform, id));
    const Diced split = run(p, looking(2, 32));
    EXPECT_EQ(split.mesh_vertices.vertices(), 1600);
    for (size_t f = 0; f < 400; f++)
        for (int k = 0; k < 4; k++)
            EXPECT_EQ(split.mesh_vertices.primvars[0].data[split.mesh.indices[4 * f + k]], float(f));
}

TEST(Mesh, NormalsAreGivenOrLeftToTheFaces) {
    scene::Primitive p = field(40, 4);
    const Diced flat = run(p, looking(2, 64));
    for (int i = 0; i < flat.mesh_vertices.vertices(); i++) {
        EXPECT_EQ(flat.mesh_vertices.normal(i), Vec3f(0));
        EXPECT_NEAR(flat.mesh_vertices.Ng[i + 2 * flat.mesh_vertices.stride], 1,
                    0.7f); // vertex normals for shaders
    }
    std::vector<float> n;
    for (int i = 0; i < 41 * 41; i++)
        n.insert(n.end(), {0, 0.6f, 0.8f});
    p.primvars.set(floats("N", Type::Normal, Detail::Vertex, n));
    EXPECT_EQ(run(p, looking(2, 64)).mesh_vertices.normal(7), Vec3f(0, 0.6f, 0.8f));
}

TEST(Mesh, DisplacedAlongVertexNormals) {
    const Diced d = run(field(60, 4), looking(2, 64), [](grid::Grid& g) {
        for (int i = 0; i < g.vertices(); i++)
            for (int c = 0; c < 3; c++)
                g.P[i + c * g.stride] += 0.1f * g.N[i + c * g.stride];
    });
    ASSERT_TRUE(d.is_mesh);
    const Diced before = run(field(60, 4), looking(2, 64));
    for (int i = 0; i < d.mesh_vertices.vertices(); i++)
        EXPECT_NEAR(length(d.mesh_vertices.position(i) - before.mesh_vertices.position(i)), 0.1f, 1e-5f);
}

TEST(Mesh, BadFacesAreDropped) {
    scene::Primitive p = field(30, 3);
    auto values =
        std::vector<float>(p.primvars.find("P")->floats.begin(), p.primvars.find("P")->floats.end());
    values[3 * 100] = NAN;
    p.primvars.set(floats("P", Type::Point, Detail::Vertex, values));
    auto m = std::get<scene::PolygonMesh>(p.geometry);
    std::vector<int32_t> v(m.vertices.begin(), m.vertices.end());
    v[0] = 1000000;
    m.vertices = v;
    p.geometry = m;
    Journal journal;
    const Diced d = dice::dice(p, {}, looking(2, 32), {}, journal);
    ASSERT_TRUE(d.is_mesh);
    EXPECT_EQ(journal.entries().size(), 2u);
    size_t around = 0;
    for (size_t t = 3; t + 2 < v.size(); t += 3)
        around += v[t] == 100 || v[t + 1] == 100 || v[t + 2] == 100;
    EXPECT_EQ(triangles(d.mesh).size(), v.size() / 3 - 1 - around);
    for (const uint32_t i : d.mesh.indices)
        EXPECT_TRUE(std::isfinite(vertex(d, i).x));
    for (const float f : d.mesh_vertices.P)
        ASSERT_TRUE(std::isfinite(f)); // unused vertices too
}

TEST(Mesh, ConcaveQuadsAndHoledPolygonsKeepTheirArea) {
    scene::PolygonMesh m;
    std::vector<int32_t> n, v;
    std::vector<float> p;
    for (int k = 0; k < 20; k++) { // arrow heads of area 1/2, starting at any corner
        const float c[4][2] = {{0, 0}, {1, 1}, {0, 0.5f}, {-1, 1}};
        for (int i = 0; i < 4; i++)
            p.insert(p.end(), {c[(i + k) % 4][0] + 3 * float(k), c[(i + k) % 4][1], 0});
        n.push_back(4);
        v.insert(v.end(), {4 * k, 4 * k + 1, 4 * k + 2, 4 * k + 3});
    }
    m.vertices_per_loop = n;
    m.vertices = v;
    const Diced d = run(primitive(m, p), looking(100, 10));
    ASSERT_TRUE(d.is_mesh);
    double area = 0;
    for (const auto& t : triangles(d.mesh)) {
        const Vec3f c = cross(vertex(d, t[1]) - vertex(d, t[0]), vertex(d, t[2]) - vertex(d, t[0]));
        EXPECT_GT(c.z, 0);
        area += 0.5 * c.z;
    }
    EXPECT_NEAR(area, 10, 1e-5);
}

TEST(Merge, FineSubdivisionBecomesOneMeshOnItsLimit) {
    // A torus cage of 40 x 40 quads in few pixels.
    constexpr int N = 40;
    std::vector<float> p, st;
    std::vector<int32_t> v;
    for (int j = 0; j < N; j++)
        for (int i = 0; i < N; i++) {
            const float a = 2 * Pi * float(i) / N, b = 2 * Pi * float(j) / N, r = 1 + 0.4f * std::cos(b);
            p.insert(p.end(), {r * std::cos(a), r * std::sin(a), 0.4f * std::sin(b)});
            const int i1 = (i + 1) % N, j1 = (j + 1) % N;
            v.insert(v.end(), {j * N + i, j * N + i1, j1 * N + i1, j1 * N + i});
            for (const auto& [x, y] : {std::pair{i, j}, {i + 1, j}, {i + 1, j + 1}, {i, j + 1}})
                st.insert(st.end(), {float(x) / N, float(y) / N});
        }
    scene::SubdivisionMesh m;
    m.vertices_per_face = std::vector<int32_t>(N * N, 4);
    m.vertices = v;
    scene::Primitive prim = primitive(m, p);
    const DiceOptions o = looking(4, 32);
    const Diced d = run(prim, o);
    ASSERT_TRUE(d.is_mesh);
    EXPECT_EQ(d.mesh_vertices.vertices(), N * N);
    EdgeCount edges;
    for (const auto& t : triangles(d.mesh)) {
        std::array<Key, 3> k;
        for (int c = 0; c < 3; c++) {
            const Vec3f q = vertex(d, t[c]);
            k[c] = positive_zero({q.x, q.y, q.z});
        }
        edges.triangle(k[0], k[1], k[2]);
    }
    EXPECT_EQ(edges.open(), 0u);
    for (int i = 0; i < d.mesh_vertices.vertices(); i++) {
        const Vec3f q = d.mesh_vertices.position(i);
        const Vec3f ring = Vec3f(q.x, q.y, 0) / std::hypot(q.x, q.y);
        EXPECT_NEAR(length(q - ring), 0.4f, 0.01f); // the limit lies a little inside its cage
        EXPECT_GT(dot(normalize(d.mesh_vertices.normal(i)), normalize(q - ring)), 0.999f);
    }
    // Texture seams double their vertices, and nothing else.
    prim.primvars.set(floats("st", Type::Float, Detail::FaceVarying, st, 2));
    EXPECT_EQ(run(prim, o).mesh_vertices.vertices(), (N + 1) * (N + 1));
    // The same for any number of threads; a later shape has the same vertices, those of the seams too.
    std::vector<scene::Primitive> later{prim};
    for (scene::Value& value : later[0].primvars.values)
        if (value.name == "P") {
            std::vector<float> shifted(value.floats.begin(), value.floats.end());
            for (size_t i = 0; i < shifted.size(); i += 3)
                shifted[i] += 0.5f;
            value.floats = std::move(shifted);
        }
    DiceTarget moving;
    moving.later = later;
    Diced by_threads[2];
    for (const int threads : {1, 3})
        tasks::with_threads(threads, [&] { by_threads[threads / 3] = run(prim, o, {}, moving); });
    const grid::Grid &one = by_threads[0].mesh_vertices, &three = by_threads[1].mesh_vertices;
    EXPECT_EQ(by_threads[0].mesh.indices, by_threads[1].mesh.indices);
    EXPECT_EQ(one.P, three.P);
    EXPECT_EQ(one.s, three.s);
    ASSERT_EQ(one.later.size(), 1u);
    EXPECT_EQ(one.later[0].P, three.later[0].P);
    for (int i = 0; i < one.vertices(); i++)
        EXPECT_NEAR(one.later[0].P[i] - one.P[i], 0.5f, 1e-6f);
    // Displacement moves it along its normals.
    const Diced moved = run(prim, o, [](grid::Grid& g) {
        for (int i = 0; i < g.vertices(); i++)
            for (int c = 0; c < 3; c++)
                g.P[i + c * g.stride] += 0.1f * g.N[i + c * g.stride];
    });
    for (int i = 0; i < moved.mesh_vertices.vertices(); i++) {
        const Vec3f q = moved.mesh_vertices.position(i);
        EXPECT_NEAR(length(q - Vec3f(q.x, q.y, 0) / std::hypot(q.x, q.y)), 0.5f, 0.01f);
    }
}

TEST(Mesh, SmallTrianglesAreOneGridEach) {
    const Diced d = run(field(10, 3), looking(2, 40));
    ASSERT_FALSE(d.is_mesh);
    EXPECT_EQ(d.grids.size(), 200u);
    double area = 0; // of the triangles as they are
    DiceTarget uniform;
    uniform.shade_uniform = true;
    const Diced whole = run(field(10, 3), looking(2, 40), {}, uniform);
    for (const auto& t : triangles(whole.mesh))
        area += 0.5 * length(cross(vertex(whole, t[1]) - vertex(whole, t[0]),
                                   vertex(whole, t[2]) - vertex(whole, t[0])));
    EXPECT_NEAR(grid_area(d) / area, 1, 1e-4); // nothing folds over
    EXPECT_NEAR(traced_area(d) / area, 1, 1e-4);
    for (const grid::Grid& g : d.grids)
        for (int i = 0; i < g.vertices(); i++)
            EXPECT_NEAR(length(g.normal(i)), 1, 1e-5f);
}
