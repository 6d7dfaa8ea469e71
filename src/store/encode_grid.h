// One grid or mesh on its way into a page.
#pragma once

#include "color/color.h"
#include "store/store.h"

namespace kanuka::store {

// Everything of one grid, offsets relative to its own sections.
struct Encoded {
    ShapeRecord shape{};
    std::vector<uint32_t> table; // {offset into inputs, stride}
    std::vector<uint32_t> inputs;
    std::vector<float> positions;
    std::vector<std::vector<float>> later; // positions at further steps
    std::vector<uint32_t> indices;
    std::vector<Emitter> emitters;
    uint64_t bad = 0, lost = 0;
};

// What is constant folded, what is not quantised.
void encode_grid(const ShadedGrid& shaded, const grid::LayeringProgram& program,
                 const grid::WordLayout& layout, const color::Palette& palette, Encoded& out);

} // namespace kanuka::store
