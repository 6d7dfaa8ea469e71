// Polygons that trim curves leave of a triangle, and their own triangles.
#pragma once

#include "geom/trim.h"

namespace kanuka::dice {

// A polygon's corners: where they are, and as vertices.
struct Polygon {
    using Point = geom::TrimRegion::Point;
    std::vector<Point> points;
    std::vector<uint32_t> vertices;
    std::vector<size_t> holes; // which of the holes lie in it

    void add(const Point& p, uint32_t vertex) {
        points.push_back(p);
        vertices.push_back(vertex);
    }
};

// Does the polygon go around the point?
bool around(const Polygon& o, const Polygon::Point& p);
// Twice its area, negative if it runs clockwise.
double extent(const Polygon& o);
// Vertices of the triangles of an outline without its holes. `origin`: near by, which floats are relative to.
std::vector<std::array<uint32_t, 3>> triangles_of(const Polygon& o, const std::vector<Polygon>& holes,
                                                  const Polygon::Point& origin);

} // namespace kanuka::dice
