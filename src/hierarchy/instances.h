// Leaves that are places of other pages, and where among them a hit lies.
#pragma once

#include <algorithm>
#include <compare>

#include "hierarchy/page.h"
#include "hierarchy/ray.h"

namespace kanuka::hierarchy {

// How deep instances may lie in instances.
inline constexpr int MostNesting = 17;

struct InstanceLeaf {
    float page_from_world[9]; // the linear part, column by column; of a level inside, "world" is the page
                              // that it stands in
    float origin[3]; // of the page, in the world: taken off first, so that places far away keep their digits
    uint32_t page;   // number of what stands there
    uint32_t number; // of the instance in its level
    uint32_t stays;  // 1: the page lies in the level as it is, and rays are not made anew
    uint32_t unused;

    // The ray as it runs in the page; distances are the same. Sums are taken in double, rounded once.
    Ray inner(const Ray& r) const {
        const auto doubles = [](const float* at) { return _mm256_cvtps_pd(_mm_loadu_ps(at)); };
        const __m256d x = doubles(page_from_world), y = doubles(page_from_world + 3),
                      z = doubles(page_from_world + 6);
        const auto turned = [&](__m256d v) {
            __m256d sum = _mm256_mul_pd(z, _mm256_permute4x64_pd(v, 0xaa));
            sum = _mm256_fmadd_pd(y, _mm256_permute4x64_pd(v, 0x55), sum);
            return _mm256_cvtpd_ps(_mm256_fmadd_pd(x, _mm256_permute4x64_pd(v, 0x00), sum));
        };
        Ray out;
        _mm_storeu_ps(&out.o.x, turned(_mm256_sub_pd(doubles(&r.o.x), doubles(origin))));
        _mm_storeu_ps(&out.d.x, turned(doubles(&r.d.x)));
        out.t_min = r.t_min, out.t_max = r.t_max; // the fourth lanes hold nothing
        return out;
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
