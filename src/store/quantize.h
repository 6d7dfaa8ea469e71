// Vertex words: what a lobe input costs at a vertex, and how it is read back. Scalar forms; transport has
// them in lanes.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "base/vec.h"

namespace kanuka::store {

inline constexpr float LargestHalf = 65504;

inline uint16_t to_half(float f) {
    const _Float16 h = static_cast<_Float16>(std::clamp(f, -LargestHalf, LargestHalf));
    uint16_t bits;
    std::memcpy(&bits, &h, 2);
    return bits;
}
inline float from_half(uint16_t bits) {
    _Float16 h;
    std::memcpy(&h, &bits, 2);
    return float(h);
}

// Shared exponent, 9-9-9-5 bits, bias 15 (as EXT_texture_shared_exponent): steps of 0.2 to 0.4 % of the
// largest component, however dark.
inline uint32_t to_rgb9e5(const Rgb& c) {
    const auto bounded = [](float x) { return x > 0 ? std::min(x, 65408.0f) : 0.0f; };
    const float r = bounded(c.x), g = bounded(c.y), b = bounded(c.z), m = std::max({r, g, b});
    if (m < 1e-8f)
        return 0;
    int e = std::max(-16, int(std::floor(std::log2(m)))) + 16;
    float unit = std::exp2(float(e - 24));
    if (std::floor(m / unit + 0.5f) >= 512) {
        e++;
        unit *= 2;
    }
    const auto mantissa = [&](float x) { return uint32_t(std::floor(x / unit + 0.5f)); };
    return mantissa(r) | mantissa(g) << 9 | mantissa(b) << 18 | uint32_t(e) << 27;
}
inline Rgb from_rgb9e5(uint32_t w) {
    const float unit = std::exp2(float(int(w >> 27) - 24));
    return {float(w & 511) * unit, float((w >> 9) & 511) * unit, float((w >> 18) & 511) * unit};
}

// Of unit length, or zero where there is no direction.
inline Vec3f unit_or_zero(const Vec3f& n) {
    const float largest = std::max({std::abs(n.x), std::abs(n.y), std::abs(n.z)});
    return largest > 0 && std::isfinite(n.x + n.y + n.z) ? normalize(n * (1 / largest)) : Vec3f(0.0f);
}

// Unit vectors on the octahedron (Cigolle et al. 2014), 16 bits an axis: 0.004 degrees.
inline uint32_t to_oct32(const Vec3f& n) {
    const float s = std::abs(n.x) + std::abs(n.y) + std::abs(n.z);
    float x = n.x / s, y = n.y / s;
    if (n.z < 0) {
        const float ox = x;
        x = (1 - std::abs(y)) * (ox >= 0 ? 1.0f : -1.0f);
        y = (1 - std::abs(ox)) * (y >= 0 ? 1.0f : -1.0f);
    }
    const auto code = [](float f) {
        return uint32_t(std::clamp(f * 32767.0f, -32767.0f, 32767.0f) + 32767.5f);
    };
    return code(x) | code(y) << 16;
}
inline Vec3f from_oct32(uint32_t w) {
    float x = (float(w & 0xffff) - 32767.0f) * (1 / 32767.0f),
          y = (float(w >> 16) - 32767.0f) * (1 / 32767.0f);
    const float z = 1 - std::abs(x) - std::abs(y);
    if (z < 0) {
        const float ox = x;
        x = (1 - std::abs(y)) * (ox >= 0 ? 1.0f : -1.0f);
        y = (1 - std::abs(ox)) * (y >= 0 ? 1.0f : -1.0f);
    }
    return normalize(Vec3f(x, y, z));
}

} // namespace kanuka::store
