// Rays through a page, many of them in turn: while memory brings what one needs next, others go on.
//
//     rays ──► slots ──┬─► those whose next is a node ──► test of eight boxes ──► stack ──┐
//               ▲      └─► those whose next is a leaf ──► test of its triangles ──────────┤
//               └──────────────────── done: the next ray ◄────────────────────────────────┘
//
// Each ray visits what it would visit alone, in the same order: what is found does not depend on its
// neighbours.
//
// Where pages stand as instances (world.h) a leaf may be a place of another page: the ray goes on in that,
// made anew for it, on the same stack, and comes back when it has seen all of it.
#pragma once

#include <cstring>
#include <memory>
#include <span>
#include <tuple>

#include "hierarchy/instances.h"
#include "hierarchy/leaf_lanes.h"
#include "hierarchy/page.h"
#include "hierarchy/ray.h"
#include "hierarchy/triangle_lanes.h"
#include "hierarchy/world.h"

namespace kanuka::hierarchy {

// What a ray may hit. Whoever asks gives an object like this one: accepts() is called for each candidate that
// would be the closest hit so far, in no particular order; what it refuses is not there for the ray.
struct EverythingIsThere {
    static constexpr bool Filters = false;
    bool accepts(size_t /*ray*/, const Page&, const Hit&, const InstancePath&) const { return true; }
};

// What boxes a ray meets of a node's: lanes from far to near, with the distances at which it enters them.
struct Entered {
    Float<8> t;
    uint32_t lanes;
};
inline Entered enter_children(const Node& node, const TracedRay& ray) {
    const uint8_t* planes = node.plane[0][0];
    const auto eight = [](const uint8_t* p) {
        return Float<8>(Int<8>(
            (NativeLanes<8>::I)_mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(p)))));
    };
    Float<8> enter(ray.t_min), leave(ray.t_max);
    for (int a = 0; a < 3; a++) {
        const Int<8> frame(node.frame[a]);
        const Float<8> origin(Int<8>(frame.v >> 8)); // signed
        const Float<8> step = bitcast_float((frame & Int<8>(255)) << 23), minus_o(-ray.o[a]);
        const Float<8> near = fma(eight(planes + ray.near_plane[a]) + origin, step, minus_o);
        const Float<8> far = fma(eight(planes + (ray.near_plane[a] ^ 8)) + origin, step, minus_o);
        enter = max(enter, near * Float<8>(ray.near_per_d[a]));
        leave = min(leave, far * Float<8>(ray.far_per_d[a]));
    }
    const __m256i order =
        _mm256_load_si256(reinterpret_cast<const __m256i*>(octant_tables.place[ray.octant]));
    const auto ordered = [order](const Float<8>& x) {
        return Float<8>((NativeLanes<8>::F)_mm256_permutevar8x32_ps((__m256)x.v, order));
    };
    enter = ordered(enter), leave = ordered(leave);
    const uint32_t last = node.children >> Children::CountShift & 7;
    return {enter, (enter <= leave).bits() & octant_tables.present[ray.octant][last]};
}

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

    void push(const Node& node, const TracedRay& ray, const Entered& entered) {
        const Children c = Children::of(node.children);
        const int32_t first = int32_t(uint32_t(c.kind) << KindShift | c.offset);
        const Int<8> refs =
            Int<8>::load(octant_tables.place[ray.octant]) * Int<8>(int(UnitsOf[uint32_t(c.kind)])) +
            Int<8>(first);
        compress_store(m_t + m_size, entered.t, entered.lanes);
        m_size += compress_store(m_ref + m_size, refs, entered.lanes);
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
        Page page;
        int base;
    };
    Page page;               // the one it is in
    Ray ray;                 // as it runs there
    Outer outer[Levels - 1]; // around that, from the outermost on
    InstancePath at, hit;    // where it is; where the closest hit is
};
template <>
struct Nest<1> {};

enum class Query { Closest, Any };

// Levels: how deep pages may stand in pages, themselves counted.
template <int W, Query Asked, class Filter, int Levels = 1>
class RayQueue {
  public:
    static constexpr int Slots = 16;

    // `pages`: what instances stand for, by number.
    RayQueue(const Page& root, std::span<const Ray> rays, Filter& filter, std::span<const Page> pages = {})
        : m_root(root), m_pages(pages), m_rays(rays), m_filter(filter), m_slots(new Slot[Slots]) {}

    // done(ray, hit, path) is called once for each, in the order in which they end. Of Query::Any the hit is
    // any.
    template <class Done>
    void run(Done&& done) {
        m_waiting = {}, m_next = 0;
        for (int i = 0; i < Slots && start(i, done); i++)
            wait(m_waiting, i);
        while (m_waiting.nodes != 0 || m_waiting.leaves != 0) {
            const Waiting now = m_waiting;
            m_waiting = {};
            for (int k = 0; k < now.nodes; k++) {
                Slot& s = m_slots[now.at_node[k]];
                const Node& node = page_of(s).template at<Node>(s.stack.pop());
                s.stack.push(node, s.ray, enter_children(node, s.ray));
                next(now.at_node[k], done);
            }
            for (int k = 0; k < now.leaves; k++) {
                Slot& s = m_slots[now.at_leaf[k]];
                meet_leaf(s, s.stack.pop());
                next(now.at_leaf[k], done);
            }
        }
    }

  private:
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
    struct Waiting {
        int nodes = 0, leaves = 0;
        uint8_t at_node[Slots + 1], at_leaf[Slots + 1];
    };

    // Gives a slot its next ray; false = there is none.
    template <class Done>
    bool start(int slot, Done& done) {
        const Ref root = m_root.header().root;
        for (; m_next < m_rays.size(); m_next++) {
            Slot& s = m_slots[slot];
            s.ray = TracedRay(m_rays[m_next]);
            s.hit = {};
            s.hit.t = m_rays[m_next].t_max;
            s.number = m_next;
            if constexpr (Levels > 1) {
                s.nest.page = m_root, s.nest.ray = m_rays[m_next];
                s.nest.at = s.nest.hit = {};
            }
            if (s.ray.traceable && root != NoRef) {
                s.stack.start(root);
                m_next++;
                return true;
            }
            done(m_next, s.hit, path_of_hit(s));
        }
        return false;
    }
    template <class Done>
    void next(int slot, Done& done) {
        Slot& s = m_slots[slot];
        while (__builtin_expect(s.stack.empty(), 0)) {
            if (leave(s))
                continue;
            done(s.number, s.hit, path_of_hit(s));
            if (!start(slot, done))
                return;
        }
        wait(m_waiting, slot);
    }
    // Into the page that stands at a place, and back from it; false = it is in the outermost.
    void enter(Slot& s, const InstanceLeaf& place) {
        if constexpr (Levels > 1) {
            Nest<Levels>& n = s.nest;
            const Page& inner = m_pages[place.page]; // not empty, and not too deep: World::add()
            Ray ray = place.inner(n.ray);
            ray.t_max = s.ray.t_max;
            const TracedRay traced(ray);
            if (!traced.traceable)
                return;
            n.outer[n.at.depth] = {n.ray, n.page, s.stack.open(inner.header().root)};
            n.at.instance[n.at.depth++] = place.number;
            n.page = inner, n.ray = ray, s.ray = traced;
        }
    }
    bool leave(Slot& s) {
        if constexpr (Levels > 1) {
            Nest<Levels>& n = s.nest;
            if (n.at.depth == 0)
                return false;
            const auto& outer = n.outer[--n.at.depth];
            n.at.instance[n.at.depth] = 0;
            n.page = outer.page, n.ray = outer.ray;
            s.stack.close(outer.base);
            s.ray = TracedRay(n.ray);
            s.ray.t_max = s.hit.t;
            s.stack.keep_before(s.hit.t);
            return true;
        }
        return false;
    }
    void wait(Waiting& waiting, int slot) {
        const Ref ref = m_slots[slot].stack.top();
        const int leaf = is_leaf(ref);
        const uint8_t* at = page_of(m_slots[slot]).bytes() + byte_of(ref);
        _mm_prefetch(reinterpret_cast<const char*>(at), _MM_HINT_T0);
        _mm_prefetch(reinterpret_cast<const char*>(at + 64 * leaf), _MM_HINT_T0);  // a leaf has two lines
        waiting.at_node[waiting.nodes] = uint8_t(slot), waiting.nodes += 1 - leaf; // no branch: it is either
        waiting.at_leaf[waiting.leaves] = uint8_t(slot), waiting.leaves += leaf;
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
            if (Filter::Filters && !m_filter.accepts(s.number, page, candidate, path_of(s)))
                return false;
            s.hit = candidate;
            if constexpr (Levels > 1)
                s.nest.hit = s.nest.at;
            ray.t_max = t;
            closer = true;
            return Asked == Query::Any;
        };
        switch (kind_of(leaf)) {
        case Kind::Grid32:
            trace_grid_leaf<W>(Reader32(page.at<Grid32>(leaf)), ray, found);
            break;
        case Kind::Grid48:
            trace_grid_leaf<W>(Reader48(page.at<Grid48>(leaf)), ray, found);
            break;
        case Kind::GridFloat:
            trace_grid_leaf<W>(ReaderFloat(page.at<GridFloat>(leaf)), ray, found);
            break;
        case Kind::Triangle32:
            trace_triangle_leaf(TriangleReader32(page.at<Triangle32>(leaf)), ray, found);
            break;
        case Kind::Triangle48:
            trace_triangle_leaf(TriangleReader48(page.at<Triangle48>(leaf)), ray, found);
            break;
        case Kind::TriangleFloat:
            trace_triangle_leaf(TriangleReaderFloat(page.at<TriangleFloat>(leaf)), ray, found);
            break;
        case Kind::Instance:
            enter(s, page.at<InstanceLeaf>(leaf));
            break;
        default:
            break;
        }
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
    Filter& m_filter;
    std::unique_ptr<Slot[]> m_slots;
    Waiting m_waiting;
    size_t m_next = 0;
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
                  Filter& filter) {
    RayQueue<W, Query::Closest, Filter, MostNesting + 1>(world.page(root), rays, filter, world.pages())
        .run([&](size_t i, const Hit& h, const InstancePath& path) { hits[i] = {h, path}; });
}
template <int W, class Filter>
void find_any(const World& world, uint32_t root, std::span<const Ray> rays, std::span<uint8_t> hidden,
              Filter& filter) {
    RayQueue<W, Query::Any, Filter, MostNesting + 1>(world.page(root), rays, filter, world.pages())
        .run([&](size_t i, const Hit& h, const InstancePath&) { hidden[i] = h.found(); });
}

} // namespace kanuka::hierarchy
