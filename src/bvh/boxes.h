// Boxes that instances place.
#pragma once

#include "base/vec.h"

namespace kanuka::bvh {

// The box around a box that a matrix (row-major 3x4) places, a little wider for rounding; empty where it is
// beyond all numbers.
Bounds3f placed(const float* m, const Bounds3f& box);

// By which the surface area heuristic counts the rays that meet a box (MacDonald and Booth 1990, Heuristics
// for ray tracing using space subdivision).
double half_area(const Bounds3f& b);

} // namespace kanuka::bvh
