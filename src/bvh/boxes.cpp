#include "bvh/boxes.h"

#include <cmath>

#include "base/lanes.h"

namespace kanuka::bvh {

namespace {

using F = Float<4>; // a row of a matrix, or a number of each row

// Of each of three rows the sum of its numbers, from left to right.
F sums(F a, F b, F c) {
    const auto ab = __builtin_shufflevector(a.v, b.v, 0, 4, 1, 5),
               cc = __builtin_shufflevector(c.v, c.v, 0, 0, 1, 1),
               AB = __builtin_shufflevector(a.v, b.v, 2, 6, 3, 7),
               CC = __builtin_shufflevector(c.v, c.v, 2, 2, 3, 3);
    return F(__builtin_shufflevector(ab, cc, 0, 1, 4, 5)) + F(__builtin_shufflevector(ab, cc, 2, 3, 6, 7)) +
           F(__builtin_shufflevector(AB, CC, 0, 1, 4, 5)) + F(__builtin_shufflevector(AB, CC, 2, 3, 6, 7));
}

} // namespace

Bounds3f placed(const float* m, const Bounds3f& box) {
    constexpr float Rounding = 4e-7f; // of what the sums below are made of: theirs, and a ray's on its way in
    if (box.empty())
        return {};
    const Vec3f middle = (box.lo + box.hi) * 0.5f, half = (box.hi - box.lo) * 0.5f;
    const F at_middle(F::F{middle.x, middle.y, middle.z, 1}), by_half(F::F{half.x, half.y, half.z, 0});
    const F x = F::load(m), y = F::load(m + 4), z = F::load(m + 8);
    const F a = x * at_middle, b = y * at_middle, c = z * at_middle;
    const F at = sums(a, b, c), extent = sums(abs(x) * by_half, abs(y) * by_half, abs(z) * by_half);
    const F size = sums(abs(a), abs(b), abs(c)) + extent;
    const F reach = extent + size * F(Rounding), low = at - reach, high = at + reach;
    if (!std::isfinite(size[0] + size[1] + size[2]))
        return {};
    return {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
}

double half_area(const Bounds3f& b) {
    const Vec3f d = b.hi - b.lo;
    return double(d.x) * double(d.y) + double(d.y) * double(d.z) + double(d.z) * double(d.x);
}

} // namespace kanuka::bvh
