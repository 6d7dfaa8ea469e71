#include "dice/trim_polygon.h"

#include <cmath>

#include "geom/triangulate.h"

namespace kanuka::dice {
namespace {

using geom::TrimRegion;
using Point = TrimRegion::Point;
using Triangles = std::vector<std::array<uint32_t, 3>>;

constexpr size_t MostEars = 64; // of an outline that is searched for the best one

// All of n - 2 triangles, those without area too: a corner that lies on its neighbours' line is a corner
// of what lies on the other side.
void clip_ears(const Polygon& o, bool backwards, Triangles& out) {
    std::vector<size_t> left(o.points.size());
    for (size_t i = 0; i < left.size(); i++)
        left[i] = backwards ? left.size() - 1 - i : i;
    while (left.size() > 2) {
        const size_t n = left.size();
        size_t best = 0;
        double least = -1; // of the angle's sine
        for (size_t i = 0; i < n; i++) {
            const size_t before = left[(i + n - 1) % n], at = left[i], after = left[(i + 1) % n];
            const Point &a = o.points[before], &b = o.points[at], &c = o.points[after];
            const double twice = double(TrimRegion::area(a, b, c));
            bool free = twice > 0;
            for (size_t k = 0; k < n && free; k++) {
                const Point& p = o.points[left[k]];
                free = p == a || p == b || p == c || TrimRegion::area(a, b, p) < 0 ||
                       TrimRegion::area(b, c, p) < 0 || TrimRegion::area(c, a, p) < 0;
            }
            if (!free)
                continue;
            const double ab = std::hypot(double(b.x - a.x), double(b.y - a.y)),
                         bc = std::hypot(double(c.x - b.x), double(c.y - b.y)),
                         ca = std::hypot(double(a.x - c.x), double(a.y - c.y));
            const double quality = twice / (ab * bc + bc * ca + ca * ab);
            if (quality > least) {
                least = quality;
                best = i;
            }
        }
        out.push_back(
            {o.vertices[left[(best + n - 1) % n]], o.vertices[left[best]], o.vertices[left[(best + 1) % n]]});
        left.erase(left.begin() + ptrdiff_t(best));
    }
}

} // namespace

bool around(const Polygon& o, const Point& p) {
    bool odd = false;
    for (size_t i = 0; i < o.points.size(); i++) {
        const Point &a = o.points[i], &b = o.points[(i + 1) % o.points.size()];
        if ((a.y > p.y) != (b.y > p.y))
            odd ^= (TrimRegion::area(a, b, p) > 0) == (b.y > a.y);
    }
    return odd;
}

double extent(const Polygon& o) {
    double twice = 0;
    for (size_t i = 1; i + 1 < o.points.size(); i++)
        twice += double(TrimRegion::area(o.points[0], o.points[i], o.points[i + 1]));
    return twice;
}

Triangles triangles_of(const Polygon& o, const std::vector<Polygon>& holes, const Point& origin) {
    Triangles out;
    if (o.points.size() <= MostEars && o.holes.empty()) {
        clip_ears(o, extent(o) < 0, out);
        return out;
    }
    // Relative to a corner the whole numbers are exact as floats.
    geom::Loops loops;
    std::vector<uint32_t> vertices;
    loops.loop_first = {0};
    const auto add = [&](const Polygon& part, bool backwards) {
        for (size_t i = 0; i < part.points.size(); i++) {
            const size_t k = backwards ? part.points.size() - 1 - i : i;
            loops.points.push_back(
                {float(part.points[k].x - origin.x), float(part.points[k].y - origin.y), 0});
            vertices.push_back(part.vertices[k]);
        }
        loops.loop_first.push_back(int(loops.points.size()));
    };
    add(o, extent(o) < 0);
    for (const size_t h : o.holes)
        add(holes[h], false);
    for (const auto& t : geom::triangulate(loops))
        out.push_back({vertices[size_t(t[0])], vertices[size_t(t[1])], vertices[size_t(t[2])]});
    return out;
}

} // namespace kanuka::dice
