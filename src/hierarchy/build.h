// Makes pages.
#pragma once

#include <span>

#include "hierarchy/lattice.h"
#include "hierarchy/page.h"

namespace kanuka::hierarchy {

// (columns + 1) x (rows + 1) vertices, rows one behind the other. Cells are split from their second corner to
// their third: triangles (0, 1, 2) and (3, 2, 1) of the corners (0, 0), (1, 0), (0, 1), (1, 1).
struct GridView {
    const float* positions; // xyz
    int columns, rows;      // cells
};

struct MeshView {
    const float* positions; // xyz
    size_t vertices;
    const uint32_t* corners; // three a face; a face with a corner that no vertex has is left out
    size_t faces;
};

struct Content {
    std::span<const GridView> grids;
    std::span<const MeshView> meshes;
};

// What the leaves of this content wish for: pages that share edges add theirs up, and are built on one
// lattice.
StepVotes votes_of(const Content& content);

// In parallel; the same bytes for any number of threads. Throws Error where a page would be too large, or the
// content has more grids or faces than names.
PageMemory build(const Content& content, const Lattice& lattice);

// What a hit of a grid is in.
struct Cell {
    uint32_t grid;
    int column, row;
};
// `leaf` is of grids, `cell` from 0 to 15.
Cell cell_of(const Page& page, Ref leaf, uint32_t cell);

} // namespace kanuka::hierarchy
