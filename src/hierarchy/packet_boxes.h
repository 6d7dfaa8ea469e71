// A node's eight children against sixteen rays that run side by side: first against what bounds all of them,
// then those that pass against each ray, as many at once as there are lanes.
#pragma once

#include <bit>

#include "base/lanes.h"
#include "hierarchy/groups.h"
#include "hierarchy/node_lanes.h"

namespace kanuka::hierarchy {

template <int W>
struct PacketBoxes {
    static constexpr int Strips = PacketRays / W; // of lanes
    static constexpr uint32_t AllLanes = uint32_t((uint64_t(1) << W) - 1);

    // The planes of a node that rays meet first and last: those of all rays are the same.
    int near_plane[3], far_plane[3];
    // Of each ray.
    Float<W> o[3][Strips], per_d[3][Strips], t_min[Strips], t_max[Strips];

    void set(const TracedRay (&rays)[PacketRays]) {
        alignas(64) float lane[8][PacketRays];
        for (int i = 0; i < PacketRays; i++) {
            for (int a = 0; a < 3; a++)
                lane[a][i] = rays[i].o[a], lane[3 + a][i] = rays[i].per_d[a];
            lane[6][i] = rays[i].t_min, lane[7][i] = rays[i].t_max;
        }
        for (int s = 0; s < Strips; s++) {
            for (int a = 0; a < 3; a++) {
                o[a][s] = Float<W>::load(lane[a] + s * W);
                per_d[a][s] = Float<W>::load(lane[3 + a] + s * W);
            }
            t_min[s] = Float<W>::load(lane[6] + s * W), t_max[s] = Float<W>::load(lane[7] + s * W);
        }
        for (int a = 0; a < 3; a++)
            near_plane[a] = rays[0].near_plane[a], far_plane[a] = rays[0].far_plane[a];
        bound(rays);
    }
    // The ray has been as far as it goes.
    void shorten(int ray, float t) { t_max[ray / W].v[ray % W] = t; }
    // To be called when rays are shorter: what bounds all of them.
    void bound_ends() {
        Float<W> most = t_max[0];
        for (int s = 1; s < Strips; s++)
            most = max(most, t_max[s]);
        alignas(64) float t[W];
        most.store(t);
        for (int half = W / 2; half > 0; half /= 2)
            for (int i = 0; i < half; i++)
                t[i] = max(t[i], t[i + half]);
        m_t_max = t[0];
    }
    // Rays that go at least so far, each its own way.
    uint32_t reach(const float* t) const {
        uint32_t rays = 0;
        for (int s = 0; s < Strips; s++)
            rays |= (Float<W>::load(t + s * W) <= t_max[s]).bits() << (s * W);
        return rays;
    }

    // The children that a ray may enter: those that it does enter, and few others. A plane q is ahead of a
    // ray by (origin + q) step - o, an interval, which is divided by d, another. All is mirrored so that
    // directions are positive. Roundings are those of enter_children(), in another order: the margin is twice
    // as wide.
    [[gnu::always_inline]] Entered enter_together(const Node& node) const {
        const uint8_t* const planes = node.plane[0][0];
        const NodeFrame frame(node);
        const __m128 step_of = _mm_mul_ps(frame.step, _mm_load_ps(m_sign));
        alignas(16) float step[4], near_shift[4], far_shift[4];
        _mm_store_ps(step, step_of);
        _mm_store_ps(near_shift, _mm_fmsub_ps(frame.origin, step_of, _mm_load_ps(m_o_most)));
        _mm_store_ps(far_shift, _mm_fmsub_ps(frame.origin, step_of, _mm_load_ps(m_o_least)));
        __m256 first = _mm256_broadcast_ss(&m_t_min), last = _mm256_broadcast_ss(&m_t_max);
        for (int a = 0; a < 3; a++) {
            const __m256 s = _mm256_broadcast_ss(step + a), least = _mm256_broadcast_ss(m_per_d_least + a),
                         most = _mm256_broadcast_ss(m_per_d_most + a);
            const __m256 from = _mm256_fmadd_ps(eight_planes(planes + near_plane[a]), s,
                                                _mm256_broadcast_ss(near_shift + a)),
                         to = _mm256_fmadd_ps(eight_planes(planes + far_plane[a]), s,
                                              _mm256_broadcast_ss(far_shift + a));
            first =
                _mm256_max_ps(first, _mm256_min_ps(_mm256_mul_ps(from, least), _mm256_mul_ps(from, most)));
            last = _mm256_min_ps(last, _mm256_max_ps(_mm256_mul_ps(to, least), _mm256_mul_ps(to, most)));
        }
        return entered_of(node, _mm256_mul_ps(first, _mm256_set1_ps(1 - 2 * TracedRay::Margin)),
                          _mm256_mul_ps(last, _mm256_set1_ps(1 + 2 * TracedRay::Margin)))
            .sorted();
    }

    // Of the children that rays may enter, in their order, those that some of `rays` do enter:
    // visit(key, rays, distances). What is computed of a ray is what enter_children() computes, to the bit.
    template <class Visit>
    [[gnu::always_inline]] void enter_each(const Node& node, const Entered& may, uint32_t rays,
                                           Visit&& visit) const {
        alignas(32) float near_planes[3][8], far_planes[3][8];
        for (int a = 0; a < 3; a++) {
            _mm256_store_ps(near_planes[a], eight_planes(node.plane[0][0] + near_plane[a]));
            _mm256_store_ps(far_planes[a], eight_planes(node.plane[0][0] + far_plane[a]));
        }
        alignas(32) uint32_t keys[8];
        _mm256_store_si256(reinterpret_cast<__m256i*>(keys), may.keys);
        alignas(64) float t[8][PacketRays];
        uint32_t entered[8] = {};
        for (int strip = 0; strip < Strips; strip++) {
            const uint32_t here = rays >> (strip * W) & AllLanes;
            if (here == 0)
                continue;
            Float<W> scale[3], shift[3];
            for (int a = 0; a < 3; a++) {
                const Float<W> step(std::bit_cast<float>(uint32_t(node.frame[a] & 255) << 23));
                const Float<W> d = per_d[a][strip];
                scale[a] = step * d;
                shift[a] = fma(Float<W>(float(node.frame[a] >> 8)), step, -o[a][strip]) * d;
            }
            for (int k = 0; k < may.count; k++) {
                const uint32_t child = keys[k] & 7;
                const auto enter = [&](int a) {
                    return fma(Float<W>(near_planes[a][child]), scale[a], shift[a]);
                };
                const auto leave = [&](int a) {
                    return fma(Float<W>(far_planes[a][child]), scale[a], shift[a]);
                };
                const Float<W> first = max(max(enter(0), enter(1)), max(enter(2), t_min[strip])),
                               last = min(min(leave(0), leave(1)), min(leave(2), t_max[strip])),
                               from = first * Float<W>(1 - TracedRay::Margin);
                from.store(t[k] + strip * W);
                entered[k] |= ((from <= last * Float<W>(1 + TracedRay::Margin)).bits() & here) << (strip * W);
            }
        }
        for (int k = 0; k < may.count; k++)
            if (entered[k] != 0)
                visit(keys[k], entered[k], t[k]);
    }

  private:
    void bound(const TracedRay (&rays)[PacketRays]) {
        __m128 o_least = _mm_load_ps(rays[0].o), o_most = o_least;
        __m128 d_least = _mm_load_ps(rays[0].per_d), d_most = d_least;
        m_t_min = rays[0].t_min;
        for (const TracedRay& ray : rays) {
            const __m128 start = _mm_load_ps(ray.o), d = _mm_load_ps(ray.per_d);
            o_least = _mm_min_ps(o_least, start), o_most = _mm_max_ps(o_most, start);
            d_least = _mm_min_ps(d_least, d), d_most = _mm_max_ps(d_most, d);
            m_t_min = min(m_t_min, ray.t_min);
        }
        const __m128 minus = _mm_set1_ps(-0.0f), mirror = _mm_and_ps(d_least, minus);
        _mm_store_ps(m_sign, _mm_or_ps(_mm_set1_ps(1), mirror));
        const auto put = [&](__m128 a, __m128 b, float(&least)[4], float(&most)[4]) {
            a = _mm_xor_ps(a, mirror), b = _mm_xor_ps(b, mirror);
            _mm_store_ps(least, _mm_min_ps(a, b)), _mm_store_ps(most, _mm_max_ps(a, b));
        };
        put(o_least, o_most, m_o_least, m_o_most);
        put(d_least, d_most, m_per_d_least, m_per_d_most);
        bound_ends();
    }

    alignas(16) float m_sign[4], m_o_least[4], m_o_most[4], m_per_d_least[4], m_per_d_most[4];
    float m_t_min, m_t_max;
};

} // namespace kanuka::hierarchy
