// The lattice that vertices stand on. Where a vertex goes depends on itself and the group's step alone, so
// polygons that share a vertex agree to the bit, whichever page and leaf they are in: no cracks.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "base/vec.h"

namespace kanuka::hierarchy {

// 2^e, for e from -126 to 127.
constexpr float power_of_two(int e) {
    return std::bit_cast<float>(uint32_t(e + 127) << 23);
}
// For e from -1022 to 1023.
constexpr double double_power_of_two(int e) {
    return std::bit_cast<double>(uint64_t(e + 1023) << 52);
}
// e, of 2^e <= |x| < 2^(e + 1); -127 for zero and for denormal numbers.
constexpr int exponent_of(float x) {
    return int(std::bit_cast<uint32_t>(x) >> 23 & 255) - 127;
}

// Numbers that can be traced; others are nowhere.
inline constexpr float LargestCoordinate = 1e18f;
inline bool is_somewhere(const Vec3f& p) {
    return abs(p.x) < LargestCoordinate && abs(p.y) < LargestCoordinate && abs(p.z) < LargestCoordinate;
}

struct Lattice {
    // Its step is 2^exponent near the origin. Further off, where floats are coarser than that, it is coarser
    // too: 22 bits are left of the largest coordinate, and leaves have room for one more.
    static constexpr int Bits = 22, LeastExponent = -100, MostExponent = 60;
    int exponent = LeastExponent;

    int exponent_at(const Vec3f& p) const {
        const float largest = max(max(abs(p.x), abs(p.y)), abs(p.z));
        return max(exponent, exponent_of(largest) - (Bits - 1));
    }
    Vec3f snap(const Vec3f& p) const {
        const int e = exponent_at(p);
        const Vec3f q = snap(p, e);
        const int up = exponent_at(q); // rounded up to where the lattice is coarser
        return up == e ? q : snap(q, up);
    }

  private:
    static Vec3f snap(const Vec3f& p, int e) {
        const float step = power_of_two(e), per_step = power_of_two(-e);
        return {__builtin_rintf(p.x * per_step) * step, __builtin_rintf(p.y * per_step) * step,
                __builtin_rintf(p.z * per_step) * step};
    }
};

// Where vertices of fibres stand, and how thick they may be there: radii are floats of 12 bits, 2^-32 of the
// largest at the least. Both depend on the vertex alone, as in Lattice.
struct FibreLattice {
    static constexpr int DroppedBits = 12;
    Lattice places;
    uint32_t least_radius = 0; // by its upper bits

    // `largest`: of all radii.
    static FibreLattice of(const Lattice& places, float largest) {
        constexpr uint32_t Words = 1 << 16;
        const uint32_t last = upper_bits(largest);
        return {places, last < Words ? 0 : last - (Words - 1)};
    }
    uint16_t word(float radius) const {
        return uint16_t(std::clamp<int64_t>(int64_t(upper_bits(radius)) - least_radius, 0, 65535));
    }
    float radius(uint16_t word) const {
        return std::bit_cast<float>((uint32_t(word) + least_radius) << DroppedBits);
    }

  private:
    static uint32_t upper_bits(float radius) { // rounded
        return (std::bit_cast<uint32_t>(max(radius, 0.0f)) + (1u << (DroppedBits - 1))) >> DroppedBits;
    }
};

// What the leaves of a group wish its step to be. Votes of pages are added up, so that pages which are made
// one by one can agree; the outcome does not depend on their order.
class StepVotes {
  public:
    // A leaf with these extents: steps are wished for at which 32 bits hold a vertex of it, up to `largest`.
    void add(const Vec3f& extent, float largest = LargestCoordinate);
    // Steps at which 16 bits hold each coordinate.
    void add_fine(const Vec3f& extent);
    void add(const StepVotes& other);
    // The step that most leaves wish for. Of a thousand leaves three may be larger, and take more memory. But
    // no leaf loses more than `Slack` bits: with a leaf of 4x4 cells, a cell is 16 steps wide or more.
    Lattice lattice() const;

    static constexpr int Slack = 4;
    static constexpr double Larger = 0.003;

  private:
    static constexpr int Range = Lattice::MostExponent - Lattice::LeastExponent + 1;
    std::array<uint64_t, size_t(Range)> m_count{};
};

} // namespace kanuka::hierarchy
