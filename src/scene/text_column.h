// Texts that instances say, of a few that differ: a table of these, and 4 bytes an instance.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "scene/values.h"

namespace kanuka::scene {

// A variable of instances that is a text (Variation::primvars): `strings` has the values that differ, one
// behind the other, each as many texts as its array has; `ints` has each instance's number among these. A
// constant one has one value, and no `ints`.
class TextColumn {
  public:
    explicit TextColumn(size_t width = 1) : m_width(width) {} // texts a value
    void add(std::span<const std::string_view> value);        // of the next instance
    void add(std::span<const std::string> value);
    void move_to(Value& value); // constant where there is one instance, else uniform

  private:
    size_t m_width;
    std::unordered_map<std::string, int32_t> m_known; // by all texts of a value
    std::vector<std::string> m_texts;
    std::vector<int32_t> m_numbers;
    std::string m_key; // kept for its memory
};

// Numbers, or texts, of one value.
size_t width_of(const Value& value);
// What instance `i` says of a text.
std::span<const std::string> texts_of(const Value& value, size_t i);

} // namespace kanuka::scene
