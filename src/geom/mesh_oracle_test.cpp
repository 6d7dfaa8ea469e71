// Meshes that are traced as they are, points and thin curves: normals, turned quads, parameters, and what is
// done where there would be too many vertices.
#include "geom/test_lattices.h"
#include "geom/test_traced.h"
#include "geom/triangulate.h"

namespace kanuka::geom {
namespace {

using namespace testing;

scene::Primitive points(int count, float width, const std::string& type) {
    std::vector<float> p;
    for (int i = 0; i < count; i++)
        p.insert(p.end(), {float(3 * i), float(i), float(-i)});
    scene::Primitive out = primitive(scene::Points{}, p);
    out.primvars.set(value("constantwidth", Type::Float, Detail::Constant, {width}));
    scene::Value name;
    name.name = "type", name.type = Type::String, name.detail = Detail::Constant;
    name.strings = std::vector<std::string>{type};
    out.primvars.set(name);
    return out;
}

// Straight ones, eight micropolygons a cut: each segment as long as its number of cuts says.
scene::Primitive straight(const std::vector<std::vector<int>>& cuts) {
    scene::Curves c;
    c.cubic = false;
    std::vector<int32_t> sizes;
    std::vector<float> p;
    for (size_t i = 0; i < cuts.size(); i++) {
        float x = 0;
        p.insert(p.end(), {x, float(i), 0});
        for (int n : cuts[i])
            p.insert(p.end(), {x += 8 * float(n) - 4, float(i), 0});
        sizes.push_back(int32_t(cuts[i].size()) + 1);
    }
    c.vertices_per_curve = sizes;
    scene::Primitive out = primitive(c, p);
    out.primvars.set(value("constantwidth", Type::Float, Detail::Constant, {0.1f}));
    return out;
}

} // namespace

// Normals of vertices are the sums of their faces' vector areas, in double; none where there is no area. Both
// of triangles and of quads, some of which are triangles.
TEST(MeshOracles, VertexNormalsGoByArea) {
    Random random(5);
    for (const int per : {3, 4})
        for (const bool flips : {false, true}) {
            constexpr size_t Vertices = 60, Faces = 101;
            MeshParts parts;
            allocate_mesh(parts, Vertices, Primvars());
            grid::Grid& g = parts.vertices;
            const size_t n = size_t(g.stride);
            std::vector<std::array<double, 3>> p(Vertices), sum(Vertices, {0, 0, 0});
            for (size_t i = 0; i < Vertices; i++)
                for (size_t c = 0; c < 3; c++)
                    p[i][c] = double(g.P[i + c * n] = 2 * random.one() - 1);
            parts.mesh.vertices_per_face = per;
            for (size_t f = 0; f < Faces; f++) {
                std::vector<uint32_t> q; // the last two vertices are in no face
                while (q.size() < size_t(per)) {
                    const auto i = uint32_t(random.one() * float(Vertices - 2));
                    if (std::find(q.begin(), q.end(), i) == q.end())
                        q.push_back(i);
                }
                if (per == 4 && f % 3 == 0)
                    q[3] = q[2];
                parts.mesh.indices.insert(parts.mesh.indices.end(), q.begin(), q.end());
                if (per == 4 && q[3] == q[2])
                    q.pop_back();
                std::array<double, 3> area{}; // half the sum of cross products around the face
                for (size_t k = 0; k < q.size(); k++) {
                    const auto &a = p[q[k]], &b = p[q[(k + 1) % q.size()]];
                    for (size_t c = 0; c < 3; c++)
                        area[c] += (a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3]) / 2;
                }
                for (const uint32_t i : q)
                    for (size_t c = 0; c < 3; c++)
                        sum[i][c] += area[c];
            }
            std::vector<float> normals;
            vertex_normals(g, parts.mesh, flips, normals);
            for (size_t i = 0; i < Vertices; i++) {
                const double l = std::hypot(sum[i][0], sum[i][1], sum[i][2]);
                for (size_t c = 0; c < 3; c++)
                    EXPECT_NEAR(normals[i + c * n], l > 0 ? (flips ? -1 : 1) * sum[i][c] / l : 0, 1e-5);
            }
        }
}

// Quads with a reflex corner, whichever it is: their two triangles, as they are traced, do not overlap.
TEST(MeshOracles, ConcaveQuadsAreTurned) {
    Random random(11);
    for (const bool mirrored : {false, true}) {
        std::vector<float> p;
        std::vector<int32_t> index;
        constexpr int Quads = 64;
        for (int f = 0; f < Quads; f++)
            for (int k = 0; k < 4; k++) { // an arrow: the third corner lies inside of the other three
                const int corner = (k + f) % 4;
                const float x[4] = {0, 2, 0.3f + 0.3f * random.one(), 0},
                            y[4] = {0, 0, 0.3f + 0.3f * random.one(), 2};
                p.insert(p.end(), {x[corner], y[corner], float(f)});
                index.push_back(4 * f + k);
            }
        scene::PolygonMesh m;
        m.vertices_per_loop = std::vector<int32_t>(Quads, 4);
        m.vertices = index;
        MeshParts out;
        Journal journal;
        const Transform turn = Transform::rotate(40, 1, 2, 3) * Transform::scale(mirrored ? -3 : 3, 3, 3);
        ASSERT_TRUE(mesh_from_polygons(primitive(m, p), m, turn, false, journal, out));
        ASSERT_EQ(out.mesh.indices.size(), size_t(4 * Quads));
        const Vec3f up = turn.vector({0, 0, mirrored ? -1.0f : 1.0f});
        for (size_t f = 0; f < out.mesh.indices.size(); f += 4) {
            const auto q = [&](size_t k) { return out.vertices.position(int(out.mesh.indices[f + k])); };
            EXPECT_GT(dot(cross(q(1) - q(0), q(3) - q(0)), up), 0) << f / 4;
            EXPECT_GT(dot(cross(q(3) - q(2), q(1) - q(2)), up), 0) << f / 4;
        }
    }
}

// Flat triangles have one normal, of length one, to the outside: mirrored, reversed and of any size.
TEST(MeshOracles, TrianglesHaveUnitNormals) {
    for (const bool mirrored : {false, true})
        for (const bool reversed : {false, true}) {
            scene::PolygonMesh m;
            m.vertices_per_loop = std::vector<int32_t>{3};
            m.vertices = std::vector<int32_t>{0, 1, 2};
            scene::Primitive p = primitive(m, {0, 0, 1, 3, 0, 1, 0, 5, 1});
            auto attributes = std::make_shared<scene::Attributes>();
            attributes->reverse_orientation = reversed;
            p.attributes = attributes;
            const auto s = make(p, Transform::scale(mirrored ? -2 : 2, 2, 2));
            for (int f = 0; f < s->faces(); f++) {
                const grid::Grid g = evaluate(*s, f, 4);
                for (size_t i = 0; i < size_t(g.vertices()); i++) {
                    // Counterclockwise in object space is its outside, whichever way that is placed.
                    const Vec3f n = at(g.Ng, i, size_t(g.stride));
                    EXPECT_LT(length(n - Vec3f(0, 0, reversed ? -1.0f : 1.0f)), 1e-6f)
                        << mirrored << reversed;
                }
            }
        }
}

// Whether a polygon is convex does not go by its size.
TEST(MeshOracles, ConvexAtAnySize) {
    for (const float size : {1e-9f, 1e-4f, 1.0f, 1e4f, 1e6f, 1e15f}) {
        const auto convex = [&](float dent) { // of a side of the unit square
            const Vec3f p[5] = {{0, 0, 0}, {0.5f, dent, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
            Vec3f q[5];
            for (int i = 0; i < 5; i++)
                q[i] = p[i] * size;
            return is_convex(q, 5, newell_normal(q, 5));
        };
        EXPECT_TRUE(convex(-0.1f)) << size;
        EXPECT_TRUE(convex(0)) << size;
        EXPECT_TRUE(convex(1e-8f)) << size; // as straight as single precision can say
        EXPECT_FALSE(convex(1e-4f)) << size;
        EXPECT_FALSE(convex(0.1f)) << size;
    }
}

// u and v of disks and squares lie over their square, v from the top; squares are turned counterclockwise and
// as much wider than high as they say.
TEST(PointOracles, FlatOnesHaveParameters) {
    for (const bool square : {false, true}) {
        scene::Primitive p = points(3, 1.5f, square ? "patch" : "disk");
        p.primvars.set(value("patchangle", Type::Float, Detail::Constant, {30}));
        p.primvars.set(value("patchaspectratio", Type::Float, Detail::Constant, {2.5f}));
        Eye eye;
        eye.pixels = 10;
        MeshParts out;
        Journal journal;
        ASSERT_TRUE(mesh_from_points(p, {}, eye, true, journal, out));
        const grid::Grid& g = out.vertices;
        const int each = g.vertices() / 3;
        const double angle = square ? std::acos(-1.0) / 6 : 0, higher = square ? 1 / 2.5 : 1;
        for (int i = 0; i < g.vertices(); i++) {
            const size_t v = size_t(i);
            const Vec3f q = g.position(i) - Vec3f(3 * float(i / each), float(i / each), -float(i / each));
            EXPECT_EQ(q.z, 0);
            const double across = 2 * double(g.u[v]) - 1, up = 1 - 2 * double(g.v[v]);
            if (square) {
                EXPECT_EQ(std::abs(across), 1);
                EXPECT_EQ(std::abs(up), 1);
            } else {
                EXPECT_NEAR(std::hypot(across, up), i % each ? 1 : 0, 1e-6);
            }
            // A polygon of the disk's area: wider than its circle by the same factor all round.
            const double n = each - 1, turn = 2 * std::acos(-1.0) / n;
            const double radius = 0.75 * (square ? 1 : std::sqrt(turn / std::sin(turn)));
            const double x = radius * across, y = radius * up * higher;
            EXPECT_NEAR(q.x, x * std::cos(angle) - y * std::sin(angle), 1e-6);
            EXPECT_NEAR(q.y, x * std::sin(angle) + y * std::cos(angle), 1e-6);
            EXPECT_EQ(g.s[v], g.u[v]);
            EXPECT_EQ(g.t[v], g.v[v]);
            EXPECT_LT(length(at(g.N, v, size_t(g.stride)) - Vec3f(0, 0, 1)), 1e-6f);
        }
    }
}

// Balls of too many vertices are made of fewer, the largest first, and the journal says so: of octahedra cut
// in four l times there are 4^(l + 1) + 2.
TEST(PointOracles, TooManyVerticesMakeThemCoarser) {
    scene::Primitive p = points(10, 1, "sphere");
    std::vector<float> width; // 100 pixels, and 2
    for (int i = 0; i < 10; i++)
        width.push_back(i < 5 ? 2.0f : 0.04f);
    p.primvars.set(value("width", Type::Float, Detail::Vertex, width));
    Eye eye;
    eye.pixels = 100;
    const auto vertices = [](int big, int small) {
        return 5 * ((4 << 2 * big) + 2) + 5 * ((4 << 2 * small) + 2);
    };
    for (const auto& [most, big, small] : {std::tuple{double(1 << 25), 4, 1},
                                           {double(vertices(4, 1)), 4, 1},
                                           {double(vertices(4, 1) - 1), 3, 1},
                                           {double(vertices(3, 1)), 3, 1},
                                           {double(vertices(2, 1)), 2, 1},
                                           {double(vertices(1, 1)) - 1, 0, 0},
                                           {1.0, 0, 0}}) {
        eye.most = most;
        MeshParts out;
        Journal journal;
        ASSERT_TRUE(mesh_from_points(p, {}, eye, true, journal, out));
        EXPECT_EQ(out.vertices.vertices(), vertices(big, small)) << most;
        EXPECT_EQ(out.mesh.indices.size(), 5 * 24 * size_t((1 << 2 * big) + (1 << 2 * small)));
        EXPECT_EQ(journal.entries().size(), big < 4 ? 1u : 0u);
    }
}

// Curves of too many vertices are not made, and that is said; but there may always be four times as many as
// two rings for each end of a segment.
TEST(CurveOracles, TooManyVertices) {
    for (const auto& [first, most, made] : {std::tuple{18, 0.0, true},
                                            {19, 0.0, false},
                                            {19, 40.0, false},
                                            {19, 41.0, true},
                                            {100, 121.0, false},
                                            {100, 122.0, true}}) {
        // Two and three ends: 4 * 2 * 5 vertices, whatever the budget.
        const scene::Primitive p = straight({{first}, {10, 10}});
        Eye eye;
        eye.most = most;
        MeshParts out;
        Journal journal;
        const auto& c = std::get<scene::Curves>(p.geometry);
        EXPECT_EQ(mesh_from_curves(p, c, {}, eye, false, journal, out), made) << first << " " << most;
        EXPECT_EQ(out.too_many, !made) << first << " " << most;
        if (made) {
            EXPECT_EQ(out.vertices.vertices(), first + 1 + 21) << most;
        }
    }
}

// Ribbons thinner than a micropolygon are one quad across.
TEST(CurveOracles, ThinRibbons) {
    scene::Primitive p = straight({{3}});
    p.primvars.set(value("N", Type::Normal, Detail::Varying, {0, 0, 1, 0, 0, 1}));
    const MeshParts out = curves(p, Eye());
    const grid::Grid& g = out.vertices;
    ASSERT_EQ(g.vertices(), 2 * 4);
    ASSERT_EQ(out.mesh.vertices_per_face, 4);
    double area = 0;
    for (size_t f = 0; f < out.mesh.indices.size(); f += 4) {
        const auto q = [&](size_t k) { return g.position(int(out.mesh.indices[f + k])); };
        const Vec3f n = cross(q(2) - q(0), q(3) - q(1));
        EXPECT_GT(n.z, 0);
        area += 0.5 * double(length(n));
    }
    EXPECT_NEAR(area, 20 * 0.1, 1e-5);
}

// Of a wavy net of 7 x 7 points the limit of each edge is that of the faces beside it, at its ends (b + 4 a +
// c) / 6 in either direction.
TEST(MeshOracles, EdgesOfRegularFaces) {
    constexpr int N = 7;
    scene::SubdivisionMesh m;
    std::vector<float> p;
    std::vector<int32_t> v;
    const auto z = [](int i, int j) { return 0.3f * std::sin(float(3 * i + j * j)); };
    for (int j = 0; j < N; j++)
        for (int i = 0; i < N; i++)
            p.insert(p.end(), {float(i), float(j), z(i, j)});
    for (int j = 0; j + 1 < N; j++)
        for (int i = 0; i + 1 < N; i++)
            v.insert(v.end(), {j * N + i, j * N + i + 1, j * N + N + i + 1, j * N + N + i});
    m.vertices_per_face = std::vector<int32_t>((N - 1) * (N - 1), 4);
    m.vertices = v;
    const auto s = make(primitive(m, p));
    const float t[5] = {0, 0.2f, 0.5f, 0.9f, 1}, back[5] = {1, 0.8f, 0.5f, 0.1f, 0}, zero = 0, one = 1;
    int inside = 0;
    for (int f = 0; f < s->faces(); f++)
        for (int side = 0; side < 4; side++) {
            const Topology::Side& sd = s->topology().faces[size_t(f)].sides[size_t(side)];
            const Line along{sd.reversed ? back : t, 5}, at{side == 0 || side == 3 ? &zero : &one, 1};
            float on_edge[15], on_face[15];
            s->edge_positions(sd.edge, {t, 5}, on_edge, 5);
            s->positions(f, side % 2 ? at : along, side % 2 ? along : at, on_face, 5);
            for (int k = 0; k < 15; k++)
                EXPECT_NEAR(on_edge[k], on_face[k], 2e-6f) << f << " " << side;
            const int i = int(std::lround(on_edge[0])), j = int(std::lround(on_edge[5]));
            if (i < 1 || j < 1 || i > N - 2 || j > N - 2)
                continue;
            const auto row = [&](int b) { return (z(i - 1, b) + 4 * z(i, b) + z(i + 1, b)) / 6; };
            EXPECT_NEAR(on_edge[10], (row(j - 1) + 4 * row(j) + row(j + 1)) / 6, 2e-6f);
            inside++;
        }
    EXPECT_GT(inside, 60);
}

} // namespace kanuka::geom
