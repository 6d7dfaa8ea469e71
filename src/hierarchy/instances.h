// Leaves that are places of other pages, and where among them a hit lies.
#pragma once

#include <algorithm>
#include <compare>

#include "hierarchy/page.h"
#include "hierarchy/ray.h"

namespace kanuka::hierarchy {

// How deep instances may lie in instances.
inline constexpr int MostNesting = 8;

struct InstanceLeaf {
    float page_from_world[9]; // the linear part, row by row; of a level inside, "world" is the page that it
                              // stands in
    float origin[3]; // of the page, in the world: taken off first, so that places far away keep their digits
    uint32_t page;   // number of what stands there
    uint32_t number; // of the instance in its level
    uint32_t unused[2];

    // The ray as it runs in the page; distances are the same. Sums are taken in double, rounded once.
    Ray inner(const Ray& r) const {
        const double from[3] = {double(r.o.x) - double(origin[0]), double(r.o.y) - double(origin[1]),
                                double(r.o.z) - double(origin[2])};
        const double along[3] = {double(r.d.x), double(r.d.y), double(r.d.z)};
        const auto turned = [&](const double* v) {
            float out[3];
            for (int a = 0; a < 3; a++) {
                const float* row = page_from_world + 3 * a;
                out[a] = float(double(row[0]) * v[0] + double(row[1]) * v[1] + double(row[2]) * v[2]);
            }
            return Vec3f(out[0], out[1], out[2]);
        };
        return {turned(from), r.t_min, turned(along), r.t_max};
    }
};
static_assert(sizeof(InstanceLeaf) == 64);
static_assert(UnitsOf[int(Kind::Instance)] * UnitBytes == sizeof(InstanceLeaf));

// Which instances a hit lies in, the outermost first, by their numbers in their levels.
struct InstancePath {
    uint32_t depth = 0;
    uint32_t instance[MostNesting] = {}; // zero behind the last

    static const InstancePath& none() {
        static const InstancePath path;
        return path;
    }
    friend auto operator<=>(const InstancePath&, const InstancePath&) = default;
};

struct InstanceHit {
    Hit hit;
    InstancePath path;
    friend bool operator==(const InstanceHit&, const InstanceHit&) = default;
};

} // namespace kanuka::hierarchy
