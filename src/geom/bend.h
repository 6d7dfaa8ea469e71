// How much a smooth surface bends from one vertex to the next.
#pragma once

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

} // namespace kanuka::geom
