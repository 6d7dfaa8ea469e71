// Where many instances of one thing stand, by the matrices that the scene has: they are large, and nobody
// needs a copy of them.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"

namespace kanuka {

struct Places {
    std::span<const float> matrices; // row-major 3x4, 12 floats each; whoever has them keeps them
    std::span<const uint32_t> which; // of them, and in which order; empty = all. They are kept likewise
    // What stands there is moved by `inner` before the matrix and by `outer` behind it, as it is read.
    std::array<double, 3> outer{};
    Vec3f inner{0, 0, 0};

    Places() = default;
    Places(std::span<const float> matrices, const std::array<double, 3>& outer = {},
           const Vec3f& inner = Vec3f(0.0f))
        : matrices(matrices), outer(outer), inner(inner) {}
    Places(const std::vector<float>& matrices) : matrices(matrices) {}

    size_t size() const { return which.empty() ? matrices.size() / 12 : which.size(); }
    size_t number(size_t i) const { return which.empty() ? i : which[i]; }
    bool empty() const { return size() == 0; }
    void prefetch(size_t i) const { prefetch_matrix(number(i)); }
    void prefetch_matrix(size_t number) const {
        const float* const m = matrices.data() + 12 * number;
        __builtin_prefetch(m);
        __builtin_prefetch(m + 11); // on the next line, one time in two
    }
    std::array<float, 12> operator[](size_t i) const { return matrix(number(i)); }
    // By its number among the matrices. Summed in double, since what one translation takes away the next
    // often adds again.
    std::array<float, 12> matrix(size_t number) const {
        std::array<float, 12> m;
        std::copy_n(matrices.data() + 12 * number, 12, m.begin());
        for (size_t r = 0; r < 3; r++) {
            float* const row = m.data() + 4 * r;
            double moved = double(row[3]) + outer[r];
            for (int k = 0; k < 3; k++)
                moved += double(row[k]) * double(inner[k]);
            row[3] = float(moved);
        }
        return m;
    }
};

} // namespace kanuka
