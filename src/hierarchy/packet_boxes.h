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
    Float<W> fraction[Strips]; // of the interval of time, where shapes change

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
    void set_fractions(const float (&of)[PacketRays]) {
        for (int s = 0; s < Strips; s++)
            fraction[s] = Float<W>::load(of + s * W);
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
        const Ahead planes(*this, node);
        return enter_between(
            node, [&](int a) { return planes.from(a); }, [&](int a) { return planes.to(a); });
    }
    // Whenever in the interval rays are.
    [[gnu::always_inline]] Entered enter_together(const ChangingNode& node) const {
        const Ahead begin(*this, node.begin), end(*this, node.end);
        return enter_between(
            node.begin, [&](int a) { return _mm256_min_ps(begin.from(a), end.from(a)); },
            [&](int a) { return _mm256_max_ps(begin.to(a), end.to(a)); });
    }

    // Of the children that rays may enter, in their order, those that some of `rays` do enter:
    // visit(key, rays, distances). What is computed of a ray is what enter_children() computes, to the bit.
    template <class NodeKind, class Visit>
    [[gnu::always_inline]] void enter_each(const NodeKind& node, const Entered& may, uint32_t rays,
                                           Visit&& visit) const {
        const Planes<NodeKind> planes(*this, node);
        alignas(32) uint32_t keys[8];
        _mm256_store_si256(reinterpret_cast<__m256i*>(keys), may.keys);
        alignas(64) float t[8][PacketRays];
        uint32_t entered[8] = {};
        for (int strip = 0; strip < Strips; strip++) {
            const uint32_t here = rays >> (strip * W) & AllLanes;
            if (here == 0)
                continue;
            const typename Planes<NodeKind>::Along along(*this, node, strip);
            for (int k = 0; k < may.count; k++) {
                const uint32_t child = keys[k] & 7;
                const auto enter = [&](int a) { return along.cross(planes.near[a], child, a); };
                const auto leave = [&](int a) { return along.cross(planes.far[a], child, a); };
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
    // How far the planes of a node are ahead of all rays, along each axis.
    struct Ahead {
        const PacketBoxes& rays;
        const uint8_t* planes;
        alignas(16) float step[4], near_shift[4], far_shift[4];

        [[gnu::always_inline]] Ahead(const PacketBoxes& of, const Node& node)
            : rays(of), planes(node.plane[0][0]) {
            const NodeFrame frame(node);
            const __m128 step_of = _mm_mul_ps(frame.step, _mm_load_ps(of.m_sign));
            _mm_store_ps(step, step_of);
            _mm_store_ps(near_shift, _mm_fmsub_ps(frame.origin, step_of, _mm_load_ps(of.m_o_most)));
            _mm_store_ps(far_shift, _mm_fmsub_ps(frame.origin, step_of, _mm_load_ps(of.m_o_least)));
        }
        [[gnu::always_inline]] __m256 from(int a) const { return at(a, rays.near_plane[a], near_shift); }
        [[gnu::always_inline]] __m256 to(int a) const { return at(a, rays.far_plane[a], far_shift); }

      private:
        [[gnu::always_inline]] __m256 at(int a, int plane, const float* shift) const {
            return _mm256_fmadd_ps(eight_planes(planes + plane), _mm256_broadcast_ss(step + a),
                                   _mm256_broadcast_ss(shift + a));
        }
    };
    template <class From, class To>
    [[gnu::always_inline]] Entered enter_between(const Node& node, const From& from_of,
                                                 const To& to_of) const {
        __m256 first = _mm256_broadcast_ss(&m_t_min), last = _mm256_broadcast_ss(&m_t_max);
        for (int a = 0; a < 3; a++) {
            const __m256 least = _mm256_broadcast_ss(m_per_d_least + a),
                         most = _mm256_broadcast_ss(m_per_d_most + a);
            const __m256 from = from_of(a), to = to_of(a);
            first =
                _mm256_max_ps(first, _mm256_min_ps(_mm256_mul_ps(from, least), _mm256_mul_ps(from, most)));
            last = _mm256_min_ps(last, _mm256_max_ps(_mm256_mul_ps(to, least), _mm256_mul_ps(to, most)));
        }
        return entered_of(node, _mm256_mul_ps(first, _mm256_set1_ps(1 - 2 * TracedRay::Margin)),
                          _mm256_mul_ps(last, _mm256_set1_ps(1 + 2 * TracedRay::Margin)))
            .sorted();
    }

    // Planes of eight children that rays meet first and last, axis by axis; and where they lie along as many
    // rays as there are lanes.
    struct StillPlanes {
        alignas(32) float near[3][8], far[3][8];

        [[gnu::always_inline]] StillPlanes(const PacketBoxes& rays, const Node& node) {
            for (int a = 0; a < 3; a++)
                store(near[a], node, rays.near_plane[a]), store(far[a], node, rays.far_plane[a]);
        }
        struct Along {
            Float<W> scale[3], shift[3];
            [[gnu::always_inline]] Along(const PacketBoxes& rays, const Node& node, int strip) {
                for (int a = 0; a < 3; a++) {
                    const Float<W> step = step_of(node, a), d = rays.per_d[a][strip];
                    scale[a] = step * d;
                    shift[a] = fma(origin_of(node, a), step, -rays.o[a][strip]) * d;
                }
            }
            [[gnu::always_inline]] Float<W> cross(const float (&planes)[8], uint32_t child, int a) const {
                return fma(Float<W>(planes[child]), scale[a], shift[a]);
            }
        };
    };

    struct ChangingPlanes {
        struct BothEnds {
            alignas(32) float begin[8], end[8];
        };
        BothEnds near[3], far[3];

        [[gnu::always_inline]] ChangingPlanes(const PacketBoxes& rays, const ChangingNode& node) {
            for (int a = 0; a < 3; a++) {
                store(near[a].begin, node.begin, rays.near_plane[a]);
                store(near[a].end, node.end, rays.near_plane[a]);
                store(far[a].begin, node.begin, rays.far_plane[a]);
                store(far[a].end, node.end, rays.far_plane[a]);
            }
        }
        struct Along {
            Float<W> scale0[3], scale1[3], shift[3];
            [[gnu::always_inline]] Along(const PacketBoxes& rays, const ChangingNode& node, int strip) {
                const Float<W> f = rays.fraction[strip];
                for (int a = 0; a < 3; a++) {
                    const Float<W> d = rays.per_d[a][strip],
                                   step0 = step_of(node.begin, a) * (Float<W>(1.0f) - f),
                                   step1 = step_of(node.end, a) * f;
                    scale0[a] = step0 * d, scale1[a] = step1 * d;
                    shift[a] = fma(origin_of(node.end, a), step1,
                                   fma(origin_of(node.begin, a), step0, -rays.o[a][strip])) *
                               d;
                }
            }
            [[gnu::always_inline]] Float<W> cross(const BothEnds& planes, uint32_t child, int a) const {
                return fma(Float<W>(planes.end[child]), scale1[a],
                           fma(Float<W>(planes.begin[child]), scale0[a], shift[a]));
            }
        };
    };
    template <class NodeKind>
    using Planes = std::conditional_t<std::is_same_v<NodeKind, Node>, StillPlanes, ChangingPlanes>;

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

    static Float<W> step_of(const Node& node, int a) {
        return Float<W>(std::bit_cast<float>(uint32_t(node.frame[a] & 255) << 23));
    }
    static Float<W> origin_of(const Node& node, int a) { return Float<W>(float(node.frame[a] >> 8)); }
    static void store(float (&to)[8], const Node& node, int plane) {
        _mm256_store_ps(to, eight_planes(node.plane[0][0] + plane));
    }

    alignas(16) float m_sign[4], m_o_least[4], m_o_most[4], m_per_d_least[4], m_per_d_most[4];
    float m_t_min, m_t_max;
};

} // namespace kanuka::hierarchy
