// Rays and hits, and what a ray is made into before it is traced.
#pragma once

#include <immintrin.h>

#include "hierarchy/format.h"
#include "hierarchy/lattice.h"

namespace kanuka::hierarchy {

// From o + t_min d to o + t_max d; d need not be of unit length, t_min is not negative.
struct Ray {
    Vec3f o;
    float t_min = 0;
    Vec3f d;
    float t_max = std::numeric_limits<float>::infinity();
};

struct Hit {
    float t = std::numeric_limits<float>::infinity();
    // Of grids: within the cell. Of triangles: weights of the second and third corner.
    float u = 0, v = 0;
    Ref leaf = NoRef; // NoRef = nothing is hit
    // Of a leaf of grids: cell * 2 + triangle; of triangles: which.
    uint32_t primitive = 0;

    bool found() const { return leaf != NoRef; }
    friend bool operator==(const Hit&, const Hit&) = default;
};

// The axis along which a ray runs most is the third, behind the two that follow it: by three comparisons of
// the sizes of its direction's components, x >= y, x >= z, y >= z. The fourth is none.
struct AxisOrder {
    alignas(16) int axis[4];
};
inline constexpr AxisOrder axis_order[8] = {{{0, 1, 2, 3}}, {{0, 1, 2, 3}}, {{0, 1, 2, 3}}, {{1, 2, 0, 3}},
                                            {{2, 0, 1, 3}}, {{0, 1, 2, 3}}, {{2, 0, 1, 3}}, {{1, 2, 0, 3}}};

// Made without branches: what a ray does says nothing about the next.
struct TracedRay {
    // Boxes begin nearer and end further away by 2^-20: with Node::Slack more than all rounding of the test
    // of boxes and of that of triangles together (docs/hierarchy.md, "Robustness").
    static constexpr float Margin = 0x1p-20f;
    alignas(16) float o[4], per_d[4];
    int near_plane[4], far_plane[4]; // bytes of the node's first ones
    // Triangles: axis[2] is the one along which the ray runs most. Subtracting z times the slopes shears the
    // ray onto the z axis [Woop, Benthin, Wald 2013, "Watertight ray/triangle intersection"].
    int axis[4];
    float minus_slope[2], per_z, unused;
    float t_min, t_max; // t_max: of the closest hit so far
    bool traceable;     // else it hits nothing

    TracedRay() = default;
    [[gnu::always_inline]] explicit TracedRay(const Ray& r) {
        const __m128 start = _mm_loadu_ps(&r.o.x), d = _mm_loadu_ps(&r.d.x); // beside t_min and t_max
        const __m128 sign = _mm_set1_ps(-0.0f), size = _mm_andnot_ps(sign, d);
        const __m128 xxy = _mm_permute_ps(size, _MM_SHUFFLE(3, 1, 0, 0)),
                     yzz = _mm_permute_ps(size, _MM_SHUFFLE(3, 2, 2, 1));
        const __m128i order = load(axis_order[_mm_movemask_ps(_mm_cmpge_ps(xxy, yzz)) & 7].axis);
        const __m128 in_order = _mm_permutevar_ps(d, order),
                     z = _mm_permute_ps(in_order, _MM_SHUFFLE(2, 2, 2, 2)), largest = _mm_andnot_ps(sign, z);
        const __m128 limit = _mm_set1_ps(LargestCoordinate);
        const int somewhere = _mm_movemask_ps(
            _mm_and_ps(_mm_cmplt_ps(_mm_andnot_ps(sign, start), limit), _mm_cmplt_ps(size, limit)));
        const int runs = _mm_movemask_ps(_mm_cmpgt_ps(largest, _mm_set1_ps(1 / LargestCoordinate)));
        traceable =
            ((somewhere & 7) == 7) & (runs & 1) & int(r.t_min <= r.t_max) & int(r.t_min >= 0); // no branch
        // Along an axis that it hardly moves along it moves so little: reciprocals stay finite.
        const __m128 least = _mm_mul_ps(_mm_set1_ps(0x1p-60f), largest);
        _mm_store_ps(o, start);
        const __m128 inverse =
            _mm_div_ps(_mm_set1_ps(1), _mm_or_ps(_mm_max_ps(size, least), _mm_and_ps(d, sign)));
        // Fourth: zero. What stands beside frames of nodes would become numbers too small to be normal by it.
        _mm_store_ps(per_d, _mm_blend_ps(inverse, _mm_setzero_ps(), 0b1000));
        const __m128i backwards = _mm_srai_epi32(_mm_castps_si128(d), 31), upper = _mm_set1_epi32(8);
        const __m128i nearer = _mm_add_epi32(_mm_and_si128(backwards, upper), _mm_setr_epi32(0, 16, 32, 0));
        store(near_plane, nearer), store(far_plane, _mm_xor_si128(nearer, upper)), store(axis, order);
        const __m128 over_z = _mm_blend_ps(_mm_xor_ps(in_order, sign), _mm_set1_ps(1), 0b1100);
        _mm_store_ps(minus_slope, _mm_div_ps(over_z, z)); // and per_z
        t_min = r.t_min + 0.0f, t_max = r.t_max;          // -0 would not be the least of distances, as bits
    }

  private:
    static __m128i load(const int* from) { return _mm_load_si128(reinterpret_cast<const __m128i*>(from)); }
    static void store(int* to, __m128i v) { _mm_store_si128(reinterpret_cast<__m128i*>(to), v); }
};

} // namespace kanuka::hierarchy
