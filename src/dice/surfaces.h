// Primitives that become surfaces: split, diced to grids, joined, displaced, welded, and traced as coarse as
// stays within the tolerance. What is finer than the rate is merged to a mesh.
#pragma once

#include "dice/density.h"
#include "geom/surface.h"

namespace kanuka::dice {

// Does displacement or shading read u and v?
bool reads_parameters(const DiceTarget& target);

// At every step that `target` has of it.
Diced dice_surface(const scene::Primitive& primitive, const DiceTarget& target,
                   const geom::SurfaceHints& hints, const RateRule& rule, bool simplify,
                   const Displace& displace, Journal& journal);

} // namespace kanuka::dice
