// How much a smooth surface bends from one vertex to the next.
#pragma once

#include <algorithm>

#include "base/vec.h"

namespace kanuka::geom {

// Traced vertices stand off by this much of the second difference along each of four edges (dice/outline.h).
inline constexpr float BendOfAnEdge = 1.0f / 32;

inline constexpr float LeastTurn = 1e-5f; // radians along an edge: what single precision turns flat ones by
inline constexpr float MostTurn = -0.1f;  // its cosine: of one cell, a right angle, nearly

// The part along the normal of the second difference of an edge whose ends have these unit normals. Its sign
// goes with theirs: times a normal it points to where the surface is convex.
inline float bend_of(const Vec3f& na, const Vec3f& nb, const Vec3f& edge) {
    const float bend = dot(nb - na, edge);
    return bend * bend > LeastTurn * LeastTurn * length_squared(edge) && dot(na, nb) > MostTurn ? bend : 0;
}

// Chords lie inside of a convex surface, and what they miss is made up for. Of a saddle facets lie on both
// sides, those of a twisted one outside alone: the part that stands off, of second differences along two
// lines, l and n, and across, m.
inline float part_of_saddle(float l, float n, float m) {
    const float gauss = l * n - m * m, sum = l + n;
    return gauss < 0 ? std::max(0.0f, 1 + 4 * gauss / std::max(sum * sum, 1e-37f)) : 1.0f;
}

} // namespace kanuka::geom
