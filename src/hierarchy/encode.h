// Vertices of a leaf into bytes: which kind of leaf holds them exactly, and how it does.
#pragma once

#include "base/vec.h"
#include "hierarchy/fields.h"
#include "hierarchy/format.h"
#include "hierarchy/lattice.h"

namespace kanuka::hierarchy {

// Coordinates of lattice points as integers: (base + field) * 2^exponent, with fields from 0 to `extent`.
struct Frame {
    static constexpr int64_t LargestBase = (1 << 23) - 1;
    int64_t base[3] = {};
    int extent[3] = {};
    int exponent = 0;
    double per_step = 1;
    bool exact = false; // false: the points are too far apart, or some are nowhere

    // `points` stand on the lattice.
    template <size_t N>
    Frame(const Lattice& lattice, const Vec3f (&points)[N]) {
        exponent = lattice.exponent_at(points[0]);
        for (const Vec3f& p : points) {
            if (!is_somewhere(p))
                return;
            exponent = std::min(exponent, lattice.exponent_at(p));
        }
        per_step = std::ldexp(1.0, -exponent);
        for (int a = 0; a < 3; a++) {
            float lo = points[0][a], hi = lo;
            for (const Vec3f& p : points)
                lo = std::min(lo, p[a]), hi = std::max(hi, p[a]);
            const double first = double(lo) * per_step, last = double(hi) * per_step;
            if (first < -double(LargestBase) || last > double(LargestBase))
                return;
            base[a] = int64_t(first);
            extent[a] = int(last - first);
        }
        exact = true;
    }
    bool holds_48() const { return exact && extent[0] <= 65535 && extent[1] <= 65535 && extent[2] <= 65535; }
    int fields() const { // -1 = no widths hold them
        if (!exact)
            return -1;
        const int n = field_table.holding(extent);
        return n >= 0 && base[2] + field_table[uint8_t(n)].half() > LargestBase ? -1 : n;
    }
    int field(const Vec3f& p, int axis) const {
        return int(int64_t(double(p[axis]) * per_step) - base[axis]);
    }
    // The three words of a frame: for 32 bits z is signed, so its base is in the middle.
    void write(int32_t (&frame)[3], int fields, uint32_t shape) const {
        const int64_t middle = fields >= 0 ? field_table[uint8_t(fields)].half() : 0;
        frame[0] = int32_t(uint32_t(base[0]) << 8 | (fields >= 0 ? uint32_t(fields) : 0));
        frame[1] = int32_t(uint32_t(base[1]) << 8 | uint32_t(exponent + 127));
        frame[2] = int32_t(uint32_t(base[2] + middle) << 8 | shape);
    }
    uint32_t pack(const Vec3f& p, int fields) const {
        return field_table[uint8_t(fields)].pack(field(p, 0), field(p, 1), field(p, 2));
    }
};

} // namespace kanuka::hierarchy
