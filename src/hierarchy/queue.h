// Rays through a page, many of them in turn: while memory brings what one needs next, others go on.
//
//     rays ──► slots ──┬─► those whose next is a node ──► test of eight boxes ──► stack ──┐
//               ▲      └─► those whose next is a leaf ──► test of its triangles ──────────┤
//               └──────────────────── done: the next ray ◄────────────────────────────────┘
//
// Each ray visits what it would visit alone, in the same order: what is found does not depend on its
// neighbours.
//
// Rays that run side by side are taken out before, and go together (packet.h).
//
// Where pages stand as instances (world.h) a leaf may be a place of another page: the ray goes on in that,
// made anew for it, on the same stack, and comes back when it has seen all of it.
#pragma once

#include <cstring>
#include <memory>
#include <span>
#include <tuple>

#include "hierarchy/instances.h"
#include "hierarchy/leaves.h"
#include "hierarchy/node_lanes.h"
#include "hierarchy/packet.h"
#include "hierarchy/page.h"
#include "hierarchy/ray.h"
#include "hierarchy/world.h"

namespace kanuka::hierarchy {

// What a ray has yet to look at, the nearest on top: in the page that it is in, above what it has left to do
// in those around it.
template <int Levels>
class Stack {
  public:
    void start(Ref root) { m_base = 0, m_ref[0] = root, m_t[0] = 0, m_size = 1; }
    // Of the page that the ray is in.
    bool empty() const { return m_size == base(); }
    void clear() { m_base = m_size = 0; }
    // Goes on in another page; what close() needs to come back.
    int open(Ref root) {
        const int outer = m_base;
        m_base = m_size;
        m_ref[m_size] = root, m_t[m_size++] = 0;
        return outer;
    }
    void close(int outer) { m_base = outer; }
    Ref top() const { return m_ref[m_size - 1]; }
    Ref pop() { return m_ref[--m_size]; }
    void put_back(Ref ref) { m_ref[m_size++] = ref; } // for what was popped, at the same distance

    // Eight are written where fewer are pushed.
    void push(const Entered& entered, __m256i refs) {
        // With the places, distances are too large by less than their margin.
        _mm256_storeu_si256(reinterpret_cast<__m256i*>(m_t + m_size), entered.keys);
        _mm256_storeu_si256(reinterpret_cast<__m256i*>(m_ref + m_size), refs);
        m_size += entered.count;
    }
    // Takes out what begins behind the closest hit.
    void keep_before(float t) {
        int kept = base();
        for (int i = kept; i < m_size; i += 8) {
            const Float<8> at = Float<8>::load(m_t + i);
            const Int<8> refs = Int<8>::load(reinterpret_cast<const int32_t*>(m_ref + i));
            uint32_t lanes = (at <= Float<8>(t)).bits();
            if (m_size - i < 8)
                lanes &= (1u << (m_size - i)) - 1;
            compress_store(m_t + kept, at, lanes);
            kept += compress_store(m_ref + kept, refs, lanes);
        }
        m_size = kept;
    }

  private:
    static int compress_store(float* to, Float<8> v, uint32_t lanes) {
        return kanuka::compress_store(to, v, lanes);
    }
    static int compress_store(Ref* to, Int<8> v, uint32_t lanes) {
        return kanuka::compress_store(reinterpret_cast<int32_t*>(to), v, lanes);
    }

    int base() const { return Levels > 1 ? m_base : 0; }

    int m_size = 0, m_base = 0;
    alignas(32) float m_t[StackEntries * Levels + 8]; // eight are written where one is pushed
    alignas(32) Ref m_ref[StackEntries * Levels + 8];
};

// Where a ray is among instances in instances. Of one level it is nowhere but in the page.
template <int Levels>
struct Nest {
    struct Outer {
        Ray ray;
        TracedRay traced;
        Page page;
        int base;
    };
    Page page;               // the one it is in
    bool changes = false;    // has shapes that change:
    float fraction = 0;      // as they are so far into the interval of the page
    Ray ray;                 // as it runs there
    Outer outer[Levels - 1]; // around that, from the outermost on
    InstancePath at, hit;    // where it is; where the closest hit is
};
template <>
struct Nest<1> {};

// Levels: how deep pages may stand in pages, themselves counted.
template <int W, Query Asked, class Filter, int Levels = 1>
class RayQueue {
  public:
    static constexpr int Slots = 16;

    // `pages`: what instances stand for, by number; `times` of the shutter, by ray: none = all begin with it;
    // `levels` of detail that rays see: none = all see all.
    RayQueue(const Page& root, std::span<const Ray> rays, Filter& filter, std::span<const Page> pages = {},
             std::span<const float> times = {}, std::span<const float> levels = {})
        : m_root(root), m_pages(pages), m_rays(rays), m_times(times), m_levels(levels), m_filter(filter) {}

    // done(ray, hit, path) is called once for each, in the order in which they end. Of Query::Any the hit is
    // any. What runs side by side goes together, where no instances are.
    template <class Done>
    void run(Done&& done) {
        if (Levels > 1 || m_root.header().root == NoRef)
            return run_alone(done);
        RayGroups& groups = RayGroups::of_thread();
        groups.sort(m_rays, m_root.bounds().hi - m_root.bounds().lo);
        m_alone = groups.alone();
        trace_alone(done);
        if (!groups.packets().empty())
            PacketQueue<W, Asked, Filter>(m_root, m_rays, m_filter).run(groups.packets(), done);
    }
    // The same hits, each ray by itself.
    template <class Done>
    void run_alone(Done&& done) {
        m_alone = RayGroups::of_thread().all(m_rays.size());
        trace_alone(done);
    }

  private:
    template <class Done>
    void trace_alone(Done& done) {
        Waiting lists[2];
        Waiting *now = lists, *then = lists + 1;
        m_next = 0;
        Slot* const slots = slots_of_thread();
        for (int i = 0; i < Slots && start(slots[i], done); i++)
            wait(*now, slots[i]);
        while (now->nodes != 0 || now->leaves != 0) {
            then->nodes = then->leaves = 0;
            for (int k = 0; k < now->nodes; k++) {
                Slot& s = *now->at_node[k];
                const Node& node = page_of(s).template at<Node>(s.stack.pop());
                const Entered entered = enter_children(node, s.ray);
                s.stack.push(entered, refs_of(node, entered));
                next(*then, s, done);
            }
            for (int k = 0; k < now->leaves; k++) {
                Slot& s = *now->at_leaf[k];
                meet_leaf(s, s.stack.pop());
                next(*then, s, done);
            }
            std::swap(now, then);
        }
    }

    struct alignas(64) Slot {
        TracedRay ray;
        Hit hit;
        size_t number;
        [[no_unique_address]] Nest<Levels> nest;
        Stack<Levels> stack;
    };
    const Page& page_of(const Slot& s) const {
        if constexpr (Levels > 1)
            return s.nest.page;
        else
            return m_root;
    }
    const Ray& ray_of(const Slot& s) const {
        if constexpr (Levels > 1)
            return s.nest.ray;
        else
            return m_rays[s.number];
    }
    static const InstancePath& path_of_hit(const Slot& s) {
        if constexpr (Levels > 1)
            return s.nest.hit;
        else
            return InstancePath::none();
    }
    static const InstancePath& path_of(const Slot& s) {
        if constexpr (Levels > 1)
            return s.nest.at;
        else
            return InstancePath::none();
    }
    static float fraction_of(const Slot& s) {
        if constexpr (Levels > 1)
            return s.nest.fraction;
        else
            return 0;
    }
    // Of what changes; such pages stand in a world alone.
    static bool changes(const Slot& s) {
        if constexpr (Levels > 1)
            return s.nest.changes;
        else
            return false;
    }
    struct Waiting {
        int nodes = 0, leaves = 0;
        Slot *at_node[Slots + 1], *at_leaf[Slots + 1];
    };
    // Queries follow each other by the thousand: their memory is made once.
    static Slot* slots_of_thread() {
        static thread_local const std::unique_ptr<Slot[]> slots(new Slot[Slots]);
        return slots.get();
    }

    // Gives a slot its next ray; false = there is none.
    template <class Done>
    bool start(Slot& s, Done& done) {
        const Ref root = m_root.header().root;
        while (m_next < m_alone.size()) {
            const uint32_t number = m_alone[m_next++];
            const Ray& ray = m_rays[number];
            s.ray = TracedRay(ray);
            s.hit = {};
            s.hit.t = ray.t_max;
            s.number = number;
            if constexpr (Levels > 1) {
                s.nest.page = m_root, s.nest.ray = ray;
                s.nest.at = s.nest.hit = {};
            }
            if (s.ray.traceable && root != NoRef) {
                s.stack.start(root);
                return true;
            }
            done(number, s.hit, path_of_hit(s));
        }
        return false;
    }
    template <class Done>
    void next(Waiting& waiting, Slot& s, Done& done) {
        while (__builtin_expect(s.stack.empty(), 0)) {
            if (leave(s))
                continue;
            done(s.number, s.hit, path_of_hit(s));
            if (!start(s, done))
                return;
        }
        wait(waiting, s);
    }
    float time_of(const Slot& s) const { return m_times.empty() ? 0 : shutter_time(m_times[s.number]); }
    // What stands at a place, or moves or changes there.
    void meet_place(Slot& s, const Page& page, Ref leaf) {
        if (kind_of(leaf) == Kind::Instance)
            return enter(s, page.at<InstanceLeaf>(leaf));
        if (kind_of(leaf) == Kind::Changing)
            return meet_changing(s, page.at<ChangingNode>(leaf));
        const MovingLeaf& moving = page.at<MovingLeaf>(leaf);
        if (moving.stands_still())
            return enter(s, moving.place);
        const float time = time_of(s);
        if (kind_of(leaf) == Kind::Moving) { // other rays go on while memory brings the path
            if (!moving.is_met_by(s.ray, time))
                return;
            if (moving.changes())
                return enter_interval(s, moving.place, time);
            moving.fetch_path();
            return s.stack.put_back(make_ref(Kind::Met, byte_of(leaf)));
        }
        InstanceLeaf place;
        if (moving.stand(time, place))
            enter(s, place);
    }
    // Into the page that stands at a place, and back from it; false = it is in the outermost.
    void enter(Slot& s, const InstanceLeaf& place) {
        if constexpr (Levels > 1) {
            if (!m_levels.empty() && !place.seen.holds(m_levels[s.number]))
                return;
            Nest<Levels>& n = s.nest;
            const Page& inner = m_pages[place.page]; // not empty, and not too deep: World::add()
            auto& outer = n.outer[n.at.depth];
            outer.ray = n.ray, outer.traced = s.ray, outer.page = n.page;
            if (!place.stays) {
                Ray ray = place.inner(n.ray);
                ray.t_max = s.ray.t_max;
                const TracedRay traced(ray);
                if (!traced.traceable)
                    return;
                n.ray = ray, s.ray = traced;
            }
            outer.base = s.stack.open(inner.header().root);
            n.at.instance[n.at.depth++] = place.number;
            n.page = inner, n.changes = inner.changes();
        }
    }
    void enter_interval(Slot& s, const InstanceLeaf& place, float time) {
        if constexpr (Levels > 1) {
            const Interval interval(time, place.times - 1u);
            InstanceLeaf there = place;
            there.page += interval.number;
            if (m_pages[there.page].header().root == NoRef) // all of it is nowhere meanwhile
                return;
            s.nest.fraction = interval.fraction;
            enter(s, there);
        }
    }
    void meet_changing(Slot& s, const ChangingNode& node) {
        if constexpr (Levels > 1) {
            const Entered entered = enter_children(node, s.ray, s.nest.fraction);
            s.stack.push(entered, refs_of(node.begin, entered, 2));
        }
    }
    bool leave(Slot& s) {
        if constexpr (Levels > 1) {
            Nest<Levels>& n = s.nest;
            if (n.at.depth == 0)
                return false;
            n.changes = false;
            const auto& outer = n.outer[--n.at.depth];
            n.at.instance[n.at.depth] = 0;
            n.page = outer.page, n.ray = outer.ray;
            s.stack.close(outer.base);
            s.ray = outer.traced;
            s.ray.t_max = s.hit.t;
            s.stack.keep_before(s.hit.t);
            return true;
        }
        return false;
    }
    void wait(Waiting& waiting, Slot& s) {
        const Ref ref = s.stack.top();
        const int leaf = is_leaf(ref);
        const uint8_t* at = page_of(s).bytes() + byte_of(ref);
        _mm_prefetch(reinterpret_cast<const char*>(at), _MM_HINT_T0);
        _mm_prefetch(reinterpret_cast<const char*>(at + 64 * leaf), _MM_HINT_T0); // a leaf has two lines
        if (changes(s)) {                                                         // or four
            _mm_prefetch(reinterpret_cast<const char*>(at + 128), _MM_HINT_T0);
            _mm_prefetch(reinterpret_cast<const char*>(at + 192), _MM_HINT_T0);
        }
        waiting.at_node[waiting.nodes] = &s, waiting.nodes += 1 - leaf; // no branch: it is either
        waiting.at_leaf[waiting.leaves] = &s, waiting.leaves += leaf;
    }

    void meet_leaf(Slot& s, Ref leaf) {
        bool closer = false;
        const Page page = page_of(s);
        // By this name: where leaves' functions stay calls, GCC 12 takes a write by way of the slot for none
        // to the ray that they are given, and they go on with an old t_max (-fno-ipa-modref and
        // -fno-strict-aliasing are right).
        TracedRay& ray = s.ray;
        const auto found = [&](uint32_t primitive, float t, float u, float v) {
            const Hit candidate{t, u, v, leaf, primitive};
            // Of hits at one distance that of the lowest number counts, whatever the order of their lanes.
            if (t == s.hit.t && s.hit.found() &&
                std::tie(path_of_hit(s), s.hit.leaf, s.hit.primitive) < std::tie(path_of(s), leaf, primitive))
                return false;
            if (Filter::Filters && !m_filter.accepts(Candidate{s.number, page, ray_of(s), candidate,
                                                               path_of(s), fraction_of(s)}))
                return false;
            s.hit = candidate;
            if constexpr (Levels > 1)
                s.nest.hit = s.nest.at;
            ray.t_max = t;
            closer = true;
            return Asked == Query::Any;
        };
        if (Levels > 1 && kind_of(leaf) >= Kind::Instance)
            meet_place(s, page, leaf);
        else if (changes(s))
            read_changing_leaf<W>(page, leaf, fraction_of(s),
                                  [&](const auto& content) { trace_leaf<W>(content, ray, found); });
        else
            read_leaf<W, false>(page, leaf, [&](const auto& content) { trace_leaf<W>(content, ray, found); });
        if (!closer)
            return;
        if (Asked == Query::Any) {
            s.stack.clear();
            if constexpr (Levels > 1)
                s.nest.at = {};
        } else {
            s.stack.keep_before(s.hit.t);
        }
    }

    const Page m_root;
    std::span<const Page> m_pages;
    std::span<const Ray> m_rays;
    std::span<const float> m_times, m_levels;
    Filter& m_filter;
    size_t m_next = 0;
    std::span<const uint32_t> m_alone;
};

// Closest hits, and whether there is any.
template <int W, class Filter>
void find_closest(const Page& page, std::span<const Ray> rays, std::span<Hit> hits, Filter& filter) {
    RayQueue<W, Query::Closest, Filter>(page, rays, filter)
        .run([&](size_t i, const Hit& h, const InstancePath&) { hits[i] = h; });
}
template <int W, class Filter>
void find_any(const Page& page, std::span<const Ray> rays, std::span<uint8_t> hidden, Filter& filter) {
    RayQueue<W, Query::Any, Filter>(page, rays, filter).run([&](size_t i, const Hit& h, const InstancePath&) {
        hidden[i] = h.found();
    });
}

// The same in page `root` of a world, and in what stands there.
template <int W, class Filter>
void find_closest(const World& world, uint32_t root, std::span<const Ray> rays, std::span<InstanceHit> hits,
                  Filter& filter, std::span<const float> times = {}) {
    RayQueue<W, Query::Closest, Filter, MostNesting + 1>(world.page(root), rays, filter, world.pages(), times)
        .run([&](size_t i, const Hit& h, const InstancePath& path) { hits[i] = {h, path}; });
}
template <int W, class Filter>
void find_any(const World& world, uint32_t root, std::span<const Ray> rays, std::span<uint8_t> hidden,
              Filter& filter, std::span<const float> times = {}) {
    RayQueue<W, Query::Any, Filter, MostNesting + 1>(world.page(root), rays, filter, world.pages(), times)
        .run([&](size_t i, const Hit& h, const InstancePath&) { hidden[i] = h.found(); });
}

} // namespace kanuka::hierarchy
