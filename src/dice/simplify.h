// The traced density: the coarsest lattice that stays near the displaced surface in position and normal.
#pragma once

#include "dice/seams.h"

namespace kanuka::dice {

// Decides every edge's step from the edge's displaced points alone, within half of the distance that may be
// lost.
void choose_edge_steps(Splitter& splitter, const std::vector<grid::Grid>& grids, const Seams& seams,
                       const RateRule& rule, bool simplify);
// Then a grid's own steps follow from its interior and what its edges have left of the distance. Both look at
// all steps of a grid that changes its shape: the finest wins. Positions are left out.
grid::TracedGrid choose_steps(const Splitter& splitter, const Piece& piece, const grid::Grid& grid,
                              const RateRule& rule, bool simplify);
// The kept vertices of one step's positions.
std::vector<float> traced_positions(const Piece& piece, const grid::Grid& grid, const std::vector<float>& P,
                                    const grid::TracedGrid& traced);

} // namespace kanuka::dice
