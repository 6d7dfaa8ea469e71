// How 32 bits are shared among the three coordinates of a vertex: all widths from 2 to 16 bits that fill
// them. x has the lowest bits, z the highest, and is signed; so a coordinate is what is left by a mask, taken
// as an integer, times a power of two. No shifts are needed, which vector code would pay for.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace kanuka::hierarchy {

struct Fields {
    float scale[3] = {};
    int32_t mask[3] = {};
    uint8_t bits[3] = {};

    // Half the range of z, which is stored less that.
    int half() const { return 1 << (bits[2] - 1); }
    uint32_t pack(int x, int y, int z) const { // all from 0 on
        return uint32_t(x) | uint32_t(y) << bits[0] | uint32_t(z - half()) << (bits[0] + bits[1]);
    }
};

class FieldTable {
  public:
    static constexpr int Least = 2, Most = 16;

    constexpr FieldTable() {
        int n = 0;
        for (int x = Least; x <= Most; x++)
            for (int y = Least; y <= Most; y++) {
                const int z = 32 - x - y;
                m_number[size_t(x)][size_t(y)] = -1;
                if (z < Least || z > Most)
                    continue;
                m_number[size_t(x)][size_t(y)] = int16_t(n);
                Fields& f = m_fields[size_t(n++)];
                f.bits[0] = uint8_t(x), f.bits[1] = uint8_t(y), f.bits[2] = uint8_t(z);
                f.scale[0] = 1, f.scale[1] = 1 / float(1u << x),
                f.scale[2] = 1 / float(uint64_t(1) << (x + y));
                f.mask[0] = int32_t((1u << x) - 1), f.mask[1] = int32_t(((1u << y) - 1) << x);
                f.mask[2] = int32_t(~0u << (x + y));
            }
        m_count = n;
    }
    constexpr int count() const { return m_count; }
    // Any byte is answered: what lies behind the last is no field at all, and decodes to zeros.
    const Fields& operator[](uint8_t number) const { return m_fields[number]; }

    // Are there widths that hold coordinates from 0 to `extent`?
    static constexpr bool holds(const int extent[3]) {
        int bits[3];
        return room(extent, bits) >= 0;
    }
    // Their number; -1 = there are none.
    constexpr int holding(const int extent[3]) const {
        int bits[3];
        int left = room(extent, bits);
        if (left < 0)
            return -1;
        for (; left > 0; left--) { // what is left goes to the narrowest: few widths are in use at all
            const int a = bits[0] <= bits[1] && bits[0] <= bits[2] ? 0 : bits[1] <= bits[2] ? 1 : 2;
            bits[a]++;
        }
        return m_number[size_t(bits[0])][size_t(bits[1])];
    }

  private:
    // The bits that each coordinate takes, and how many of 32 are left; negative: they are not held.
    static constexpr int room(const int extent[3], int (&bits)[3]) {
        int left = 32;
        for (int a = 0; a < 3; a++) {
            bits[a] = std::bit_width(unsigned(extent[a]) | ((1u << Least) - 1));
            left -= extent[a] < 0 || bits[a] > Most ? 33 : bits[a];
        }
        return left;
    }

    std::array<Fields, 256> m_fields;
    std::array<std::array<int16_t, Most + 1>, Most + 1> m_number{};
    int m_count = 0;
};
inline constexpr FieldTable field_table;

} // namespace kanuka::hierarchy
