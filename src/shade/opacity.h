// Cs and Os outside shaders: colours of grids, and opacity as presence.
#pragma once

#include "grid/grid.h"
#include "grid/layering.h"

namespace kanuka::shade {

const grid::Channel* find_channel(const grid::Grid& grid, const char* name,
                                  int components); // null = not there

// The grid's primvar of that name, or the constant where there is none.
void fill_color(const grid::Grid& grid, const char* name, const Vec3f& constant, grid::SlotValues& out);

// Presence is one number a vertex: the mean of Os, in [0, 1].
int add_presence_slot(grid::LayeringProgram& program, bool uniform); // its index
void fill_presence(const grid::Grid& grid, const Vec3f& opacity, grid::SlotValues& out);

} // namespace kanuka::shade
