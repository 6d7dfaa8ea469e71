// Area lights by shader: the shader runs on the surface that shines, and what it would send straight ahead,
// to unit distance, is the radiance of its place.
#pragma once

#include "grid/grid.h"
#include "sl/sl.h"

namespace kanuka::shade {

// `shader` was compiled with CompileOptions::area_light. Cl is finite and not negative.
sl::Emission run_area_light(const sl::Instance& shader, const grid::Grid& grid,
                            const sl::GridGlobals& globals, sl::Services& services);

// The cosine to the normal below which the light is dark: of illuminate (P, N, angle); 0 = a hemisphere.
float cone_of(const sl::Emission& emission);

} // namespace kanuka::shade
