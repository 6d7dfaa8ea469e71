// What hierarchy_bench traces: grids, meshes, and fibres.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "hierarchy/test_oracle.h"

namespace kanuka::hierarchy::bench {

using testing::Random;
using testing::TestGrid;

struct BenchScene {
    std::vector<TestGrid> grids;
    std::vector<float> positions; // of the mesh
    std::vector<uint32_t> corners;
    std::vector<float> fibres; // xyz and the radius
    std::vector<uint32_t> segments;
    Vec3f eye, at, light, light_u, light_v;
    float offset = 0; // of rays that start on it

    size_t primitives() const {
        size_t n = corners.size() / 3 + segments.size();
        for (const TestGrid& g : grids)
            n += size_t(g.columns) * size_t(g.rows);
        return n;
    }
};

inline constexpr int GridSide = 32;

inline BenchScene terrain(int n) {
    BenchScene s;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++)
            s.grids.push_back(testing::make_grid(GridSide, GridSide, [&](float u, float v) {
                const float x = (float(i) + u - float(n) / 2) * GridSide,
                            z = (float(j) + v - float(n) / 2) * GridSide;
                const Vec3f p(x, 0, z);
                return p +
                       Vec3f(3 * testing::waves({x, 7, z}, 0.09f),
                             40 * testing::waves({x, 3, z}, 0.006f) + 5 * testing::waves({x, 5, z}, 0.08f),
                             3 * testing::waves({x, 11, z}, 0.1f));
            }));
    const float side = float(n) * GridSide;
    s.eye = {-0.3f * side, 0.25f * side, -0.4f * side}, s.at = {0, -0.05f * side, 0};
    s.light = {-100, 900, -100}, s.light_u = {200, 0, 0}, s.light_v = {0, 0, 200}, s.offset = 0.05f;
    return s;
}

inline BenchScene terrain_mesh(int n) { // its triangles as one mesh that shares its vertices
    BenchScene s = terrain(n);
    const uint32_t side = uint32_t(n) * GridSide, row = side + 1;
    for (uint32_t y = 0; y <= side; y++)
        for (uint32_t x = 0; x <= side; x++) {
            const uint32_t i = std::min(x / GridSide, uint32_t(n) - 1),
                           j = std::min(y / GridSide, uint32_t(n) - 1);
            const Vec3f p = s.grids[j * uint32_t(n) + i].at(int(x - i * GridSide), int(y - j * GridSide));
            s.positions.insert(s.positions.end(), {p.x, p.y, p.z});
            const uint32_t a = y * row + x, b = a + 1, c = a + row, d = c + 1;
            if (x < side && y < side)
                s.corners.insert(s.corners.end(), {a, b, c, d, c, b});
        }
    s.grids.clear();
    return s;
}

inline BenchScene cave(int n) {
    BenchScene s;
    s.grids = testing::ball(n, GridSide, 500, 60, 0.011f);
    for (TestGrid& g : s.grids) // overhanging
        for (size_t i = 0; i < g.positions.size(); i += 3) {
            float* p = &g.positions[i];
            const Vec3f q(p[0], p[1], p[2]);
            for (int a = 0; a < 3; a++)
                p[a] += 35 * testing::waves(q + Vec3f(float(100 * a)), 0.021f);
        }
    s.eye = {0, 0, 0}, s.at = {1, 0.1f, 0.3f};
    s.light = {-100, 150, -100}, s.light_u = {200, 0, 0}, s.light_v = {0, 0, 200}, s.offset = 0.05f;
    return s;
}

inline BenchScene globe(int n) { // a mesh: triangles whose corners are shaken, over a floor
    BenchScene s;
    Random random(5);
    const int around = 2 * n, up = n;
    for (int j = 0; j <= up; j++)
        for (int i = 0; i < around; i++) {
            const float a = 2 * Pi * (float(i) + random.uniform(-0.3f, 0.3f)) / float(around),
                        b = Pi * std::clamp(float(j) + random.uniform(-0.3f, 0.3f), 0.01f, float(up)) /
                            float(up);
            const Vec3f d(std::sin(b) * std::cos(a), std::cos(b), std::sin(b) * std::sin(a));
            const Vec3f p = d * (50 + 6 * testing::waves(d * 50, 0.15f));
            s.positions.insert(s.positions.end(), {p.x, p.y, p.z});
        }
    for (int j = 0; j < up; j++)
        for (int i = 0; i < around; i++) {
            const uint32_t a = uint32_t(j * around + i), b = uint32_t(j * around + (i + 1) % around),
                           c = a + uint32_t(around), d = b + uint32_t(around);
            s.corners.insert(s.corners.end(), {a, c, b, b, c, d});
        }
    const uint32_t first = uint32_t(s.positions.size() / 3);
    s.positions.insert(s.positions.end(), {-200, -60, -200, 200, -60, -200, -200, -60, 200, 200, -60, 200});
    s.corners.insert(s.corners.end(), {first, first + 1, first + 2, first + 3, first + 2, first + 1});
    s.eye = {0, 30, -140}, s.at = {0, -10, 0};
    s.light = {-40, 150, -90}, s.light_u = {80, 0, 0}, s.light_v = {0, 0, 80}, s.offset = 0.01f;
    return s;
}

inline BenchScene hair(int n) { // a ball with fur, n thousand hairs of eight segments, which curl and narrow
    BenchScene s;
    Random random(3);
    constexpr int Segments = 8;
    constexpr float Ball = 10, Length = 3, Radius = 0.008f;
    for (int i = 0; i < 1000 * n; i++) {
        const Vec3f out = random.direction(), x = normalize(cross(out, Vec3f(0.3f, 1, 0.1f))),
                    y = cross(out, x);
        const Vec3f comb = x * 0.6f + y * (0.5f * testing::waves(out * Ball, 0.4f));
        const float length = Length * random.uniform(0.6f, 1), phase = random.uniform(0, 6.28f);
        for (int k = 0; k <= Segments; k++) {
            const float f = float(k) / Segments, curl = 0.12f * f;
            const Vec3f p = out * (Ball + length * f * (1 - 0.35f * f)) + comb * (length * f * f) +
                            x * (curl * std::cos(phase + 9 * f)) + y * (curl * std::sin(phase + 9 * f));
            if (k < Segments)
                s.segments.push_back(uint32_t(s.fibres.size() / 4));
            s.fibres.insert(s.fibres.end(), {p.x, p.y, p.z, Radius * (1 - 0.9f * f)});
        }
    }
    s.eye = {0, 6, -26}, s.at = {0, 1, 0};
    s.light = {-20, 40, -30}, s.light_u = {10, 0, 0}, s.light_v = {0, 0, 10}, s.offset = 1e-4f;
    return s;
}

} // namespace kanuka::hierarchy::bench
