// Sixteen rays that run side by side go through a page together.
//
//     stack ──► a node: children that a ray may enter ──► which rays enter them ──┐
//       ▲       a node that one ray or two enter: each of them, as if alone ──────┤
//       │       a leaf: each ray that enters it                                   │
//       └────────────────────── children, and who enters them ◄───────────────────┘
//
// A ray looks at what it would look at alone, if in another order: the closest hit does not depend on that.
// Some packets are under way in turn, as single rays are (queue.h).
#pragma once

#include <cstring>
#include <memory>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>

#include "hierarchy/candidate.h"
#include "hierarchy/leaves.h"
#include "hierarchy/packet_boxes.h"

namespace kanuka::hierarchy {

// What the rays of a packet have yet to look at, the nearest on top, and which of them.
template <int W>
class PacketStack {
  public:
    // So many rays or fewer are looked at one by one.
    static constexpr int Few = 2;

    void clear() { m_size = 0; }
    // Of one ray, whose bit is given; `ends` as of Children::ref(). Eight are written where fewer are pushed.
    void push(const Entered& entered, uint32_t ray, uint32_t ends) {
        _mm256_storeu_si256(reinterpret_cast<__m256i*>(m_t + m_size), entered.keys);
        _mm256_storeu_si256(reinterpret_cast<__m256i*>(m_ref + m_size), refs_of(entered, ends));
        _mm256_storeu_si256(reinterpret_cast<__m256i*>(m_rays + m_size), _mm256_set1_epi32(int(ray)));
        m_size += entered.count;
    }
    void push(Ref ref, uint32_t rays, const float* t) {
        m_ref[m_size] = ref, m_rays[m_size] = rays, m_t[m_size] = t[__builtin_ctz(rays)];
        std::memcpy(m_ts[m_size++], t, sizeof m_ts[0]);
    }
    // The next that some rays still reach; false = there is none.
    bool pop(const PacketBoxes<W>& boxes, Ref& ref, uint32_t& rays) {
        while (m_size > 0) {
            const int i = --m_size;
            rays = m_rays[i];
            if (std::has_single_bit(rays)) {
                const int ray = __builtin_ctz(rays);
                if (!(m_t[i] <= boxes.t_max[ray / W][ray % W]))
                    continue;
            } else {
                rays &= boxes.reach(m_ts[i]);
                if (rays == 0)
                    continue;
            }
            ref = m_ref[i];
            return true;
        }
        return false;
    }

  private:
    // Where few rays part, each has its own children, once on the way down; and eight are written.
    static constexpr int Entries = StackEntries + 8 * Few + 8;
    int m_size = 0;
    alignas(32) float m_t[Entries]; // of one ray
    alignas(32) Ref m_ref[Entries];
    alignas(32) uint32_t m_rays[Entries];
    alignas(64) float m_ts[Entries][PacketRays]; // of more
};

// NodeKind: ChangingNode in pages of shapes that change, of one interval of time.
template <int W, Query Asked, class Filter, class NodeKind = Node>
class PacketQueue {
  public:
    static constexpr int Slots = 4;
    static constexpr bool Changes = std::is_same_v<NodeKind, ChangingNode>;

    // `times`: by ray, where shapes change; none = all begin with the shutter.
    PacketQueue(const Page& page, std::span<const Ray> rays, Filter& filter,
                std::span<const float> times = {})
        : m_page(page), m_rays(rays), m_times(times), m_filter(filter) {}

    // done(ray, hit, path) is called once for each ray of the packets.
    template <class Done>
    void run(std::span<const PacketOfRays> packets, Done&& done) {
        Slot* const slots = slots_of_thread();
        Slot* live[Slots];
        size_t next = 0;
        int count = 0;
        for (; count < Slots && next < packets.size(); count++)
            start(*(live[count] = slots + count), packets[next++]);
        while (count > 0)
            for (int i = 0; i < count; i++) {
                Slot& s = *live[i];
                if (Changes ? !is_of_nodes(kind_of(s.ref)) : is_leaf(s.ref))
                    meet_leaf(s);
                else
                    meet_node(s);
                if (s.stack.pop(s.boxes, s.ref, s.rays)) {
                    fetch(s.ref);
                    continue;
                }
                for (int k = 0; k < s.packet->count; k++)
                    done(s.packet->ray[k], s.hit[k], InstancePath::none());
                if (next < packets.size())
                    start(s, packets[next++]);
                else
                    std::swap(live[i--], live[--count]);
            }
    }

  private:
    struct alignas(64) Slot {
        PacketBoxes<W> boxes;
        const PacketOfRays* packet;
        Ref ref;       // what comes next,
        uint32_t rays; // and for which rays
        TracedRay ray[PacketRays];
        float fraction[PacketRays]; // of the interval of time, where shapes change
        Hit hit[PacketRays];
        PacketStack<W> stack;
    };
    // Queries follow each other by the thousand: their memory is made once.
    static Slot* slots_of_thread() {
        static thread_local const std::unique_ptr<Slot[]> slots(new Slot[Slots]);
        return slots.get();
    }

    void start(Slot& s, const PacketOfRays& packet) {
        s.packet = &packet, s.rays = 0, s.ref = m_page.header().root;
        for (int i = 0; i < packet.count; i++) {
            const Ray& r = m_rays[packet.ray[i]];
            s.ray[i] = TracedRay(r);
            s.hit[i] = {}, s.hit[i].t = r.t_max;
            s.rays |= uint32_t(s.ray[i].traceable) << i;
        }
        // What is no ray is another's double, which nobody looks at.
        const int some = s.rays == 0 ? 0 : __builtin_ctz(s.rays);
        for (int i = 0; i < PacketRays; i++)
            if (!(s.rays >> i & 1))
                s.ray[i] = s.ray[some];
        s.boxes.set(s.ray);
        if constexpr (Changes) {
            for (int i = 0; i < PacketRays; i++)
                s.fraction[i] = i < packet.count ? fraction_of(packet.ray[i]) : 0;
            s.boxes.set_fractions(s.fraction);
        }
        s.stack.clear();
    }
    float fraction_of(uint32_t ray) const { return m_times.empty() ? 0 : Interval(m_times[ray], 1).fraction; }
    void fetch(Ref ref) const {
        const char* const at = reinterpret_cast<const char*>(m_page.bytes() + byte_of(ref));
        _mm_prefetch(at, _MM_HINT_T0);
        _mm_prefetch(at + 64 * (Changes || is_leaf(ref)), _MM_HINT_T0); // a leaf has two lines,
        if constexpr (Changes)                                          // or four
            _mm_prefetch(at + 128, _MM_HINT_T0), _mm_prefetch(at + 192, _MM_HINT_T0);
    }
    static Children children_of(const Node& node) { return Children::of(node.children); }
    static Children children_of(const ChangingNode& node) { return children_of(node.begin); }

    void meet_node(Slot& s) {
        constexpr uint32_t Ends = Changes ? 2 : 1;
        const NodeKind& node = m_page.at<NodeKind>(s.ref);
        if (std::popcount(s.rays) <= PacketStack<W>::Few) {
            for (uint32_t rays = s.rays; rays != 0; rays &= rays - 1) {
                const int i = __builtin_ctz(rays);
                PlanesAlong<NodeKind> planes;
                planes.set(node, s.ray[i], Changes ? s.fraction[i] : 0);
                s.stack.push(planes.enter(node, s.ray[i]).sorted(), rays & -rays, Ends);
            }
            return;
        }
        const Children c = children_of(node);
        s.boxes.enter_each(node, s.boxes.enter_together(node), s.rays,
                           [&](uint32_t key, uint32_t rays, const float* t) {
                               s.stack.push(c.ref(key & 7, Ends), rays, t);
                           });
    }

    void meet_leaf(Slot& s) {
        uint32_t closer = 0;
        const auto trace_all = [&](const auto& content) {
            for (uint32_t rays = s.rays; rays != 0; rays &= rays - 1) {
                const int i = __builtin_ctz(rays);
                closer |= uint32_t(trace(s, content, i)) << i;
            }
        };
        constexpr int Many = 3; // then it pays to keep what is read
        const bool few = std::popcount(s.rays) < Many;
        if constexpr (Changes) {
            const auto trace_at = [&](const auto& at) { // each ray has its own time
                for (uint32_t rays = s.rays; rays != 0; rays &= rays - 1) {
                    const int i = __builtin_ctz(rays);
                    closer |= uint32_t(trace(s, at(s.fraction[i]), i)) << i;
                }
            };
            if (few)
                read_changing_leaf<W, false>(m_page, s.ref, trace_at);
            else
                read_changing_leaf<W, true>(m_page, s.ref, trace_at);
        } else if (few) {
            read_leaf<W, false>(m_page, s.ref, trace_all);
        } else {
            read_leaf<W, true>(m_page, s.ref, trace_all);
        }
        if (closer == 0)
            return;
        for (; closer != 0; closer &= closer - 1) {
            const int i = __builtin_ctz(closer);
            s.boxes.shorten(i, Asked == Query::Any ? -1 : s.hit[i].t); // it enters nothing any more
        }
        s.boxes.bound_ends();
    }
    // Was there a hit that is closer?
    template <class Content>
    bool trace(Slot& s, const Content& content, int i) {
        bool closer = false;
        TracedRay& ray = s.ray[i];
        Hit& hit = s.hit[i];
        const Ref leaf = s.ref;
        const size_t number = s.packet->ray[i];
        trace_leaf<W>(content, ray, [&](uint32_t primitive, float t, float u, float v) {
            const Hit candidate{t, u, v, leaf, primitive};
            if (t == hit.t && hit.found() && std::tie(hit.leaf, hit.primitive) < std::tie(leaf, primitive))
                return false;
            if (Filter::Filters &&
                !m_filter.accepts(Candidate{number, m_page, m_rays[number], candidate, InstancePath::none(),
                                            Changes ? s.fraction[i] : 0}))
                return false;
            hit = candidate, ray.t_max = t;
            closer = true;
            return Asked == Query::Any;
        });
        return closer;
    }

    const Page m_page;
    std::span<const Ray> m_rays;
    std::span<const float> m_times;
    Filter& m_filter;
};

} // namespace kanuka::hierarchy
