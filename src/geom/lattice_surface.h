// What patch meshes, NURBS and quadrics share: faces in rows and columns.
#pragma once

#include "geom/surface.h"

namespace kanuka::geom {

// A lattice of faces. Sides that are one point become poles; sides that meet their opposite become a seam, so
// that a closed shape is closed for dicing too. Both are found by evaluating the surface.
LatticeShape find_lattice(const Surface& surface, LatticeShape shape);

// P = (X/w, Y/w, Z/w) and its derivatives, in place: the lattice holds the homogeneous values and slopes.
void divide_rational(const float* w, const float* wu, const float* wv, int count_u, int count_v,
                     Lattice lattice);

} // namespace kanuka::geom
