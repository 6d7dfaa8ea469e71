// Pieces to grids: evaluates each piece's lattice, its sides moved onto the shared polylines.
#pragma once

#include "dice/split.h"

namespace kanuka::dice {

// Walks the boundary of a piece: each vertex once.
struct BoundaryVertex {
    int index;  // in the grid
    int point;  // Splitter's number
    bool moved; // not where the polyline's vertex lies of itself
};

grid::Grid make_grid(const Splitter& splitter, const Piece& piece);
// Of another surface with the same topology.
grid::Grid make_grid(const Splitter& splitter, const geom::Surface& surface, const Piece& piece);
// The same into a grid of this many cells that the surface has made channels for.
void fill_grid(const Splitter& splitter, const geom::Surface& surface, const Piece& piece, grid::Grid& grid);
// Part of a piece's lattice: vertices from (i0, j0) to (i1, j1).
struct LatticePart {
    int i0 = 0, j0 = 0, i1 = 0, j1 = 0;
    int columns() const { return i1 - i0 + 1; }
    int rows() const { return j1 - j0 + 1; }
};
// The same into a grid of so many vertices, where no side is moved; of pieces of at most MostFew cells a
// side.
constexpr int MostFew = 32;
void fill_part(const geom::Surface& surface, const Piece& piece, const LatticePart& part, grid::Grid& grid);
void list_boundary(const Splitter& splitter, const Piece& piece, std::vector<BoundaryVertex>& out);
// Where side k's polyline vertices lie: lattice index i of the side is moved to side_parameters[i].
void side_parameters(const Splitter& splitter, const Piece& piece, int side, std::vector<float>& out);

} // namespace kanuka::dice
