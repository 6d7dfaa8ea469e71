#include "bvh/boxes.h"

#include <cmath>

namespace kanuka::bvh {

Bounds3f placed(const float* m, const Bounds3f& box) {
    constexpr float Rounding = 4e-7f; // of what the sums below are made of: theirs, and a ray's on its way in
    if (box.empty())
        return {};
    const Vec3f middle = (box.lo + box.hi) * 0.5f, half = (box.hi - box.lo) * 0.5f;
    Bounds3f b;
    float sum = 0;
    for (int r = 0; r < 3; r++, m += 4) {
        const float x = m[0] * middle.x, y = m[1] * middle.y, z = m[2] * middle.z;
        const float extent = std::abs(m[0]) * half.x + std::abs(m[1]) * half.y + std::abs(m[2]) * half.z;
        const float size = std::abs(x) + std::abs(y) + std::abs(z) + std::abs(m[3]) + extent;
        const float at = x + y + z + m[3], reach = extent + Rounding * size;
        b.lo[r] = at - reach;
        b.hi[r] = at + reach;
        sum += size;
    }
    return std::isfinite(sum) ? b : Bounds3f();
}

double half_area(const Bounds3f& b) {
    const Vec3f d = b.hi - b.lo;
    return double(d.x) * double(d.y) + double(d.y) * double(d.z) + double(d.z) * double(d.x);
}

} // namespace kanuka::bvh
