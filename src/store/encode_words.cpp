// Lobe inputs as words: what is constant over the grid is kept as floats, what varies takes a word a vertex.
#include "grid/lobe_table.h"
#include "store/encode_parts.h"

namespace kanuka::store {

namespace {

using grid::WordLayout;

// Is it read for emitters alone, which keep whole floats? Its word is what fits.
bool is_emission(const grid::LayeringProgram& program, int slot) {
    return std::ranges::any_of(program.nodes, [&](const grid::LayerNode& n) {
        return n.op == grid::LayerOp::Lobe && grid::lobe(n.lobe).kind == grid::LobeKind::Emission &&
               (n.weight == slot || std::ranges::find(n.inputs, slot) != n.inputs.end());
    });
}

void encode_word(size_t w, GridInputs& inputs, const WordLayout& layout, const color::Palette& palette,
                 Encoded& out) {
    const auto [low, high] = layout.slots_of_word[w];
    const uint64_t lost = out.lost;
    const bool folds = inputs.constant(low) && (high < 0 || inputs.constant(high));
    out.table.push_back(uint32_t(out.inputs.size()));
    out.table.push_back(folds ? 0 : 1);
    auto& words = out.inputs;
    if (folds && layout.words[w] == WordLayout::Word::HalfPair) {
        words.push_back(std::bit_cast<uint32_t>(inputs.value(low, 0, 0)));
        words.push_back(std::bit_cast<uint32_t>(high < 0 ? 0.0f : inputs.value(high, 0, 0)));
    } else if (folds && layout.words[w] == WordLayout::Word::Float) {
        words.push_back(std::bit_cast<uint32_t>(inputs.value(low, 0, 0)));
    } else if (folds && layout.words[w] == WordLayout::Word::Unit) {
        for (int c = 0; c < 3; c++) // zero is the surface's normal, which varies
            words.push_back(std::bit_cast<uint32_t>(inputs.value(low, c, 0)));
    } else if (folds) {
        // Reflectances lie in [0, 1]; amounts without bound are scaled into it, twice their maximum to
        // keep the spectrum smooth.
        const Rgb rgb = inputs.color(low, 0);
        const float m = std::max({rgb.x, rgb.y, rgb.z});
        const float scale = layout.words[w] == WordLayout::Word::Amount && m > 0 ? 2 * m : 1;
        for (float f : palette.reflectance(rgb, scale))
            words.push_back(std::bit_cast<uint32_t>(f));
    } else {
        const size_t base = words.size();
        words.resize(base + inputs.vertices());
        for (int i = 0; i < inputs.vertices(); i++) {
            switch (layout.words[w]) {
            case WordLayout::Word::Color:
            case WordLayout::Word::Amount:
                words[base + i] = to_rgb9e5(inputs.color(low, i));
                break;
            case WordLayout::Word::Float:
                words[base + i] = std::bit_cast<uint32_t>(inputs.value(low, 0, i));
                break;
            case WordLayout::Word::Unit:
                words[base + i] = to_oct32(inputs.unit(low, i));
                break;
            case WordLayout::Word::HalfPair:
                words[base + i] = to_half(inputs.value(low, 0, i)) |
                                  uint32_t(high < 0 ? 0 : to_half(inputs.value(high, 0, i))) << 16;
                break;
            }
        }
    }
    if (is_emission(inputs.program(), low) && (high < 0 || is_emission(inputs.program(), high)))
        out.lost = lost; // emitters have the whole of it
}

} // namespace

void encode_words(GridInputs& inputs, const WordLayout& layout, const color::Palette& palette, Encoded& out) {
    for (size_t w = 0; w < layout.words.size(); w++)
        encode_word(w, inputs, layout, palette, out);
}

} // namespace kanuka::store
