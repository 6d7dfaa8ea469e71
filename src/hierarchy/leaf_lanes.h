// Leaves of 4x4 cells against one ray: W triangles at once, of the kind that lies before the cells' diagonals
// and then of the other. W is 8 or 16; both compute the same bits.
#pragma once

#include <limits>

#include "base/lanes.h"
#include "hierarchy/fields.h"
#include "hierarchy/ray.h"

namespace kanuka::hierarchy {

// W triangles, seen along the ray: x and y of their corners, sheared.
template <int W>
struct Seen {
    Float<W> x, y;
};

// What side of the edge from a to b the ray passes. Products are rounded, not fused: then edge(b, a) is
// -edge(a, b) to the bit, and two triangles never both leave the ray to the other.
template <int W>
Float<W> edge(const Seen<W>& a, const Seen<W>& b) {
    return a.x * b.y - a.y * b.x;
}

// Lanes where the ray passes through the triangle. Zero is on both sides.
template <int W>
uint32_t through(Float<W> a, Float<W> b, Float<W> c) {
    const Float<W> zero(0.0f);
    return ((min(min(a, b), c) >= zero) | (max(max(a, b), c) <= zero)).bits();
}

// A hit of a triangle that is a line as the ray sees it, or a point: the nearest of its edges' that the ray
// passes through. So it is where the neighbours at those edges have it, and their values go on.
struct FlatHit {
    float z = std::numeric_limits<float>::quiet_NaN(); // along the ray: over per_z; NaN = it passes none
    float u = 0, v = 0;
};
inline FlatHit flat_hit(const float (&x)[3], const float (&y)[3], const float (&z)[3], float per_z) {
    FlatHit best;
    float nearest = std::numeric_limits<float>::infinity();
    for (int i = 0; i < 3; i++) {
        const int k = i == 2 ? 0 : i + 1;
        if (min(x[i], x[k]) > 0 || max(x[i], x[k]) < 0 || min(y[i], y[k]) > 0 || max(y[i], y[k]) < 0)
            continue;
        const float dx = x[k] - x[i], dy = y[k] - y[i];
        const float along = abs(dx) > abs(dy) ? -x[i] / dx : dy != 0 ? -y[i] / dy : 0;
        const float depth = z[i] * (1 - along) + z[k] * along, t = depth * per_z;
        if (t < nearest) {
            const float weight[3] = {i == 0   ? 1 - along
                                     : k == 0 ? along
                                              : 0,
                                     i == 1   ? 1 - along
                                     : k == 1 ? along
                                              : 0,
                                     i == 2   ? 1 - along
                                     : k == 2 ? along
                                              : 0};
            nearest = t, best = {depth, weight[1], weight[2]};
        }
    }
    return best;
}

// Where a ray passes through a triangle, in doubles: products of two floats are exact in these, so the signs
// of edge functions are true. NaN: it passes by, or where neighbours at an edge have the triangle.
struct ExactHit {
    float t = std::numeric_limits<float>::quiet_NaN();
    float u = 0, v = 0;
};
inline ExactHit exact_hit(const float (&x)[3], const float (&y)[3], const float (&z)[3], float per_z) {
    double weight[3];
    for (int i = 0; i < 3; i++) {
        const int j = i == 2 ? 0 : i + 1, k = j == 2 ? 0 : j + 1;
        weight[i] = double(x[j]) * double(y[k]) - double(y[j]) * double(x[k]);
    }
    const double least = min(min(weight[0], weight[1]), weight[2]),
                 most = max(max(weight[0], weight[1]), weight[2]);
    if (least < 0 && most > 0)
        return {};
    if (least == 0 && most == 0) {
        const FlatHit flat = flat_hit(x, y, z, per_z);
        return {flat.z * per_z, flat.u, flat.v};
    }
    const double sum = weight[0] + weight[1] + weight[2],
                 depth = weight[0] * double(z[0]) + weight[1] * double(z[1]) + weight[2] * double(z[2]);
    return {float(depth / sum * double(per_z)), float(weight[1] / sum), float(weight[2] / sum)};
}

// What rays have to do with distances, in lanes: of one ray all are the same.
template <int W>
struct DepthRange {
    Float<W> per_z, t_min, t_max; // as in TracedRay
};

// Where the ray passes through triangles, for lanes of `inside`: distances, weights of the second and third
// corner. Takes lanes out that are hit elsewhere than on the ray.
template <int W>
struct Depths {
    Float<W> t, u, v;
    uint32_t hit;

    // Weights and depths of the corners.
    Depths(const TracedRay& ray, uint32_t inside, const Seen<W> (&corner)[3], const Float<W> (&weight)[3],
           const Float<W> (&z)[3])
        : Depths(DepthRange<W>{Float<W>(ray.per_z), Float<W>(ray.t_min), Float<W>(ray.t_max)}, inside, corner,
                 weight, z) {}
    Depths(const DepthRange<W>& ray, uint32_t inside, const Seen<W> (&corner)[3], const Float<W> (&weight)[3],
           const Float<W> (&z)[3])
        : Depths(ray, inside, corner, weight, z,
                 [&](Float<W> depth, Float<W> sum) { return depth * ray.per_z / sum; }) {}
    // t_of(depth, sum of the weights): the distance, unless weights are mostly rounding.
    template <class TOf>
    Depths(const DepthRange<W>& ray, uint32_t inside, const Seen<W> (&corner)[3], const Float<W> (&weight)[3],
           const Float<W> (&z)[3], const TOf& t_of) {
        const Float<W> sum = weight[0] + weight[1] + weight[2];
        const Float<W> depth = fma(weight[2], z[2], fma(weight[1], z[1], weight[0] * z[0]));
        t = t_of(depth, sum);
        u = weight[1] / sum, v = weight[2] / sum;
        const uint32_t rough = inside & ~(rounding_squared(corner, z, sum) < depth * depth).bits();
        if (rough != 0)
            mend(ray.per_z, rough, corner, z);
        hit = inside & ((t >= ray.t_min) & (t <= ray.t_max)).bits();
    }

  private:
    // The square of what rounding of the weights may come to in `depth`, in units of 4.6 eps: their largest
    // product times the size of the triangle. Less than zero where that is no more than twice the sum of the
    // weights: of most, and of those that a ray starts from (docs/hierarchy.md, "Offsets").
    static Float<W> rounding_squared(const Seen<W> (&corner)[3], const Float<W> (&z)[3], Float<W> sum) {
        const Float<W> x0 = corner[0].x, x1 = corner[1].x, y1 = corner[1].y, y2 = corner[2].y;
        const Float<W> x = fma(x1, x1, x0 * x0), y = fma(y2, y2, y1 * y1);
        const Float<W> z01 = z[0] - z[1], z12 = z[1] - z[2];
        const Float<W> product = fma(sum * Float<W>(-4.0f), sum, x * y);
        return product * fma(z12, z12, fma(z01, z01, x + y));
    }
    // Lanes whose weights are mostly rounding, as are those of slivers.
    [[gnu::noinline]] void mend(Float<W> per_z, uint32_t lanes, const Seen<W> (&corner)[3],
                                const Float<W> (&z)[3]) {
        alignas(64) float x[3][W], y[3][W], depth[3][W], of_t[W], of_u[W], of_v[W];
        for (int c = 0; c < 3; c++)
            corner[c].x.store(x[c]), corner[c].y.store(y[c]), z[c].store(depth[c]);
        t.store(of_t), u.store(of_u), v.store(of_v);
        for (uint32_t m = lanes; m != 0; m &= m - 1) {
            const int i = __builtin_ctz(m);
            const ExactHit h = exact_hit({x[0][i], x[1][i], x[2][i]}, {y[0][i], y[1][i], y[2][i]},
                                         {depth[0][i], depth[1][i], depth[2][i]}, per_z[i]);
            of_t[i] = h.t, of_u[i] = h.u, of_v[i] = h.v;
        }
        t = Float<W>::load(of_t), u = Float<W>::load(of_u), v = Float<W>::load(of_v);
    }
};

// ---- vertices, four of a row side by side, W / 4 rows from `row` on
template <int W, class Rows>
Int<W> join_rows(const Rows& rows_of_8) {
    if constexpr (W == 8)
        return rows_of_8(0);
    else
        return Int<16>(__builtin_shufflevector(rows_of_8(0).v, rows_of_8(2).v, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9,
                                               10, 11, 12, 13, 14, 15));
}
inline Int<8> two_fours(const void* first, const void* second) {
    const __m128i a = _mm_loadu_si128(static_cast<const __m128i*>(first));
    const __m128i b = _mm_loadu_si128(static_cast<const __m128i*>(second));
    return Int<8>((NativeLanes<8>::I)_mm256_inserti128_si256(_mm256_castsi128_si256(a), b, 1));
}
inline Int<8> two_fours_of_16_bits(const uint16_t* first, const uint16_t* second) {
    const __m128i both = _mm_unpacklo_epi64(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(first)),
                                            _mm_loadl_epi64(reinterpret_cast<const __m128i*>(second)));
    return Int<8>((NativeLanes<8>::I)_mm256_cvtepu16_epi32(both));
}

// A reader is told an axis, and reads vertices in steps of the lattice; and from those where they are less
// the ray's origin, which is rounded once: so it does not matter which kind of leaf a vertex is in. `pair` is
// any two places where four vertices begin.
class Reader32 {
  public:
    explicit Reader32(const Grid32& leaf)
        : m_leaf(leaf), m_fields(field_table[uint8_t(leaf.frame[0])]),
          m_unit(std::bit_cast<float>(uint32_t(leaf.frame[1] & 255) << 23)) {}
    uint32_t shape() const { return uint32_t(m_leaf.frame[2]) & 15; }
    Int<8> pair(int, int first, int second) const {
        return two_fours(m_leaf.vertex + first, m_leaf.vertex + second);
    }
    template <int W>
    Float<W> steps(int axis, Int<W> raw) const {
        const Float<W> field = Float<W>(raw & Int<W>(m_fields.mask[axis]));
        return fma(field, Float<W>(m_fields.scale[axis]), Float<W>(float(m_leaf.frame[axis] >> 8)));
    }
    template <int W>
    Float<W> place(Float<W> steps, float o) const {
        return fma(steps, Float<W>(m_unit), Float<W>(-o));
    }

  private:
    const Grid32& m_leaf;
    const Fields& m_fields;
    float m_unit;
};

class Reader48 {
  public:
    explicit Reader48(const Grid48& leaf)
        : m_leaf(leaf), m_unit(std::bit_cast<float>(uint32_t(leaf.frame[1] & 255) << 23)) {}
    uint32_t shape() const { return uint32_t(m_leaf.frame[2]) & 15; }
    Int<8> pair(int axis, int first, int second) const {
        return two_fours_of_16_bits(m_leaf.coordinate[axis] + first, m_leaf.coordinate[axis] + second);
    }
    template <int W>
    Float<W> steps(int axis, Int<W> raw) const {
        return Float<W>(raw) + Float<W>(float(m_leaf.frame[axis] >> 8));
    }
    template <int W>
    Float<W> place(Float<W> steps, float o) const {
        return fma(steps, Float<W>(m_unit), Float<W>(-o));
    }

  private:
    const Grid48& m_leaf;
    float m_unit;
};

class ReaderFloat {
  public:
    explicit ReaderFloat(const GridFloat& leaf) : m_leaf(leaf) {}
    uint32_t shape() const { return m_leaf.shape & 15; }
    Int<8> pair(int axis, int first, int second) const {
        return two_fours(m_leaf.coordinate[axis] + first, m_leaf.coordinate[axis] + second);
    }
    template <int W>
    Float<W> steps(int, Int<W> raw) const {
        return bitcast_float(raw);
    }
    template <int W>
    Float<W> place(Float<W> steps, float o) const {
        return steps - Float<W>(o);
    }

  private:
    const GridFloat& m_leaf;
};

// ---- the vertices of a leaf, along an axis
// Cells are W at once, from row to row; a strip is W / 4 rows of them. `left` has the vertices at the cells'
// left sides, `right` at their right sides, `last` those of the last row of all, four and four.
template <int W, class Reader>
class GridVertices {
  public:
    static constexpr int Strips = 16 / W, StripRows = W / 4;

    explicit GridVertices(const Reader& reader) : m_reader(reader) {}
    uint32_t shape() const { return m_reader.shape(); }
    Float<W> left(int axis, int s) const { return rows(axis, s * StripRows * LeafRow); }
    Float<W> right(int axis, int s) const { return rows(axis, s * StripRows * LeafRow + 1); }
    Float<8> last(int axis) const {
        return m_reader.template steps<8>(axis, m_reader.pair(axis, 4 * LeafRow, 4 * LeafRow + 1));
    }
    template <int V>
    Float<V> place(Float<V> steps, float o) const {
        return m_reader.place(steps, o);
    }

  private:
    Float<W> rows(int axis, int from) const {
        return m_reader.template steps<W>(axis, join_rows<W>([&](int row) {
                                              const int at = from + row * LeafRow;
                                              return m_reader.pair(axis, at, at + LeafRow);
                                          }));
    }
    const Reader m_reader;
};
// The same, read once for many rays.
template <int W, class Reader>
class KeptGridVertices {
    using Vertices = GridVertices<W, Reader>;

  public:
    explicit KeptGridVertices(const Reader& reader) : m_vertices(reader) {
        for (int a = 0; a < 3; a++) {
            for (int s = 0; s < Vertices::Strips; s++)
                m_left[a][s] = m_vertices.left(a, s), m_right[a][s] = m_vertices.right(a, s);
            m_last[a] = m_vertices.last(a);
        }
    }
    uint32_t shape() const { return m_vertices.shape(); }
    Float<W> left(int axis, int s) const { return m_left[axis][s]; }
    Float<W> right(int axis, int s) const { return m_right[axis][s]; }
    Float<8> last(int axis) const { return m_last[axis]; }
    template <int V>
    Float<V> place(Float<V> steps, float o) const {
        return m_vertices.place(steps, o);
    }

  private:
    const Vertices m_vertices;
    Float<W> m_left[3][Vertices::Strips], m_right[3][Vertices::Strips];
    Float<8> m_last[3];
};

// ---- the cells of a leaf, as a ray sees them
template <int W>
class GridCells {
  public:
    static constexpr int Strips = 16 / W;

    template <class Vertices>
    GridCells(const Vertices& vertices, const TracedRay& ray) {
        for (int k = 0; k < 3; k++) {
            const int axis = ray.axis[k];
            const float o = ray.o[axis];
            for (int s = 0; s < Strips; s++) {
                m_left[k][s] = vertices.place(vertices.left(axis, s), o);
                m_right[k][s] = vertices.place(vertices.right(axis, s), o);
            }
            m_last[k] = vertices.place(vertices.last(axis), o);
        }
        for (int k = 0; k < 2; k++) {
            const Float<W> minus_slope(ray.minus_slope[k]);
            for (int s = 0; s < Strips; s++) {
                m_left[k][s] = fma(m_left[2][s], minus_slope, m_left[k][s]);
                m_right[k][s] = fma(m_right[2][s], minus_slope, m_right[k][s]);
            }
            m_last[k] = fma(m_last[2], Float<8>(ray.minus_slope[k]), m_last[k]);
        }
    }

    // Corners of the cells of a strip: 0 and 1 at its beginning, 2 and 3 a row further.
    template <int Corner>
    Float<W> coordinate(int k, int s) const {
        if constexpr (Corner == 0)
            return m_left[k][s];
        else if constexpr (Corner == 1)
            return m_right[k][s];
        else if constexpr (Corner == 2)
            return s + 1 < Strips ? next_row<0>(m_left[k][s], m_left[k][s + 1 < Strips ? s + 1 : s])
                                  : next_row<0>(m_left[k][s], widened(m_last[k]));
        else
            return s + 1 < Strips ? next_row<0>(m_right[k][s], m_right[k][s + 1 < Strips ? s + 1 : s])
                                  : next_row<4>(m_right[k][s], widened(m_last[k]));
    }
    template <int Corner>
    Seen<W> seen(int s) const {
        return {coordinate<Corner>(0, s), coordinate<Corner>(1, s)};
    }
    template <int Corner>
    Float<W> z(int s) const {
        return coordinate<Corner>(2, s);
    }

  private:
    static Float<W> widened(Float<8> v) {
        if constexpr (W == 8)
            return v;
        else
            return Float<16>(
                __builtin_shufflevector(v.v, v.v, 0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3, 4, 5, 6, 7));
    }
    // What lies one row further: all but the first four, and then four of `after`.
    template <int From>
    static Float<W> next_row(Float<W> here, Float<W> after) {
        if constexpr (W == 8)
            return Float<8>(__builtin_shufflevector(here.v, after.v, 4, 5, 6, 7, 8 + From, 9 + From,
                                                    10 + From, 11 + From));
        else
            return Float<16>(__builtin_shufflevector(here.v, after.v, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14,
                                                     15, 16 + From, 17 + From, 18 + From, 19 + From));
    }

    Float<W> m_left[3][Strips], m_right[3][Strips];
    Float<8> m_last[3];
};

// Cells of a leaf of that shape, as bits.
struct ShapeTable {
    uint16_t cells[16] = {};
    constexpr ShapeTable() {
        for (unsigned shape = 0; shape < 16; shape++)
            for (unsigned cell = 0; cell < 16; cell++)
                if (cell % 4 <= (shape & 3) && cell / 4 <= shape >> 2)
                    cells[shape] |= uint16_t(1u << cell);
    }
};
inline constexpr ShapeTable shape_table;

// Offers to `found` whatever the ray hits: found(primitive, t, u, v), which answers whether that ends the
// leaf. Returns that too.
template <int W, class Vertices, class Found>
bool trace_grid_leaf(const Vertices& vertices, const TracedRay& ray, Found&& found) {
    const GridCells<W> cells(vertices, ray);
    const uint32_t present = shape_table.cells[vertices.shape()];
    alignas(64) float t[W], u[W], v[W];
    const auto offer = [&](const Depths<W>& depths, int strip, int second) {
        depths.t.store(t), depths.u.store(u), depths.v.store(v);
        for (uint32_t m = depths.hit; m != 0; m &= m - 1) {
            const int i = __builtin_ctz(m);
            const uint32_t primitive = uint32_t((strip * W + i) * 2 + second);
            if (t[i] <= ray.t_max &&
                found(primitive, t[i], second ? 1 - u[i] : u[i], second ? 1 - v[i] : v[i]))
                return true;
        }
        return false;
    };
    for (int s = 0; s < GridCells<W>::Strips; s++) {
        const Seen<W> c0 = cells.template seen<0>(s), c1 = cells.template seen<1>(s),
                      c2 = cells.template seen<2>(s), c3 = cells.template seen<3>(s);
        const uint32_t here = present >> (s * W);
        const Float<W> across = edge(c1, c2), e01 = edge(c0, c1), e20 = edge(c2, c0);
        const Float<W> back = -across, e32 = edge(c3, c2), e13 = edge(c1, c3);
        const uint32_t first = through(across, e20, e01) & here, second = through(back, e13, e32) & here;
        if ((first | second) == 0)
            continue;
        const Float<W> z1 = cells.template z<1>(s), z2 = cells.template z<2>(s);
        if (first != 0) {
            const Depths<W> depths(ray, first, {c0, c1, c2}, {across, e20, e01},
                                   {cells.template z<0>(s), z1, z2});
            if (depths.hit != 0 && offer(depths, s, 0))
                return true;
        }
        if (second != 0) {
            const Depths<W> depths(ray, second, {c3, c2, c1}, {back, e13, e32},
                                   {cells.template z<3>(s), z2, z1});
            if (depths.hit != 0 && offer(depths, s, 1))
                return true;
        }
    }
    return false;
}

} // namespace kanuka::hierarchy
