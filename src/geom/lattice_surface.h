// What patch meshes, NURBS and quadrics share: faces in rows and columns.
#pragma once

#include <functional>

#include "geom/surface.h"

namespace kanuka::geom {

// A lattice of faces. Sides that are one point become poles; sides that meet their opposite become a seam, so
// that a closed shape is closed for dicing too. Both are found by evaluating the surface.
LatticeShape find_lattice(const Surface& surface, LatticeShape shape);

// The faces of a lattice without those that a control point is not finite of, which are reported as `what`.
class FiniteFaces {
  public:
    // vertex(face, k): the k-th of a face's `each` control points, of the first `used` of `points`. Those
    // that are not finite become another one: nobody sees them, but the lattice's sides are looked at as a
    // whole. False: no face is left.
    bool find(ControlPoints& points, size_t used, int faces, int each,
              const std::function<size_t(int, int)>& vertex, const char* what, const Location& where,
              Journal& journal);
    // Takes the others out of the topology of the whole lattice.
    void keep(Topology& topology) const;
    // Where a face that is left is in the lattice.
    int in_lattice(int face) const { return m_kept.empty() ? face : m_kept[size_t(face)]; }

  private:
    std::vector<int> m_kept; // empty = all
};

// P = (X/w, Y/w, Z/w) and its derivatives, in place: the lattice holds the homogeneous values and slopes.
void divide_rational(const float* w, const float* wu, const float* wv, int count_u, int count_v,
                     Lattice lattice);

} // namespace kanuka::geom
