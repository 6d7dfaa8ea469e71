// What traced vertices stand off by: areas against closed forms, and who must not move.
#include <gtest/gtest.h>

#include "dice/test_coverage.h"
#include "dice/test_scene.h"

using namespace kanuka;
using namespace kanuka::dice;
using namespace kanuka::dice::test;
using scene::Quadric;

namespace {

Diced run(const scene::Primitive& p, int pixels, float rate, bool uniform, const Displace& displace = {},
          const Transform& place = {}) {
    DiceOptions o = looking(2, pixels);
    o.shading_rate_scale = rate;
    o.camera.projection = Projection::Orthographic;
    DiceTarget target;
    target.shade_uniform = uniform;
    target.page_from_object = place;
    Journal journal;
    return dice::dice(p, target, o, displace, journal);
}

double area(const Diced& d) {
    double sum = 0;
    for (const auto& t : traced_triangles(d, 0))
        sum += length(cross(t[1] - t[0], t[2] - t[0])) / 2;
    return sum;
}

// Of the shading lattice, whose vertices lie on the surface, at the traced steps.
double area_on_surface(Diced d) {
    for (size_t k = 0; k < d.traced.size(); k++) {
        grid::TracedGrid& t = d.traced[k];
        const grid::Grid& g = d.grids[k];
        for (int j = 0; j <= t.mv; j++)
            for (int i = 0; i <= t.mu; i++) {
                const Vec3f p = g.position(j * t.step_v * (g.nu + 1) + i * t.step_u);
                for (int c = 0; c < 3; c++)
                    t.P[3 * size_t(j * (t.mu + 1) + i) + size_t(c)] = p[c];
            }
    }
    return area(d);
}

} // namespace

// The mean silhouette of a convex body is a quarter of its surface (Cauchy).
TEST(Outline, MeanSilhouettesOfConvexShapes) {
    const Transform flattened = Transform::scale(1, 1, 0.5);
    // An oblate spheroid: 2 pi a^2 (1 + (1 - e^2) / e atanh e).
    const double e = std::sqrt(0.75), spheroid = 2 * 3.14159265358979 * (1 + 0.25 / e * std::atanh(e));
    for (const int pixels : {24, 60, 200})
        for (const bool uniform : {false, true}) {
            const float rate = uniform ? 1 : 16;
            const scene::Primitive ball = primitive(Quadric{Quadric::Kind::Sphere, {1, -1, 1, 360}});
            const Diced round = run(ball, pixels, rate, uniform),
                        flat = run(ball, pixels, rate, uniform, {}, flattened);
            for (const auto& [d, exact] : {std::pair(&round, 4 * 3.14159265358979), {&flat, spheroid}}) {
                const double off = area(*d) / exact - 1, before = area_on_surface(*d) / exact - 1;
                EXPECT_LT(before, -0.0005) << "the test would see nothing, " << pixels;
                EXPECT_LT(std::abs(off), 0.2 * std::abs(before)) << pixels << " pixels, uniform " << uniform;
            }
        }
}

// Their own lines, too: the border of a disk, and whatever meets it there goes along.
TEST(Outline, BordersStandOffAsLinesDo) {
    for (const int pixels : {60, 100, 200}) { // fewer: a mesh, whose border stays
        const Diced disk = run(primitive(Quadric{Quadric::Kind::Disk, {0, 1, 360}}), pixels, 1, true),
                    tube = run(primitive(Quadric{Quadric::Kind::Cylinder, {1, 0, 1, 360}}), pixels, 1, true);
        const double before = area_on_surface(disk) / 3.14159265358979 - 1,
                     off = area(disk) / 3.14159265358979 - 1;
        EXPECT_LT(before, -0.001) << "the test would see nothing, " << pixels;
        EXPECT_LT(std::abs(off), 0.3 * std::abs(before)) << pixels;
        double farthest = 0;
        size_t found = 0;
        for (const auto& t : traced_triangles(tube, 0))
            for (const D3& p : t) {
                if (p.z != 0)
                    continue;
                double nearest = 9;
                for (const auto& s : traced_triangles(disk, 0))
                    for (const D3& q : s)
                        nearest = std::min(nearest, length(p - q));
                farthest = std::max(farthest, nearest);
                EXPECT_GT(length(p), 1.0002);
                found++;
            }
        EXPECT_GT(found, 16u);
        EXPECT_LT(farthest, 1e-5) << "a cap that does not meet its tube, " << pixels << " pixels";
    }
}

TEST(Outline, WhatIsFlatOrDisplacedStays) {
    scene::PatchMesh mesh;
    mesh.u_basis = mesh.v_basis = scene::basis_by_name("bezier");
    std::vector<float> p;
    for (int j = 0; j < 4; j++)
        for (int i = 0; i < 4; i++)
            p.insert(p.end(), {0.5f * i - 0.7f + 0.02f * float(i * j), 0.4f * j - 0.6f, 0.3f});
    const auto expect_same = [](const Diced& d, const char* what) {
        ASSERT_FALSE(d.traced.empty());
        for (size_t k = 0; k < d.traced.size(); k++) {
            const grid::TracedGrid& t = d.traced[k];
            const grid::Grid& g = d.grids[k];
            for (int j = 1; j < t.mv; j++)
                for (int i = 1; i < t.mu; i++)
                    for (int c = 0; c < 3; c++)
                        ASSERT_EQ(t.P[3 * size_t(j * (t.mu + 1) + i) + size_t(c)],
                                  g.position(j * t.step_v * (g.nu + 1) + i * t.step_u)[c])
                            << what;
            for (const auto& [from, to] :
                 {std::pair{0, 0}, {t.mu, g.nu}, {t.mv * (t.mu + 1), g.nv * (g.nu + 1)}})
                for (int c = 0; c < 3; c++)
                    ASSERT_EQ(t.P[3 * size_t(from) + size_t(c)], g.position(to)[c]) << what;
        }
    };
    DiceOptions o = looking(2, 200);
    o.geometry_tolerance = 0;
    Journal journal;
    expect_same(dice::dice(primitive(mesh, p), {}, o, {}, journal), "a flat patch");
    const Displace up = [](grid::Grid& g) {
        for (int i = 0; i < g.vertices(); i++)
            g.P[i] += 0.125f;
    };
    const scene::Primitive ball = primitive(Quadric{Quadric::Kind::Sphere, {1, -1, 1, 360}});
    expect_same(dice::dice(ball, {}, o, up, journal), "a displaced sphere");
}
