#include "dice/dice.h"

#include <cstring>
#include <gtest/gtest.h>

#include "base/tasks.h"
#include "dice/test_dicing.h"

using namespace kanuka;
using namespace kanuka::dice;
using namespace kanuka::dice::test;
using scene::Detail;
using scene::Type;

namespace {

scene::Primitive sphere(float radius = 1, float rate = 1) {
    return primitive(scene::Quadric{scene::Quadric::Kind::Sphere, {radius, -radius, radius, 360}}, {}, rate);
}

scene::Primitive cube(bool subdivision, std::vector<scene::SubdivisionMesh::Tag> tags = {}) {
    const std::vector<float> p{-1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1,
                               -1, -1, 1,  1, -1, 1,  1, 1, 1,  -1, 1, 1};
    const std::vector<int32_t> v{0, 3, 2, 1, 4, 5, 6, 7, 0, 1, 5, 4, 1, 2, 6, 5, 2, 3, 7, 6, 3, 0, 4, 7};
    const std::vector<int32_t> n(6, 4);
    if (subdivision) {
        scene::SubdivisionMesh m;
        m.vertices_per_face = n;
        m.vertices = v;
        m.tags = std::move(tags);
        return primitive(std::move(m), p);
    }
    scene::PolygonMesh m;
    m.vertices_per_loop = n;
    m.vertices = v;
    return primitive(std::move(m), p);
}

void expect_closed(const Diced& d) {
    const EdgeCount shading = shading_edges(d), traced = traced_edges(d);
    EXPECT_GT(shading.all(), 0u);
    EXPECT_EQ(shading.open(), 0u) << "of " << shading.all() << " shading edges";
    EXPECT_EQ(traced.open(), 0u) << "of " << traced.all() << " traced edges";
}

} // namespace

TEST(Dice, SphereIsClosedAndRound) {
    const Diced d = run(sphere(), looking(3, 512));
    expect_closed(d);
    for (const grid::Grid& g : d.grids)
        for (int i = 0; i < g.vertices(); i++) {
            ASSERT_NEAR(length(g.position(i)), 1, 1e-6f);
            ASSERT_GT(dot(normalize(g.normal(i)), g.position(i)), 0.99999f);
        }
    EXPECT_NEAR(grid_area(d), 4 * Pi, 0.01);
    EXPECT_LT(traced_count(d), cell_count(d) / 4);
}

TEST(Dice, DisplacedShapesStayClosed) {
    const DiceOptions o = looking(3, 512);
    expect_closed(run(sphere(), o, bumps(0.05f, 9)));
    expect_closed(run(cube(true), o, bumps(0.1f, 9)));
    expect_closed(run(cube(true, {{"crease", {0, 1, 5, 4, 0}, {4}, {}}, {"corner", {6}, {10}, {}}}), o,
                      bumps(0.1f, 9)));
    expect_closed(run(cube(false), o, bumps(0.1f, 9)));
}

TEST(Dice, NearAndOffCentreShapesStayClosed) {
    for (const float distance : {1.01f, 1.2f, 0.5f, 0.0f}) {
        DiceOptions o = looking(distance, 100);
        o.camera.page_from_camera =
            Transform::translate(0.3, 0.2, -distance) * Transform::rotate(25, 1, 1, 0);
        expect_closed(run(sphere(), o));
        expect_closed(run(cube(true), o, bumps(0.02f, 20)));
        expect_closed(run(cube(false), o));
    }
}

namespace {

scene::Primitive quad(std::vector<float> p, float rate = 1) {
    scene::PolygonMesh m;
    m.vertices_per_loop = std::vector<int32_t>{4};
    return primitive(m, std::move(p), rate);
}

scene::Primitive torus_net(bool cubic) {
    scene::PatchMesh m;
    m.cubic = cubic;
    m.nu = 7, m.nv = 5;
    m.u_periodic = m.v_periodic = true;
    m.u_basis = m.v_basis = scene::basis_by_name("b-spline");
    std::vector<float> p;
    for (int j = 0; j < 5; j++)
        for (int i = 0; i < 7; i++) {
            const float a = float(i) * 2 * Pi / 7, b = float(j) * 2 * Pi / 5, r = 1 + 0.5f * std::cos(b);
            p.insert(p.end(), {r * std::cos(a), r * std::sin(a), 0.5f * std::sin(b)});
        }
    return primitive(m, p);
}

// A pyramid over a pentagon: triangles and an n-gon.
scene::Primitive pyramid(bool subdivision) {
    std::vector<float> p{0, 0, 1};
    std::vector<int32_t> n, v;
    for (int i = 0; i < 5; i++) {
        p.insert(p.end(), {std::cos(float(i) * 1.2566371f), std::sin(float(i) * 1.2566371f), 0});
        n.push_back(3);
        v.insert(v.end(), {0, 1 + i, 1 + (i + 1) % 5});
    }
    n.push_back(5);
    v.insert(v.end(), {1, 5, 4, 3, 2});
    if (subdivision) {
        scene::SubdivisionMesh m;
        m.vertices_per_face = n;
        m.vertices = v;
        return primitive(m, p);
    }
    scene::PolygonMesh m;
    m.vertices_per_loop = n;
    m.vertices = v;
    return primitive(m, p);
}

float distance_to_triangle(const Vec3f& p, const Vec3f& a, const Vec3f& b, const Vec3f& c) {
    // Inside, by barycentric coordinates of the foot point; else the nearest side.
    const Vec3f ab = b - a, ac = c - a, n = cross(ab, ac);
    const float n2 = length_squared(n);
    if (n2 > 0) {
        const float v = dot(cross(p - a, ac), n) / n2, w = dot(cross(ab, p - a), n) / n2;
        if (v >= 0 && w >= 0 && v + w <= 1)
            return abs(dot(p - a, n)) / std::sqrt(n2);
    }
    float best = std::numeric_limits<float>::infinity();
    const Vec3f corners[4] = {a, b, c, a};
    for (int k = 0; k < 3; k++) {
        const Vec3f e = corners[k + 1] - corners[k];
        const float l2 = length_squared(e);
        const float t = l2 > 0 ? std::clamp(dot(p - corners[k], e) / l2, 0.0f, 1.0f) : 0;
        best = std::min(best, length(p - corners[k] - e * t));
    }
    return best;
}

// Largest distance, in pixels, of a shading vertex from the traced cells around it.
float worst_distance(const Diced& d, const DiceOptions& o) {
    float worst = 0;
    for (size_t k = 0; k < d.grids.size(); k++) {
        const grid::Grid& g = d.grids[k];
        const grid::TracedGrid& t = d.traced[k];
        const auto at = [&](int i, int j) {
            const float* p = &t.P[3 * size_t(j * (t.mu + 1) + i)];
            return Vec3f{p[0], p[1], p[2]};
        };
        for (int j = 0; j <= g.nv; j++)
            for (int i = 0; i <= g.nu; i++) {
                const Vec3f p = g.position(j * (g.nu + 1) + i);
                float best = std::numeric_limits<float>::infinity();
                const int ci = i / t.step_u, cj = j / t.step_v,
                          reach = std::max(t.edge_step[0] / t.step_u, 1) + 1;
                for (int y = std::max(0, cj - reach); y < std::min(t.mv, cj + reach); y++)
                    for (int x = std::max(0, ci - reach); x < std::min(t.mu, ci + reach); x++) {
                        best = std::min(best, distance_to_triangle(p, at(x, y), at(x + 1, y), at(x, y + 1)));
                        best = std::min(
                            best, distance_to_triangle(p, at(x + 1, y + 1), at(x, y + 1), at(x + 1, y)));
                    }
                const Vec3f eye = o.camera.page_from_camera.point({0, 0, 0});
                worst = std::max(worst, best * o.camera.pixels_per_tangent / (p.z - eye.z));
            }
    }
    return worst;
}

} // namespace

TEST(Dice, EveryKindIsClosedDisplacedOrNot) {
    DiceOptions o = looking(3, 300);
    o.camera.page_from_camera = Transform::rotate(20, 1, 0, 0) * Transform::translate(0, 0, -3);
    for (const Displace& displace : {Displace{}, bumps(0.04f, 15)}) {
        expect_closed(run(torus_net(true), o, displace));
        expect_closed(run(torus_net(false), o, displace));
        expect_closed(run(pyramid(false), o, displace));
        expect_closed(run(pyramid(true), o, displace));
        expect_closed(
            run(primitive(scene::Quadric{scene::Quadric::Kind::Torus, {1, 0.4f, 0, 360, 360}}), o, displace));
    }
}

TEST(Dice, CollapsedAndTinyEdgesStayClosed) {
    // A cube squeezed so flat that most edges have a single cell, seen from near.
    scene::Primitive p = cube(true);
    DiceTarget thin;
    thin.page_from_object = Transform::scale(1, 0.002, 1);
    expect_closed(run(p, looking(1.3f, 400), bumps(0.001f, 10), thin));
    expect_closed(run(pyramid(false), looking(2, 400), {}, thin));
    thin.page_from_object = Transform::scale(1, 1, 0.001) * Transform::rotate(90, 0, 1, 0);
    expect_closed(run(sphere(), looking(0.4f, 400), {}, thin));
}

TEST(Dice, DisplacedBoundariesShareNormals) {
    const Diced d = run(sphere(), looking(3, 200), [](grid::Grid& g) {
        for (int i = 0; i < g.vertices(); i++) // each grid tilts its normals another way
            g.N[i] += 0.2f * std::sin(float(g.nu * 7 + g.nv) + g.P[0] * 50);
    });
    std::map<Key, Vec3f> seen;
    size_t shared = 0;
    for (const grid::Grid& g : d.grids)
        for (int i = 0; i < g.vertices(); i++) {
            const int x = i % (g.nu + 1), y = i / (g.nu + 1);
            if (x > 0 && x < g.nu && y > 0 && y < g.nv)
                continue;
            const Vec3f p = g.position(i), n = g.normal(i);
            const auto [at, fresh] = seen.try_emplace(positive_zero({p.x, p.y, p.z}), n);
            if (!fresh) {
                shared++;
                EXPECT_TRUE(at->second == n);
            }
        }
    EXPECT_GT(shared, 100u);
}

TEST(Dice, HugeGroundThroughTheCameraIsBounded) {
    const DiceOptions o = looking(0, 1024);
    for (const float height : {-1.7f, -0.01f, 0.0f}) {
        const float r = 1e5f;
        const Diced d = run(quad({-r, height, -r, r, height, -r, r, height, r, -r, height, r}), o);
        EXPECT_GT(cell_count(d), 1000u);
        EXPECT_LT(cell_count(d), 20000000u) << height;
        for (const grid::Grid& g : d.grids)
            for (const float p : g.P)
                ASSERT_TRUE(std::isfinite(p));
    }
}

TEST(Dice, UniformMaterialsAskForShapeAlone) {
    DiceTarget uniform;
    uniform.shade_uniform = true;
    const DiceOptions o = looking(3, 1024);
    const Diced d = run(sphere(), o, {}, uniform);
    expect_closed(d);
    EXPECT_LT(cell_count(d), cell_count(run(sphere(), o)) / 20);
    EXPECT_NEAR(traced_area(d), 4 * Pi, 0.02 * 4 * Pi);
    // Displacement needs the full rate whatever the material.
    EXPECT_EQ(cell_count(run(sphere(), o, bumps(0.01f, 30), uniform)), cell_count(run(sphere(), o)));
    // A cylinder is straight along v.
    for (const grid::Grid& g :
         run(primitive(scene::Quadric{scene::Quadric::Kind::Cylinder, {1, 0, 1, 360}}), o, {}, uniform).grids)
        EXPECT_EQ(g.nv, 1);
    // A twisted quad is not flat though all its sides are straight.
    EXPECT_GT(cell_count(run(quad({-1, -1, -1, 1, -1, 1, 1, 1, -1, -1, 1, 1}), o, {}, uniform)), 64u);
}

TEST(Dice, TracedGeometryKeepsItsTolerance) {
    for (const float tolerance : {0.1f, 0.25f, 1.0f}) {
        DiceOptions o = looking(4, 300);
        o.geometry_tolerance = tolerance;
        o.normal_tolerance = 30; // so that distance decides
        size_t cells = 0, traced = 0;
        for (const Displace& displace : {Displace{}, bumps(0.02f, 8), bumps(0.01f, 40)})
            for (const scene::Primitive& p : {sphere(), cube(true), torus_net(true)}) {
                const Diced d = run(p, o, displace);
                EXPECT_LE(worst_distance(d, o), tolerance * 1.01f);
                cells += cell_count(d);
                traced += traced_count(d);
            }
        EXPECT_LT(traced, cells * 0.8);
    }
    // Normals: inside the grids no fine cell turns away from its traced triangle by more than the tolerance.
    DiceOptions o = looking(3, 512);
    o.geometry_tolerance = 100;
    o.normal_tolerance = 5;
    const Diced d = run(sphere(), o);
    EXPECT_LT(traced_count(d), cell_count(d) / 2);
    for (size_t k = 0; k < d.grids.size(); k++) {
        const grid::Grid& g = d.grids[k];
        const grid::TracedGrid& t = d.traced[k];
        for (int j = 1; j + 1 < t.mv; j++)
            for (int i = 1; i + 1 < t.mu; i++) {
                const auto at = [&](int a, int b) {
                    return g.position((j * t.step_v + b) * (g.nu + 1) + i * t.step_u + a);
                };
                const Vec3f coarse = cross(at(t.step_u, 0) - at(0, 0), at(0, t.step_v) - at(0, 0));
                const Vec3f fine = cross(at(1, 1) - at(0, 0), at(0, 1) - at(1, 0));
                EXPECT_GT(dot(normalize(coarse), normalize(fine)), std::cos(5.01f * Pi / 180));
            }
    }
    auto rough = sphere();
    auto a = std::make_shared<scene::Attributes>();
    a->dice_flatness = false;
    rough.attributes = a;
    const Diced full = run(rough, o);
    EXPECT_EQ(traced_count(full), cell_count(full));
}

TEST(Dice, SameForAnyNumberOfThreads) {
    const auto bytes = [](const Diced& d) {
        std::string all;
        const auto add = [&](const std::vector<float>& v) {
            all.append((const char*)v.data(), v.size() * sizeof(float));
        };
        for (const grid::Grid& g : d.grids)
            for (const auto* v : {&g.P, &g.N, &g.Ng, &g.dPdu, &g.dPdv, &g.u, &g.v, &g.s, &g.t})
                add(*v);
        for (const grid::TracedGrid& t : d.traced)
            add(t.P);
        return all;
    };
    std::string once[2];
    for (int threads = 1; threads <= 2; threads++)
        tasks::with_threads(threads, [&] {
            DiceOptions o = looking(1.5f, 512);
            for (const scene::Primitive& p : {sphere(), cube(true), pyramid(true), torus_net(true)})
                once[threads - 1] += bytes(run(p, o, bumps(0.05f, 12)));
        });
    EXPECT_EQ(once[0].size(), once[1].size());
    EXPECT_TRUE(once[0] == once[1]);
}

TEST(Dice, PrimvarsFollowCollapsedEdges) {
    // A quad whose far side has fewer cells: moved vertices carry the data of where they went.
    scene::Primitive p = quad({-1, -1, 0, 1, -1, 0, 0.1f, 1, 0, -0.1f, 1, 0});
    p.primvars.set(
        floats("where", Type::Point, Detail::Vertex, {-1, -1, 0, 1, -1, 0, 0.1f, 1, 0, -0.1f, 1, 0}));
    const Diced d = run(p, looking(2, 128));
    size_t moved = 0;
    for (const grid::Grid& g : d.grids) {
        moved += g.edge_cells[grid::VMax] < g.nu;
        for (int i = 0; i < g.vertices(); i++)
            for (int c = 0; c < 3; c++)
                EXPECT_NEAR(g.primvars[0].component(c)[i], g.position(i)[c], 1e-5f);
    }
    EXPECT_GT(moved, 0u);
}

TEST(Dice, BadDisplacementIsReportedAndUndone) {
    Journal journal;
    const Diced d =
        run(sphere(), looking(3, 100), [](grid::Grid& g) { g.P[g.nu / 2 + g.nu + 1] = NAN; }, {}, &journal);
    ASSERT_EQ(journal.entries().size(), 1u);
    EXPECT_EQ(journal.entries()[0].where.line, 1);
    expect_closed(d);
    for (const grid::Grid& g : d.grids)
        for (int i = 0; i < g.vertices(); i++)
            EXPECT_NEAR(length(g.position(i)), 1, 1e-5f);
}

TEST(Dice, HostileTransformsAndSizesEnd) {
    Journal journal;
    for (const Transform& m : {Transform::scale(0, 1, 1), Transform::scale(1e20, 1e20, 1e20),
                               Transform::scale(1e-30, 1, 1), Transform::scale(1e38, 1e38, 1e38)})
        for (const scene::Primitive& p : {sphere(), cube(true), cube(false), torus_net(true)}) {
            DiceTarget t;
            t.page_from_object = m;
            DiceOptions o = looking(3, 100);
            o.max_micropolygons = 100000;
            const Diced d = dice::dice(p, t, o, {}, journal);
            EXPECT_LE(cell_count(d), 200000u);
        }
    // Far too fine: coarser, and said so.
    DiceOptions o = looking(3, 1000);
    o.max_micropolygons = 50000;
    const Diced d = dice::dice(sphere(1, 1e-2f), {}, o, {}, journal);
    EXPECT_LT(cell_count(d), 60000u);
    EXPECT_GT(cell_count(d), 5000u);
    expect_closed(d);
    bool told = false;
    for (const auto& e : journal.entries())
        told |= e.message.find(" micropolygons; they were made ") != std::string::npos;
    EXPECT_TRUE(told);
}
