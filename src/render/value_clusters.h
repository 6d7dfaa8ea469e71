// Rows of numbers, and a few that stand for them all.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace kanuka::render {

// Rows of `width` numbers each, one behind the other.
struct Rows {
    size_t width = 0;
    std::vector<float> values;
    size_t count() const { return width ? values.size() / width : 0; }
    std::span<const float> operator[](size_t i) const { return {values.data() + i * width, width}; }
};

// Those that differ, in ascending order; `which` comes out with the number of each row's, `weights` with how
// many rows are of each.
Rows distinct_rows(const Rows& rows, std::vector<uint32_t>& which, std::vector<uint32_t>& weights);

// At most `count` rows that stand for all: boxes are cut in two along the column that deviates most, where
// the two parts deviate least (Wan, Wong and Prusinkiewicz, "An Algorithm for Multidimensional Data
// Clustering", ACM TOMS 14(2), 1988), and their means moved to those of the rows next to them (Lloyd's
// iteration). `scales`: what columns are measured by, infinity = not at all; `which`: the nearest of each
// row. `kinds`: of each row (none = all alike). What stands for a row is of its kind; of more kinds than
// `count` those of most weight have a row each, and others are stood for by the nearest of these.
Rows cluster(const Rows& rows, std::span<const uint32_t> weights, std::span<const float> scales,
             std::span<const uint32_t> kinds, size_t count, std::vector<uint32_t>& which);

} // namespace kanuka::render
