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

// A hit that would be the closest so far.
struct Candidate {
    size_t ray;       // its number
    const Page& page; // that the hit lies in,
    const Ray& here;  // the ray as it runs there,
    const Hit& hit;
    const InstancePath& path; // and how it came there
};
// What a ray may hit. Whoever asks gives an object like this one: accepts() is called in no particular order;
// what it refuses is not there for the ray.
struct EverythingIsThere {
    static constexpr bool Filters = false;
    bool accepts(const Candidate&) const { return true; }
};

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

// The children of a node that a ray enters, from the far ones to the near: the distance as a float's bits,
// whose last three are the child's place in the node; 0 = no child.
struct Entered {
    __m256i keys;
    int count;
};
// A plane q lies at distance ((origin + q) step - o) / d = q scale + shift along the ray. The error of the
// shift is relative to that itself, so to the distance and to the width of the node: hence two margins.
[[gnu::always_inline]] inline Entered enter_children(const Node& node, const TracedRay& ray) {
    const uint8_t* const planes = node.plane[0][0];
    const __m128i frame = _mm_load_si128(reinterpret_cast<const __m128i*>(node.frame)); // and the children
    const __m128 origin = _mm_cvtepi32_ps(_mm_srai_epi32(frame, 8));                    // signed
    const __m128 step = _mm_castsi128_ps(_mm_slli_epi32(_mm_and_si128(frame, _mm_set1_epi32(255)), 23));
    const __m128 per_d = _mm_load_ps(ray.per_d);
    const __m128 scale_of = _mm_mul_ps(step, per_d),
                 shift = _mm_mul_ps(_mm_fmsub_ps(origin, step, _mm_load_ps(ray.o)), per_d);
    const __m128 margin =
        _mm_mul_ps(_mm_andnot_ps(_mm_set1_ps(-0.0f), scale_of), _mm_set1_ps(TracedRay::StepMargin));
    alignas(16) float scale[4], near_shift[4], far_shift[4];
    _mm_store_ps(scale, scale_of);
    _mm_store_ps(near_shift, _mm_sub_ps(shift, margin));
    _mm_store_ps(far_shift, _mm_add_ps(shift, margin));
    const auto eight = [](const uint8_t* p) {
        return _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(p))));
    };
    const auto enter = [&](int a) {
        return _mm256_fmadd_ps(eight(planes + ray.near_plane[a]), _mm256_broadcast_ss(scale + a),
                               _mm256_broadcast_ss(near_shift + a));
    };
    const auto leave = [&](int a) {
        return _mm256_fmadd_ps(eight(planes + ray.far_plane[a]), _mm256_broadcast_ss(scale + a),
                               _mm256_broadcast_ss(far_shift + a));
    };
    const __m256 first = _mm256_max_ps(_mm256_max_ps(enter(0), enter(1)),
                                       _mm256_max_ps(enter(2), _mm256_broadcast_ss(&ray.t_min)));
    const __m256 last = _mm256_min_ps(_mm256_min_ps(leave(0), leave(1)),
                                      _mm256_min_ps(leave(2), _mm256_broadcast_ss(&ray.t_max)));
    const __m256 t = _mm256_mul_ps(first, _mm256_set1_ps(1 - TracedRay::Margin));
    const __m256 end = _mm256_mul_ps(last, _mm256_set1_ps(1 + TracedRay::Margin));
    const __m256i lane = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    const __m256i is_there =
        _mm256_cmpgt_epi32(_mm256_set1_epi32(int(node.children >> Children::CountShift & 7) + 1), lane);
    const __m256 entered = _mm256_and_ps(_mm256_cmp_ps(t, end, _CMP_LE_OQ), _mm256_castsi256_ps(is_there));
    const __m256i key =
        _mm256_or_si256(_mm256_andnot_si256(_mm256_set1_epi32(7), _mm256_castps_si256(t)), lane);
    return {sort_down(_mm256_and_si256(key, _mm256_castps_si256(entered))),
            __builtin_popcount(unsigned(_mm256_movemask_ps(entered)))};
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

    // Eight are written where fewer are pushed.
    void push(const Node& node, const Entered& entered) {
        const Children c = Children::of(node.children);
        const __m256i place = _mm256_and_si256(entered.keys, _mm256_set1_epi32(7));
        const __m256i refs =
            _mm256_add_epi32(_mm256_mullo_epi32(place, _mm256_set1_epi32(int(UnitsOf[uint32_t(c.kind)]))),
                             _mm256_set1_epi32(int(uint32_t(c.kind) << KindShift | c.offset)));
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
        : m_root(root), m_pages(pages), m_rays(rays), m_filter(filter) {}

    // done(ray, hit, path) is called once for each, in the order in which they end. Of Query::Any the hit is
    // any.
    template <class Done>
    void run(Done&& done) {
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
                s.stack.push(node, enter_children(node, s.ray));
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
        for (; m_next < m_rays.size(); m_next++) {
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
    // Into the page that stands at a place, and back from it; false = it is in the outermost.
    void enter(Slot& s, const InstanceLeaf& place) {
        if constexpr (Levels > 1) {
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
            n.page = inner;
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
        waiting.at_node[waiting.nodes] = &s, waiting.nodes += 1 - leaf;           // no branch: it is either
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
            if (Filter::Filters &&
                !m_filter.accepts(Candidate{s.number, page, ray_of(s), candidate, path_of(s)}))
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
