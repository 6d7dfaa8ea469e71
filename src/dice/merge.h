// Pieces of hardly a micropolygon each, as one mesh: a subdivision or patch mesh that is finer than the rate.
#pragma once

#include "dice/gridder.h"
#include "geom/traced_mesh.h"

namespace kanuka::dice {

// All pieces' lattices with their shared vertices joined, except where normals, primvars or u and v differ.
// Where those are a face's own and nobody reads them (`parameters`) they do not count: a shared vertex has
// those of one of its faces. The result has a part for every surface: the splitter's, then the later ones, of
// the same vertices. `outlines`: what is traced stands off (merge_outline.h).
std::vector<geom::MeshParts> merge_pieces(const Splitter& splitter,
                                          std::span<const std::unique_ptr<geom::Surface>> later,
                                          bool parameters, bool outlines);

} // namespace kanuka::dice
