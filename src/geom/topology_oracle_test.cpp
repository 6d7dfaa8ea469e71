// How faces are joined and what polygons are cut to, in whole numbers and by counting.
#include <map>
#include <random>
#include <set>

#include "geom/polygon_faces.h"
#include "geom/test_surfaces.h"
#include "geom/triangulate.h"

namespace kanuka::geom {
namespace {

using namespace testing;

// Sides lie on their edges, edges end at their vertices, and what is one place has one number; so many
// vertices, edges and faces as Euler's formula has for the shape.
void expect_joined(const Surface& s, int euler, const std::string& what) {
    const Topology& t = s.topology();
    std::map<int, Vec3f> where;
    const auto place = [&](int vertex, const Vec3f& p) {
        const auto [it, fresh] = where.try_emplace(vertex, p);
        EXPECT_LT(length(it->second - p), 1e-5f) << what << " vertex " << vertex;
    };
    std::set<int> used;
    for (int f = 0; f < s.faces(); f++)
        for (int side = 0; side < 4; side++) {
            const Topology::Side& sd = t.faces[size_t(f)].sides[size_t(side)];
            const Topology::Edge& e = t.edges[size_t(sd.edge)];
            used.insert(sd.edge);
            for (const float x : {0.0f, 0.3f, 0.5f, 1.0f}) {
                // Sides 0 and 2 run along u, at v = 0 and 1; 3 and 1 along v, at u = 0 and 1.
                const float u = side == 3 ? 0 : side == 1 ? 1 : x, v = side == 0 ? 0 : side == 2 ? 1 : x;
                float p[3], q[3];
                s.positions(f, {&u, 1}, {&v, 1}, p, 1);
                const float along = sd.reversed ? 1 - x : x;
                const float on_edge = sd.part == Topology::Part::Whole   ? along
                                      : sd.part == Topology::Part::First ? along / 2
                                                                         : 0.5f + along / 2;
                s.edge_positions(sd.edge, {&on_edge, 1}, q, 1);
                const Vec3f at(p[0], p[1], p[2]);
                EXPECT_LT(length(at - Vec3f(q[0], q[1], q[2])), 1e-5f)
                    << what << " face " << f << " side " << side;
                if (on_edge == 0)
                    place(e.a, at);
                if (on_edge == 1)
                    place(e.b, at);
                if (on_edge == 0.5f && sd.part != Topology::Part::Whole)
                    place(e.middle, at);
            }
            // Many at once, rising on the edge, as one by one.
            if (sd.part == Topology::Part::Whole) {
                std::vector<float> all, some(60);
                for (int i = 0; i < 20; i++)
                    all.push_back(float(i) / 19);
                s.edge_positions(sd.edge, {all.data(), 20}, some.data(), 20);
                for (size_t i = 0; i < 20; i++) {
                    float q[3];
                    s.edge_positions(sd.edge, {&all[i], 1}, q, 1);
                    for (size_t c = 0; c < 3; c++)
                        EXPECT_NEAR(some[i + 20 * c], q[c], 1e-5f) << what;
                }
            }
        }
    // Places that are different numbers are apart.
    for (auto a = where.begin(); a != where.end(); a++)
        for (auto b = std::next(a); b != where.end(); b++)
            EXPECT_GT(length(a->second - b->second), 1e-4f) << what << " " << a->first << " " << b->first;
    // Halves of an edge are edges between vertices, too; a pole's edges are none.
    int edges = 0;
    for (const int k : used) {
        const Topology::Edge& e = t.edges[size_t(k)];
        edges += e.point ? 0 : e.middle >= 0 && where.count(e.middle) ? 2 : 1;
        EXPECT_EQ(e.point, e.a == e.b && !(length(where.at(e.a) - where.at(e.b)) > 0)) << what;
    }
    EXPECT_EQ(int(where.size()) - edges + s.faces(), euler) << what;
}

scene::Primitive polygons(std::vector<int32_t> sizes, std::vector<int32_t> vertices, std::vector<float> p) {
    scene::PolygonMesh m;
    m.vertices_per_loop = std::move(sizes);
    m.vertices = std::move(vertices);
    return primitive(m, std::move(p));
}

} // namespace

TEST(TopologyOracles, SurfacesAreJoinedWhereTheyMeet) {
    using K = scene::Quadric::Kind;
    const auto quadric = [](K kind, std::vector<float> a) {
        return make(primitive(scene::Quadric{kind, std::move(a)}, {}));
    };
    expect_joined(*quadric(K::Sphere, {1, -1, 1, 360}), 2, "sphere");
    expect_joined(*quadric(K::Sphere, {1, -1, 0.5f, 360}), 1, "cup");
    expect_joined(*quadric(K::Sphere, {1, -1, 1, 250}), 1, "part of a sphere");
    expect_joined(*quadric(K::Cylinder, {1, 0, 1, 360}), 0, "cylinder");
    expect_joined(*quadric(K::Cone, {1, 1, 360}), 1, "cone");
    expect_joined(*quadric(K::Torus, {3, 1, 0, 360, 360}), 0, "torus");
    expect_joined(*quadric(K::Torus, {3, 1, 20, 200, 360}), 0, "gutter");
    expect_joined(*quadric(K::Torus, {3, 1, 0, 360, 100}), 0, "bent pipe");
    // A prism over a pentagon with triangles: quads, a pentagon, five triangles, closed.
    std::vector<float> p;
    std::vector<int32_t> sizes, v;
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < 5; i++)
            p.insert(p.end(), {std::cos(1.2566371f * float(i)), std::sin(1.2566371f * float(i)), float(k)});
    p.insert(p.end(), {0, 0, 1.5f});
    for (int i = 0; i < 5; i++) {
        const int32_t j = (i + 1) % 5;
        sizes.push_back(4), v.insert(v.end(), {i, j, 5 + j, 5 + i});
        sizes.push_back(3), v.insert(v.end(), {5 + j, 10, 5 + i}); // turned on
    }
    sizes.push_back(5), v.insert(v.end(), {4, 3, 2, 1, 0});
    const scene::Primitive tower = polygons(sizes, v, p);
    expect_joined(*make(tower), 2, "tower");
    Journal journal;
    expect_joined(*make_surface(tower, {}, journal, {true}), 2, "tower of small triangles");
    scene::Primitive smooth = primitive(scene::SubdivisionMesh{}, p);
    scene::SubdivisionMesh m;
    m.vertices_per_face = sizes, m.vertices = v;
    smooth.geometry = m;
    expect_joined(*make(smooth), 2, "smooth tower");
    m.vertices_per_face = std::vector<int32_t>(sizes.begin(), sizes.end() - 1);
    m.vertices = std::vector<int32_t>(v.begin(), v.end() - 5);
    m.tags = {{"interpolateboundary", {1}, {}, {}}};
    smooth.geometry = m;
    expect_joined(*make(smooth), 1, "smooth tower without a floor");
    // Nets that are closed by what they say.
    scene::PatchMesh net;
    net.u_basis = net.v_basis = scene::basis_by_name("b-spline");
    net.nu = 5, net.nv = 7;
    std::vector<float> ring;
    for (int j = 0; j < 7; j++)
        for (int i = 0; i < 5; i++) {
            const float a = 1.2566371f * float(i), b = 0.8975979f * float(j), r = 3 + std::cos(a);
            ring.insert(ring.end(), {r * std::cos(b), r * std::sin(b), std::sin(a)});
        }
    for (const bool u : {false, true})
        for (const bool w : {false, true}) {
            net.u_periodic = u, net.v_periodic = w;
            expect_joined(*make(primitive(net, ring)), u || w ? 0 : 1, "net");
        }
}

// Faces as they are counted out by hand, of one loop or several, all alike or not, with numbers that are
// missing.
TEST(TopologyOracles, PolygonFacesAreCountedOut) {
    std::mt19937 g(3);
    const auto pick = [&](int n) { return int(g() % unsigned(n)); };
    for (int round = 0; round < 400; round++) {
        scene::PolygonMesh m;
        const bool several = pick(3) == 0, alike = pick(2), numbered = pick(4) > 0;
        const int faces = 1 + pick(6), same = 3 + pick(2);
        std::vector<int32_t> sizes, loops;
        int need = 0;
        for (int f = 0; f < faces; f++) {
            loops.push_back(1 + pick(3));
            for (int l = 0; l < (several ? loops.back() : 1); l++) {
                sizes.push_back(alike ? same : 3 + pick(4));
                need += sizes.back();
            }
        }
        const int have = std::max(0, need - (pick(2) ? 0 : 1 + pick(8)));
        std::vector<int32_t> vertices;
        for (int i = 0; i < have; i++)
            vertices.push_back(pick(12) - 1); // -1 and from `points` on there are none
        if (numbered && have == 0)
            continue;
        m.vertices_per_loop = sizes;
        if (several)
            m.loops_per_face = loops;
        if (numbered)
            m.vertices = vertices;
        const size_t points = numbered ? 9 : size_t(have);
        const PolygonFaces found(m, points);
        // By hand.
        size_t corner = 0, loop = 0;
        std::vector<std::vector<int>> expected; // first corners of loops and the end
        for (int f = 0; f < faces; f++) {
            std::vector<int> one{int(corner)};
            for (int l = 0; l < (several ? loops[size_t(f)] : 1); l++)
                one.push_back(one.back() + sizes[loop++]);
            if (one.back() > have)
                break;
            corner = size_t(one.back());
            expected.push_back(one);
        }
        ASSERT_EQ(found.count(), expected.size());
        EXPECT_EQ(found.corners(), corner);
        EXPECT_EQ(found.truncated(), expected.size() < size_t(faces));
        for (size_t f = 0; f < expected.size(); f++) {
            EXPECT_EQ(found.loops(f), expected[f]);
            EXPECT_EQ(found.first_corner(f), size_t(expected[f].front()));
            EXPECT_EQ(found.corner_count(f), size_t(expected[f].back() - expected[f].front()));
            EXPECT_EQ(found.one_loop(f), expected[f].size() == 2);
        }
        for (size_t c = 0; c < corner; c++) {
            const int v = numbered ? vertices[c] : int(c);
            EXPECT_EQ(found.vertex(c), v >= 0 && size_t(v) < points ? v : -1);
        }
    }
}

namespace {

int64_t twice_area(const std::vector<std::array<int, 2>>& p) {
    int64_t sum = 0;
    for (size_t i = 0; i < p.size(); i++) {
        const auto &a = p[i], &b = p[(i + 1) % p.size()];
        sum += int64_t(a[0]) * b[1] - int64_t(b[0]) * a[1];
    }
    return sum;
}

} // namespace

// Newell's vector is the polygon's doubled area along the normal of its plane, whichever that is: the cross
// product of the plane's axes, times the area in them. In whole numbers.
TEST(TopologyOracles, NormalsAreTwiceTheArea) {
    std::mt19937 g(8);
    const auto pick = [&](int n) { return int(g() % unsigned(2 * n + 1)) - n; };
    for (int round = 0; round < 500; round++) {
        int64_t axis[3][3]; // origin, two directions
        for (auto& a : axis)
            for (int64_t& x : a)
                x = pick(9);
        std::vector<std::array<int, 2>> outline;
        std::vector<Vec3f> p;
        for (int i = 0; i < 3 + round % 6; i++) {
            outline.push_back({pick(20), pick(20)});
            Vec3f at;
            for (int c = 0; c < 3; c++)
                at[c] = float(axis[0][c] + outline.back()[0] * axis[1][c] + outline.back()[1] * axis[2][c]);
            p.push_back(at);
        }
        const Vec3f n = newell_normal(p.data(), int(p.size()));
        bool turns = true; // every corner to the left
        for (size_t i = 0; i < p.size(); i++)
            turns &= twice_area({outline[i], outline[(i + 1) % p.size()], outline[(i + 2) % p.size()]}) >= 0;
        for (int c = 0; c < 3; c++) {
            const int a = (c + 1) % 3, b = (c + 2) % 3;
            const int64_t across = axis[1][a] * axis[2][b] - axis[1][b] * axis[2][a];
            EXPECT_EQ(n[c], float(across * twice_area(outline)));
        }
        EXPECT_TRUE(!(length(n) > 0) || twice_area(outline) <= 0 ||
                    is_convex(p.data(), int(p.size()), n) == turns);
    }
}

// Star-shaped polygons on whole numbers, in any plane of the axes: pieces turn as they do and have their
// area, to the last unit; convex ones of up to eight corners stay whole.
TEST(TopologyOracles, PiecesHaveThePolygonsArea) {
    std::mt19937 g(4);
    const auto pick = [&](int n) { return int(g() % unsigned(n)); };
    int whole = 0, cut = 0;
    for (int round = 0; round < 600; round++) {
        const int n = 3 + pick(9), axis = pick(3);
        std::vector<std::array<int, 2>> outline;
        const bool round_one = pick(2);
        for (int i = 0; i < n; i++) {
            const double a = 6.283185307179586 * (i + 0.2) / n, r = round_one ? 1000 : 200 + pick(800);
            outline.push_back({int(std::lround(r * std::cos(a))), int(std::lround(r * std::sin(a)))});
        }
        bool convex = true;
        for (size_t i = 0; i < outline.size(); i++)
            convex &= twice_area({outline[i], outline[(i + 1) % outline.size()],
                                  outline[(i + 2) % outline.size()]}) > 0;
        std::vector<float> p;
        std::vector<int32_t> v;
        for (int i = 0; i < n; i++) {
            float at[3];
            at[axis] = 5, at[(axis + 1) % 3] = float(outline[size_t(i)][0]),
            at[(axis + 2) % 3] = float(outline[size_t(i)][1]);
            p.insert(p.end(), at, at + 3);
            v.push_back(i);
            if (pick(5) == 0)
                v.push_back(i); // said twice
        }
        scene::PolygonMesh m;
        m.vertices_per_loop = std::vector<int32_t>{int32_t(v.size())};
        m.vertices = v;
        const scene::Primitive primitive = geom::testing::primitive(m, p);
        const PolygonFaces faces(m, size_t(n));
        for (const bool triangles : {false, true}) {
            Dropped dropped;
            const Pieces pieces = cut_polygons(faces, control_points(primitive, {}), triangles, dropped);
            EXPECT_EQ(dropped.degenerate + dropped.bad_index + dropped.non_finite, 0u);
            int64_t sum = 0;
            for (size_t k = 0; k + 1 < pieces.first.size(); k++) {
                std::vector<std::array<int, 2>> piece;
                for (int c = pieces.first[k]; c < pieces.first[k + 1]; c++)
                    piece.push_back(outline[size_t(v[size_t(pieces.corner[size_t(c)])])]);
                EXPECT_GT(twice_area(piece), 0);
                EXPECT_TRUE(!triangles || piece.size() == 3);
                sum += twice_area(piece);
            }
            EXPECT_EQ(sum, twice_area(outline));
            if (!triangles && convex && n <= 8) {
                EXPECT_EQ(pieces.face.size(), 1u);
                whole++;
            } else if (!triangles) { // pairs of triangles are quads where they make good ones
                EXPECT_LE(pieces.face.size(), size_t(n - 2));
                cut++;
            } else {
                EXPECT_EQ(pieces.face.size(), size_t(n - 2));
            }
        }
    }
    EXPECT_GT(whole, 100);
    EXPECT_GT(cut, 100);
}

} // namespace kanuka::geom
