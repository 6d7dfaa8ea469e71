// Shapes that change: every kind is diced at all steps with one topology, as finely as the finest step needs.
#include <gtest/gtest.h>

#include "dice/density.h"
#include "dice/test_scene.h"

using namespace kanuka;
using namespace kanuka::dice;
using namespace kanuka::dice::test;
using scene::Detail;
using scene::Type;

namespace {

// The primitive with its points moved by a function.
template <class Move>
scene::Primitive moved(scene::Primitive p, Move move) {
    for (scene::Value& v : p.primvars.values)
        if (v.name == "P") {
            std::vector<float> f(v.floats.begin(), v.floats.end());
            for (size_t i = 0; i < f.size(); i += 3) {
                const Vec3f q = move(Vec3f(f[i], f[i + 1], f[i + 2]));
                f[i] = q.x, f[i + 1] = q.y, f[i + 2] = q.z;
            }
            v.floats = std::move(f);
        }
    return p;
}

Diced run(const scene::Primitive& p, std::span<const scene::Primitive> later, const DiceOptions& o,
          const Displace& displace = {}, Journal* journal = nullptr) {
    Journal own;
    DiceTarget target;
    target.later = later;
    return dice::dice(p, target, o, displace, journal ? *journal : own);
}

// What the later step of a diced shape is, as if it were the first.
Diced step(const Diced& d, size_t k) {
    Diced out = d;
    for (grid::Grid& g : out.grids)
        g.P = g.later[k].P, g.N = g.later[k].N;
    for (grid::TracedGrid& t : out.traced)
        t.P = t.later[k];
    if (d.is_mesh)
        out.mesh_vertices.P = d.mesh_vertices.later[k].P, out.mesh_vertices.N = d.mesh_vertices.later[k].N;
    return out;
}

scene::Primitive flat_patch(bool cubic) {
    scene::PatchMesh patch;
    patch.cubic = cubic;
    patch.nu = patch.nv = cubic ? 4 : 2;
    patch.u_basis = patch.v_basis = scene::basis_by_name("bezier");
    std::vector<float> p;
    for (int j = 0; j < patch.nv; j++)
        for (int i = 0; i < patch.nu; i++)
            p.insert(p.end(),
                     {2 * float(i) / float(patch.nu - 1) - 1, 2 * float(j) / float(patch.nv - 1) - 1, 0.0f});
    return primitive(patch, p);
}

scene::Primitive cube(bool subdivision) {
    const std::vector<int32_t> faces = {0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4,
                                        2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5};
    std::vector<float> p;
    for (int k = 0; k < 8; k++)
        p.insert(p.end(), {k & 1 ? 1.0f : -1.0f, k & 2 ? 1.0f : -1.0f, k & 4 ? 1.0f : -1.0f});
    const std::vector<int32_t> sizes(6, 4);
    if (subdivision) {
        scene::SubdivisionMesh m;
        m.vertices_per_face = sizes;
        m.vertices = faces;
        return primitive(m, p);
    }
    scene::PolygonMesh m;
    m.vertices_per_loop = sizes;
    m.vertices = faces;
    return primitive(m, p);
}

} // namespace

// A linear map of the control points is one of every point of the surface, whatever the kind.
TEST(MovingDice, EveryKindFollowsItsPoints) {
    const Transform map = Transform::translate(0.2, -0.1, 0.3) * Transform::rotate(25, 1, 2, 3);
    const auto move = [&](const Vec3f& p) { return map.point(p); };
    for (const scene::Primitive& p : {flat_patch(true), flat_patch(false), cube(true), cube(false)}) {
        const scene::Primitive later[] = {moved(p, move)};
        const Diced d = run(p, later, looking(4, 64));
        ASSERT_FALSE(d.grids.empty());
        for (const grid::Grid& g : d.grids) {
            ASSERT_EQ(g.later.size(), 1u);
            for (int i = 0; i < g.vertices(); i++) {
                const Vec3f want = map.point(g.position(i)), n = map.vector(g.normal(i));
                const size_t s = size_t(g.stride), k = size_t(i);
                const auto& P = g.later[0].P;
                const auto& N = g.later[0].N;
                EXPECT_LT(length(want - Vec3f(P[k], P[k + s], P[k + 2 * s])), 2e-5f);
                EXPECT_GT(dot(normalize(n), normalize(Vec3f(N[k], N[k + s], N[k + 2 * s]))), 0.9999f);
            }
        }
        for (const grid::TracedGrid& t : d.traced)
            EXPECT_EQ(t.later.at(0).size(), t.P.size());
        EXPECT_EQ(shading_edges(step(d, 0)).open(), shading_edges(d).open());
        EXPECT_EQ(traced_edges(step(d, 0)).open(), traced_edges(d).open());
    }
}

namespace {

scene::Primitive quadric(scene::Quadric::Kind kind, std::vector<float> arguments) {
    return primitive(scene::Quadric{kind, std::move(arguments)});
}

// A sheet that is rolled up about y, by so many parts of a whole turn; its last column is then the first.
scene::Primitive rolled(float turn) {
    constexpr int N = 9;
    scene::NuPatch n{};
    n.u_order = 3, n.v_order = 2, n.nu = N, n.nv = 2;
    std::vector<float> knots;
    for (int i = 0; i < N + 3; i++)
        knots.push_back(float(std::clamp(i - 2, 0, N - 2)));
    n.u_knots = knots;
    n.v_knots = std::vector<float>{0, 0, 1, 1};
    n.u_max = N - 2, n.v_max = 1;
    std::vector<float> p;
    for (const float y : {-1.0f, 1.0f})
        for (int i = 0; i < N; i++) {
            const float a = turn == 1 && i == N - 1 ? 0 : turn * 2 * Pi * float(i) / (N - 1);
            p.insert(p.end(), {std::cos(a), y, std::sin(a)});
        }
    return primitive(n, p);
}

// Edges without a neighbour that do not lie on one of two lines around it.
size_t open_seam(const Diced& d, bool rims) {
    const EdgeCount all = traced_edges(d);
    return all.open() -
           (rims ? all.open_if([](const Key& a, const Key& b) { return a[1] == b[1] && std::abs(a[1]) == 1; })
                 : 0);
}

} // namespace

// Sides that meet are joined, whatever else changes; and where they meet for a time alone, nothing shows
// between them then.
TEST(MovingDice, SeamsAreClosedAsOftenAsTheyMeet) {
    using K = scene::Quadric::Kind;
    struct Case {
        const char* what;
        scene::Primitive first, later;
        bool closed_first;
    };
    const Case cases[] = {
        {"a sphere grows", quadric(K::Sphere, {1, -1, 1, 360}),
         quadric(K::Sphere, {1.31f, -1.31f, 1.31f, 360}), true},
        {"a sphere closes", quadric(K::Sphere, {1, -1, 1, 300}), quadric(K::Sphere, {1.1f, -1.1f, 1.1f, 360}),
         false},
        {"a ring grows", quadric(K::Torus, {1, 0.3f, 0, 360, 360}),
         quadric(K::Torus, {1.2f, 0.5f, 0, 360, 360}), true},
        {"a ring closes", quadric(K::Torus, {1, 0.3f, 0, 300, 200}),
         quadric(K::Torus, {1, 0.4f, 0, 360, 360}), false},
        {"a sheet is rolled up", rolled(0.6f), rolled(1), false},
    };
    for (const Case& c : cases)
        for (const int pixels : {40, 200, 600})
            for (const bool uniform : {true, false}) {
                DiceTarget target;
                target.later = {&c.later, 1};
                target.shade_uniform = uniform;
                target.page_from_object = Transform::rotate(20, 0, 1, 0); // leaves y as it is
                DiceOptions o = looking(3, pixels);
                o.camera.page_from_camera = o.camera.page_from_camera * Transform::translate(0.7, 0, 0);
                o.max_grid_cells = 8;
                Journal journal;
                const Diced d = dice::dice(c.first, target, o, {}, journal);
                EXPECT_TRUE(journal.entries().empty()) << c.what;
                const bool rims = std::holds_alternative<scene::NuPatch>(c.first.geometry);
                EXPECT_EQ(open_seam(d, rims) == 0, c.closed_first) << c.what;
                EXPECT_EQ(open_seam(step(d, 0), rims), 0u)
                    << c.what << ", " << pixels << " pixels, uniform " << uniform;
            }
}

// Two sides that meet later are cut alike, as the one that is larger in the picture needs: whichever comes
// first.
TEST(MovingDice, TheLargerOfTwoSidesDecides) {
    const auto sheet = [](float turn, bool turned) {
        scene::Primitive p = rolled(turn);
        const scene::Buffer<float>& own = p.primvars.find("P")->floats;
        std::vector<float> P(own.begin(), own.end());
        for (size_t row = 0; turned && row < 2; row++)
            for (size_t i = 0; i < 4; i++)
                std::swap_ranges(&P[(row * 9 + i) * 3], &P[(row * 9 + i) * 3] + 3, &P[(row * 9 + 8 - i) * 3]);
        p.primvars.set(floats("P", scene::Type::Point, scene::Detail::Vertex, P));
        return p;
    };
    for (const double x : {-1.6, -1.2, 1.2, 1.6}) { // beside it: one side is far nearer than the other
        size_t cells[2];
        for (const bool turned : {false, true}) {
            const scene::Primitive first = sheet(0.6f, turned), later = sheet(1, turned);
            DiceTarget target;
            target.later = {&later, 1};
            DiceOptions o = looking(0.8f, 300);
            o.camera.page_from_camera = o.camera.page_from_camera * Transform::translate(x, 0, 0);
            Journal journal;
            cells[turned] = cell_count(dice::dice(first, target, o, {}, journal));
        }
        EXPECT_EQ(cells[0], cells[1]) << x;
    }
}

// Flat at first, bent later: cut and traced as finely as the bent one.
TEST(MovingDice, TheFinestStepDecides) {
    const scene::Primitive flat = flat_patch(true);
    const scene::Primitive bent[] = {
        moved(flat, [](const Vec3f& p) { return Vec3f(p.x, p.y, p.x * p.x * 2); })};
    const DiceOptions o = looking(4, 256);
    const Diced still = run(flat, {}, o), moving = run(flat, bent, o);
    const Diced late = run(bent[0], {}, o);
    EXPECT_EQ(traced_count(still), still.traced.size());
    EXPECT_GE(traced_count(moving), traced_count(late));
    EXPECT_GE(cell_count(moving), cell_count(late));
    EXPECT_EQ(traced_edges(step(moving, 0)).open(), traced_edges(moving).open());
}

TEST(MovingDice, DisplacementHappensAtEveryStep) {
    const scene::Primitive p = cube(true);
    const scene::Primitive later[] = {moved(p, [](const Vec3f& q) { return q * 1.5f; })};
    const Diced d = run(p, later, looking(4, 64), bumps(0.1f, 5));
    const Diced alone = run(later[0], {}, looking(4, 64), bumps(0.1f, 5));
    EXPECT_EQ(shading_edges(step(d, 0)).open(), 0u);
    EXPECT_EQ(traced_edges(step(d, 0)).open(), 0u);
    EXPECT_NEAR(grid_area(step(d, 0)), grid_area(alone), 0.02 * grid_area(alone));
    EXPECT_GT(grid_area(step(d, 0)), 1.5 * grid_area(d));
}

TEST(MovingDice, MeshesCurvesAndPoints) {
    const auto move = [](const Vec3f& p) { return p + Vec3f(0.5f, 0.1f * p.x, 0); };
    std::vector<scene::Primitive> all;
    std::vector<float> p;
    std::vector<int32_t> v;
    for (int j = 0; j <= 40; j++)
        for (int i = 0; i <= 40; i++)
            p.insert(p.end(), {float(i) / 20 - 1, float(j) / 20 - 1, 0.1f * std::sin(float(i + j))});
    for (int j = 0; j < 40; j++)
        for (int i = 0; i < 40; i++)
            v.insert(v.end(), {j * 41 + i, j * 41 + i + 1, j * 41 + i + 42, j * 41 + i, j * 41 + i + 42,
                               j * 41 + i + 41});
    scene::PolygonMesh mesh;
    mesh.vertices = v;
    all.push_back(primitive(mesh, p));
    scene::Curves curves;
    curves.basis = scene::basis_by_name("bezier");
    curves.vertices_per_curve = std::vector<int32_t>{4, 4};
    all.push_back(primitive(
        curves, {-1, 0, 0, -0.5f, 1, 0, 0.5f, -1, 0, 1, 0, 0, 0, -1, 0, 1, 0, 0, -1, 0.5f, 0, 0, 1, 0}));
    all.back().primvars.set(floats("constantwidth", Type::Float, Detail::Constant, {0.05f}));
    all.push_back(primitive(scene::Points{}, {0, 0, 0, 0.5f, 0.5f, 0}));
    all.back().primvars.set(floats("constantwidth", Type::Float, Detail::Constant, {0.3f}));
    for (const scene::Primitive& first : all) {
        const scene::Primitive later[] = {moved(first, move),
                                          moved(first, [&](const Vec3f& q) { return move(move(q)); })};
        const Diced d = run(first, later, looking(4, 64));
        ASSERT_TRUE(d.is_mesh);
        const grid::Grid& g = d.mesh_vertices;
        ASSERT_EQ(g.later.size(), 2u);
        double mean[3] = {0, 0, 0};
        for (size_t k = 0; k < 3; k++)
            for (int i = 0; i < g.vertices(); i++)
                mean[k] += double((k == 0 ? g.P : g.later[k - 1].P)[size_t(i)]) / g.vertices();
        EXPECT_NEAR(mean[1] - mean[0], 0.5, 1e-3);
        EXPECT_NEAR(mean[2] - mean[1], 0.5, 1e-3);
    }
}

// A concave polygon whose later shape would be cut otherwise; and one that really is another thing.
TEST(MovingDice, OneTopologyForAllSteps) {
    scene::PolygonMesh concave;
    concave.vertices_per_loop = std::vector<int32_t>{5};
    const scene::Primitive arrow = primitive(concave, {-1, -1, 0, 1, -1, 0, 1, 1, 0, 0, -0.5f, 0, -1, 1, 0});
    const scene::Primitive later[] = {
        primitive(concave, {-1, -1, 0, 1, -1, 0, 1, 1, 0, 0, 1.5f, 0, -1, 1, 0})};
    Journal journal;
    const Diced d = run(arrow, later, looking(4, 64), {}, &journal);
    EXPECT_TRUE(journal.entries().empty());
    ASSERT_FALSE(d.grids.empty());
    EXPECT_EQ(d.grids[0].later.size(), 1u);
    scene::PolygonMesh two;
    two.vertices_per_loop = std::vector<int32_t>{4, 4};
    two.vertices = std::vector<int32_t>{0, 1, 2, 3, 0, 3, 4, 1};
    const scene::Primitive other[] = {primitive(two, {-1, -1, 0, 1, -1, 0, 1, 1, 0, 0, 1.5f, 0, -1, 1, 0})};
    const Diced still = run(arrow, other, looking(4, 64), {}, &journal);
    EXPECT_EQ(journal.entries().size(), 1u);
    ASSERT_FALSE(still.grids.empty());
    EXPECT_TRUE(still.grids[0].later.empty());
}

// ---- rates
// --------------------------------------------------------------------------------------------------

// A small square in any direction gets as many micropolygons as it has pixels there.
TEST(Rates, FollowTheProjection) {
    for (const Projection projection : {Projection::Fisheye, Projection::Equisolid, Projection::Spherical}) {
        DiceOptions o;
        o.camera.projection = projection;
        o.camera.half_angle = 2;
        o.camera.width = 1024, o.camera.height = 512;
        o.camera.pixels_per_tangent = 200;
        const Density density({}, o, 1);
        for (const float degrees : {0.0f, 40.0f, 80.0f, 110.0f}) {
            const float a = degrees * Pi / 180;
            // In the picture's middle row; for spherical cameras a latitude.
            const Vec3f d = projection == Projection::Spherical
                                ? Vec3f(0, std::sin(0.7f * a), std::cos(0.7f * a))
                                : Vec3f(std::sin(a), 0, std::cos(a));
            const double pixels_a_steradian =
                200.0 * 200.0 *
                (projection == Projection::Fisheye     ? (a > 0 ? double(a) / std::sin(double(a)) : 1)
                 : projection == Projection::Equisolid ? 1
                                                       : 1 / std::cos(0.7 * double(a)));
            const float got = density.pixels_per_unit(d * 5.0f) * 5;
            EXPECT_NEAR(got * got, pixels_a_steradian, 1e-3 * pixels_a_steradian)
                << int(projection) << " " << degrees;
        }
        // Behind: seen by the spherical camera as well as in front.
        const float behind = density.pixels_per_unit({0, 0, -5}) * 5;
        if (projection == Projection::Spherical)
            EXPECT_NEAR(behind, 200, 1);
        else
            EXPECT_LT(behind, 100);
    }
}

// A thing that comes nearer, or comes into the picture, is diced as it is seen best.
TEST(Rates, TheNearestPoseCounts) {
    DiceTarget target;
    target.also_from = {Transform::translate(0, 0, -2)};
    const DiceOptions o = looking(8, 256);
    EXPECT_FLOAT_EQ(Density(target, o, 1).pixels_per_unit({0, 0, 0}),
                    4 * Density({}, o, 1).pixels_per_unit({0, 0, 0}));
    DiceOptions turning = looking(2, 256);
    turning.camera.also_from = {Transform::translate(0, 0, -2) * Transform::rotate(90, 0, 1, 0)};
    const Vec3f beside{20, 0, -2};
    EXPECT_GT(Density({}, turning, 1).pixels_per_unit(beside),
              3 * Density({}, looking(2, 256), 1).pixels_per_unit(beside));
}
