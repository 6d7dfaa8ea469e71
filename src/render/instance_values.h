// What instances say of variables, as rows of numbers.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "render/value_clusters.h"
#include "scene/scene.h"

namespace kanuka::render {

inline constexpr const char* VariantVariable = "variant"; // what Variation::variant says

// A variable of instances: a column of a table, or more.
struct InstanceVariable {
    std::string name;
    scene::Type type = scene::Type::Float;
    int array_size = 1;
    Location where = {}; // the first that was said
    bool is_text() const { return type == scene::Type::String; }
    // Nothing lies between two values, and none is nearer than another.
    bool is_exact() const { return is_text() || type == scene::Type::Matrix; }
    size_t width() const { return is_text() ? 1 : size_t(scene::components(type)) * size_t(array_size); }
};

// A row for each that says any of the variables: the values of all, and behind them which of these it says. A
// text is its number among those that differ, in ascending order.
class InstanceValues {
  public:
    InstanceValues(std::span<const scene::Group::Instances* const> lists,
                   std::vector<InstanceVariable> variables);
    const std::vector<InstanceVariable>& variables() const { return m_variables; }
    const Rows& rows() const { return m_rows; }
    std::span<const int32_t> row_of() const { return m_row_of; } // each instance's; -1 = it says none
    scene::ValueList values_of(std::span<const float> row) const;
    // What columns are measured by. Numbers: the widest range of a variable's components; and what some do
    // not say is farther off than any.
    std::vector<float> scales_of(const Rows& rows) const;
    // What rows have of all that is exact, and of what they say at all: its number. Empty: nothing is exact.
    std::vector<uint32_t> kinds_of(const Rows& rows) const;
    bool is_same_kind(std::span<const float> a, std::span<const float> b) const;
    // The only column of numbers that can be blended; -1 = there is none, or there are several.
    int blended_column() const;

  private:
    using Value = std::span<const std::string>;
    // Of one variable: the values that differ, and the number of each list's own.
    struct Texts {
        std::vector<Value> values;
        std::map<const scene::Value*, std::vector<float>> numbers;
    };
    // Where a list has a variable.
    struct Source {
        const float* numbers = nullptr; // null = it says nothing
        const int32_t* index = nullptr; // of texts, into `numbers`
        size_t stride = 0;              // 0 = one value for all
    };
    void number_texts(std::span<const scene::Group::Instances* const> lists, size_t variable);
    Source source_of(const scene::Variation& variation, size_t variable) const;
    void add_rows(const scene::Group::Instances& list);

    std::vector<InstanceVariable> m_variables;
    std::vector<Texts> m_texts;  // of each variable
    std::vector<size_t> m_exact; // columns that tell kinds
    Rows m_rows;
    std::vector<int32_t> m_row_of;
};

// Rows that are shaded, and what is shown of them in place of all.
struct Approximation {
    Rows rows;
    std::vector<float> number; // of each that differs; between two of `rows` where it is not whole
    size_t replaced = 0;       // instances that show other texts or matrices than theirs
    bool blended = false;
};
// `rows`: those that differ, which `weights` instances have; `room`: how many can be shaded.
Approximation approximated(const InstanceValues& values, const Rows& rows, std::span<const uint32_t> weights,
                           size_t room);

} // namespace kanuka::render
