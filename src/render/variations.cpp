#include "render/variations.h"

#include <algorithm>
#include <functional>

namespace kanuka::render {

size_t VariationTable::Hash::operator()(const Values& v) const {
    size_t h = 0;
    for (const float x : {v.variant, v.roughness, v.tint[0], v.tint[1], v.tint[2]})
        h = (h ^ std::hash<float>{}(x)) * 0x9e3779b97f4a7c15ull + (h >> 29);
    return h;
}

int32_t VariationTable::row_of(const Values& values) {
    const auto [known, fresh] = m_known.try_emplace(values, int32_t(m_rows.size()));
    if (!fresh)
        return known->second;
    transport::VariationRow row;
    row.variant = values.variant, row.roughness = values.roughness;
    const Rgb tint(values.tint[0], values.tint[1], values.tint[2]);
    if (const float most = std::max({tint.x, tint.y, tint.z}); !(tint == Rgb(1, 1, 1))) {
        row.is_tinted = 1;
        // Twice the largest component where it is no reflectance, to keep the spectrum smooth.
        row.tint = m_palette.reflectance(tint, most > 1 ? 2 * most : 1);
    }
    m_rows.push_back(row);
    return known->second;
}

std::vector<int32_t> VariationTable::rows_of(const scene::Variation& variation, size_t count) {
    std::vector<int32_t> rows;
    if (variation.empty() || count == 0)
        return rows;
    if (m_rows.empty())
        m_rows.emplace_back();
    const auto value = [&](const scene::Buffer<float>& of, size_t components, size_t i, size_t c,
                           float none) {
        return of.empty() ? none : of[of.size() == components ? c : components * i + c];
    };
    rows.reserve(count);
    for (size_t i = 0; i < count; i++) {
        Values values;
        values.variant = std::max(value(variation.variant, 1, i, 0, 0), 0.0f);
        values.roughness = value(variation.roughness, 1, i, 0, 0);
        for (size_t c = 0; c < 3; c++)
            values.tint[c] = value(variation.tint, 3, i, c, 1);
        rows.push_back(row_of(values));
    }
    return rows;
}

} // namespace kanuka::render
