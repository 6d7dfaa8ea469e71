// Triangles that are two halves of a flat quadrilateral, made one again: a triangle costs three grids, a
// quadrilateral one.
#pragma once

#include "geom/polygon_faces.h"
#include "geom/primvars.h"
#include "geom/surface.h"

namespace kanuka::geom {

// Joins triangles in pairs where nothing can tell afterwards: both lie in one plane, the quadrilateral is
// convex, and every primvar is one linear function over both. O(pieces).
void pair_triangles(const PolygonFaces& faces, const ControlPoints& points, const Primvars& primvars,
                    Pieces& pieces);

} // namespace kanuka::geom
