// Planar polygons with holes to triangles and convex quads.
#pragma once

#include <array>
#include <vector>

#include "base/vec.h"

namespace kanuka::geom {

// A face as loops of 3D points: the first is the outline, the others are holes. Loops may wind either way.
struct Loops {
    std::vector<Vec3f> points;   // all loops, one after another
    std::vector<int> loop_first; // begin of each loop, and the end of the last
};

// Twice the area times the unit normal (Newell's method) of the outline.
Vec3f newell_normal(const Vec3f* points, int count);
// All corners turn the same way as `normal`.
bool is_convex(const Vec3f* points, int count, const Vec3f& normal);

// Triangles as indices into `points`, wound as the outline is. Ear clipping; holes are joined to the outline
// by bridges (Eberly, "Triangulation by Ear Clipping", 2002). Self-intersecting input gives some covering,
// and always ends.
std::vector<std::array<int, 3>> triangulate(const Loops& loops);

// Joins neighbouring triangles to convex quads; the last entry is -1 for a triangle.
std::vector<std::array<int, 4>> join_quads(const std::vector<std::array<int, 3>>& triangles,
                                           const Loops& loops);

} // namespace kanuka::geom
