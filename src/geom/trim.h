// Trim curves as polygons in the parameters of a surface, and which side of them is kept.
//
// Everything is decided in whole numbers: what is cut (vertices of the dicing) has even coordinates, what
// cuts (vertices of the loops) odd ones, so that the two never coincide; a point that lies on a line counts
// as left of it. All who ask about the same line and point get the same answer, so neighbours agree on every
// crossing.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "base/error.h"
#include "scene/scene.h"

namespace kanuka::geom {

struct ParameterRange {
    double u0 = 0, u1 = 1, v0 = 0, v1 = 1;
};

class TrimRegion {
  public:
    static constexpr double Unit = double(1 << 23); // of the parameters' range; even numbers are 2^-22 apart
    struct Point {
        int64_t x = 0, y = 0;
        bool operator==(const Point&) const = default;
        auto operator<=>(const Point&) const = default;
    };
    struct Box {
        Point lo{INT64_MAX, INT64_MAX}, hi{INT64_MIN, INT64_MIN};
        void extend(const Point& p) {
            lo = {std::min(lo.x, p.x), std::min(lo.y, p.y)};
            hi = {std::max(hi.x, p.x), std::max(hi.y, p.y)};
        }
        bool overlaps(const Box& o) const {
            return lo.x <= o.hi.x && hi.x >= o.lo.x && lo.y <= o.hi.y && hi.y >= o.lo.y;
        }
    };
    // How far apart two places of the surface are, in micropolygon edges: parameters in [0, 1].
    using Distance = std::function<float(double u0, double v0, double u1, double v1)>;

    // Bad curves are left out and reported; loops that are not closed are closed by a straight line.
    TrimRegion(const scene::TrimCurves& curves, const ParameterRange& range, const Distance& distance,
               const Location& where, Journal& journal);

    static Point even(double u, double v); // of parameters in [0, 1]
    // Twice the signed area of a triangle.
    static int64_t area(const Point& a, const Point& b, const Point& c) {
        return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    }
    // c lies to the left of the line from a to b; the same answer's opposite for (b, a).
    static bool left(const Point& a, const Point& b, const Point& c) {
        return b < a ? !(area(b, a, c) >= 0) : area(a, b, c) >= 0;
    }

    // Segment i runs from points[i] to points[next[i]].
    std::vector<Point> points;
    std::vector<int> next, previous;
    const Point& begin(int segment) const { return points[size_t(segment)]; }
    const Point& end(int segment) const { return points[size_t(next[size_t(segment)])]; }
    // Of p to a segment; consistent for all segments and vertices.
    bool left_of(int segment, const Point& p) const { return area(begin(segment), end(segment), p) >= 0; }
    bool crosses(int segment, const Point& p, const Point& q) const {
        return left(p, q, begin(segment)) != left(p, q, end(segment)) &&
               left_of(segment, p) != left_of(segment, q);
    }
    Box box(int segment) const {
        Box b;
        b.extend(begin(segment));
        b.extend(end(segment));
        return b;
    }
    void overlapping(const Box& box, std::vector<int>& segments) const; // rising numbers
    bool keeps(const Point& p) const;
    // As seen just outside of a whole loop: without the segments from `first` round to itself.
    bool keeps_without(const Point& p, int first) const;

  private:
    void add_loop(const std::vector<std::array<double, 2>>& loop);
    void make_rows();
    size_t row_of(int64_t y) const;
    bool odd(const Point& p, const std::vector<int>& segments) const;

    bool m_outside = false;
    Box m_box;
    std::vector<std::vector<int>> m_rows; // segments by the strips of v that they touch
};

} // namespace kanuka::geom
