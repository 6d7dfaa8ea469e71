// Trimmed patches: how much is left, where it ends, and that nothing opens in between.
#include <gtest/gtest.h>

#include "base/tasks.h"
#include "dice/test_scene.h"
#include "dice/trim_polygon.h"
#include "grid/trimmed.h"

using namespace kanuka;
using namespace kanuka::dice;
using namespace kanuka::dice::test;

namespace {

// Several knot spans each way over [0, 2]^2; x = u - 1, y = v - 1 by Greville's abscissae, z from `height`.
template <class Height>
scene::Primitive patch(Height height, float rate = 1) {
    scene::NuPatch n{};
    n.nu = n.nv = 6;
    n.u_order = n.v_order = 4;
    const std::vector<float> knots{0, 0, 0, 0, 0.6f, 1.4f, 2, 2, 2, 2};
    n.u_knots = n.v_knots = knots;
    n.u_min = n.v_min = 0, n.u_max = n.v_max = 2;
    std::vector<float> p;
    const auto greville = [&](int i) {
        return (knots[size_t(i) + 1] + knots[size_t(i) + 2] + knots[size_t(i) + 3]) / 3 - 1;
    };
    for (int j = 0; j < 6; j++)
        for (int i = 0; i < 6; i++)
            p.insert(p.end(), {greville(i), greville(j), height(i, j)});
    return primitive(std::move(n), p, rate);
}

struct Loops {
    scene::TrimCurves t;
    std::vector<int32_t> loops, order, points;
    std::vector<float> knots, min, max, u, v, w;

    void polygon(std::vector<std::array<float, 2>> p) {
        p.push_back(p[0]);
        curve(2, p, std::vector<float>(p.size(), 1.0f));
    }
    // Nine points of a rational quadratic: exact.
    void circle(float x, float y, float r) {
        const float s = std::sqrt(0.5f);
        curve(3,
              {{x + r, y},
               {x + r, y + r},
               {x, y + r},
               {x - r, y + r},
               {x - r, y},
               {x - r, y - r},
               {x, y - r},
               {x + r, y - r},
               {x + r, y}},
              {1, s, 1, s, 1, s, 1, s, 1}, {0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4});
    }
    void curve(int k, const std::vector<std::array<float, 2>>& p, const std::vector<float>& weights,
               std::vector<float> given = {}) {
        if (given.empty()) {
            given.push_back(0);
            for (size_t i = 0; i < p.size(); i++)
                given.push_back(float(i));
            given.push_back(float(p.size() - 1));
        }
        loops.push_back(1), order.push_back(k), points.push_back(int32_t(p.size()));
        min.push_back(given.front()), max.push_back(given.back());
        knots.insert(knots.end(), given.begin(), given.end());
        for (size_t i = 0; i < p.size(); i++) {
            u.push_back(p[i][0] * weights[i]), v.push_back(p[i][1] * weights[i]), w.push_back(weights[i]);
        }
    }
    std::shared_ptr<const scene::TrimCurves> take(bool outside = false) const {
        auto out = std::make_shared<scene::TrimCurves>();
        out->curves_per_loop = loops, out->order = order, out->points = points;
        out->knots = knots, out->min = min, out->max = max;
        out->u = u, out->v = v, out->w = w;
        out->outside = outside;
        return out;
    }
};

struct Cut {
    Diced diced;
    double area = 0; // over x and y
    EdgeCount edges; // of all that is traced
    std::vector<std::array<Key, 3>> triangles;

    explicit Cut(const scene::Primitive& p, const DiceOptions& o, const Displace& displace = {},
                 bool uniform = false) {
        Journal journal;
        DiceTarget target;
        target.shade_uniform = uniform;
        diced = dice::dice(p, target, o, displace, journal);
        EXPECT_TRUE(journal.entries().empty()) << journal.entries()[0].message;
        for (size_t g = 0; g < diced.grids.size(); g++)
            if (diced.trimmed[g].indices.empty())
                add_lattice(diced.traced[g]);
            else
                add_cut(diced.grids[g], diced.trimmed[g]);
    }
    void add(const Key& a, const Key& b, const Key& c) {
        area += 0.5 * ((double(b[0]) - a[0]) * (double(c[1]) - a[1]) -
                       (double(b[1]) - a[1]) * (double(c[0]) - a[0]));
        edges.triangle(a, b, c);
        triangles.push_back({a, b, c});
    }
    void add_lattice(const grid::TracedGrid& t) {
        const auto at = [&](int i, int j) {
            const float* p = &t.P[3 * size_t(j * (t.mu + 1) + i)];
            return positive_zero({p[0], p[1], p[2]});
        };
        for (int j = 0; j < t.mv; j++)
            for (int i = 0; i < t.mu; i++) {
                add(at(i, j), at(i + 1, j), at(i, j + 1));
                add(at(i + 1, j + 1), at(i, j + 1), at(i + 1, j));
            }
    }
    void add_cut(const grid::Grid& g, const grid::TrimmedMesh& m) {
        grid::VertexInputs none, merged;
        none.stride = g.stride;
        grid::Grid out;
        grid::TracedMesh mesh;
        const grid::TrimmedPart part{&g, &none, &m};
        grid::merge_trimmed({&part, 1}, {}, out, merged, mesh);
        const auto at = [&](uint32_t i) {
            const Vec3f p = out.position(int(i));
            return positive_zero({p.x, p.y, p.z});
        };
        for (size_t k = 0; k < mesh.indices.size(); k += 3)
            add(at(mesh.indices[k]), at(mesh.indices[k + 1]), at(mesh.indices[k + 2]));
    }
    // Open edges that `allowed` does not explain.
    template <class Allowed>
    size_t cracks(Allowed allowed) const {
        std::map<std::pair<Key, Key>, int> count;
        for (const auto& t : triangles)
            for (size_t k = 0; k < 3; k++) {
                const Key &a = t[k], &b = t[(k + 1) % 3];
                if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0])
                    continue;
                a < b ? count[{a, b}]++ : count[{b, a}]--;
            }
        size_t n = 0;
        for (const auto& [edge, c] : count)
            if (c != 0 && !(allowed(edge.first) && allowed(edge.second))) {
                if (n++ == 0)
                    ADD_FAILURE() << "open from (" << edge.first[0] << ", " << edge.first[1] << ") to ("
                                  << edge.second[0] << ", " << edge.second[1] << "), " << c << " times";
            }
        return n;
    }
};

bool on_border(const Key& p) {
    return std::abs(std::abs(p[0]) - 1) < 2e-6f || std::abs(std::abs(p[1]) - 1) < 2e-6f;
}

float waves(int i, int j) {
    return 0.3f * std::sin(1.7f * float(i) + 0.4f * float(j)) * std::cos(1.1f * float(j));
}

} // namespace

TEST(Trim, HolesHaveTheirArea) {
    Loops loops;
    loops.polygon({{0, 0}, {2, 0}, {2, 2}, {0, 2}});
    loops.circle(0.9f, 1.1f, 0.5f);
    loops.polygon({{0.8f, 1}, {1, 1}, {1, 1.2f}, {0.8f, 1.2f}}); // an island in it
    scene::Primitive p = patch([](int, int) { return 0.0f; });
    for (const bool outside : {false, true})
        for (const bool uniform : {false, true}) {
            std::get<scene::NuPatch>(p.geometry).trim = loops.take(outside);
            const Cut cut(p, looking(3, 512), {}, uniform);
            const double hole = double(Pi) * 0.25 - 0.04;
            EXPECT_NEAR(cut.area, outside ? hole : 4 - hole, 1.2e-3) << outside << uniform;
            EXPECT_EQ(cut.cracks([](const Key& k) {
                const float r = std::hypot(k[0] + 0.1f, k[1] - 0.1f);
                const bool square = std::max(std::abs(k[0] + 0.1f), std::abs(k[1] - 0.1f)) < 0.1001f;
                return on_border(k) || std::abs(r - 0.5f) < 2e-3f || square;
            }),
                      0u)
                << outside << uniform;
        }
}

// A loop of many corners within a triangle keeps its area, whichever way it runs and with a hole in it.
TEST(Trim, LoopsMayRunEitherWay) {
    const auto ring = [](float radius, bool back) {
        std::vector<std::array<float, 2>> p;
        for (int i = 0; i < 100; i++) {
            const float a = 2 * Pi * float(back ? 99 - i : i) / 100;
            p.push_back({0.82f + radius * std::cos(a), 0.83f + radius * std::sin(a)});
        }
        return p;
    };
    const double unit = 50 * std::sin(2 * double(Pi) / 100); // area of a hundred-sided polygon of radius 1
    scene::Primitive p = patch([](int, int) { return 0.0f; });
    for (const bool back : {false, true})
        for (const bool inner_back : {false, true})
            for (const double hole : {0.0, 0.05}) {
                Loops loops;
                loops.polygon(ring(0.12f, back));
                if (hole > 0)
                    loops.polygon(ring(float(hole), inner_back));
                std::get<scene::NuPatch>(p.geometry).trim = loops.take();
                const Cut cut(p, looking(3, 2048), {}, true);
                EXPECT_NEAR(cut.area, unit * (0.0144 - hole * hole), 2e-5) << back << inner_back << hole;
            }
}

TEST(Trim, WavyAndDisplacedPatchesStayWhole) {
    Loops loops;
    loops.polygon({{-1, -1}, {3, -1}, {3, 3}, {-1, 3}}); // around all of it
    for (int k = 0; k < 12; k++) // some across knots, some smaller than a cell, some over the border
        loops.circle(0.37f * float(k % 5) + 0.13f, 0.61f * float(k / 3) + 0.09f * float(k % 3),
                     0.004f * float(1 + k * k));
    scene::Primitive p = patch(waves, 2);
    std::get<scene::NuPatch>(p.geometry).trim = loops.take();
    // Overlapping circles cross each other: cells there are decided by their middle, so their borders are
    // open by up to a cell. Everywhere else the border is the circles.
    for (const float height : {0.0f, 0.05f}) {
        const Cut cut(p, looking(2.5f, 200), height > 0 ? bumps(height, 9) : Displace());
        EXPECT_GT(cut.triangles.size(), 1000u);
        if (height > 0)
            continue;
        const float cell = 0.05f;
        EXPECT_EQ(cut.cracks([&](const Key& key) {
            bool allowed = on_border(key);
            int near = 0;
            for (int k = 0; k < 12; k++) {
                const float r = 0.004f * float(1 + k * k);
                const float d = std::hypot(key[0] + 1 - (0.37f * float(k % 5) + 0.13f),
                                           key[1] + 1 - (0.61f * float(k / 3) + 0.09f * float(k % 3)));
                allowed |= std::abs(d - r) < 4e-3f; // 0.05 micropolygon edges, and some
                near += std::abs(d - r) < cell;
            }
            return allowed || near > 1;
        }),
                  0u);
    }
}

TEST(Trim, NothingAndEverything) {
    Loops all, none;
    all.polygon({{0, 0}, {2, 0}, {2, 2}, {0, 2}});
    none.polygon({{5, 5}, {6, 5}, {6, 6}, {5, 6}});
    scene::Primitive p = patch(waves);
    std::get<scene::NuPatch>(p.geometry).trim = all.take();
    const Cut whole(p, looking(3));
    EXPECT_NEAR(whole.area, 4, 1e-5);
    EXPECT_EQ(whole.cracks(on_border), 0u);
    std::get<scene::NuPatch>(p.geometry).trim = none.take();
    EXPECT_TRUE(Cut(p, looking(3)).triangles.empty());
}

TEST(Trim, SameForAnyThreadCount) {
    Loops loops;
    loops.circle(1, 1, 0.8f);
    scene::Primitive p = patch(waves);
    std::get<scene::NuPatch>(p.geometry).trim = loops.take();
    std::vector<std::array<Key, 3>> by_threads[2];
    for (const int threads : {1, 3})
        tasks::with_threads(threads, [&] { by_threads[threads / 3] = Cut(p, looking(3)).triangles; });
    EXPECT_EQ(by_threads[0], by_threads[1]);
}

TEST(Trim, BadCurvesAreReported) {
    Loops loops;
    loops.circle(1, 1, 0.5f);
    loops.knots[3] = 9; // not rising
    scene::Primitive p = patch(waves);
    std::get<scene::NuPatch>(p.geometry).trim = loops.take();
    Journal journal;
    const Diced d = dice::dice(p, {}, looking(3), {}, journal);
    ASSERT_EQ(journal.entries().size(), 1u);
    EXPECT_NE(journal.entries()[0].message.find("knots are not in rising order"), std::string::npos);
    EXPECT_FALSE(d.grids.empty());
}

// A tube with a window across the line where its parameter begins again: open along the window and the rims
// alone, wherever the rates cut it.
TEST(Trim, WindowsAcrossTheSeam) {
    constexpr int N = 9;
    scene::NuPatch n{};
    n.u_order = 3, n.v_order = 2, n.nu = N, n.nv = 2;
    n.u_knots = std::vector<float>{0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 7, 7};
    n.v_knots = std::vector<float>{-1, -1, 1, 1};
    n.u_max = 7, n.v_min = -1, n.v_max = 1;
    std::vector<float> p;
    std::vector<std::array<float, 2>> ring;
    for (int i = 0; i < N; i++) {
        const float a = i == N - 1 ? 0 : 2 * Pi * float(i) / (N - 1);
        ring.push_back({std::cos(a), std::sin(a)});
    }
    for (const float y : {-1.0f, 1.0f})
        for (const auto& q : ring)
            p.insert(p.end(), {q[0], y, q[1]});
    Loops window;
    window.polygon({{-1, -0.4f}, {1, -0.4f}, {1, 0.4f}, {-1, 0.4f}});
    window.polygon({{6, -0.4f}, {8, -0.4f}, {8, 0.4f}, {6, 0.4f}});
    n.trim = window.take();
    // At a knot a quadratic spline is half way between two of its points.
    const auto beside = [&](const Key& k, size_t knot) {
        const auto &a = ring[knot], &b = ring[knot + 1];
        return std::hypot(k[0] - (a[0] + b[0]) / 2, k[2] - (a[1] + b[1]) / 2) < 4e-3f;
    };
    for (const int pixels : {30, 200, 900})
        for (const bool uniform : {false, true}) {
            DiceOptions o = looking(3, pixels);
            o.camera.page_from_camera = Transform::translate(0.3, 0.4, 0) * o.camera.page_from_camera;
            const Cut cut(primitive(n, p), o, {}, uniform);
            EXPECT_EQ(cut.cracks([&](const Key& k) {
                const float y = std::abs(k[1]);
                return y == 1 || std::abs(y - 0.4f) < 4e-3f || (y < 0.41f && (beside(k, 1) || beside(k, 6)));
            }),
                      0u)
                << pixels << uniform;
        }
}

// Where a triangle is cut, what wraps goes the shorter way round, what is a code is its nearest corner's, and
// all else is linear; parts that have one value for all of them keep it.
TEST(Trim, CutCornersHaveTheirInputs) {
    grid::Grid g;
    g.allocate(1, 1);
    grid::VertexInputs varying, same;
    varying.stride = same.stride = g.stride;
    const auto slot = [&](std::vector<float> values) {
        values.resize(size_t(g.stride));
        varying.slots.push_back({false, {}, values});
    };
    slot({0, 1, 3, 0});
    slot({0.9f, 0.1f, 0.2f, 0});
    slot({5, 7, 9, 0});
    for (const float f : {2.0f, 0.25f, 6.0f})
        same.slots.push_back({true, Vec3f(f), {}});
    std::vector<grid::Slot> slots(3);
    slots[1].between = grid::Between::Turns;
    slots[2].between = grid::Between::Nearest;
    const grid::TrimmedMesh cut{{{0, 1, 2, 0, 0},
                                 {0, 1, 2, 0.5f, 0},
                                 {0, 1, 2, 0.25f, 0.25f},
                                 {1, 0, 2, 0.25f, 0},
                                 {0, 1, 2, 0.2f, 0.7f}},
                                {0, 1, 2, 2, 3, 4}};
    const grid::TrimmedPart parts[] = {{&g, &varying, &cut}, {&g, &same, &cut}};
    grid::Grid out;
    grid::VertexInputs inputs;
    grid::TracedMesh mesh;
    grid::merge_trimmed(parts, slots, out, inputs, mesh);
    ASSERT_EQ(out.vertices(), 10);
    EXPECT_EQ(mesh.indices, (std::vector<uint32_t>{0, 1, 2, 2, 3, 4, 5, 6, 7, 7, 8, 9}));
    const float linear[] = {0, 0.5f, 1, 0.75f, 2.3f};
    // Half a turn is none: from 0.9 it is 0.2 on to 0.1, and 0.2 back to 0.2.
    const float turns[] = {0.9f, 0, 0.9f, 0.05f, 0.8f}, code[] = {5, 5, 5, 7, 9};
    for (size_t i = 0; i < 5; i++) {
        EXPECT_FLOAT_EQ(inputs.slots[0].data[i], linear[i]);
        const float off = inputs.slots[1].data[i] - turns[i];
        EXPECT_NEAR(off - std::round(off), 0, 1e-6) << i;
        EXPECT_TRUE(inputs.slots[1].data[i] >= 0 && inputs.slots[1].data[i] <= 1);
        EXPECT_EQ(inputs.slots[2].data[i], code[i]) << i;
        for (size_t k = 0; k < 3; k++)
            EXPECT_EQ(inputs.slots[k].data[i + 5], same.slots[k].value.x);
    }
}
// Which triangles an outline is cut into depends on its shape, not on where it lies.
TEST(TrimPolygon, PlaceDoesNotMatter) {
    for (const bool upright : {false, true}) {
        const auto polygon = [&](int64_t x, int64_t y) {
            Polygon o;
            const int shape[][2] = {{0, 0},   {40, -6}, {90, 3},  {95, 40}, {70, 38},
                                    {66, 80}, {30, 90}, {34, 50}, {2, 44}};
            uint32_t vertex = 0;
            for (const auto& p : shape)
                o.add(upright ? Polygon::Point{x - p[1], y + p[0]} : Polygon::Point{x + p[0], y + p[1]},
                      vertex++);
            return o;
        };
        const auto sorted = [](std::vector<std::array<uint32_t, 3>> t) {
            std::sort(t.begin(), t.end());
            return t;
        };
        const auto there = sorted(triangles_of(polygon(0, 0), {}, {0, 0}));
        ASSERT_EQ(there.size(), 7u);
        double area = 0;
        const Polygon o = polygon(0, 0);
        for (const auto& t : there)
            area += double(geom::TrimRegion::area(o.points[t[0]], o.points[t[1]], o.points[t[2]]));
        EXPECT_EQ(area, extent(o));
        for (const int64_t x : {-100000, 0, 7, 100000})
            for (const int64_t y : {-100000, 0, 7, 100000})
                EXPECT_EQ(sorted(triangles_of(polygon(x, y), {}, {x, y})), there) << x << ' ' << y;
    }
}
