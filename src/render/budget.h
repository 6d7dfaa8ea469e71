// What a render will take, held against what the machine has before the work begins.
#pragma once

#include "render/accumulator.h"

namespace kanuka::render {

// Of the machine, or what this process may have of it.
uint64_t machine_memory();
// Throws Error with the figure where the sums of a picture's pixels, and the picture made of them, cannot
// fit.
void refuse_what_cannot_fit(const Window& window, size_t aovs, uint64_t memory);
// Throws Error where geometry has grown so large that its ray-tracing structure cannot fit beside it.
void refuse_geometry_that_cannot_fit(uint64_t bytes, uint64_t memory);
// Threads are for work, and the machine has so many.
constexpr int MostThreads = 4096;
void check_threads(int threads);

} // namespace kanuka::render
