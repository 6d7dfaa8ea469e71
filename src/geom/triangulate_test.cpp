// Polygons to triangles: their area, and every one turned the same way.
#include "geom/triangulate.h"

#include <gtest/gtest.h>
#include <random>

using namespace kanuka;
using namespace kanuka::geom;

namespace {

struct Point2 {
    double x, y;
};

} // namespace

TEST(Triangulate, ConcavePolygonWithHoles) {
    Loops l;
    const float outer[][2] = {{0, 0}, {4, 0}, {4, 4}, {2, 2.5f}, {0, 4}};
    const float hole_a[][2] = {{1, 1}, {1.5f, 1}, {1.5f, 1.5f}, {1, 1.5f}}; // winds as the outline
    const float hole_b[][2] = {{2.5f, 1}, {2.5f, 1.5f}, {3, 1.5f}, {3, 1}}; // and against it
    for (const auto& p : outer)
        l.points.push_back({p[0], p[1], 1});
    for (const auto& p : hole_a)
        l.points.push_back({p[0], p[1], 1});
    for (const auto& p : hole_b)
        l.points.push_back({p[0], p[1], 1});
    l.loop_first = {0, 5, 9, 13};
    double sum = 0, quads = 0;
    for (const auto& t : triangulate(l)) {
        const Vec3f n = cross(l.points[t[1]] - l.points[t[0]], l.points[t[2]] - l.points[t[0]]);
        EXPECT_GT(n.z, 0); // wound as the outline
        sum += 0.5 * n.z;
    }
    EXPECT_NEAR(sum, 16 - 3 - 0.5, 1e-5);
    for (const auto& q : join_quads(triangulate(l), l)) {
        const Vec3f p[4] = {l.points[q[0]], l.points[q[1]], l.points[q[2]], l.points[std::max(0, q[3])]};
        const Vec3f n = newell_normal(p, q[3] < 0 ? 3 : 4);
        EXPECT_TRUE(is_convex(p, q[3] < 0 ? 3 : 4, n));
        quads += 0.5 * n.z;
    }
    EXPECT_NEAR(quads, sum, 1e-5);
}

// Many holes in rows and columns, whose corners lie on common lines; points tell whether they are covered.
TEST(Triangulate, HolesInRowsAndColumns) {
    const std::vector<std::vector<Point2>> kinds = {
        {{1, 1}, {7, 1}, {7, 7}, {1, 7}}, {{1, 1}, {7, 1}, {7, 7}},
        {{1, 7}, {4, 1}, {7, 7}},         {{1, 1}, {7, 1}, {7, 3}, {3, 3}, {3, 7}, {1, 7}}, // an L
        {{1, 4}, {4, 1}, {7, 4}, {4, 7}}, {{1, 1}, {4, 3}, {7, 1}, {5, 4}, {7, 7}, {4, 5}, {1, 7}, {3, 4}}};
    const auto inside = [](const std::vector<Point2>& loop, double x, double y) {
        bool in = false;
        for (size_t i = 0, j = loop.size() - 1; i < loop.size(); j = i++)
            if ((loop[i].y > y) != (loop[j].y > y) &&
                x < loop[i].x + (y - loop[i].y) / (loop[j].y - loop[i].y) * (loop[j].x - loop[i].x))
                in = !in;
        return in;
    };
    std::mt19937 g(5);
    for (int round = 0; round < 1500; round++) {
        const int columns = 1 + int(g() % 4), rows = 1 + int(g() % 4);
        const double w = 8 * columns, h = 8 * rows;
        std::vector<std::vector<Point2>> loops = {{{0, 0}, {w, 0}, {w, h}, {0, h}}};
        if (g() % 3 == 0) // a notch from above, between two columns
            loops[0] = {{0, 0}, {w, 0}, {w, h}, {8.5, h}, {8, 0.5}, {7.5, h}, {0, h}};
        for (int r = 0; r < rows; r++)
            for (int c = 0; c < columns; c++) {
                if (g() % 4 == 0)
                    continue;
                std::vector<Point2> hole = kinds[g() % kinds.size()];
                const unsigned turns = g() % 4;
                for (Point2& q : hole) {
                    for (unsigned k = 0; k < turns; k++)
                        q = {8 - q.y, q.x};
                    q = {q.x + 8 * c, q.y + 8 * r};
                }
                if (g() % 2)
                    std::reverse(hole.begin(), hole.end());
                std::rotate(hole.begin(), hole.begin() + long(g() % hole.size()), hole.end());
                loops.push_back(hole);
            }
        Loops l;
        l.loop_first = {0};
        for (const auto& loop : loops) {
            for (const Point2& q : loop)
                l.points.push_back({float(q.x), float(q.y), 0});
            l.loop_first.push_back(int(l.points.size()));
        }
        const auto triangles = triangulate(l);
        for (int k = 0; k < 60; k++) {
            const double x = w * double(g()) / 4294967296.0, y = h * double(g()) / 4294967296.0;
            bool expected = inside(loops[0], x, y);
            for (size_t i = 1; i < loops.size(); i++)
                expected &= !inside(loops[i], x, y);
            int covered = 0;
            for (const auto& t : triangles) {
                std::vector<Point2> corners;
                for (const int i : t)
                    corners.push_back({l.points[size_t(i)].x, l.points[size_t(i)].y});
                covered += inside(corners, x, y);
            }
            ASSERT_EQ(covered, int(expected)) << "round " << round << " at " << x << " " << y;
        }
    }
}

TEST(Triangulate, EveryAxisAndHostileInput) {
    for (int axis = 0; axis < 3; axis++)
        for (const float turn : {1.0f, -1.0f}) {
            Loops l;
            const float c[][2] = {{0, 0}, {3, 0}, {3, 3}, {2, 1}, {1, 1}, {0, 3}};
            for (const auto& p : c) {
                Vec3f v(0);
                v[(axis + 1) % 3] = p[0];
                v[(axis + 2) % 3] = p[1] * turn;
                l.points.push_back(v);
            }
            l.loop_first = {0, 6};
            double sum = 0;
            for (const auto& t : triangulate(l))
                sum += 0.5 * cross(l.points[t[1]] - l.points[t[0]], l.points[t[2]] - l.points[t[0]])[axis];
            EXPECT_NEAR(sum, turn * 5, 1e-5);
        }
    // A bow tie, collinear corners, coinciding corners, a hole outside: anything but endless.
    Loops tie{{{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}, {0.5f, 0.5f, 0}}, {0, 5}};
    triangulate(tie);
    Loops line{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}, {0, 4}};
    EXPECT_TRUE(triangulate(line).empty());
    Loops outside{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {5, 5, 0}, {6, 5, 0}, {6, 6, 0}}, {0, 4, 7}};
    triangulate(outside);
    Loops empty{{}, {0, 0}};
    EXPECT_TRUE(triangulate(empty).empty());
}
