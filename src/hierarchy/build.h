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
    int finer = 1;          // micropolygons that a side of a cell stands for, where it is flat
    // Where the vertices are as an interval of time ends which begins with `positions`; null = it stands
    // still.
    const float* later = nullptr;
};

struct MeshView {
    const float* positions; // xyz
    size_t vertices;
    const uint32_t* corners; // `sides` a face; a face with a corner that no vertex has is left out
    size_t faces;
    int sides = 3;                // or 4: triangles (0, 1, 3) and (2, 3, 1), which are numbered as faces
    bool is_grid = false;         // its vertices stand on the lattice of grids
    const float* later = nullptr; // as of GridView

    size_t triangles() const { return faces * size_t(sides - 2); }
};

// False where one of them is nowhere: the triangle is left out. `end`: 1 = as they are later.
bool corners_of_triangle(const MeshView& mesh, size_t triangle, int end, Vec3f (&to)[3]);

// Round segments, from a vertex to the next.
struct FibreView {
    const float* vertices; // xyz and the radius
    size_t count;
    const uint32_t* first; // of each segment; one that has no second vertex is left out
    size_t segments;
    const float* later = nullptr; // as of GridView
    bool balls = false;           // segments end where they begin: each is a ball
};

// All of it stands still, or all changes.
struct Content {
    std::span<const GridView> grids;
    std::span<const MeshView> meshes;
    // Corners of meshes are to stand where 16 bits a coordinate put them, not 32 bits for all three: for
    // polygons that may be as large as the picture.
    bool fine_meshes = false;
    std::span<const FibreView> fibres = {};

    bool changes() const;
};

// What the leaves of this content wish for as they are at the beginning, fibres aside: pages that share edges
// add theirs up, and are built on one lattice.
StepVotes votes_of(const Content& content);
// Likewise for all fibres that may touch.
FibreLattice fibre_lattice_of(std::span<const FibreView> fibres);

// Meshes have one of their own: their polygons may be large in a picture.
struct Lattices {
    Lattice grids, meshes;
    FibreLattice fibres = {};
};

// In parallel; the same bytes for any number of threads. Throws Error where a page would be too large, or the
// content has more grids, faces or segments than names.
PageMemory build(const Content& content, const Lattice& lattice);
PageMemory build(const Content& content, const Lattices& lattices);

// What a hit of a grid is in.
struct Cell {
    uint32_t grid;
    int column, row;
};
// `leaf` is of grids, `cell` from 0 to 15.
Cell cell_of(const Page& page, Ref leaf, uint32_t cell);

} // namespace kanuka::hierarchy
