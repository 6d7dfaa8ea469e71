// Pieces of hardly a micropolygon each, as one mesh: a subdivision or patch mesh that is finer than the rate.
#pragma once

#include "dice/gridder.h"
#include "geom/traced_mesh.h"

namespace kanuka::dice {

// All pieces' lattices with their shared vertices joined, except where normals or primvars differ. u and v at
// a shared vertex are those of one of its faces.
// The result has a part for every surface: the splitter's, then the later ones, of the same vertices.
std::vector<geom::MeshParts> merge_pieces(const Splitter& splitter,
                                          std::span<const std::unique_ptr<geom::Surface>> later);

// Vertices from … from + count of one grid to to … of another that has the same channels: every array.
void copy_vertices(const grid::Grid& source, size_t from, grid::Grid& target, size_t to, size_t count);

} // namespace kanuka::dice
