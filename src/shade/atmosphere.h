// A volume shader between surface and camera, read as what it does to light: Ci' = filter * Ci + glow.
#pragma once

#include "grid/grid.h"
#include "grid/layering.h"
#include "sl/sl.h"

namespace kanuka::shade {

// Adds the slots that fill_atmosphere() fills.
void add_atmosphere(grid::LayeringProgram& program);

// Runs the shader at every vertex for black and for white surfaces that are opaque: two points of a line. One
// that is no line, found by a third colour at some vertices, is reported at `where`.
void fill_atmosphere(const sl::Instance& shader, grid::Grid& grid, const sl::GridGlobals& globals,
                     sl::Services& services, const Location& where, const grid::LayeringProgram& program,
                     grid::VertexInputs& out);

} // namespace kanuka::shade
