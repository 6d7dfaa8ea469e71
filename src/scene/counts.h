// How many values a primvar of each storage class has on a geometry (RISpec 3.2, section 5 and table 5.1).
#pragma once

#include <optional>
#include <string>

#include "scene/scene.h"

namespace kanuka::scene {

struct PrimvarCounts {
    size_t uniform = 1, varying = 0, vertex = 0, face_varying = 0, face_vertex = 0;
    size_t of(Detail detail) const;
};

// `positions` is the number of values of P (or Pw): polygons without indices and points have as many vertices
// as that. The geometry must be well formed: see `fault_of`.
PrimvarCounts primvar_counts(const Geometry& geometry, size_t positions);

// What is wrong with the shape of a geometry, with what would do, or nothing. Checks everything that indexing
// relies on: sums of counts, signs and ranges of indices, knots, basis steps.
std::optional<std::string> fault_of(const Geometry& geometry, size_t positions);

// "Sphere", "PolygonMesh", …
std::string_view kind_name(const Geometry& geometry);
std::string_view kind_name(Light::Kind kind); // "distant", "quad", …

} // namespace kanuka::scene
