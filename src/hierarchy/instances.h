// Leaves that are places of other pages, and where among them a hit lies.
#pragma once

#include <algorithm>
#include <cmath>
#include <compare>

#include "base/level_range.h"
#include "base/motion.h"
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
    uint16_t stays;  // 1: the page lies in the level as it is, and rays are not made anew. What changes there
                     // has a page for each interval of time, this one and those that follow
    uint16_t times;  // that its boxes are of, where it moves; 0: it stands still
    LevelRange seen; // by which rays

    // False where floats do not hold the way to the page.
    bool stand_at(const Transform& world_from_page);
    // The ray as it runs in the page, to `t_max`; distances are the same. Sums are taken in double, rounded
    // once.
    [[gnu::always_inline]] Ray inner(const Ray& r, float t_max) const {
        const auto doubles = [](const float* at) { return _mm256_cvtps_pd(_mm_loadu_ps(at)); };
        const __m256d x = doubles(page_from_world), y = doubles(page_from_world + 3),
                      z = doubles(page_from_world + 6);
        const auto turned = [&](__m256d v) {
            __m256d sum = _mm256_mul_pd(z, _mm256_permute4x64_pd(v, 0xaa));
            sum = _mm256_fmadd_pd(y, _mm256_permute4x64_pd(v, 0x55), sum);
            return _mm256_cvtpd_ps(_mm256_fmadd_pd(x, _mm256_permute4x64_pd(v, 0x00), sum));
        };
        // Fourth lanes: of origins the least distance, of directions the largest.
        const __m256d from = _mm256_blend_pd(doubles(origin), _mm256_setzero_pd(), 0b1000); // no number there
        const __m128 o = turned(_mm256_sub_pd(doubles(&r.o.x), from)), d = turned(doubles(&r.d.x));
        Ray out;
        _mm_storeu_ps(&out.o.x, _mm_blend_ps(o, _mm_loadu_ps(&r.o.x), 0b1000));
        _mm_storeu_ps(&out.d.x, _mm_blend_ps(d, _mm_set1_ps(t_max), 0b1000));
        return out;
    }
};
static_assert(sizeof(InstanceLeaf) == 64);
static_assert(UnitsOf[int(Kind::Instance)] * UnitBytes == sizeof(InstanceLeaf));

// The adjugate by the determinant: its columns are cross products of rows.
inline bool InstanceLeaf::stand_at(const Transform& t) {
    const auto row = [&](size_t r) { return _mm256_loadu_pd(t.m[r].data()); };
    const auto next = [](__m256d v) { return _mm256_permute4x64_pd(v, _MM_SHUFFLE(3, 0, 2, 1)); };
    const auto last = [](__m256d v) { return _mm256_permute4x64_pd(v, _MM_SHUFFLE(3, 1, 0, 2)); };
    const auto cross = [&](__m256d a, __m256d b) {
        return _mm256_sub_pd(_mm256_mul_pd(next(a), last(b)), _mm256_mul_pd(last(a), next(b)));
    };
    const __m256d x = row(0), y = row(1), z = row(2), yz = cross(y, z);
    alignas(32) double terms[4];
    _mm256_store_pd(terms, _mm256_mul_pd(x, yz));
    const __m256d per = _mm256_set1_pd(1 / (terms[0] + terms[1] + terms[2])),
                  limit = _mm256_set1_pd(double(LargestCoordinate)), sign = _mm256_set1_pd(-0.0);
    int held = 7;
    const auto put = [&](int column, __m256d v) { // writes beyond it: one by one in order
        v = _mm256_mul_pd(v, per);
        held &= _mm256_movemask_pd(_mm256_cmp_pd(_mm256_andnot_pd(sign, v), limit, _CMP_LT_OQ));
        _mm_storeu_ps(page_from_world + 3 * column, _mm256_cvtpd_ps(v));
    };
    put(0, yz), put(1, cross(z, x));
    alignas(16) float third[4];
    const __m256d xy = _mm256_mul_pd(cross(x, y), per);
    held &= _mm256_movemask_pd(_mm256_cmp_pd(_mm256_andnot_pd(sign, xy), limit, _CMP_LT_OQ));
    _mm_store_ps(third, _mm256_cvtpd_ps(xy));
    for (size_t a = 0; a < 3; a++)
        page_from_world[6 + a] = third[a], origin[a] = float(t.m[a][3]);
    return held == 7;
}

// A time of the shutter, as paths are asked for it.
inline float shutter_time(float time) {
    return !(time > 0) ? 0 : time < 1 ? time : 1;
}

// Which of so many intervals of time, evenly long, a time lies in, and what fraction of it is over: by the
// operations of whoever shades hits (transport/hit_place.h).
struct Interval {
    uint32_t number;
    float fraction;

    Interval(float time, uint32_t count) {
        const float x = shutter_time(time) * float(count);
        number = std::min(uint32_t(x), count - 1);
        fraction = x - float(number);
    }
};

// A place that may move, or where shapes change: a ray has the box of its own time tested, and then the way
// made for that.
struct MovingLeaf {
    InstanceLeaf place;     // where it moves: numbers alone
    const MotionPath* path; // null: what lies there changes
    const Bounds3f* boxes;  // at place.times even times; moving things lie within what is interpolated.
    Bounds3f first, second; // Where these two are all they lie here, and not beyond another miss of caches.

    bool stands_still() const { return place.times == 0; }
    bool changes() const { return !path; } // if it does not stand still
    bool is_met_by(const TracedRay& ray, float time) const {
        const Bounds3f *from = &first, *to = &second;
        float f = time;
        if (place.times > 2) {
            const double x = double(time) * (place.times - 1); // exact
            const uint32_t step = std::min(uint32_t(x), place.times - 2u);
            from = boxes + step, to = from + 1, f = float(x - step);
        }
        const __m128 lo = between(_mm_loadu_ps(&from->lo.x), _mm_loadu_ps(&to->lo.x), f); // fourth: nothing
        __m128 hi = between(_mm_loadu_ps(&from->lo.z), _mm_loadu_ps(&to->lo.z), f);       // first: nothing
        hi = _mm_permute_ps(hi, _MM_SHUFFLE(3, 3, 2, 1));
        const __m128 o = _mm_load_ps(ray.o), per_d = _mm_load_ps(ray.per_d);
        const __m128 a = _mm_mul_ps(_mm_sub_ps(lo, o), per_d), b = _mm_mul_ps(_mm_sub_ps(hi, o), per_d);
        __m128 enter = _mm_blend_ps(_mm_min_ps(a, b), _mm_set1_ps(ray.t_min), 8),
               leave = _mm_blend_ps(_mm_max_ps(a, b), _mm_set1_ps(ray.t_max), 8);
        enter = _mm_max_ps(enter, _mm_permute_ps(enter, _MM_SHUFFLE(1, 0, 3, 2)));
        enter = _mm_max_ps(enter, _mm_permute_ps(enter, _MM_SHUFFLE(2, 3, 0, 1)));
        leave = _mm_min_ps(leave, _mm_permute_ps(leave, _MM_SHUFFLE(1, 0, 3, 2)));
        leave = _mm_min_ps(leave, _mm_permute_ps(leave, _MM_SHUFFLE(2, 3, 0, 1)));
        return _mm_cvtss_f32(enter) * (1 - TracedRay::Margin) <=
               _mm_cvtss_f32(leave) * (1 + TracedRay::Margin);
    }
    void fetch_path() const {
        for (size_t byte = 0; byte < sizeof(MotionPath); byte += 64)
            _mm_prefetch(reinterpret_cast<const char*>(path) + byte, _MM_HINT_T0);
    }
    // Where it is then, by the floats that whoever shades the hit has. False: no ray can be taken there.
    bool stand(float time, InstanceLeaf& leaf) const {
        Transform t;
        path->at(double(time), t);
        for (size_t r = 0; r < 3; r++) {
            double* const row = t.m[r].data();
            _mm256_storeu_pd(row, _mm256_cvtps_pd(_mm256_cvtpd_ps(_mm256_loadu_pd(row))));
        }
        leaf.page = place.page, leaf.number = place.number, leaf.stays = leaf.times = 0;
        leaf.seen = place.seen;
        return leaf.stand_at(t);
    }

  private:
    static __m128 between(__m128 a, __m128 b, float f) {
        return _mm_fmadd_ps(_mm_sub_ps(b, a), _mm_set1_ps(f), a);
    }
};
static_assert(sizeof(MovingLeaf) == 128);
static_assert(UnitsOf[int(Kind::Moving)] * UnitBytes == sizeof(MovingLeaf));

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
