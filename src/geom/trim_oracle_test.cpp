// What trim curves keep, in whole numbers and by counting.
#include <random>

#include "geom/test_surfaces.h"
#include "geom/trim.h"

namespace kanuka::geom {
namespace {

using namespace testing;

// Loops of straight curves, and circles of nine points.
struct Trim {
    scene::TrimCurves curves;
    std::vector<int32_t> in_loop, order, count;
    std::vector<float> knots, lo, hi, u, v, w;

    void add(int order_of, const std::vector<std::array<float, 3>>& points, const std::vector<float>& k) {
        in_loop.push_back(1), order.push_back(order_of), count.push_back(int32_t(points.size()));
        knots.insert(knots.end(), k.begin(), k.end());
        lo.push_back(k[size_t(order_of - 1)]), hi.push_back(k[points.size()]);
        for (const auto& p : points)
            u.push_back(p[0] * p[2]), v.push_back(p[1] * p[2]), w.push_back(p[2]);
    }
    void polygon(const std::vector<std::array<float, 2>>& corners) {
        std::vector<std::array<float, 3>> points;
        std::vector<float> k{0};
        for (size_t i = 0; i <= corners.size(); i++) {
            points.push_back({corners[i % corners.size()][0], corners[i % corners.size()][1], 1});
            k.push_back(float(i));
        }
        k.push_back(float(corners.size()));
        add(2, points, k);
    }
    void circle(float x, float y, float r) {
        const float h = std::sqrt(0.5f);
        const float c[9][3] = {{1, 0, 1},   {1, 1, h},  {0, 1, 1},  {-1, 1, h}, {-1, 0, 1},
                               {-1, -1, h}, {0, -1, 1}, {1, -1, h}, {1, 0, 1}};
        std::vector<std::array<float, 3>> points;
        for (const auto& q : c)
            points.push_back({x + r * q[0], y + r * q[1], q[2]});
        add(3, points, {0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4});
    }
    TrimRegion region(const ParameterRange& range, float cells, bool outside = false) {
        curves.curves_per_loop = in_loop, curves.order = order, curves.points = count;
        curves.knots = knots, curves.min = lo, curves.max = hi;
        curves.u = u, curves.v = v, curves.w = w, curves.outside = outside;
        Journal journal;
        const auto distance = [cells](double u0, double v0, double u1, double v1) {
            return cells * float(std::hypot(u1 - u0, v1 - v0));
        };
        TrimRegion r(curves, range, distance, {}, journal);
        EXPECT_TRUE(journal.entries().empty()) << journal.entries()[0].message;
        return r;
    }
};

// How often closed polygons go round a place: turns counted where a line upwards is crossed, in long whole
// numbers.
int turns(const TrimRegion& r, const TrimRegion::Point& p, int without = -1) {
    int sum = 0;
    std::set<int> left_out;
    for (int i = without; i >= 0 && left_out.insert(i).second;)
        i = r.next[size_t(i)];
    for (int i = 0; i < int(r.points.size()); i++) {
        if (left_out.count(i))
            continue;
        const auto &a = r.points[size_t(i)], &b = r.points[size_t(r.next[size_t(i)])];
        if ((a.x > p.x) == (b.x > p.x))
            continue;
        const __int128 side = __int128(b.x - a.x) * (p.y - a.y) - __int128(b.y - a.y) * (p.x - a.x);
        if (b.x > a.x ? side < 0 : side > 0) // the edge lies above
            sum += b.x > a.x ? -1 : 1;
    }
    return sum;
}

} // namespace

TEST(TrimOracles, WhatIsKeptLiesWithinAnOddNumberOfLoops) {
    std::mt19937 g(6);
    const auto one = [&] { return double(g()) / 4294967296.0; };
    const ParameterRange range{2, 5, -1, 1};
    for (const bool outside : {false, true}) {
        Trim trim;
        trim.polygon({{2.2f, -0.9f}, {4.9f, -0.8f}, {4.6f, 0.9f}, {3.3f, -0.3f}, {2.4f, 0.8f}});
        trim.circle(3, -0.5f, 0.3f);
        trim.circle(4.4f, 0.1f, 0.5f);
        trim.polygon({{4.3f, 0}, {4.5f, 0}, {4.5f, 0.2f}, {4.3f, 0.2f}});
        const TrimRegion r = trim.region(range, 500, outside);
        for (size_t i = 0; i < r.points.size(); i++) {
            EXPECT_EQ(r.previous[size_t(r.next[i])], int(i));
            EXPECT_TRUE(r.points[i].x & 1 && r.points[i].y & 1);
        }
        std::vector<int> some, all;
        for (int k = 0; k < 4000; k++) {
            const auto p = TrimRegion::even(1.2 * one() - 0.1, 1.2 * one() - 0.1);
            EXPECT_EQ(r.keeps(p), (turns(r, p) & 1) != outside);
            const int first = int(g() % r.points.size());
            EXPECT_EQ(r.keeps_without(p, first), (turns(r, p, first) & 1) != outside);
            const auto q = TrimRegion::even(one(), one());
            TrimRegion::Box box;
            box.extend(p), box.extend(q);
            r.overlapping(box, some);
            all.clear();
            int crossings = 0;
            for (int i = 0; i < int(r.points.size()); i++) {
                const auto &a = r.begin(i), &b = r.end(i);
                if (std::max(a.x, b.x) >= std::min(p.x, q.x) && std::min(a.x, b.x) <= std::max(p.x, q.x) &&
                    std::max(a.y, b.y) >= std::min(p.y, q.y) && std::min(a.y, b.y) <= std::max(p.y, q.y))
                    all.push_back(i);
                crossings += r.crosses(i, p, q);
                EXPECT_EQ(r.crosses(i, p, q), r.crosses(i, q, p));
            }
            EXPECT_EQ(some, all);
            EXPECT_EQ(crossings % 2 == 1, r.keeps(p) != r.keeps(q));
        }
    }
}

// Polygons of curves keep to them within a twentieth of a micropolygon edge, with few points; straight ones
// are as they are; what runs along the border is moved outside.
TEST(TrimOracles, CurvesAreFollowedAsFarAsItShows) {
    for (const float cells : {30.0f, 300.0f, 3000.0f}) {
        Trim trim;
        trim.circle(3.5f, 0, 0.6f);
        const ParameterRange range{2, 5, -2, 1};
        const TrimRegion r = trim.region(range, cells);
        const double radius = 0.2; // of the range
        double worst = 0;
        for (size_t i = 0; i < r.points.size(); i++)
            for (int k = 0; k < 10; k++) {
                const auto &a = r.begin(int(i)), &b = r.end(int(i));
                const double x = double(a.x) + (double(b.x) - double(a.x)) * k / 10,
                             y = double(a.y) + (double(b.y) - double(a.y)) * k / 10;
                worst = std::max(
                    worst, std::abs(std::hypot(x / TrimRegion::Unit - 0.5, y / TrimRegion::Unit - 2 / 3.0) -
                                    radius));
            }
        EXPECT_LE(worst * double(cells), 0.052) << cells;
        const double least = std::acos(-1.0) / std::acos(1 - 0.05 / (double(cells) * radius));
        EXPECT_LE(double(r.points.size()), std::max(16.0, 2.1 * least)) << cells;
    }
    Trim trim;
    trim.polygon({{0, 0}, {1, 0}, {1, 1}, {0.25f, 0.5f}});
    const TrimRegion r = trim.region({}, 100);
    ASSERT_EQ(r.points.size(), 4u);
    const double expected[4][2] = {{-1e-4, -1e-4}, {1 + 1e-4, -1e-4}, {1 + 1e-4, 1 + 1e-4}, {0.25, 0.5}};
    for (size_t i = 0; i < 4; i++) {
        EXPECT_NEAR(double(r.points[i].x) / TrimRegion::Unit, expected[i][0], 2 / TrimRegion::Unit);
        EXPECT_NEAR(double(r.points[i].y) / TrimRegion::Unit, expected[i][1], 2 / TrimRegion::Unit);
    }
    EXPECT_EQ(TrimRegion::even(0.25, 0.75), (TrimRegion::Point{1 << 21, 3 << 21}));
}

} // namespace kanuka::geom
