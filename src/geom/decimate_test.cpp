#include "geom/decimate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

namespace kanuka::geom {
namespace {

Vec3f on_sphere(double theta, double phi) {
    return {float(std::sin(phi) * std::cos(theta)), float(std::sin(phi) * std::sin(theta)),
            float(std::cos(phi))};
}
ColoredMesh sphere(uint32_t nu, uint32_t nv) {
    ColoredMesh m;
    for (uint32_t j = 1; j < nv; j++)
        for (uint32_t i = 0; i < nu; i++)
            m.points.push_back(on_sphere(2 * M_PI * i / nu, M_PI * j / nv));
    const auto at = [&](uint32_t i, uint32_t j) { return (j - 1) * nu + i % nu; };
    const uint32_t top = uint32_t(m.points.size()), bottom = top + 1;
    m.points.push_back({0, 0, 1}), m.points.push_back({0, 0, -1});
    for (uint32_t i = 0; i < nu; i++) {
        for (uint32_t j = 1; j + 1 < nv; j++)
            m.triangles.insert(m.triangles.end(), {at(i, j), at(i, j + 1), at(i + 1, j), at(i + 1, j),
                                                   at(i, j + 1), at(i + 1, j + 1)});
        m.triangles.insert(m.triangles.end(),
                           {top, at(i, 1), at(i + 1, 1), bottom, at(i + 1, nv - 1), at(i, nv - 1)});
    }
    m.colors.assign(m.points.size(), Vec3f(0.5f));
    return m;
}
// A unit square whose left half is black and whose right half is white.
ColoredMesh square(uint32_t n) {
    ColoredMesh m;
    for (uint32_t j = 0; j <= n; j++)
        for (uint32_t i = 0; i <= n; i++) {
            m.points.push_back({float(i) / float(n), float(j) / float(n), 0});
            m.colors.push_back(Vec3f(2 * i < n ? 0.0f : 1.0f));
        }
    for (uint32_t j = 0; j < n; j++)
        for (uint32_t i = 0; i < n; i++) {
            const uint32_t v = j * (n + 1) + i;
            m.triangles.insert(m.triangles.end(), {v, v + 1, v + n + 1, v + 1, v + n + 2, v + n + 1});
        }
    return m;
}
size_t edges_without_two_faces(const ColoredMesh& m) {
    std::map<std::pair<uint32_t, uint32_t>, int> count;
    for (size_t t = 0; t < m.triangles.size(); t += 3)
        for (size_t k = 0; k < 3; k++) {
            const uint32_t a = m.triangles[t + k], b = m.triangles[t + (k + 1) % 3];
            count[{std::min(a, b), std::max(a, b)}]++;
        }
    size_t bad = 0;
    for (const auto& [edge, n] : count)
        bad += n != 2;
    return bad;
}
double area(const ColoredMesh& m) {
    double sum = 0;
    for (size_t t = 0; t < m.triangles.size(); t += 3) {
        const Vec3f p = m.points[m.triangles[t]];
        sum +=
            0.5 * double(length(cross(m.points[m.triangles[t + 1]] - p, m.points[m.triangles[t + 2]] - p)));
    }
    return sum;
}
size_t steps_to(const Decimation& d, size_t faces, size_t wanted) {
    size_t n = 0;
    for (; n < d.steps().size() && faces > wanted; n++)
        faces -= d.steps()[n].faces;
    return n;
}

TEST(Decimate, AClosedSurfaceStaysClosedHoweverFewFacesAreLeft) {
    const ColoredMesh mesh = sphere(96, 48);
    const Decimation d(mesh, {});
    for (const size_t wanted : {6000, 1000, 100, 20, 4}) {
        const ColoredMesh left = d.after(mesh, steps_to(d, mesh.triangles.size() / 3, wanted));
        EXPECT_LE(left.triangles.size() / 3, std::max<size_t>(wanted, 8));
        EXPECT_EQ(edges_without_two_faces(left), 0u) << wanted;
    }
}

TEST(Decimate, PointsStayWithinTheError) {
    const ColoredMesh mesh = sphere(128, 64);
    for (const float error : {0.1f, 0.01f, 0.002f}) {
        const Decimation d(mesh, {.error = error});
        const ColoredMesh left = d.after(mesh, d.steps().size());
        EXPECT_LT(left.triangles.size(), mesh.triangles.size() / 2) << error;
        EXPECT_LE(d.steps().back().error, error);
        // A face's middle is the farthest from the sphere.
        for (size_t t = 0; t < left.triangles.size(); t += 3) {
            const Vec3f c = (left.points[left.triangles[t]] + left.points[left.triangles[t + 1]] +
                             left.points[left.triangles[t + 2]]) *
                            (1.0f / 3);
            EXPECT_NEAR(length(c), 1.0f, 1.5f * error + 0.001f);
        }
    }
}

TEST(Decimate, ErrorsNeverFall) {
    const ColoredMesh mesh = sphere(32, 16);
    const Decimation d(mesh, {});
    for (size_t i = 1; i < d.steps().size(); i++) {
        EXPECT_GE(d.steps()[i].cost, d.steps()[i - 1].cost);
        EXPECT_GE(d.steps()[i].error, d.steps()[i - 1].error);
    }
    EXPECT_GT(d.steps().back().error, 0.3f); // a tetrahedron in place of a sphere
}

TEST(Decimate, ColorsAndBordersStayWhereTheyAre) {
    const ColoredMesh mesh = square(32);
    const Decimation d(mesh, {.error = 0.01f});
    const ColoredMesh left = d.after(mesh, d.steps().size());
    EXPECT_LT(left.triangles.size() / 3, 200u);
    EXPECT_NEAR(area(left), 1.0, 1e-5);
    for (size_t v = 0; v < left.points.size(); v++) {
        const float x = left.points[v].x, c = left.colors[v].x;
        EXPECT_NEAR(left.points[v].z, 0.0f, 1e-6f);
        if (x < 0.45f) {
            EXPECT_LT(c, 0.1f) << x;
        } else if (x > 0.55f) {
            EXPECT_GT(c, 0.8f) << x;
        }
    }
    ColoredMesh plain = mesh;
    plain.colors.assign(plain.points.size(), Vec3f(0.3f));
    const Decimation of_plain(plain, {.error = 0.01f});
    const ColoredMesh few = of_plain.after(plain, of_plain.steps().size());
    EXPECT_LE(few.triangles.size() / 3, 8u);
    for (const Vec3f& c : few.colors)
        EXPECT_NEAR(c.y, 0.3f, 1e-5f);
}

TEST(Decimate, WhatIsNoManifoldStaysAsItIs) {
    // Three faces of one edge, and two that meet in a point.
    ColoredMesh m{{{0, 0, 0},
                   {1, 0, 0},
                   {0, 1, 0},
                   {0, -1, 0},
                   {0, 0, 1},
                   {5, 0, 0},
                   {5, 1, 0},
                   {6, 0, 0},
                   {4, 0, 0},
                   {4, -1, 0}},
                  std::vector<Vec3f>(10, Vec3f(0.5f)),
                  {0, 1, 2, 0, 1, 3, 0, 1, 4, 5, 7, 6, 5, 8, 9}};
    const Decimation d(m, {});
    const ColoredMesh left = d.after(m, d.steps().size());
    EXPECT_EQ(left.triangles, m.triangles);
}

TEST(Decimate, FacesAreSharedByWhatTheyCost) {
    const ColoredMesh round = sphere(64, 32), flat = [] {
        ColoredMesh m = square(32);
        m.colors.assign(m.points.size(), Vec3f(0.5f));
        return m;
    }();
    const Decimation a(round, {}), b(flat, {});
    const uint64_t of_a = round.triangles.size() / 3, of_b = flat.triangles.size() / 3;
    const DecimationShare all[] = {{&a, of_a}, {&b, of_b}};
    const std::vector<size_t> steps = share_faces(all, 500);
    const size_t left_a = a.after(round, steps[0]).triangles.size() / 3,
                 left_b = b.after(flat, steps[1]).triangles.size() / 3;
    EXPECT_LE(left_a + left_b, 500u);
    EXPECT_GT(left_a + left_b, 450u);
    EXPECT_LE(left_b, 8u);
    // Copies count as often as they stand.
    const DecimationShare copied[] = {{&a, of_a, 10}, {&b, of_b}};
    EXPECT_LE(a.after(round, share_faces(copied, 500)[0]).triangles.size() / 3, 50u);
    EXPECT_EQ(share_faces(all, of_a + of_b)[0], 0u);
}

TEST(Decimate, NothingAndBadFacesDoNoHarm) {
    const ColoredMesh none;
    EXPECT_TRUE(Decimation(none, {}).steps().empty());
    ColoredMesh line{
        {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, std::vector<Vec3f>(3, Vec3f(0.5f)), {0, 1, 2, 0, 0, 1}};
    const Decimation d(line, {});
    EXPECT_TRUE(d.steps().empty());
    EXPECT_EQ(d.after(line, 1).triangles.size(), 3u);
}

} // namespace
} // namespace kanuka::geom
