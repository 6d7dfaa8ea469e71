// Rays and hits, and what a ray is made into before it is traced.
#pragma once

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

// Signs of directions make an octant: bit a is set where d[a] is negative. Children are looked at from place
// 0 ^ octant on, and wait in lanes from the far ones to the near.
struct OctantTables {
    alignas(32) int32_t place[8][8]; // of a lane
    uint8_t present[8][8];           // lanes of the first n + 1 places

    constexpr OctantTables() : place{}, present{} {
        for (int octant = 0; octant < 8; octant++)
            for (int lane = 0; lane < 8; lane++) {
                place[octant][lane] = lane ^ 7 ^ octant;
                for (int last = 0; last < 8; last++)
                    if (place[octant][lane] <= last)
                        present[octant][last] |= uint8_t(1 << lane);
            }
    }
};
inline constexpr OctantTables octant_tables;

struct TracedRay {
    // Boxes. Distances to near planes are made smaller, to far planes larger, by 2^-20: more than all
    // rounding of the test of boxes and of that of triangles together (docs/hierarchy.md, "Robustness").
    static constexpr float Near = 1 - 0x1p-20f, Far = 1 + 0x1p-20f;
    float o[3], near_per_d[3], far_per_d[3];
    int near_plane[3]; // byte of the node's first near plane
    int octant;
    // Triangles: axis[2] is the one along which the ray runs most. Subtracting z times the slopes shears the
    // ray onto the z axis [Woop, Benthin, Wald 2013, "Watertight ray/triangle intersection"].
    int axis[3];
    float minus_slope[2], per_z;
    float t_min, t_max; // t_max: of the closest hit so far
    bool traceable;     // else it hits nothing

    TracedRay() = default;
    explicit TracedRay(const Ray& r) {
        const float ax = abs(r.d.x), ay = abs(r.d.y), az = abs(r.d.z), largest = max(max(ax, ay), az);
        traceable = is_somewhere(r.o) && is_somewhere(r.d) && largest > 1 / LargestCoordinate &&
                    r.t_min <= r.t_max && r.t_min >= 0;
        axis[2] = ax >= ay ? (ax >= az ? 0 : 2) : (ay >= az ? 1 : 2);
        axis[0] = axis[2] == 2 ? 0 : axis[2] + 1, axis[1] = axis[0] == 2 ? 0 : axis[0] + 1;
        octant = 0;
        for (int a = 0; a < 3; a++) {
            o[a] = r.o[a];
            // Along an axis that it hardly moves along it moves so little: reciprocals stay finite.
            const float least = 0x1p-60f * largest;
            const float d = abs(r.d[a]) < least ? __builtin_copysignf(least, r.d[a]) : r.d[a];
            const bool negative = d < 0;
            octant |= int(negative) << a;
            near_plane[a] = a * 16 + (negative ? 8 : 0);
            near_per_d[a] = 1 / d * Near, far_per_d[a] = 1 / d * Far;
        }
        const float z = r.d[axis[2]];
        minus_slope[0] = -(r.d[axis[0]] / z), minus_slope[1] = -(r.d[axis[1]] / z), per_z = 1 / z;
        t_min = r.t_min, t_max = r.t_max;
    }
};

} // namespace kanuka::hierarchy
