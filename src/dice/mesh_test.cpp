// Meshes finer than the rate, curves and points.
#include <gtest/gtest.h>
#include <set>

#include "base/tasks.h"
#include "dice/test_scene.h"

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

Vec3f vertex(const Diced& d, uint32_t i) {
    return d.mesh_vertices.position(int(i));
}

// The triangles that are traced, each starting at its lowest vertex: quads as (0, 1, 3) and (2, 3, 1).
std::multiset<std::array<uint32_t, 3>> triangles(const grid::TracedMesh& m) {
    std::multiset<std::array<uint32_t, 3>> out;
    const auto add = [&](uint32_t a, uint32_t b, uint32_t c) {
        if (a == b || b == c || c == a)
            return;
        std::array<uint32_t, 3> t{a, b, c};
        std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
        out.insert(t);
    };
    for (size_t f = 0; f < m.indices.size(); f += m.vertices_per_face) {
        const uint32_t* q = &m.indices[f];
        if (m.vertices_per_face == 3) {
            add(q[0], q[1], q[2]);
        } else {
            add(q[0], q[1], q[3]);
            add(q[2], q[3], q[1]);
        }
    }
    return out;
}

Diced run(const scene::Primitive& p, const DiceOptions& o, const Displace& displace = {},
          DiceTarget target = {}) {
    Journal journal;
    Diced d = dice::dice(p, target, o, displace, journal);
    EXPECT_TRUE(journal.entries().empty()) << journal.entries()[0].message;
    return d;
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
