// How an instance differs in looks from others of the same thing.
#pragma once

#include <array>

namespace kanuka::transport {

// What an instance changes of the looks of what stands there: grid::LobeInput::body and roughness of lobes,
// and which of LayeringProgram::variants are blended. Eight words, loaded as a row.
struct VariationRow {
    float variant = 0, roughness = 0;
    float is_tinted = 0, unused = 0; // 1: the colour below multiplies
    std::array<float, 4> tint{};     // c0 c1 c2 scale of an uplifted colour
    bool operator==(const VariationRow&) const = default;
};
static_assert(sizeof(VariationRow) == 32);

} // namespace kanuka::transport
