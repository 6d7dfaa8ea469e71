#include "geom/triangulate.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>

namespace kanuka::geom {

Vec3f newell_normal(const Vec3f* p, int count) {
    double x = 0, y = 0, z = 0;
    for (int i = 0; i < count;
         i++) { // relative to the first point, so that far-away polygons keep their digits
        const Vec3f a = p[i] - p[0], b = p[i + 1 < count ? i + 1 : 0] - p[0];
        x += double(a.y) * b.z - double(a.z) * b.y;
        y += double(a.z) * b.x - double(a.x) * b.z;
        z += double(a.x) * b.y - double(a.y) * b.x;
    }
    return {float(x), float(y), float(z)};
}

bool is_convex(const Vec3f* p, int count, const Vec3f& normal) {
    using V = std::array<double, 3>; // fourth powers of lengths: beyond single precision from 60 000 on
    const auto v = [](const Vec3f& f) { return V{double(f.x), double(f.y), double(f.z)}; };
    const auto inner = [](const V& a, const V& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
    const V n = v(normal);
    for (int i = 0; i < count; i++) {
        const V a = v(p[(i + 1) % count] - p[i]), b = v(p[(i + 2) % count] - p[(i + 1) % count]);
        const V c{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
        if (inner(c, n) < -1e-6 * std::sqrt(inner(n, n) * inner(a, a) * inner(b, b)))
            return false;
    }
    return true;
}

namespace {

struct Point2 {
    double x, y;
};

double orient(const Point2& a, const Point2& b, const Point2& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

bool same(const Point2& a, const Point2& b) {
    return a.x == b.x && a.y == b.y;
}

// Strictly inside or on the border of a counter-clockwise triangle, its corners not counted.
bool covers(const Point2& a, const Point2& b, const Point2& c, const Point2& p) {
    return !same(p, a) && !same(p, b) && !same(p, c) && orient(a, b, p) >= 0 && orient(b, c, p) >= 0 &&
           orient(c, a, p) >= 0;
}

// Drops the coordinate along which the normal is longest, keeping the outline counter-clockwise.
std::vector<Point2> project(const Loops& loops, const Vec3f& n) {
    const int axis = abs(n.x) > abs(n.y) ? (abs(n.x) > abs(n.z) ? 0 : 2) : (abs(n.y) > abs(n.z) ? 1 : 2);
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    const bool mirrored = n[axis] < 0;
    std::vector<Point2> out;
    for (const Vec3f& p : loops.points)
        out.push_back(mirrored ? Point2{p[b], p[a]} : Point2{p[a], p[b]});
    return out;
}

double loop_area(const std::vector<Point2>& p, const std::vector<int>& loop) {
    double sum = 0;
    for (size_t i = 0; i < loop.size(); i++) {
        const Point2 &a = p[loop[i]], &b = p[loop[(i + 1) % loop.size()]];
        sum += (a.x - p[loop[0]].x) * (b.y - p[loop[0]].y) - (b.x - p[loop[0]].x) * (a.y - p[loop[0]].y);
    }
    return sum;
}

// Does the outline's corner i see q at once, between the edges that meet there? Corners that bridges meet at
// are there twice or more, each with its own part of the angle.
bool opens_to(const std::vector<Point2>& p, const std::vector<int>& outline, int i, const Point2& q) {
    const int n = int(outline.size());
    const Point2 &at = p[outline[i]], &before = p[outline[(i + n - 1) % n]], &after = p[outline[(i + 1) % n]];
    const bool left_of_after = orient(at, after, q) >= 0, left_of_before = orient(before, at, q) >= 0;
    return orient(before, at, after) > 0 ? left_of_after && left_of_before : left_of_after || left_of_before;
}

// Where the hole's rightmost corner m sees the outline: a ray to the right leaves through an edge, whose end
// farther right is a candidate; a reflex corner inside the triangle (m, hit, candidate) is seen first.
int bridge_corner(const std::vector<Point2>& p, const std::vector<int>& outline, const Point2& m) {
    const int n = int(outline.size());
    double hit_x = std::numeric_limits<double>::infinity();
    int candidate = -1;
    for (int i = 0; i < n; i++) {
        const Point2 &a = p[outline[i]], &b = p[outline[(i + 1) % n]];
        if (!(a.y <= m.y && m.y <= b.y && a.y < b.y)) // the inside is to the left of what goes up
            continue;
        const double x = a.x + (m.y - a.y) / (b.y - a.y) * (b.x - a.x);
        if (x >= m.x && x < hit_x) {
            hit_x = x;
            candidate = a.x > b.x ? i : (i + 1) % n;
        }
    }
    if (candidate < 0) { // the hole is not inside: take the nearest corner
        const auto far = [&](int i) {
            const Point2& q = p[outline[i]];
            return (q.x - m.x) * (q.x - m.x) + (q.y - m.y) * (q.y - m.y);
        };
        candidate = 0;
        for (int i = 1; i < n; i++)
            if (far(i) < far(candidate))
                candidate = i;
        return candidate;
    }
    const Point2 hit{hit_x, m.y}, c = p[outline[candidate]];
    double least = std::numeric_limits<double>::infinity(), nearest = least;
    int seen = -1;
    for (int i = 0; i < n; i++) {
        const Point2& q = p[outline[i]];
        if (q.x < m.x || same(q, m) || !opens_to(p, outline, i, m))
            continue;
        const bool in_triangle = c.y > m.y ? covers(m, hit, c, q) : covers(m, c, hit, q);
        if (!in_triangle && !same(q, c) && !same(q, hit))
            continue;
        const double slope = std::abs(q.y - m.y) / std::max(q.x - m.x, 1e-300);
        if (slope < least || (slope == least && q.x < nearest))
            least = slope, nearest = q.x, seen = i;
    }
    return seen >= 0 ? seen : candidate;
}

std::vector<int> join_holes(const std::vector<Point2>& p, const Loops& loops) {
    std::vector<std::vector<int>> rings;
    for (size_t l = 0; l + 1 < loops.loop_first.size(); l++) {
        std::vector<int> ring;
        for (int i = loops.loop_first[l]; i < loops.loop_first[l + 1]; i++)
            ring.push_back(i);
        if (l > 0 && ring.size() < 3)
            continue;
        if (l > 0 && loop_area(p, ring) > 0)
            std::reverse(ring.begin(), ring.end());
        rings.push_back(std::move(ring));
    }
    const auto rightmost = [&](const std::vector<int>& ring) {
        return std::max_element(ring.begin(), ring.end(), [&](int a, int b) { return p[a].x < p[b].x; });
    };
    std::stable_sort(rings.begin() + 1, rings.end(),
                     [&](const auto& a, const auto& b) { return p[*rightmost(a)].x > p[*rightmost(b)].x; });
    std::vector<int> outline = rings[0];
    for (size_t l = 1; l < rings.size(); l++) {
        std::vector<int>& hole = rings[l];
        std::rotate(hole.begin(), hole.begin() + (rightmost(hole) - hole.cbegin()), hole.end());
        const int at = bridge_corner(p, outline, p[hole[0]]);
        std::vector<int> joined(outline.begin(), outline.begin() + at + 1);
        joined.insert(joined.end(), hole.begin(), hole.end());
        joined.push_back(hole[0]);
        joined.insert(joined.end(), outline.begin() + at, outline.end());
        outline = std::move(joined);
    }
    return outline;
}

} // namespace

std::vector<std::array<int, 3>> triangulate(const Loops& loops) {
    std::vector<std::array<int, 3>> out;
    const int outline_size = loops.loop_first[1] - loops.loop_first[0];
    if (outline_size < 3)
        return out;
    const std::vector<Point2> p = project(loops, newell_normal(loops.points.data(), outline_size));
    const std::vector<int> ring = join_holes(p, loops);
    const int n = int(ring.size());
    std::vector<int> next(n), prev(n);
    for (int i = 0; i < n; i++) {
        next[i] = (i + 1) % n;
        prev[i] = (i + n - 1) % n;
    }
    const auto at = [&](int i) -> const Point2& { return p[ring[i]]; };
    const auto is_ear = [&](int i) {
        const Point2 &a = at(prev[i]), &b = at(i), &c = at(next[i]);
        if (orient(a, b, c) <= 0)
            return false;
        for (int k = next[next[i]]; k != prev[i]; k = next[k])
            if (orient(at(prev[k]), at(k), at(next[k])) <= 0 && covers(a, b, c, at(k)))
                return false;
        return true;
    };
    int i = 0, since_ear = 0;
    for (int left = n; left > 3;) {
        // Corners on a straight line are taken too once a whole round found no ear: they cover nothing.
        const bool forced = since_ear > left;
        const double o = orient(at(prev[i]), at(i), at(next[i]));
        if (is_ear(i) || (forced && (o == 0 || since_ear > 2 * left))) {
            if (o != 0)
                out.push_back({ring[prev[i]], ring[i], ring[next[i]]});
            next[prev[i]] = next[i];
            prev[next[i]] = prev[i];
            left--;
            since_ear = 0;
            i = next[next[i]]; // hopping over one neighbour gives fewer slivers
        } else {
            i = next[i];
            since_ear++;
        }
    }
    if (orient(at(prev[i]), at(i), at(next[i])) != 0)
        out.push_back({ring[prev[i]], ring[i], ring[next[i]]});
    return out;
}

std::vector<std::array<int, 4>> join_quads(const std::vector<std::array<int, 3>>& triangles,
                                           const Loops& loops) {
    std::unordered_map<uint64_t, int> open; // directed edge -> triangle * 3 + corner
    const auto key = [](int a, int b) { return uint64_t(uint32_t(a)) << 32 | uint32_t(b); };
    for (size_t t = 0; t < triangles.size(); t++)
        for (int k = 0; k < 3; k++)
            open.emplace(key(triangles[t][k], triangles[t][(k + 1) % 3]), int(t * 3 + k));
    std::vector<bool> used(triangles.size(), false);
    std::vector<std::array<int, 4>> out;
    for (size_t t = 0; t < triangles.size(); t++) {
        if (used[t])
            continue;
        used[t] = true;
        std::array<int, 4> best{triangles[t][0], triangles[t][1], triangles[t][2], -1};
        float best_shape = 0;
        int partner = -1;
        for (int k = 0; k < 3; k++) {
            const int a = triangles[t][k], b = triangles[t][(k + 1) % 3], c = triangles[t][(k + 2) % 3];
            const auto found = open.find(key(b, a));
            if (found == open.end() || used[found->second / 3])
                continue;
            const int d = triangles[found->second / 3][(found->second % 3 + 2) % 3];
            const Vec3f q[4] = {loops.points[a], loops.points[d], loops.points[b], loops.points[c]};
            const Vec3f n = newell_normal(q, 4);
            // The flattest corner decides: sin of the smallest turn.
            float shape = 1;
            for (int i = 0; i < 4; i++) {
                const Vec3f e = q[(i + 1) % 4] - q[i], f = q[(i + 2) % 4] - q[(i + 1) % 4];
                shape = min(shape, dot(cross(e, f), n) / (length(e) * length(f) * length(n) + 1e-30f));
            }
            if (shape > max(0.1f, best_shape)) {
                best_shape = shape;
                best = {a, d, b, c};
                partner = found->second / 3;
            }
        }
        if (partner >= 0)
            used[partner] = true;
        out.push_back(best);
    }
    return out;
}

} // namespace kanuka::geom
