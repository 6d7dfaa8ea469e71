// What a render will take, held against what the machine has before the work begins.
#pragma once

#include "base/error.h"
#include "render/accumulator.h"

namespace kanuka::render {

// No picture can be made: not a fault of one primitive, which others survive.
struct CannotFit : Error {
    using Error::Error;
};
// Of the machine, or what this process may have of it.
uint64_t machine_memory();
// The most that this process has had in memory at once.
uint64_t peak_memory();
// Throws CannotFit with the figure where the sums of a picture's pixels, and the picture made of them, cannot
// fit. sums: of how many blocks of progressions each pixel has sums at the end.
void refuse_what_cannot_fit(const Window& window, size_t aovs, uint64_t memory, int sums = 1);
// Throws CannotFit where geometry has grown so large that its ray-tracing structure cannot fit beside it.
void refuse_geometry_that_cannot_fit(uint64_t bytes, uint64_t memory);
// Throws CannotFit: while it is diced and shaded, a primitive takes so much beside what is there.
[[noreturn]] void refuse_primitive_that_cannot_fit(const Location& where, uint64_t bytes, uint64_t there,
                                                   uint64_t memory);
// Threads are for work, and the machine has so many.
constexpr int MostThreads = 4096;
void check_threads(int threads);

} // namespace kanuka::render
