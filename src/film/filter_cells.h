// Pixel filters by their values in cells: what a program's own function is brought to.
#pragma once

#include "film/film.h"

namespace kanuka::film {

Filter::Sample sample_cells(const Filter::Cells& cells, float u0, float u1);

} // namespace kanuka::film
