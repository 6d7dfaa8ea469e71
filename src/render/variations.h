// What instances differ by, as kernels read it.
#pragma once

#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "color/palette.h"
#include "scene/scene.h"
#include "transport/variation_row.h"

namespace kanuka::render {

// Fills a table whose first row changes nothing; equal instances share a row.
class VariationTable {
  public:
    // `rows`: empty until an instance has a variation. Both must outlive this.
    VariationTable(const color::Palette& palette, std::vector<transport::VariationRow>& rows)
        : m_palette(palette), m_rows(rows) {}
    // The row of each instance; empty = they do not differ.
    std::vector<int32_t> rows_of(const scene::Variation& variation, size_t count);

  private:
    struct Values { // of one instance
        float variant = 0, roughness = 0;
        std::array<float, 3> tint{1, 1, 1};
        auto operator<=>(const Values&) const = default;
    };
    struct Hash {
        size_t operator()(const Values& v) const;
    };
    int32_t row_of(const Values& values);

    const color::Palette& m_palette;
    std::vector<transport::VariationRow>& m_rows;
    std::unordered_map<Values, int32_t, Hash> m_known;
};

} // namespace kanuka::render
