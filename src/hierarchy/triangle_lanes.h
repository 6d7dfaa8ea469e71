// Leaves of up to eight triangles against one ray: all at once, whatever number of lanes grids have.
#pragma once

#include "hierarchy/leaf_lanes.h"

namespace kanuka::hierarchy {

// As those of grids (leaf_lanes.h): along an axis, one corner of all.
class TriangleReader32 {
  public:
    explicit TriangleReader32(const Triangle32& leaf)
        : m_leaf(leaf), m_fields(field_table[uint8_t(leaf.frame[0])]),
          m_unit(std::bit_cast<float>(uint32_t(leaf.frame[1] & 255) << 23)) {}
    uint32_t count() const { return uint32_t(m_leaf.frame[2]) & 15; }
    Float<8> steps(int axis, int corner) const {
        const Int<8> raw = Int<8>::load(reinterpret_cast<const int32_t*>(m_leaf.corner[corner]));
        const Float<8> field = Float<8>(raw & Int<8>(m_fields.mask[axis]));
        return fma(field, Float<8>(m_fields.scale[axis]), Float<8>(float(m_leaf.frame[axis] >> 8)));
    }
    Float<8> place(Float<8> steps, float o) const { return fma(steps, Float<8>(m_unit), Float<8>(-o)); }

  private:
    const Triangle32& m_leaf;
    const Fields& m_fields;
    float m_unit;
};

class TriangleReader48 {
  public:
    explicit TriangleReader48(const Triangle48& leaf)
        : m_leaf(leaf), m_unit(std::bit_cast<float>(uint32_t(leaf.frame[1] & 255) << 23)) {}
    uint32_t count() const { return uint32_t(m_leaf.frame[2]) & 15; }
    Float<8> steps(int axis, int corner) const {
        const uint16_t* const first = m_leaf.coordinate[axis][corner];
        return Float<8>(two_fours_of_16_bits(first, first + 4)) + Float<8>(float(m_leaf.frame[axis] >> 8));
    }
    Float<8> place(Float<8> steps, float o) const { return fma(steps, Float<8>(m_unit), Float<8>(-o)); }

  private:
    const Triangle48& m_leaf;
    float m_unit;
};

class TriangleReaderFloat {
  public:
    explicit TriangleReaderFloat(const TriangleFloat& leaf) : m_leaf(leaf) {}
    uint32_t count() const { return m_leaf.count & 15; }
    Float<8> steps(int axis, int corner) const { return Float<8>::load(m_leaf.coordinate[axis][corner]); }
    Float<8> place(Float<8> steps, float o) const { return steps - Float<8>(o); }

  private:
    const TriangleFloat& m_leaf;
};

// The same, read once for many rays.
template <class Reader>
class KeptTriangles {
  public:
    explicit KeptTriangles(const Reader& reader) : m_reader(reader) {
        for (int a = 0; a < 3; a++)
            for (int c = 0; c < 3; c++)
                m_steps[a][c] = reader.steps(a, c);
    }
    uint32_t count() const { return m_reader.count(); }
    Float<8> steps(int axis, int corner) const { return m_steps[axis][corner]; }
    Float<8> place(Float<8> steps, float o) const { return m_reader.place(steps, o); }

  private:
    const Reader m_reader;
    Float<8> m_steps[3][3];
};

template <class Reader, class Found>
bool trace_triangle_leaf(const Reader& reader, const TracedRay& ray, Found&& found) {
    Seen<8> seen[3];
    Float<8> z[3];
    for (int c = 0; c < 3; c++) {
        const auto read = [&](int k) {
            return reader.place(reader.steps(ray.axis[k], c), ray.o[ray.axis[k]]);
        };
        z[c] = read(2);
        seen[c].x = fma(z[c], Float<8>(ray.minus_slope[0]), read(0));
        seen[c].y = fma(z[c], Float<8>(ray.minus_slope[1]), read(1));
    }
    const Float<8> weight[3] = {edge(seen[1], seen[2]), edge(seen[2], seen[0]), edge(seen[0], seen[1])};
    const uint32_t present = (1u << reader.count()) - 1;
    const uint32_t inside = through(weight[0], weight[1], weight[2]) & present & 255;
    if (inside == 0)
        return false;
    const Depths<8> depths(ray, inside, seen, weight, z);
    if (depths.hit == 0)
        return false;
    alignas(32) float t[8], u[8], v[8];
    depths.t.store(t), depths.u.store(u), depths.v.store(v);
    for (uint32_t m = depths.hit; m != 0; m &= m - 1) {
        const int i = __builtin_ctz(m);
        if (t[i] <= ray.t_max && found(uint32_t(i), t[i], u[i], v[i]))
            return true;
    }
    return false;
}

} // namespace kanuka::hierarchy
