// Leaves of up to eight segments of fibres against one ray: all at once.
//
// A segment is all balls whose centre c(s) = p0 + s a and radius r(s) = r0 + s b belong together, for s from
// 0 to 1. A ray meets ball s where r(s)^2 is not below the square of its distance D(s) from the centre:
//
//     F(s) = r(s)^2 - D(s)^2 = A + 2 B s - C s^2 >= 0,
//
// from z(s) - sqrt(F(s)) on to z(s) + sqrt(F(s)), where z(s) = z0 + s az is how far along the ray the centre
// lies. It enters the segment at the least of the former, where the derivative is zero or at an end, and
// leaves it at the largest of the latter. So the round ends need no case of their own, s tells which ball is
// met, and F is taken at s from the ball itself: an error of s is of second order. As usual (Embree, and
// Inigo Quilez's "Rounded Cone - intersection", 2018) cone and balls are three quadratic equations, whose
// coefficients lose as many digits as the segment is longer than wide, squared.
#pragma once

#include "hierarchy/leaf_lanes.h"

namespace kanuka::hierarchy {

inline Int<8> eight_of_16_bits(const uint16_t* at) {
    return Int<8>(
        (NativeLanes<8>::I)_mm256_cvtepu16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(at))));
}
template <class Leaf>
Float<8> radii_of(const Leaf& leaf, int end) {
    const Int<8> word = eight_of_16_bits(leaf.radius[end]);
    return bitcast_float((word + Int<8>(int32_t(leaf.least_radius))) << 12);
}

// As those of triangles (triangle_lanes.h): along an axis, one end of all.
class FibreReader32 {
  public:
    explicit FibreReader32(const Fibre32& leaf)
        : m_leaf(leaf), m_fields(field_table[uint8_t(leaf.frame[0])]),
          m_unit(std::bit_cast<float>(uint32_t(leaf.frame[1] & 255) << 23)) {}
    uint32_t segments() const { return uint32_t(m_leaf.frame[2]) & 15; }
    Float<8> radius(int end) const { return radii_of(m_leaf, end); }
    Float<8> steps(int axis, int end) const {
        const Int<8> raw = Int<8>::load(reinterpret_cast<const int32_t*>(m_leaf.end[end]));
        const Float<8> field = Float<8>(raw & Int<8>(m_fields.mask[axis]));
        return fma(field, Float<8>(m_fields.scale[axis]), Float<8>(float(m_leaf.frame[axis] >> 8)));
    }
    Float<8> place(Float<8> steps, float o) const { return fma(steps, Float<8>(m_unit), Float<8>(-o)); }
    Float<8> length(Float<8> steps) const { return steps * Float<8>(m_unit); } // of a difference

  private:
    const Fibre32& m_leaf;
    const Fields& m_fields;
    float m_unit;
};

class FibreReader48 {
  public:
    explicit FibreReader48(const Fibre48& leaf)
        : m_leaf(leaf), m_unit(std::bit_cast<float>(uint32_t(leaf.frame[1] & 255) << 23)) {}
    uint32_t segments() const { return uint32_t(m_leaf.frame[2]) & 15; }
    Float<8> radius(int end) const { return radii_of(m_leaf, end); }
    Float<8> steps(int axis, int end) const {
        return Float<8>(eight_of_16_bits(m_leaf.coordinate[axis][end])) +
               Float<8>(float(m_leaf.frame[axis] >> 8));
    }
    Float<8> place(Float<8> steps, float o) const { return fma(steps, Float<8>(m_unit), Float<8>(-o)); }
    Float<8> length(Float<8> steps) const { return steps * Float<8>(m_unit); }

  private:
    const Fibre48& m_leaf;
    float m_unit;
};

class FibreReaderFloat {
  public:
    explicit FibreReaderFloat(const FibreFloat& leaf) : m_leaf(leaf) {}
    uint32_t segments() const { return m_leaf.count & 15; }
    Float<8> radius(int end) const { return radii_of(m_leaf, end); }
    Float<8> steps(int axis, int end) const { return Float<8>::load(m_leaf.coordinate[axis][end]); }
    Float<8> place(Float<8> steps, float o) const { return steps - Float<8>(o); }
    Float<8> length(Float<8> steps) const { return steps; }

  private:
    const FibreFloat& m_leaf;
};

// The same, read once for many rays.
template <class Reader>
class KeptFibres {
  public:
    explicit KeptFibres(const Reader& reader) : m_reader(reader) {
        for (int e = 0; e < 2; e++) {
            m_radius[e] = reader.radius(e);
            for (int a = 0; a < 3; a++)
                m_steps[a][e] = reader.steps(a, e);
        }
    }
    uint32_t segments() const { return m_reader.segments(); }
    Float<8> radius(int end) const { return m_radius[end]; }
    Float<8> steps(int axis, int end) const { return m_steps[axis][end]; }
    Float<8> place(Float<8> steps, float o) const { return m_reader.place(steps, o); }
    Float<8> length(Float<8> steps) const { return m_reader.length(steps); }

  private:
    const Reader m_reader;
    Float<8> m_steps[3][2], m_radius[2];
};

// Across a ray and along it: from what is sheared (leaf_lanes.h) to lengths.
class AcrossRay {
  public:
    explicit AcrossRay(const TracedRay& ray) : m_sx(-ray.minus_slope[0]), m_sy(-ray.minus_slope[1]) {
        const float of_y = 1 + m_sy * m_sy,
                    squared = of_y + m_sx * m_sx; // of the direction that is 1 along z
        alignas(16) float ratio[4], root[4];
        const __m128 ratios =
            _mm_div_ps(_mm_setr_ps(of_y, 1, 1, m_sx * m_sy), _mm_setr_ps(squared, of_y, squared, of_y));
        _mm_store_ps(ratio, ratios), _mm_store_ps(root, _mm_sqrt_ps(_mm_max_ps(ratios, _mm_setzero_ps())));
        m_x = root[0], m_y = root[1], m_skew = ratio[3];
        m_z = __builtin_copysignf(root[2], ray.per_z);
        t_of_z = abs(ray.per_z) * root[2];
    }
    struct Place {
        Float<8> x, y, z; // z: along the ray
    };
    Place operator()(Float<8> x, Float<8> y, Float<8> z) const {
        const Float<8> sx(m_sx), sy(m_sy);
        const Float<8> sheared_x = fma(z, -sx, x), sheared_y = fma(z, -sy, y);
        return {Float<8>(m_x) * fma(sheared_y, Float<8>(-m_skew), sheared_x), Float<8>(m_y) * sheared_y,
                Float<8>(m_z) * fma(sx, x, fma(sy, y, z))};
    }
    float t_of_z;

  private:
    float m_sx, m_sy, m_skew, m_x, m_y, m_z;
};

// Segments as a ray sees them, and where it enters and leaves them.
class FibresSeen {
  public:
    struct Met {
        Float<8> t, s;
        uint32_t lanes; // that have a ball which the ray meets
    };

    template <class Reader>
    FibresSeen(const Reader& reader, const TracedRay& ray) {
        const AcrossRay across(ray);
        Float<8> steps[3], first[3], axis[3];
        for (int k = 0; k < 3; k++) {
            steps[k] = reader.steps(ray.axis[k], 0);
            first[k] = reader.place(steps[k], ray.o[ray.axis[k]]);
            axis[k] = reader.length(reader.steps(ray.axis[k], 1) - steps[k]);
        }
        m_p = across(first[0], first[1], first[2]), m_a = across(axis[0], axis[1], axis[2]);
        m_r = reader.radius(0), m_b = reader.radius(1) - m_r;
        m_t_of_z = Float<8>(across.t_of_z);

        m_C = m_a.x * m_a.x + m_a.y * m_a.y - m_b * m_b;
        m_D = max(fma(m_a.z, m_a.z, m_C), Float<8>(1e-37f));
        // The ball that the ray comes closest to: F is the largest there, between the ends of segments that
        // are not seen from one of those.
        m_s0 = clamped((m_r * m_b - m_p.x * m_a.x - m_p.y * m_a.y) / m_C);
        m_x = fma(m_s0, m_a.x, m_p.x), m_y = fma(m_s0, m_a.y, m_p.y), m_r0 = fma(m_s0, m_b, m_r);
        m_A = m_r0 * m_r0 - m_x * m_x - m_y * m_y;
        m_from_end = (m_C <= m_D * Float<8>(1e-5f)).bits();
        m_met = ((m_A >= Float<8>(0.0f)).bits() | m_from_end) & ((1u << reader.segments()) - 1) & 255;
    }
    // Segments that the ray may meet.
    uint32_t met() const { return m_met; }

    // Before what follows.
    void solve() {
        // From that ball on A and B are small, and lose nothing to each other.
        const Float<8> zero(0.0f),
            B = m_r0 * m_b - m_x * m_a.x - m_y * m_a.y + zero; // not -0: its sign is asked for
        // Derivatives are zero at s0 + (B -+ w) / C; of the two that which loses digits is known by the
        // other.
        const Float<8> w = m_a.z * sqrt(max(B * B + m_A * m_C, zero) / m_D);
        const Float<8> sum = B + copysign(w, B), far = sum / m_C,
                       near = select(sum == zero, far, (B * B - m_a.z * m_a.z * m_A) / (m_D * sum));
        const Mask<8> alike = !((w >= zero) ^ (B >= zero));
        m_entry = clamped(m_s0 + select(alike, near, far)), m_exit = clamped(m_s0 + select(alike, far, near));
    }
    Met entry() const { return meet(m_entry, Float<8>(-1.0f), m_met); }
    Met exit(uint32_t of) const { return meet(m_exit, Float<8>(1.0f), of); }

  private:
    static Float<8> clamped(Float<8> s) { return min(max(s, Float<8>(0.0f)), Float<8>(1.0f)); }
    Met meet(Float<8> s, Float<8> side, uint32_t of) const {
        Float<8> z;
        Mask<8> met = ball(s, side, z);
        // Seen from an end the largest ball counts, or the nearest: there the derivative does not tell.
        if (__builtin_expect((m_from_end & of) != 0, 0))
            look_at_ends(side, s, z, met);
        return {z * m_t_of_z, s, met.bits() & of};
    }
    Mask<8> ball(Float<8> s, Float<8> side, Float<8>& z) const {
        const Float<8> x = fma(s, m_a.x, m_p.x), y = fma(s, m_a.y, m_p.y), r = fma(s, m_b, m_r);
        const Float<8> F = fma(r, r, -fma(x, x, y * y));
        z = fma(side, sqrt(max(F, Float<8>(0.0f))), fma(s, m_a.z, m_p.z));
        return F >= Float<8>(0.0f);
    }
    [[gnu::noinline]] void look_at_ends(Float<8> side, Float<8>& s, Float<8>& z, Mask<8>& met) const {
        for (const float end : {0.0f, 1.0f}) {
            Float<8> there;
            const Mask<8> is_met = ball(Float<8>(end), side, there);
            const Mask<8> better = is_met & ((!met) | ((there - z) * side > Float<8>(0.0f)));
            s = select(better, Float<8>(end), s), z = select(better, there, z);
            met = met | is_met;
        }
    }

    AcrossRay::Place m_p, m_a;
    Float<8> m_r, m_b, m_t_of_z, m_C, m_D;
    Float<8> m_s0, m_x, m_y, m_r0, m_A; // of the ball that comes closest
    Float<8> m_entry, m_exit;           // s of the balls that are met first and last
    uint32_t m_from_end, m_met;
};

// Offers to `found` where the ray enters segments, and where it leaves those that it begins in or whose entry
// is refused: found(segment * 2 + (1 = it leaves), t, s, 0).
template <class Reader, class Found>
bool trace_fibre_leaf(const Reader& reader, const TracedRay& ray, Found&& found) {
    FibresSeen seen(reader, ray);
    if (seen.met() == 0)
        return false;
    seen.solve();
    const FibresSeen::Met entry = seen.entry();
    alignas(32) float t[8], s[8];
    entry.t.store(t), entry.s.store(s);
    uint32_t inside = 0;
    for (uint32_t m = entry.lanes; m != 0; m &= m - 1) {
        const int i = __builtin_ctz(m);
        if (t[i] > ray.t_max)
            continue;
        if (t[i] >= ray.t_min && found(uint32_t(2 * i), t[i], s[i], 0.0f))
            return true;
        if (t[i] < ray.t_min || ray.t_max != t[i])
            inside |= 1u << i;
    }
    if (inside == 0)
        return false;
    const FibresSeen::Met exit = seen.exit(inside);
    exit.t.store(t), exit.s.store(s);
    for (uint32_t m = exit.lanes; m != 0; m &= m - 1) {
        const int i = __builtin_ctz(m);
        if (t[i] >= ray.t_min && t[i] <= ray.t_max && found(uint32_t(2 * i + 1), t[i], s[i], 0.0f))
            return true;
    }
    return false;
}

} // namespace kanuka::hierarchy
