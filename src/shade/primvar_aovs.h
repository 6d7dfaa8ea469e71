// Primitive variables as layers of the picture: what a display asks for by a name that the surface has no
// output parameter of, and the primitive a variable.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "grid/grid.h"
#include "grid/layering.h"
#include "scene/scene.h"

namespace kanuka::shade {

struct PrimvarAov {
    int index = 0;    // among the layers that are asked for
    std::string name; // of the variable; empty = P, which stands for a reference position that is not there
    scene::Type type = scene::Type::Float;
    int components = 1;
    bool varying = false;
    Vec3f value{0, 0, 0}; // where it does not vary
};

// Those of `wanted` that the primitive has. The reference position, Pref or __Pref, every primitive has.
std::vector<PrimvarAov> primvar_aovs(const scene::Primitive& primitive, std::span<const std::string> wanted);

// Adds one to the program, of an output parameter or a variable: a float slot for each component.
void add_aov(grid::LayeringProgram& program, int index, const std::string& name, scene::Type type,
             int components);

// Values in the primitive's own space, as they were given: grids have them in current space.
void fill_primvar_aov(const PrimvarAov& aov, const grid::Aov& slots, const grid::Grid& grid,
                      const Transform& current_from_object, grid::VertexInputs& out);

} // namespace kanuka::shade
