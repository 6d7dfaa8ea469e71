// Leaves that are places of other pages, and where among them a hit lies.
#pragma once

#include <algorithm>
#include <cmath>
#include <compare>

#include "base/level_range.h"
#include "base/motion.h"
#include "base/places.h"
#include "hierarchy/page.h"
#include "hierarchy/ray.h"

namespace kanuka::hierarchy {

// How deep instances may lie in instances.
inline constexpr int MostNesting = 18;

// The transform into a page from where it stands, by which rays are made anew for it. Doubles: what is
// rounded is the ray, once.
class PageFromWorld {
  public:
    // Of the place that has this number among the matrices: the same floats as Places::matrix().
    [[gnu::always_inline]] PageFromWorld(const Places& places, size_t number) {
        const float* const m = places.matrices.data() + 12 * number;
        __m128 a = _mm_loadu_ps(m), b = _mm_loadu_ps(m + 4), c = _mm_loadu_ps(m + 8), d = _mm_setzero_ps();
        set(_mm256_cvtps_pd(a), _mm256_cvtps_pd(b), _mm256_cvtps_pd(c));
        _MM_TRANSPOSE4_PS(a, b, c, d);
        __m256d at =
            _mm256_add_pd(_mm256_cvtps_pd(d), _mm256_loadu_pd(places.outer.data())); // fourth: nothing
        const auto add = [&](__m128 column, float by) {
            at = _mm256_add_pd(at, _mm256_mul_pd(_mm256_cvtps_pd(column), _mm256_set1_pd(double(by))));
        };
        add(a, places.inner.x), add(b, places.inner.y), add(c, places.inner.z);
        m_origin = _mm256_cvtps_pd(_mm256_cvtpd_ps(at));
    }
    // By a matrix, row-major 3x4.
    explicit PageFromWorld(const float* m) : PageFromWorld(Places(std::span(m, 12)), 0) {}
    // False where floats do not hold it.
    bool is_held() const {
        const __m256d limit = _mm256_set1_pd(double(LargestCoordinate)), sign = _mm256_set1_pd(-0.0);
        int held = 7;
        for (const __m256d column : {m_x, m_y, m_z})
            held &= _mm256_movemask_pd(
                _mm256_cmp_pd(_mm256_andnot_pd(sign, _mm256_mul_pd(column, m_per)), limit, _CMP_LT_OQ));
        return held == 7;
    }
    // The ray as it runs in the page, to `t_max`; distances are the same. The origin is taken off first, so
    // that places far away keep their digits.
    [[gnu::always_inline]] Ray inner(const Ray& r, float t_max) const {
        const auto doubles = [](const float* at) { return _mm256_cvtps_pd(_mm_loadu_ps(at)); };
        const auto turned = [&](__m256d v) {
            __m256d sum = _mm256_mul_pd(m_z, _mm256_permute4x64_pd(v, 0xaa));
            sum = _mm256_fmadd_pd(m_y, _mm256_permute4x64_pd(v, 0x55), sum);
            sum = _mm256_fmadd_pd(m_x, _mm256_permute4x64_pd(v, 0x00), sum);
            return _mm256_cvtpd_ps(_mm256_mul_pd(sum, m_per));
        };
        // Fourth lanes: of origins the least distance, of directions the largest.
        const __m128 o = turned(_mm256_sub_pd(doubles(&r.o.x), m_origin)), d = turned(doubles(&r.d.x));
        Ray out;
        _mm_storeu_ps(&out.o.x, _mm_blend_ps(o, _mm_loadu_ps(&r.o.x), 0b1000));
        _mm_storeu_ps(&out.d.x, _mm_blend_ps(d, _mm_set1_ps(t_max), 0b1000));
        return out;
    }

  private:
    // The adjugate by the determinant: its columns are cross products of rows.
    [[gnu::always_inline]] void set(__m256d u, __m256d v, __m256d w) {
        const auto next = [](__m256d r) { return _mm256_permute4x64_pd(r, _MM_SHUFFLE(3, 0, 2, 1)); };
        const auto last = [](__m256d r) { return _mm256_permute4x64_pd(r, _MM_SHUFFLE(3, 1, 0, 2)); };
        const __m256d next_u = next(u), last_u = last(u), next_v = next(v), last_v = last(v),
                      next_w = next(w), last_w = last(w);
        m_x = _mm256_sub_pd(_mm256_mul_pd(next_v, last_w), _mm256_mul_pd(last_v, next_w));
        m_y = _mm256_sub_pd(_mm256_mul_pd(next_w, last_u), _mm256_mul_pd(last_w, next_u));
        m_z = _mm256_sub_pd(_mm256_mul_pd(next_u, last_v), _mm256_mul_pd(last_u, next_v));
        const __m256d terms = _mm256_mul_pd(u, m_x);
        const __m128d first = _mm256_castpd256_pd128(terms),
                      sum = _mm_add_sd(_mm_add_sd(first, _mm_unpackhi_pd(first, first)),
                                       _mm256_extractf128_pd(terms, 1));
        m_per = _mm256_broadcastsd_pd(_mm_div_sd(_mm_set_sd(1), sum));
    }

    __m256d m_x, m_y, m_z, m_per; // columns of the adjugate; one over the determinant
    __m256d m_origin;             // of the page, in the world
};

// Whose run tells the page, and where it stands: matrices are the scene's.
struct InstanceLeaf {
    uint32_t number; // of the instance in its level
    uint32_t run;    // of the world's
    uint32_t matrix; // of the run's
    LevelRange seen; // by which rays
};
static_assert(sizeof(InstanceLeaf) == 16);
static_assert(UnitsOf[int(Kind::Instance)] * UnitBytes == sizeof(InstanceLeaf));

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

// A place that may move, or where shapes change. The nodes above have its box go straight from the first time
// to the last; where it does not, a ray tests the box of its own time before the matrix is made for that.
struct MovingLeaf {
    InstanceLeaf place;
    uint32_t times;         // that its boxes are of, where it moves or changes; 0: it stands still
    uint32_t path_bytes;    // that are read of it
    const MotionPath* path; // null: what lies there changes
    // At so many even times; moving things lie within what is interpolated. Null: they are two, as of nodes.
    const Bounds3f* boxes;
    uint64_t more_unused;

    bool stands_still() const { return times == 0; }
    bool changes() const { return !path; } // if it does not stand still
    bool is_met_by(const TracedRay& ray, float time) const {
        if (!boxes)
            return true;
        const double x = double(time) * (times - 1); // exact
        const uint32_t step = std::min(uint32_t(x), times - 2u);
        const Bounds3f *from = boxes + step, *to = from + 1;
        const float f = float(x - step);
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
        for (size_t byte = 0; byte < path_bytes; byte += 64)
            _mm_prefetch(reinterpret_cast<const char*>(path) + byte, _MM_HINT_T0);
    }
    // Where it is then, by the floats that whoever shades the hit has. False: no ray can be taken there.
    PageFromWorld page_from_world(float time) const {
        float rows[12];
        path->at(double(time), rows);
        return PageFromWorld(rows);
    }

  private:
    static __m128 between(__m128 a, __m128 b, float f) {
        return _mm_fmadd_ps(_mm_sub_ps(b, a), _mm_set1_ps(f), a);
    }
};
static_assert(sizeof(MovingLeaf) == 48);
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
