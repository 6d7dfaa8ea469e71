// What may be said of where a ray hits: every triangle is looked at in doubles, and answers count as right
// within the rounding that docs/hierarchy.md allows ("Robustness").
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "hierarchy/test_oracle.h"

namespace kanuka::hierarchy::bench {

using testing::Point;

class ExactHits {
  public:
    // `away`: of a ray that is rounded again in instances, its largest coordinate.
    explicit ExactHits(const Ray& ray, double away = 0) : m_o(ray.o), m_away(away) {
        const Point d(ray.d);
        m_length = std::sqrt(dot(d, d));
        m_w = {d.x / m_length, d.y / m_length, d.z / m_length};
        const Point aside = std::abs(m_w.x) < 0.6 ? Point(1, 0, 0) : Point(0, 1, 0);
        m_u = cross(m_w, aside);
        const double norm = std::sqrt(dot(m_u, m_u));
        m_u = {m_u.x / norm, m_u.y / norm, m_u.z / norm};
        m_v = cross(m_w, m_u);
    }

    // Is anything within that ball worth looking at?
    bool comes_near(const Point& centre, double radius) const {
        const Point p = centre - m_o;
        const double reach = radius + 1e-5 * (size(centre) + radius), along = dot(p, m_w);
        return dot(p, p) - along * along <= reach * reach && along >= -2 * radius;
    }

    void look_at(const Point& a, const Point& b, const Point& c) {
        // Corners as the ray sees them; z in units of its direction.
        std::array<Point, 3> p{seen(a), seen(b), seen(c)};
        const auto [least, most] = std::minmax({p[0].z, p[1].z, p[2].z});
        const double scale = m_away + std::max({size(a), size(b), size(c)});
        // Sheared coordinates are off by 5 eps of the largest coordinate, both together by less than 8.
        const double off = 8 * Epsilon * scale, late = 16 * Epsilon * scale / m_length;
        if (most < 0 || std::min({p[0].x, p[1].x, p[2].x}) > off || std::max({p[0].x, p[1].x, p[2].x}) < -off)
            return;
        const double area = turn(p[0], p[1]) + turn(p[1], p[2]) + turn(p[2], p[0]);
        bool inside = area != 0;
        double nearest = INFINITY, depth = 0;
        for (int k = 0; k < 3; k++) {
            const Point &q = p[size_t(k)], &r = p[size_t(k + 1) % 3];
            nearest = std::min(nearest, distance(q, r));
            inside &= turn(q, r) * area >= 0;
            depth += turn(q, r) * p[size_t(k + 2) % 3].z;
        }
        if (!inside && nearest > off)
            return;
        // As far as the ray may be off, so much the plane may be nearer or further, but no more than its
        // corners.
        Candidate found{least, most, inside && nearest > off && least > late};
        if (area != 0) {
            const Point normal = cross(p[1] - p[0], p[2] - p[0]);
            const double slack = off * std::hypot(normal.x, normal.y) / std::abs(normal.z);
            found.first = std::clamp(depth / area - slack, least, most);
            found.last = std::clamp(depth / area + slack, least, most);
        }
        found.first -= late, found.last += late;
        m_candidates.push_back(found);
    }

    // May the closest hit be at t? Infinite: may there be none?
    bool allow(double t) const {
        bool any = !std::isfinite(t);
        for (const Candidate& c : m_candidates) {
            any |= t >= c.first && t <= c.last;
            if (c.certain && c.last < t)
                return false;
        }
        return any;
    }

  private:
    static constexpr double Epsilon = 0x1p-24;
    struct Candidate {
        double first, last; // distances
        bool certain;       // no rounding lets the ray pass
    };
    Point seen(const Point& at) const {
        const Point p = at - m_o;
        return {dot(p, m_u), dot(p, m_v), dot(p, m_w) / m_length};
    }
    double size(const Point& at) const {
        const Point p = at - m_o;
        return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    }
    static double turn(const Point& a, const Point& b) { return a.x * b.y - a.y * b.x; }
    // Of the ray from a side.
    static double distance(const Point& a, const Point& b) {
        const double x = b.x - a.x, y = b.y - a.y, squared = x * x + y * y;
        const double s = squared > 0 ? std::clamp(-(a.x * x + a.y * y) / squared, 0.0, 1.0) : 0;
        return std::hypot(a.x + s * x, a.y + s * y);
    }
    Point m_o, m_u{0, 0, 0}, m_v{0, 0, 0}, m_w{0, 0, 0};
    double m_away, m_length;
    std::vector<Candidate> m_candidates;
};

} // namespace kanuka::hierarchy::bench
