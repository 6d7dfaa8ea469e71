// Primitives that are traced as the meshes they become: curves, points, blobbies, polygons and merged pieces
// of surfaces that are finer than the rate.
#pragma once

#include <functional>

#include "dice/density.h"
#include "geom/traced_mesh.h"

namespace kanuka::dice {

// `parts`: the mesh at every step, the first one first.
Diced dice_mesh(std::vector<geom::MeshParts> parts, const scene::Primitive& primitive,
                const DiceTarget& target, const Displace& displace, Journal& journal);

// A mesh at one step; `first`: null for the first one. False = there is none.
using MakeMesh = std::function<bool(const scene::Primitive& primitive, const scene::Primitive* first,
                                    Journal& journal, geom::MeshParts& parts)>;
// A mesh at every step, coarser where it would be too much. What was reported of the first is not repeated.
Diced dice_mesh_steps(const scene::Primitive& primitive, const DiceTarget& target, RateRule& rule,
                      const Displace& displace, Journal& journal, const MakeMesh& make);

void report_other_topology(const scene::Primitive& primitive, Journal& journal);

} // namespace kanuka::dice
