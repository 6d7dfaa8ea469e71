// A node's eight children against one ray: those that it enters, and in which order.
#pragma once

#include <type_traits>

#include "hierarchy/ray.h"

namespace kanuka::hierarchy {

// Largest first: a bitonic network [Batcher 1968].
[[gnu::always_inline]] inline __m256i sort_down(__m256i v) {
    const auto stage = [&v](__m256i partner, auto larger) { // lanes that take the larger one
        v = _mm256_blend_epi32(_mm256_min_epi32(v, partner), _mm256_max_epi32(v, partner),
                               decltype(larger)::value);
    };
    const auto by_1 = [&] { return _mm256_shuffle_epi32(v, 0xb1); };
    const auto by_2 = [&] { return _mm256_shuffle_epi32(v, 0x4e); };
    stage(by_1(), std::integral_constant<int, 0b10011001>());
    stage(by_2(), std::integral_constant<int, 0b11000011>());
    stage(by_1(), std::integral_constant<int, 0b10100101>());
    stage(_mm256_permute4x64_epi64(v, 0x4e), std::integral_constant<int, 0b00001111>());
    stage(by_2(), std::integral_constant<int, 0b00110011>());
    stage(by_1(), std::integral_constant<int, 0b01010101>());
    return v;
}

// The children of a node that a ray enters: the distance as a float's bits, whose last three are the child's
// place in the node; 0 = no child.
struct Entered {
    __m256i keys;
    int count;
    uint32_t children; // the node's word for where they are: a node is looked at once

    // From the far ones to the near.
    [[gnu::always_inline]] Entered sorted() const { return {sort_down(keys), count, children}; }
};
// Eight from the place 8 - n on: all bits of n lanes.
alignas(64) inline constexpr uint32_t children_masks[16] = {~0u, ~0u, ~0u, ~0u, ~0u, ~0u, ~0u, ~0u};
// Those that begin before they end.
[[gnu::always_inline]] inline Entered entered_of(const Node& node, __m256 t, __m256 end) {
    const __m256i lane = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    const uint32_t* const is_there = children_masks + (~node.children >> Children::CountShift & 7);
    const __m256 entered =
        _mm256_and_ps(_mm256_cmp_ps(t, end, _CMP_LE_OQ),
                      _mm256_castsi256_ps(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(is_there))));
    const __m256i key =
        _mm256_or_si256(_mm256_andnot_si256(_mm256_set1_epi32(7), _mm256_castps_si256(t)), lane);
    return {_mm256_and_si256(key, _mm256_castps_si256(entered)),
            __builtin_popcount(unsigned(_mm256_movemask_ps(entered))), node.children};
}
// Units from the first child of a node to each, by kind.
struct StepsToChildren {
    alignas(32) uint32_t of[16][8];
    constexpr explicit StepsToChildren(uint32_t ends) : of{} {
        for (uint32_t kind = 0; kind < 16; kind++)
            for (uint32_t place = 0; place < 8; place++)
                of[kind][place] = place * Children{Kind(kind), 1, 0}.stride(ends);
    }
};
inline constexpr StepsToChildren steps_to_children(1), steps_to_changing(2);
// Where those children are. `ends`: as of Children::ref().
[[gnu::always_inline]] inline __m256i refs_of(const Entered& entered, uint32_t ends = 1) {
    const Children c = Children::of(entered.children);
    const __m256i places = _mm256_load_si256(reinterpret_cast<const __m256i*>(
        (ends == 1 ? steps_to_children : steps_to_changing).of[int(c.kind)]));
    const __m256i all = _mm256_add_epi32(places, _mm256_set1_epi32(int(c.ref(0))));
    return _mm256_permutevar8x32_epi32(all, entered.keys); // looks at three bits of each
}

struct NodeFrame {
    __m128 origin, step;
    explicit NodeFrame(const Node& node) {
        const __m128i frame =
            _mm_load_si128(reinterpret_cast<const __m128i*>(node.frame)); // and the children
        origin = _mm_cvtepi32_ps(_mm_srai_epi32(frame, 8));               // signed
        step = _mm_castsi128_ps(_mm_slli_epi32(_mm_and_si128(frame, _mm_set1_epi32(255)), 23));
    }
};
[[gnu::always_inline]] inline __m256 eight_planes(const uint8_t* p) {
    return _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(p))));
}

// `near(a)`, `far(a)`: where the planes of eight boxes that the ray meets first and last, axis by axis, lie
// along it.
template <class Near, class Far>
[[gnu::always_inline]] inline Entered entered_between(const Node& node, const TracedRay& ray, Near&& near,
                                                      Far&& far) {
    const __m256 first = _mm256_max_ps(_mm256_max_ps(near(0), near(1)),
                                       _mm256_max_ps(near(2), _mm256_broadcast_ss(&ray.t_min)));
    const __m256 last =
        _mm256_min_ps(_mm256_min_ps(far(0), far(1)), _mm256_min_ps(far(2), _mm256_broadcast_ss(&ray.t_max)));
    return entered_of(node, _mm256_mul_ps(first, _mm256_set1_ps(1 - TracedRay::Margin)),
                      _mm256_mul_ps(last, _mm256_set1_ps(1 + TracedRay::Margin)));
}

// How the planes of a node lie along a ray, and then which children it enters: two steps, since others may
// come between (queue.h).
template <class NodeKind>
struct PlanesAlong;

// A plane q lies at distance ((origin + q) step - o) / d = q scale + shift along the ray.
template <>
struct PlanesAlong<Node> {
    alignas(16) float scale[4], shift[4];

    [[gnu::always_inline]] void set(const Node& node, const TracedRay& ray, float = 0) {
        const NodeFrame frame(node);
        const __m128 per_d = _mm_load_ps(ray.per_d);
        _mm_store_ps(scale, _mm_mul_ps(frame.step, per_d));
        _mm_store_ps(shift, _mm_mul_ps(_mm_fmsub_ps(frame.origin, frame.step, _mm_load_ps(ray.o)), per_d));
    }
    [[gnu::always_inline]] Entered enter(const Node& node, const TracedRay& ray) const {
        const auto cross = [&](int a, int plane) {
            return _mm256_fmadd_ps(eight_planes(node.plane[0][0] + plane), _mm256_broadcast_ss(scale + a),
                                   _mm256_broadcast_ss(shift + a));
        };
        return entered_between(
            node, ray, [&](int a) { return cross(a, ray.near_plane[a]); },
            [&](int a) { return cross(a, ray.far_plane[a]); });
    }
};
[[gnu::always_inline]] inline Entered enter_children(const Node& node, const TracedRay& ray) {
    PlanesAlong<Node> planes;
    planes.set(node, ray);
    return planes.enter(node, ray);
}

// The same where shapes change, with planes as they are at the time of the ray, `fraction` of the interval:
// ((1 - f) (o0 + q0) step0 + f (o1 + q1) step1 - o) / d = q0 scale0 + q1 scale1 + shift.
template <>
struct PlanesAlong<ChangingNode> {
    alignas(16) float scale0[4], scale1[4], shift[4];

    [[gnu::always_inline]] void set(const ChangingNode& node, const TracedRay& ray, float fraction) {
        const NodeFrame first(node.begin), last(node.end);
        const __m128 per_d = _mm_load_ps(ray.per_d);
        const __m128 step0 = _mm_mul_ps(first.step, _mm_set1_ps(1 - fraction)),
                     step1 = _mm_mul_ps(last.step, _mm_set1_ps(fraction));
        const __m128 origin =
            _mm_fmadd_ps(last.origin, step1, _mm_fmsub_ps(first.origin, step0, _mm_load_ps(ray.o)));
        _mm_store_ps(scale0, _mm_mul_ps(step0, per_d)), _mm_store_ps(scale1, _mm_mul_ps(step1, per_d));
        _mm_store_ps(shift, _mm_mul_ps(origin, per_d));
    }
    [[gnu::always_inline]] Entered enter(const ChangingNode& node, const TracedRay& ray) const {
        const auto cross = [&](int a, int plane) {
            const __m256 begins =
                _mm256_fmadd_ps(eight_planes(node.begin.plane[0][0] + plane), _mm256_broadcast_ss(scale0 + a),
                                _mm256_broadcast_ss(shift + a));
            return _mm256_fmadd_ps(eight_planes(node.end.plane[0][0] + plane),
                                   _mm256_broadcast_ss(scale1 + a), begins);
        };
        return entered_between(
            node.begin, ray, [&](int a) { return cross(a, ray.near_plane[a]); },
            [&](int a) { return cross(a, ray.far_plane[a]); });
    }
};

} // namespace kanuka::hierarchy
