// What a surface loses where its input makes no sense: that alone.
#include <cmath>
#include <random>

#include "geom/test_surfaces.h"

using namespace kanuka;
using namespace kanuka::geom;
using namespace kanuka::geom::testing;
using scene::Detail;
using scene::Type;

// One control point that is no number takes the patches along that it is of, and no others: of a periodic
// b-spline net those that have it among their sixteen.
TEST(BadInput, PatchesBesideAreKept) {
    scene::PatchMesh tube;
    tube.nu = 9, tube.nv = 8, tube.u_periodic = true;
    tube.u_basis = tube.v_basis = scene::basis_by_name("b-spline");
    std::vector<float> p, uniform;
    for (int j = 0; j < 8; j++)
        for (int i = 0; i < 9; i++)
            p.insert(p.end(), {std::cos(float(i) * 0.698f), std::sin(float(i) * 0.698f), float(j)});
    for (int f = 0; f < 9 * 5; f++)
        uniform.push_back(float(f));
    std::vector<float> broken = p;
    constexpr int I = 1, J = 2;
    broken[3 * (J * 9 + I) + 1] = NAN;
    const auto with = [&](const std::vector<float>& points) {
        scene::Primitive out = primitive(tube, points);
        out.primvars.set(value("number", Type::Float, Detail::Uniform, uniform));
        return out;
    };
    Journal journal;
    const auto whole = make_surface(with(p), {}, journal), s = make_surface(with(broken), {}, journal);
    ASSERT_TRUE(whole && s);
    ASSERT_EQ(journal.entries().size(), 1u);
    EXPECT_NE(journal.entries()[0].message.find("12 of 45 patches"), std::string::npos);
    std::vector<int> left;
    for (int j = 0; j < 5; j++)
        for (int i = 0; i < 9; i++)
            if (!((I - i + 9) % 9 < 4 && J >= j && J < j + 4))
                left.push_back(j * 9 + i);
    ASSERT_EQ(s->faces(), int(left.size()));
    for (size_t f = 0; f < left.size(); f++) {
        EXPECT_EQ(s->uniform_index(int(f)), left[f]);
        const grid::Grid a = evaluate(*s, int(f), {0, 0.5f, 1}, {0, 1}),
                         b = evaluate(*whole, left[f], {0, 0.5f, 1}, {0, 1});
        for (int i = 0; i < a.vertices(); i++) {
            EXPECT_EQ(a.position(i), b.position(i));
            EXPECT_EQ(a.v[size_t(i)], b.v[size_t(i)]);
        }
        EXPECT_EQ(a.primvars[0].data[0], float(left[f]));
    }
    // Neighbours that are left still share their edges.
    size_t sides = 0;
    for (const auto& face : s->topology().faces)
        for (const auto& side : face.sides)
            sides += side.edge >= 0;
    EXPECT_EQ(sides, 4 * left.size());
    EXPECT_LT(s->topology().edges.size(), 3 * left.size());
}

// A control point of a NURBS patch reaches over as many knot spans as its order has, each way; the others are
// as if nothing were wrong. Knots are simple, but for a double one inside.
TEST(BadInput, KnotSpansBesideAreKept) {
    constexpr int Nu = 9, Nv = 6, OrderU = 4, OrderV = 3, I = 2, J = 1;
    scene::NuPatch patch;
    patch.nu = Nu, patch.u_order = OrderU, patch.nv = Nv, patch.v_order = OrderV;
    patch.u_knots = std::vector<float>{0, 1, 2, 3, 4, 5, 5, 6, 7, 8, 9, 10, 11};
    patch.v_knots = std::vector<float>{0, 0, 0, 1, 2, 3, 4, 4, 4};
    patch.u_min = 3, patch.u_max = 8, patch.v_min = 0, patch.v_max = 4;
    std::vector<float> pw, uniform;
    for (int j = 0; j < Nv; j++)
        for (int i = 0; i < Nu; i++)
            pw.insert(pw.end(), {float(i), float(j), float(i * j % 3), 1 + 0.1f * float((i + j) % 2)});
    // Spans between 3, 4, 5, 6, 7, 8: the last of their knots, for each.
    const std::vector<int> last_u{3, 4, 6, 7, 8}, last_v{2, 3, 4, 5};
    for (size_t j = 0; j < last_v.size(); j++) // one for the empty span between 5 and 5, too
        for (float f : {0.0f, 1.0f, -1.0f, 2.0f, 3.0f, 4.0f})
            uniform.push_back(f < 0 ? f : float(j * last_u.size()) + f);
    for (const size_t component : {0u, 2u, 3u})
        for (const float bad : {NAN, INFINITY, 1e30f}) {
            std::vector<float> broken = pw;
            broken[4 * (J * Nu + I) + component] = component == 3 ? 0 : bad;
            const auto with = [&](const std::vector<float>& points) {
                scene::Primitive out = primitive(patch, {});
                out.primvars.set(value("Pw", Type::HPoint, Detail::Vertex, points));
                out.primvars.set(value("number", Type::Float, Detail::Uniform, uniform));
                return out;
            };
            std::vector<int> left;
            for (size_t j = 0; j < last_v.size(); j++)
                for (size_t i = 0; i < last_u.size(); i++)
                    if (I <= last_u[i] - OrderU || I > last_u[i] || J <= last_v[j] - OrderV || J > last_v[j])
                        left.push_back(int(j * last_u.size() + i));
            Journal journal;
            const auto whole = make_surface(with(pw), {}, journal),
                       s = make_surface(with(broken), {}, journal);
            ASSERT_TRUE(whole && s);
            ASSERT_EQ(whole->faces(), 20);
            ASSERT_EQ(journal.entries().size(), 1u);
            EXPECT_EQ(journal.entries()[0].message.find(std::to_string(20 - left.size()) +
                                                        " of 20 knot spans of a NURBS patch"),
                      0u)
                << journal.entries()[0].message;
            ASSERT_EQ(s->faces(), int(left.size()));
            for (size_t f = 0; f < left.size(); f++) {
                EXPECT_EQ(uniform[size_t(s->uniform_index(int(f)))], float(left[f]));
                const grid::Grid a = evaluate(*s, int(f), {0, 0.5f, 1}, {0, 1}),
                                 b = evaluate(*whole, left[f], {0, 0.5f, 1}, {0, 1});
                EXPECT_EQ(a.P, b.P);
                EXPECT_EQ(a.u, b.u);
                EXPECT_EQ(a.primvars[0].data[0], float(left[f]));
            }
            for (const double u : {0.05, 0.3, 0.98})
                for (const double v : {0.1, 0.9}) { // trim curves are measured here
                    const Vec3f p = s->at_parameters(u, v), q = whole->at_parameters(u, v);
                    EXPECT_TRUE(std::isfinite(p.x + p.y + p.z));
                    if (u > 0.9) {
                        EXPECT_EQ(p, q);
                    }
                }
        }
}

TEST(BadInput, FacesThatAreThereAlready) {
    scene::SubdivisionMesh m;
    m.vertices_per_face = std::vector<int32_t>(6, 3); // a tetrahedron, and two of its faces again
    m.vertices = std::vector<int32_t>{0, 2, 1, 0, 1, 3, 2, 1, 0, 1, 2, 3, 0, 3, 2, 0, 1, 3};
    Journal journal;
    const auto s = make_surface(primitive(m, {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}), {}, journal);
    ASSERT_TRUE(s);
    ASSERT_EQ(journal.entries().size(), 1u);
    EXPECT_NE(journal.entries()[0].message.find("2 of 6 subdivision faces have the vertices of another one"),
              std::string::npos)
        << journal.entries()[0].message;
}

// Faces joined anyhow, with sharp edges and corners: whatever is left of them can be evaluated.
TEST(BadInput, SharpEdgesOfTornMeshes) {
    std::mt19937 g(11);
    const auto pick = [&](int n) { return int(g() % unsigned(n)); };
    int whole = 0;
    for (int round = 0; round < 1500; round++) {
        const int points = 3 + pick(8), faces = 2 + pick(20), sides = 3 + pick(2);
        scene::SubdivisionMesh m;
        std::vector<int32_t> sizes, vertices;
        for (int f = 0; f < faces; f++) {
            sizes.push_back(sides);
            for (int k = 0; k < sides; k++)
                vertices.push_back(pick(points));
        }
        m.vertices_per_face = sizes, m.vertices = vertices;
        if (round % 3 > 0) // without, boundaries only guide
            m.tags = {{"interpolateboundary", {pick(3)}, {}, {}},
                      {"crease", {0, 1, 2}, {2.5f}, {}},
                      {"crease", {pick(points), pick(points)}, {10}, {}},
                      {"corner", {pick(points)}, {3}, {}}};
        std::vector<float> p;
        for (int i = 0; i < 3 * points; i++)
            p.push_back(float(pick(2000)) / 1000 - 1);
        Journal journal;
        const auto s = make_surface(primitive(m, p), {}, journal);
        for (int f = 0; s && f < s->faces(); f++)
            whole += std::isfinite(evaluate(*s, f, 2).P[0]);
    }
    EXPECT_GT(whole, 1000);
}

TEST(BadInput, IsReportedAndDropped) {
    scene::PolygonMesh m;
    m.vertices_per_loop = std::vector<int32_t>{3, 3, 3, 3, 4};
    m.vertices = std::vector<int32_t>{0, 1, 2, 0, 1, 99, 0, 0, 1, 0, 1, 4, 0, 1};
    scene::Primitive p = primitive(m, {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, NAN, 0, 0});
    p.where = {"a.rib", 7, 3};
    Journal journal;
    const auto s = make_surface(p, {}, journal);
    ASSERT_TRUE(s);
    EXPECT_EQ(s->faces(), 3); // of one triangle
    ASSERT_EQ(journal.entries().size(), 3u);
    for (const auto& e : journal.entries())
        EXPECT_EQ(e.where.line, 7);
    for (scene::Geometry g :
         {scene::Geometry(scene::PatchMesh{}), scene::Geometry(scene::NuPatch{4, 4, 4, 4}),
          scene::Geometry(scene::Quadric{scene::Quadric::Kind::Torus, {1, 2}}),
          scene::Geometry(scene::SubdivisionMesh{}), scene::Geometry(scene::PolygonMesh{})}) {
        EXPECT_FALSE(make_surface(primitive(g, {}), {}, journal));
        EXPECT_FALSE(make_surface(primitive(g, {0, NAN, 0}), {}, journal));
    }
}
