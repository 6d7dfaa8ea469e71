// Bounds of a field's density in the cells of a coarse grid, by which collisions are sampled.
#pragma once

#include <array>
#include <vector>

#include "store/store.h"

namespace kanuka::transport {

struct Majorants {
    std::array<int, 3> cells{1, 1, 1};
    std::vector<float> values; // none of the cell's densities is above; x runs fastest
};

// The finest of the bounds with `cells` along each axis, or as many as the lattice has there.
Majorants bound_density(const store::DensityField& field, int cells);

// Of the grids of 1, 2, 4, 8 and 16 cells along each axis the one by which rays through it take the fewest
// steps, where `extinction` is the most there is, in 1/m.
Majorants make_majorants(const store::DensityField& field, float extinction);

} // namespace kanuka::transport
