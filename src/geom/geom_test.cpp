#include "geom/surface.h"

#include "geom/test_surfaces.h"

using namespace kanuka;
using namespace kanuka::geom;
using namespace kanuka::geom::testing;
using scene::Detail;
using scene::Type;

namespace {

// Integral of |dPdu x dPdv| by the midpoint rule: independent of how the surface is diced.
double area(const Surface& s) {
    constexpr int N = 64;
    std::vector<float> t(N);
    for (int i = 0; i < N; i++)
        t[i] = (float(i) + 0.5f) / N;
    double sum = 0;
    for (int f = 0; f < s.faces(); f++) {
        const grid::Grid g = evaluate(s, f, t, t);
        const float du = (g.u[1] - g.u[0]) * N,
                    dv = (g.v[N] - g.v[0]) * N; // derivatives are per unit of u and v
        for (int i = 0; i < g.vertices(); i++) {
            const size_t n = size_t(g.stride);
            const Vec3f a{g.dPdu[i], g.dPdu[i + n], g.dPdu[i + 2 * n]},
                b{g.dPdv[i], g.dPdv[i + n], g.dPdv[i + 2 * n]};
            sum += double(length(cross(a, b))) * du * dv / (N * N);
        }
    }
    return sum;
}

double quadric_area(scene::Quadric::Kind kind, std::vector<float> arguments) {
    return area(*make(primitive(scene::Quadric{kind, std::move(arguments)}, {})));
}

constexpr double D = 3.14159265358979323846;

const std::vector<float> CubePoints{-1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1,
                                    -1, -1, 1,  1, -1, 1,  1, 1, 1,  -1, 1, 1};
const std::vector<int32_t> CubeFaces{0, 3, 2, 1, 4, 5, 6, 7, 0, 1, 5, 4, 1, 2, 6, 5, 2, 3, 7, 6, 3, 0, 4, 7};

scene::SubdivisionMesh cube(std::vector<scene::SubdivisionMesh::Tag> tags = {}) {
    scene::SubdivisionMesh m;
    m.vertices_per_face = std::vector<int32_t>(6, 4);
    m.vertices = CubeFaces;
    m.tags = std::move(tags);
    return m;
}

// Derivatives of a lattice against differences of its positions, relative to their size.
void expect_derivatives(const Surface& s, int face, float tolerance) {
    const float h = 1e-3f;
    for (const float u : {0.13f, 0.5f, 0.81f})
        for (const float v : {0.22f, 0.5f, 0.9f}) {
            const grid::Grid g = evaluate(s, face, {u - h, u, u + h}, {v - h, v, v + h});
            const size_t n = size_t(g.stride);
            const Vec3f du = (g.position(5) - g.position(3)) * (1 / (g.u[5] - g.u[3]));
            const Vec3f dv = (g.position(7) - g.position(1)) * (1 / (g.v[7] - g.v[1]));
            const Vec3f a{g.dPdu[4], g.dPdu[4 + n], g.dPdu[4 + 2 * n]},
                b{g.dPdv[4], g.dPdv[4 + n], g.dPdv[4 + 2 * n]};
            EXPECT_LT(length(du - a), tolerance * (length(a) + 0.1f)) << u << " " << v;
            EXPECT_LT(length(dv - b), tolerance * (length(b) + 0.1f)) << u << " " << v;
            EXPECT_GT(dot(normalize(cross(a, b)), normalize(g.normal(4))) * (s.flips() ? -1 : 1), 0.999f);
        }
}

} // namespace

TEST(Quadrics, AreasIncludingPartialSweeps) {
    using K = scene::Quadric::Kind;
    EXPECT_NEAR(quadric_area(K::Sphere, {2, -2, 2, 360}) / (16 * D), 1, 1e-3);
    EXPECT_NEAR(quadric_area(K::Sphere, {2, -1, 1.5f, 200}) / (2 * D * 2 * 2.5 * 200 / 360), 1, 1e-3);
    EXPECT_NEAR(quadric_area(K::Cylinder, {0.5f, -1, 2, 270}) / (D * 3 * 0.75), 1, 1e-4);
    EXPECT_NEAR(quadric_area(K::Cone, {3, 4, 360}) / (D * 4 * 5), 1, 1e-4);
    EXPECT_NEAR(quadric_area(K::Disk, {1, 2, 90}) / D, 1, 1e-4);
    EXPECT_NEAR(quadric_area(K::Torus, {3, 1, 0, 360, 360}) / (4 * D * D * 3), 1, 1e-4);
    EXPECT_NEAR(quadric_area(K::Torus, {3, 1, 0, 90, 180}) / (D * (3 * D / 2 + 1)), 1, 1e-3);
    // z = x^2 + y^2 up to 1: pi / 6 (5 sqrt(5) - 1).
    EXPECT_NEAR(quadric_area(K::Paraboloid, {1, 0, 1, 360}) / (D / 6 * (5 * std::sqrt(5.0) - 1)), 1, 2e-3);
    // A hyperboloid whose line is parallel to the axis is a cylinder, one that meets it a cone.
    EXPECT_NEAR(quadric_area(K::Hyperboloid, {1, 0, 0, 1, 0, 2, 360}) / (4 * D), 1, 1e-4);
    EXPECT_NEAR(quadric_area(K::Hyperboloid, {1, 0, 0, 0, 0, 1, 360}) / (D * std::sqrt(2.0)), 1, 1e-4);
}

TEST(Quadrics, NormalsPointOutAndDerivativesFit) {
    using K = scene::Quadric::Kind;
    const auto sphere = make(primitive(scene::Quadric{K::Sphere, {1, -1, 1, 360}}, {}));
    const grid::Grid g = evaluate(*sphere, 0);
    for (int i = 0; i < g.vertices(); i++)
        EXPECT_GT(dot(g.normal(i), g.position(i)), 0.9999f); // at the pole too
    for (const auto& q : std::vector<scene::Quadric>{{K::Sphere, {1, -0.8f, 0.9f, 300}},
                                                     {K::Cone, {2, 1, 250}},
                                                     {K::Cylinder, {1, -1, 1, -120}},
                                                     {K::Hyperboloid, {1, 0.5f, 0, 0.2f, 1, 2, 360}},
                                                     {K::Paraboloid, {1, 0.1f, 2, 360}},
                                                     {K::Disk, {0, 1, 360}},
                                                     {K::Torus, {2, 1, 10, 300, 360}}}) {
        const auto s = make(primitive(q, {}), Transform::rotate(40, 1, 2, 3) * Transform::scale(1, 2, 1));
        for (int f = 0; f < s->faces(); f++)
            expect_derivatives(*s, f, 0.01f);
    }
}

TEST(Orientation, MirroringAndReversing) {
    scene::Primitive p = primitive(scene::Quadric{scene::Quadric::Kind::Sphere, {1, -1, 1, 360}}, {});
    for (const bool mirror : {false, true})
        for (const bool reverse : {false, true}) {
            auto a = std::make_shared<scene::Attributes>();
            a->reverse_orientation = reverse;
            p.attributes = a;
            const auto s = make(p, Transform::scale(1, 1, mirror ? -1 : 1));
            EXPECT_EQ(s->flips(), mirror != reverse);
            const grid::Grid g = evaluate(*s, 0, 4);
            EXPECT_GT(dot(g.normal(6), g.position(6)) * (reverse ? -1 : 1), 0.99f);
        }
    // Polygons: the cross product of the sides in object space, outside after mirroring too.
    scene::PolygonMesh quad;
    quad.vertices_per_loop = std::vector<int32_t>{4};
    const scene::Primitive flat = primitive(quad, {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
    EXPECT_GT(evaluate(*make(flat), 0, 1).normal(0).z, 0);
    EXPECT_GT(evaluate(*make(flat, Transform::scale(-1, 1, 1)), 0, 1).normal(0).z, 0);
    EXPECT_LT(evaluate(*make(flat, Transform::scale(1, 1, -1)), 0, 1).normal(0).z, 0);
}

TEST(Subdivision, CubeLimit) {
    const auto s = make(primitive(cube(), CubePoints));
    ASSERT_EQ(s->faces(), 6);
    // Vertex of valence 3: (9 v + 4 sum e + sum f) / 24 = 1/2 of the cage's corner.
    for (int f = 0; f < 6; f++) {
        const grid::Grid g = evaluate(*s, f, 8);
        for (const int i : {0, 8, 72, 80})
            for (int c = 0; c < 3; c++)
                EXPECT_NEAR(abs(g.position(i)[c]), 0.5f, 1e-5f);
        for (int i = 0; i < g.vertices(); i++)
            EXPECT_GT(dot(g.normal(i), g.position(i)), 0);
        expect_derivatives(*s, f, 0.02f);
    }
    // All edges sharp: the cube itself.
    const auto sharp = make(primitive(cube({{"crease", {0, 1, 2, 3, 0}, {10}, {}},
                                            {"crease", {4, 5, 6, 7, 4}, {10}, {}},
                                            {"crease", {0, 4}, {10}, {}},
                                            {"crease", {1, 5}, {10}, {}},
                                            {"crease", {2, 6}, {10}, {}},
                                            {"crease", {3, 7}, {10}, {}}}),
                                      CubePoints));
    EXPECT_NEAR(area(*sharp), 24, 1e-2);
}

TEST(Subdivision, RegularPatchesMatchBsplines) {
    // The middle face of a 3 x 3 net is a uniform bicubic B-spline patch: compare with a PatchMesh of that
    // basis.
    std::vector<float> p;
    std::vector<int32_t> v;
    for (int j = 0; j < 4; j++)
        for (int i = 0; i < 4; i++)
            p.insert(p.end(), {float(i), float(j), float((i * 5 + j * 3) % 4)});
    for (int j = 0; j < 3; j++)
        for (int i = 0; i < 3; i++)
            for (const int k : {j * 4 + i, j * 4 + i + 1, (j + 1) * 4 + i + 1, (j + 1) * 4 + i})
                v.push_back(k);
    scene::SubdivisionMesh m;
    m.vertices_per_face = std::vector<int32_t>(9, 4);
    m.vertices = v;
    scene::PatchMesh patch;
    patch.u_basis = patch.v_basis = scene::basis_by_name("b-spline");
    const auto a = make(primitive(m, p)), b = make(primitive(patch, p));
    ASSERT_EQ(a->faces(), 1); // without interpolateboundary the others have no surface
    const grid::Grid ga = evaluate(*a, 0), gb = evaluate(*b, 0);
    for (int i = 0; i < ga.vertices(); i++) {
        EXPECT_LT(length(ga.position(i) - gb.position(i)), 2e-6f);
        EXPECT_LT(length(normalize(ga.normal(i)) - normalize(gb.normal(i))), 1e-5f);
    }
}

TEST(Subdivision, NgonsAndLoopJoinAcrossSubFaces) {
    // A pentagonal pyramid: five triangles and a pentagon, by both ways of cutting faces.
    std::vector<float> p{0, 0, 1.5f};
    scene::SubdivisionMesh m;
    std::vector<int32_t> sizes, v;
    for (int i = 0; i < 5; i++) {
        p.insert(p.end(), {std::cos(float(i) * 1.2566371f), std::sin(float(i) * 1.2566371f), 0});
        sizes.push_back(3);
        v.insert(v.end(), {0, 1 + i, 1 + (i + 1) % 5});
    }
    sizes.push_back(5);
    v.insert(v.end(), {1, 5, 4, 3, 2});
    m.vertices_per_face = sizes;
    m.vertices = v;
    for (const bool loop : {false, true}) {
        if (loop) { // an octahedron-like shape of triangles alone
            m.scheme = "loop";
            p.insert(p.end(), {0, 0, -1.5f});
            sizes.assign(10, 3);
            v.resize(15);
            for (int i = 0; i < 5; i++)
                v.insert(v.end(), {6, 1 + (i + 1) % 5, 1 + i});
            m.vertices_per_face = sizes;
            m.vertices = v;
        }
        const auto s = make(primitive(m, p));
        const Topology& t = s->topology();
        ASSERT_EQ(s->faces(), loop ? 30 : 20);
        for (int f = 0; f < s->faces(); f++) {
            expect_derivatives(*s, f, 0.03f); // Gregory patches near the irregular vertices
            for (int side = 0; side < 4; side++) {
                const Topology::Side& sd = t.faces[f].sides[side];
                for (const float x : {0.0f, 0.3f, 1.0f}) {
                    float u, w, q[3], r[3];
                    side_position(side, x, u, w);
                    s->positions(f, {&u, 1}, {&w, 1}, q, 1);
                    const float along = sd.reversed ? 1 - x : x;
                    const float e = sd.part == Topology::Part::Whole   ? along
                                    : sd.part == Topology::Part::First ? along / 2
                                                                       : 0.5f + along / 2;
                    s->edge_positions(sd.edge, {&e, 1}, r, 1);
                    EXPECT_LT(length(Vec3f(q[0], q[1], q[2]) - Vec3f(r[0], r[1], r[2])), 1e-5f)
                        << f << " " << side;
                }
            }
        }
    }
}

TEST(Subdivision, HolesBoundariesAndBadTags) {
    Journal journal;
    const auto holed = make(primitive(cube({{"hole", {2, 3}, {}, {}}}), CubePoints));
    EXPECT_EQ(holed->faces(), 4);
    scene::Primitive bad =
        primitive(cube({{"crease", {0, 6}, {2}, {}}, {"corner", {99}, {2}, {}}, {"smoothish", {}, {}, {}}}),
                  CubePoints);
    EXPECT_TRUE(make_surface(bad, {}, journal));
    EXPECT_EQ(journal.entries().size(), 2u);
    // A single quad: nothing without the tag, a flat patch with sharp corners with it.
    scene::SubdivisionMesh one;
    one.vertices_per_face = std::vector<int32_t>{4};
    one.vertices = std::vector<int32_t>{0, 1, 2, 3};
    const std::vector<float> square{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
    Journal again;
    EXPECT_FALSE(make_surface(primitive(one, square), {}, again));
    EXPECT_EQ(again.entries().size(), 1u);
    one.tags = {{"interpolateboundary", {}, {}, {}}};
    EXPECT_NEAR(area(*make(primitive(one, square))), 1, 1e-4);
}

TEST(Nupatch, RationalCylinderIsRound) {
    scene::NuPatch n;
    const float w = std::sqrt(0.5f);
    std::vector<float> pw;
    for (int j = 0; j < 2; j++) {
        const float c[9][3] = {{1, 0, 1},   {1, 1, w},  {0, 1, 1},  {-1, 1, w}, {-1, 0, 1},
                               {-1, -1, w}, {0, -1, 1}, {1, -1, w}, {1, 0, 1}};
        for (const auto& q : c)
            pw.insert(pw.end(), {q[0] * q[2], q[1] * q[2], float(j) * q[2], q[2]});
    }
    n.nu = 9, n.u_order = 3, n.nv = 2, n.v_order = 2;
    n.u_knots = std::vector<float>{0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4};
    n.v_knots = std::vector<float>{0, 0, 1, 1};
    n.u_min = 0, n.u_max = 4, n.v_min = 0, n.v_max = 1;
    scene::Primitive p = primitive(n, {});
    p.primvars.set(value("Pw", Type::HPoint, Detail::Vertex, pw));
    const auto s = make(p);
    ASSERT_EQ(s->faces(), 4);
    EXPECT_EQ(s->topology().edges.size(), 12u); // the seam is one edge
    for (int f = 0; f < 4; f++) {
        const grid::Grid g = evaluate(*s, f);
        for (int i = 0; i < g.vertices(); i++)
            EXPECT_NEAR(std::hypot(g.P[i], g.P[i + g.stride]), 1, 1e-6f);
        expect_derivatives(*s, f, 0.01f);
    }
    EXPECT_NEAR(area(*s) / (2 * D), 1, 1e-4);
    // A part of it.
    n.u_min = 0.5f, n.u_max = 2.5f;
    p.geometry = n;
    EXPECT_EQ(make(p)->faces(), 3);
}

// RISpec 5.3: u_min and u_max are of the knots' range in which all basis functions are there; what is asked
// beyond that is not drawn, and nothing of the rest moves.
TEST(Nupatch, RangesEndWhereTheBasisDoes) {
    scene::NuPatch n;
    n.nu = 6, n.u_order = 4, n.nv = 5, n.v_order = 3;
    n.u_knots = std::vector<float>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
    n.v_knots = std::vector<float>{0, 1, 2, 3, 4, 5, 6, 7};
    std::vector<float> points;
    for (int j = 0; j < 5; j++)
        for (int i = 0; i < 6; i++)
            points.insert(points.end(), {float(i) + 0.1f * float(j * j), float(j), float(i * i - 2 * j)});
    const auto surface = [&](float u0, float u1, float v0, float v1) {
        n.u_min = u0, n.u_max = u1, n.v_min = v0, n.v_max = v1;
        return make(primitive(n, points));
    };
    const auto whole = surface(3, 6, 2, 5);
    for (const auto& wide : {surface(0, 6, 2, 5), surface(3, 9, 2, 5), surface(3, 6, 0, 5),
                             surface(3, 6, 2, 7), surface(-50, 90, -8, 70)}) {
        ASSERT_EQ(wide->faces(), whole->faces());
        for (int f = 0; f < whole->faces(); f++) {
            const grid::Grid a = evaluate(*whole, f, 4), b = evaluate(*wide, f, 4);
            EXPECT_EQ(a.P, b.P) << f;
            EXPECT_EQ(a.dPdu, b.dPdu) << f;
        }
    }
    // Uniform cubic times uniform quadratic: the corner is a mean of the control points around.
    const grid::Grid g = evaluate(*whole, 0, {0, 1}, {0, 1});
    EXPECT_NEAR(g.position(0).x, 1 + 0.1f * 0.5f, 1e-5f);
    EXPECT_NEAR(g.position(0).y, 0.5f, 1e-5f);
}

TEST(PatchMesh, BasesWrapsAndPoles) {
    // Bezier and Hermite describe the same curve: (0, a, b, 3) control points against ends and tangents.
    scene::PatchMesh bezier;
    bezier.u_basis = bezier.v_basis = scene::basis_by_name("bezier");
    std::vector<float> p;
    for (int j = 0; j < 4; j++)
        for (int i = 0; i < 4; i++)
            p.insert(p.end(), {float(i), float(j), float(i * i + j)});
    const auto s = make(primitive(bezier, p));
    expect_derivatives(*s, 0, 0.01f);
    const grid::Grid g = evaluate(*s, 0, {0, 1}, {0, 1});
    EXPECT_EQ(g.position(0), Vec3f(0, 0, 0));
    EXPECT_EQ(g.position(3), Vec3f(3, 3, 12));

    // Periodic B-spline net: its seam is shared.
    scene::PatchMesh tube;
    tube.nu = 6, tube.nv = 4, tube.u_periodic = true;
    tube.u_basis = tube.v_basis = scene::basis_by_name("b-spline");
    p.clear();
    for (int j = 0; j < 4; j++)
        for (int i = 0; i < 6; i++)
            p.insert(p.end(), {std::cos(float(i)), std::sin(float(i)), float(j)});
    const auto t = make(primitive(tube, p));
    EXPECT_EQ(t->faces(), 6);
    EXPECT_EQ(t->topology().edges.size(), 18u);
    EXPECT_EQ(t->topology().faces[0].sides[3].edge, t->topology().faces[5].sides[1].edge);

    // A collapsed side is a pole, and has a normal all the same.
    std::vector<float> cap;
    for (int j = 0; j < 4; j++)
        for (int i = 0; i < 4; i++)
            cap.insert(cap.end(), {(float(i) - 1.5f) * float(j), float(j), 0});
    const auto c = make(primitive(bezier, cap));
    EXPECT_TRUE(c->topology().edges[c->topology().faces[0].sides[0].edge].point);
    const grid::Grid gc = evaluate(*c, 0);
    for (int i = 0; i < gc.vertices(); i++)
        EXPECT_NEAR(gc.normal(i).z, 1, 1e-4f);
    // Height field.
    scene::Primitive h = primitive(bezier, {});
    h.primvars.set(value("Pz", Type::Float, Detail::Vertex, std::vector<float>(16, 2.0f)));
    const grid::Grid gh = evaluate(*make(h), 0, {0, 1}, {0, 1});
    EXPECT_EQ(gh.position(3), Vec3f(1, 1, 2));
}

TEST(Primvars, EveryClassOnEveryKind) {
    // A primvar that repeats the position must come out as the position, by each class that can carry it.
    const auto expect_position = [](const Surface& s, const char* what) {
        for (int f = 0; f < s.faces(); f++) {
            const grid::Grid g = evaluate(s, f, 5);
            ASSERT_EQ(g.primvars.size(), 1u) << what;
            for (int i = 0; i < g.vertices(); i++)
                for (int c = 0; c < 3; c++)
                    EXPECT_NEAR(g.primvars[0].component(c)[i], g.position(i)[c], 1e-5f) << what;
        }
    };
    const Transform m = Transform::translate(1, 2, 3) * Transform::rotate(30, 0, 1, 1);
    std::vector<float> corner_points;
    for (const int32_t v : CubeFaces)
        corner_points.insert(corner_points.end(), &CubePoints[3 * v], &CubePoints[3 * v] + 3);
    scene::PolygonMesh polygons;
    polygons.vertices_per_loop = std::vector<int32_t>(6, 4);
    polygons.vertices = CubeFaces;
    for (const Detail d : {Detail::Vertex, Detail::Varying, Detail::FaceVarying, Detail::FaceVertex}) {
        const bool corners = d == Detail::FaceVarying || d == Detail::FaceVertex;
        scene::Primitive p = primitive(polygons, CubePoints);
        p.primvars.set(value("where", Type::Point, d, corners ? corner_points : CubePoints));
        expect_position(*make(p, m), "polygons");
    }
    scene::Primitive sub = primitive(cube(), CubePoints);
    sub.primvars.set(value("where", Type::Point, Detail::Vertex, CubePoints));
    expect_position(*make(sub, m), "subdivision vertex");
    sub.primvars.set(value("where", Type::Point, Detail::FaceVarying, corner_points));
    auto smooth = cube({{"facevaryinginterpolateboundary", {0}, {}, {}}});
    sub.geometry = smooth; // without seams and linear parts, face-varying data follow the limit surface
    expect_position(*make(sub, m), "subdivision facevarying");

    scene::PatchMesh bilinear;
    bilinear.cubic = false;
    bilinear.nu = 3, bilinear.nv = 2;
    const std::vector<float> net{0, 0, 0, 1, 0, 1, 2, 0, 0, 0, 1, 0, 1, 2, 0, 2, 1, 1};
    for (const Detail d : {Detail::Vertex, Detail::Varying}) {
        scene::Primitive p = primitive(bilinear, net);
        p.primvars.set(value("where", Type::Point, d, net));
        expect_position(*make(p, m), "bilinear patches");
    }
    // Uniform: one value a face, constant on it.
    scene::Primitive p = primitive(bilinear, net);
    p.primvars.set(value("id", Type::Float, Detail::Uniform, {7, 9}));
    const auto s = make(p);
    EXPECT_EQ(evaluate(*s, 0, 3).primvars[0].data[5], 7);
    EXPECT_EQ(evaluate(*s, 1, 3).primvars[0].data[5], 9);
    // Too short: reported and left out.
    Journal journal;
    p.primvars.set(value("id", Type::Float, Detail::Uniform, {7}));
    EXPECT_TRUE(evaluate(*make_surface(p, {}, journal), 0, 3).primvars.empty());
    EXPECT_EQ(journal.entries().size(), 1u);
}

TEST(Primvars, TextureCoordinatesAndNormals) {
    scene::Primitive p = primitive(scene::Quadric{scene::Quadric::Kind::Cylinder, {1, 0, 1, 360}}, {});
    auto a = std::make_shared<scene::Attributes>();
    a->texture_coordinates = {0, 0, 2, 0, 0, 3, 2, 3};
    p.attributes = a;
    const auto s = make(p);
    const grid::Grid g = evaluate(*s, s->faces() - 1, 4);
    EXPECT_FLOAT_EQ(g.s[24], 2);
    EXPECT_FLOAT_EQ(g.t[24], 3);
    p.primvars.set(value("st", Type::Float, Detail::Varying, {0, 0, 1, 0, 0, 1, 1, 1}));
    p.primvars.values.back().array_size = 2;
    EXPECT_FLOAT_EQ(evaluate(*make(p), s->faces() - 1, 4).t[24], 1);
    // Polygons take object-space x and y.
    scene::PolygonMesh quad;
    quad.vertices_per_loop = std::vector<int32_t>{4};
    scene::Primitive flat = primitive(quad, {3, 5, 0, 4, 5, 0, 4, 7, 0, 3, 7, 0});
    const grid::Grid f = evaluate(*make(flat, Transform::translate(100, 0, 0)), 0, 1);
    EXPECT_FLOAT_EQ(f.s[3], 4);
    EXPECT_FLOAT_EQ(f.t[3], 7);
    // Given normals are used, turned by the inverse transpose.
    flat.primvars.set(value("N", Type::Normal, Detail::Vertex, {1, 1, 0, 1, 1, 0, 1, 1, 0, 1, 1, 0}));
    const grid::Grid n = evaluate(*make(flat, Transform::scale(2, 1, 1)), 0, 1);
    EXPECT_FLOAT_EQ(n.normal(0).x / n.normal(0).y, 0.5f);
    EXPECT_EQ(n.Ng[2 * n.stride], 1);
}
