#include "scene/text_column.h"

#include <algorithm>

namespace kanuka::scene {

void TextColumn::add(std::span<const std::string_view> value) {
    m_key.clear();
    for (const std::string_view text : value) {
        if (m_width > 1) // where one ends and the next begins
            m_key += std::to_string(text.size()) + ':';
        m_key += text;
    }
    const auto [known, fresh] = m_known.try_emplace(m_key, int32_t(m_known.size()));
    if (fresh)
        m_texts.insert(m_texts.end(), value.begin(), value.end());
    m_numbers.push_back(known->second);
}

void TextColumn::add(std::span<const std::string> value) {
    const std::vector<std::string_view> views(value.begin(), value.end());
    add(std::span<const std::string_view>(views));
}

void TextColumn::move_to(Value& value) {
    value.detail = m_numbers.size() == 1 ? Detail::Constant : Detail::Uniform;
    value.floats = {};
    value.strings = std::move(m_texts);
    if (value.detail == Detail::Uniform)
        value.ints = std::move(m_numbers);
}

size_t width_of(const Value& value) {
    return size_t(components(value.type)) * size_t(std::max(value.array_size, 1));
}

std::span<const std::string> texts_of(const Value& value, size_t i) {
    const size_t width = width_of(value), number = value.ints.empty() ? 0 : size_t(value.ints[i]);
    return {value.strings.data() + width * number, width};
}

} // namespace kanuka::scene
