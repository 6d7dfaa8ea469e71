// Trimming of diced grids: whole grids are kept or dropped; of those that a trim curve crosses every traced
// triangle is cut along it.
#pragma once

#include "dice/gridder.h"
#include "geom/trim.h"
#include "grid/trimmed.h"

namespace kanuka::dice {

enum class Kept : uint8_t { All, None, Part };

// Of all that a grid covers.
Kept kept_of(const geom::TrimRegion& region, const grid::Grid& grid);
// Triangles of what is left of a grid that is kept in part. `traced` has steps of 1.
grid::TrimmedMesh cut_grid(const geom::TrimRegion& region, const Piece& piece, const grid::Grid& grid,
                           const grid::TracedGrid& traced);
// The loops as polygons fine enough for the rates.
geom::TrimRegion make_region(const geom::Surface& surface, const RateRule& rule, const Location& where,
                             Journal& journal);

} // namespace kanuka::dice
