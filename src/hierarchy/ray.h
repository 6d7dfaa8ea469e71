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

// The axis along which a ray runs most, by three comparisons of the sizes of its direction's components:
// x >= y, x >= z, y >= z.
inline constexpr uint8_t LongestAxis[8] = {2, 2, 2, 0, 1, 2, 1, 0};

struct TracedRay {
    // Boxes begin nearer and end further away by 2^-20, and by 2^-12 of the step of their planes: more than
    // all rounding of the test of boxes and of that of triangles together (docs/hierarchy.md, "Robustness").
    static constexpr float Margin = 0x1p-20f, StepMargin = 0x1p-12f;
    alignas(16) float o[4], per_d[4];
    int near_plane[3], far_plane[3]; // bytes of the node's first ones
    // Triangles: axis[2] is the one along which the ray runs most. Subtracting z times the slopes shears the
    // ray onto the z axis [Woop, Benthin, Wald 2013, "Watertight ray/triangle intersection"].
    int axis[3];
    float minus_slope[2], per_z;
    float t_min, t_max; // t_max: of the closest hit so far
    bool traceable;     // else it hits nothing

    TracedRay() = default;
    explicit TracedRay(const Ray& r) {
        const __m128 start = _mm_loadu_ps(&r.o.x), d = _mm_loadu_ps(&r.d.x); // beside t_min and t_max
        const __m128 sign = _mm_set1_ps(-0.0f), size = _mm_andnot_ps(sign, d);
        const float ax = abs(r.d.x), ay = abs(r.d.y), az = abs(r.d.z), largest = max(max(ax, ay), az);
        const __m128 limit = _mm_set1_ps(LargestCoordinate);
        const int somewhere = _mm_movemask_ps(
            _mm_and_ps(_mm_cmplt_ps(_mm_andnot_ps(sign, start), limit), _mm_cmplt_ps(size, limit)));
        traceable =
            (somewhere & 7) == 7 && largest > 1 / LargestCoordinate && r.t_min <= r.t_max && r.t_min >= 0;
        // Along an axis that it hardly moves along it moves so little: reciprocals stay finite.
        const __m128 least = _mm_set1_ps(0x1p-60f * largest);
        _mm_store_ps(o, start);
        _mm_store_ps(per_d,
                     _mm_div_ps(_mm_set1_ps(1), _mm_or_ps(_mm_max_ps(size, least), _mm_and_ps(d, sign))));
        const int backwards = _mm_movemask_ps(d);
        for (int a = 0; a < 3; a++)
            near_plane[a] = a * 16 + (backwards >> a & 1) * 8, far_plane[a] = near_plane[a] ^ 8;
        axis[2] = LongestAxis[int(ax >= ay) | int(ax >= az) << 1 | int(ay >= az) << 2];
        axis[0] = axis[2] == 2 ? 0 : axis[2] + 1, axis[1] = axis[0] == 2 ? 0 : axis[0] + 1;
        const float z = r.d[axis[2]];
        alignas(16) float per[4];
        _mm_store_ps(per, _mm_div_ps(_mm_setr_ps(-r.d[axis[0]], -r.d[axis[1]], 1, 1), _mm_set1_ps(z)));
        minus_slope[0] = per[0], minus_slope[1] = per[1], per_z = per[2];
        t_min = r.t_min + 0.0f, t_max = r.t_max; // -0 would not be the least of distances, as bits
    }
};

} // namespace kanuka::hierarchy
