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
struct PictureCellsView {
    int columns = 0, rows = 0;
    std::span<const float> marginal, conditional;

    PictureCellsView() = default;
    PictureCellsView(const PictureCells& cells)
        : columns(cells.columns), rows(cells.rows), marginal(cells.marginal), conditional(cells.conditional) {
    }
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
