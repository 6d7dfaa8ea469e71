// Displacement shaders, run over grids and over patches of meshes.
#pragma once

#include "dice/dice.h"
#include "geom/traced_mesh.h"

namespace kanuka::dice {

// Vertices that displacement made infinite or not a number go back to where they were. Counts them among the
// first `own`. Says in `moved` if it changed any.
size_t displace_grid(grid::Grid& g, const Displace& displace, size_t own, char* moved = nullptr);
void report_bad_displacement(size_t vertices, const Location& where, Journal& journal);

// Displaces a mesh's vertices, patch by patch. `rest`: takes what P was. N is what the shader leaves, as on
// grids.
void displace_mesh(geom::MeshParts& parts, const Displace& displace, int rings, std::vector<float>& rest,
                   const Location& where, Journal& journal);

} // namespace kanuka::dice
