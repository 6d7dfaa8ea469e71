// Sampling of pictures that are looked up with bilinear interpolation: a cell between texel centres by its
// integral, a place in it by inverting the bilinear density (Shirley 2020, Ray Tracing Gems II, chapter 16;
// Pharr, Jakob and Humphreys 2023, section A.5). The density is what is looked up, so that a sun of one texel
// has no variance.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "base/lanes_math.h"
#include "base/rows.h"

namespace kanuka::transport {

// Rows and columns of cells, whose corners have weights. Cells at the borders may be narrower.
struct PictureCells {
    int columns = 0, rows = 0;
    double total = 0;                         // integral of the weight, in texels
    std::vector<float> marginal, conditional; // cumulative: rows + 1; rows * (columns + 1)
};

// Where search() in cumulative tables begins (Chen and Asau 1974, On Generating Random Variates from an
// Empirical Distribution): entry k of a table's is what it finds for u = k / shares. So it looks between
// entry k and the next one, which are mostly close, whatever the size of the table.
struct SearchGuide {
    int shares = 0;             // a power of two: products with it are exact
    std::vector<int32_t> found; // shares + 1 a table

    SearchGuide() = default;
    // Of tables of `steps` + 1 values, one after the other.
    SearchGuide(std::span<const float> tables, int steps);
};
struct SearchGuideView {
    int shares = 0;
    std::span<const int32_t> found;

    SearchGuideView() = default;
    SearchGuideView(const SearchGuide& guide) : shares(guide.shares), found(guide.found) {}
};

struct PictureCellsView {
    int columns = 0, rows = 0;
    std::span<const float> marginal, conditional;
    SearchGuideView marginal_guide, conditional_guide;

    PictureCellsView() = default;
    PictureCellsView(const PictureCells& cells, const SearchGuide& marginal_guide,
                     const SearchGuide& conditional_guide)
        : columns(cells.columns), rows(cells.rows), marginal(cells.marginal), conditional(cells.conditional),
          marginal_guide(marginal_guide), conditional_guide(conditional_guide) {}
};
PictureCells make_picture_cells(int columns, int rows, const std::function<double(int, int)>& corner,
                                const std::function<double(int)>& width,
                                const std::function<double(int)>& height);

// MIS compensation (Karlik et al. 2019, MIS Compensation: Optimizing Sampling Techniques in Multiple
// Importance Sampling, section 5): what is no brighter than the mean is left to the material's own
// directions, which find it well.
inline float above_mean(float value, float mean) {
    return value > mean ? value - mean : 0.0f;
}
template <int W>
Float<W> above_mean(Float<W> value, Float<W> mean) {
    return max(value - mean, Float<W>(0.0f));
}

// Weight of a texel; linear, so that of what lies between is theirs.
template <class T>
T texel_weight(const T& r, const T& g, const T& b) {
    return (r + g + b) * T(1 / 3.0f);
}

// Largest i in [0, count) with table[base + i] <= u.
template <int W>
Int<W> search(const float* table, Int<W> base, Int<W> count, Float<W> u) {
    Int<W> lo(0), size = count;
    while (any(size > Int<W>(1))) {
        const Int<W> half = size >> 1, mid = lo + half;
        const Mask<W> right = (gather(table, base + mid) <= u) & (half > Int<W>(0));
        lo = select(right, mid, lo);
        size = max(select(right, size - half, half), Int<W>(1));
    }
    return lo;
}

// The same in the whole of the table with this number of those that the guide has been made of; base: where
// it begins. u: in [0, 1).
template <int W>
Int<W> search(const SearchGuideView& guide, const float* tables, Int<W> number, Int<W> base, Float<W> u) {
    const Int<W> share = min(to_int(u * Float<W>(float(guide.shares))), Int<W>(guide.shares - 1)),
                 at = number * Int<W>(guide.shares + 1) + share;
    const Int<W> first = gather(guide.found.data(), at), last = gather(guide.found.data() + 1, at);
    return first + search(tables, base + first, last - first + Int<W>(1), u);
}

// Where u lies in step `at` of a cumulative table, which rises there.
template <int W>
Float<W> within_step(const float* table, Int<W> at, Float<W> u) {
    const Float<W> a = gather(table, at), b = gather(table + 1, at);
    return clamp((u - a) / max(b - a, Float<W>(1e-20f)), Float<W>(0.0f), Float<W>(0.99999994f));
}

// Of a density that goes from a at 0 to b at 1.
template <int W>
Float<W> sample_linear(Float<W> a, Float<W> b, Float<W> u) {
    const Float<W> root = sqrt(max(fma(u, b * b - a * a, a * a), Float<W>(0.0f)));
    return clamp(u * (a + b) / max(a + root, Float<W>(1e-37f)), Float<W>(0.0f), Float<W>(0.99999994f));
}

// A density between four corners: [row][column].
template <int W>
struct BilinearCell {
    Float<W> w[2][2];

    Float<W> at(Float<W> x, Float<W> y) const {
        const Float<W> a = fma(x, w[0][1] - w[0][0], w[0][0]), b = fma(x, w[1][1] - w[1][0], w[1][0]);
        return fma(y, b - a, a);
    }
    void sample(Float<W> u0, Float<W> u1, Float<W>& x, Float<W>& y) const {
        y = sample_linear(w[0][0] + w[0][1], w[1][0] + w[1][1], u1);
        x = sample_linear(fma(y, w[1][0] - w[0][0], w[0][0]), fma(y, w[1][1] - w[0][1], w[0][1]), u0);
    }
};

} // namespace kanuka::transport
