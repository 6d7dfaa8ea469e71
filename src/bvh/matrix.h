// Affine matrices of instances, as floats: row-major 3x4.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "base/vec.h"

namespace kanuka::bvh {

using Matrix = std::array<float, 12>;
inline constexpr Matrix Identity = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

// Inverse by the adjugate; false if singular.
bool invert(const float* m, float* out);
bool has_inverse(const float* m);

inline Matrix concat(const Matrix& a, const float* b) {
    Matrix r;
    for (size_t i = 0; i < 3; i++)
        for (size_t j = 0; j < 4; j++)
            r[i * 4 + j] = a[i * 4] * b[j] + a[i * 4 + 1] * b[4 + j] + a[i * 4 + 2] * b[8 + j] +
                           (j == 3 ? a[i * 4 + 3] : 0);
    return r;
}

inline Vec3f apply(const float* m, const Vec3f& p, float w) {
    return {m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3] * w, m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7] * w,
            m[8] * p.x + m[9] * p.y + m[10] * p.z + m[11] * w};
}

// What the components of m (p, w) are sums of.
inline Vec3f sizes(const float* m, const Vec3f& p, float w) {
    const auto row = [&](int r) {
        return std::abs(m[r] * p.x) + std::abs(m[r + 1] * p.y) + std::abs(m[r + 2] * p.z) +
               std::abs(m[r + 3] * w);
    };
    return {row(0), row(4), row(8)};
}

// By how much rounding moves a point that is taken from one space up to the next, and whose ray was taken
// down: to first order so much times a few units in the last place (Higham 2002, Accuracy and Stability of
// Numerical Algorithms, section 3.5). As it looks in the world; `up` and `down` are the two matrices,
// `parent` and `at` the point above and below.
inline Vec3f rounding_of(const float* up, const float* down, const Matrix& world_from_parent,
                         const Matrix& world_from_here, const Vec3f& parent, const Vec3f& at) {
    if (std::equal(up, up + 12, Identity.data())) // rounds nothing: what was read on demand has it
        return Vec3f(0.0f);
    return sizes(world_from_here.data(), sizes(down, parent, 1), 0) +
           sizes(world_from_parent.data(), sizes(up, at, 1), 0);
}

} // namespace kanuka::bvh
