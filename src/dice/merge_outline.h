// Where vertices of merged pieces are traced: as outline.h has it, of a mesh's edges in place of a grid's.
#pragma once

#include <span>

#include "grid/grid.h"

namespace kanuka::dice {

// Laid out like Grid::P. `points`: of a vertex, the first of all that are in its place. `borders`: of such a
// point, it lies on an edge that one face alone has. Quads.
std::vector<float> standing_off(const grid::Grid& vertices, const grid::TracedMesh& mesh,
                                std::span<const uint32_t> points, std::vector<char> borders);

} // namespace kanuka::dice
