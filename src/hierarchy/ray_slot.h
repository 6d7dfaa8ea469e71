// What a ray that is under way has with it: where it is, what it has hit, and what it has yet to look at.
#pragma once

#include <span>
#include <utility>

#include "hierarchy/instances.h"
#include "hierarchy/node_lanes.h"
#include "hierarchy/page.h"
#include "hierarchy/ray.h"

namespace kanuka::hierarchy {

// What a ray has yet to look at, the nearest on top: in the page that it is in, above what it has left to do
// in those around it.
template <int Levels>
class Stack {
  public:
    // Lies below all that is to be looked at in a page.
    static constexpr Ref End = make_ref(Kind::End, 0);

    void start(Ref root) { m_base = m_size = 0, open(root); }
    void clear() { m_base = 0, m_size = 1; } // but for the end
    // Goes on in another page; what close() needs, behind the end of that, to come back.
    int open(Ref root) {
        const int outer = std::exchange(m_base, m_size);
        m_ref[m_size] = End, m_t[m_size++] = 0;
        m_ref[m_size] = root, m_t[m_size++] = 0;
        return outer;
    }
    void close(int outer) { m_base = outer; }
    Ref top() const { return m_ref[m_size - 1]; }
    Ref pop() { return m_ref[--m_size]; }

    // Eight are written where fewer are pushed.
    void push(const Entered& entered, __m256i refs) {
        // With the places, distances are too large by less than their margin.
        const int size = m_size; // which the compiler would read again after each store
        _mm256_storeu_si256(reinterpret_cast<__m256i*>(m_t + size), entered.keys);
        _mm256_storeu_si256(reinterpret_cast<__m256i*>(m_ref + size), refs);
        m_size = size + entered.count;
    }
    // Takes out what begins behind the closest hit.
    void keep_before(float t) {
        int kept = base() + 1; // the end stays
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

    static constexpr int Entries = (StackEntries + 1) * Levels + 8; // eight are written where one is pushed
    int m_size = 0, m_base = 0;
    alignas(32) float m_t[Entries];
    alignas(32) Ref m_ref[Entries];
};

// A page that a ray is in, and the ray as it runs there.
struct Frame {
    TracedRay traced;
    Ray ray;
    Page page;
    int outer;          // what the stack needs to come back from it
    bool has_changing;  // shapes that change:
    float fraction = 0; // as they are so far into the interval of the page; of levels, the time
};

// Levels: how deep pages may stand in pages, themselves counted.
template <int Levels>
struct alignas(64) Slot {
    Hit hit;
    size_t number; // of the ray,
    float time;    // and when it is, from 0 to 1
    Frame* in;     // the page that it is in; those before are around it
    InstancePath at, of_hit;
    Frame frame[Levels];
    Stack<Levels> stack;

    bool is_in_changing() const { return Levels > 1 && in->has_changing; } // such pages stand in others alone
    const InstancePath& path() const { return Levels > 1 ? at : InstancePath::none(); }
    const InstancePath& path_of_hit() const { return Levels > 1 ? of_hit : InstancePath::none(); }

    void start(const Page& root, const Ray& ray, size_t ray_number, float at_time) {
        in = frame;
        in->traced = TracedRay(ray);
        in->ray = ray, in->page = root, in->has_changing = false, in->fraction = at_time;
        hit = {}, hit.t = ray.t_max;
        number = ray_number, time = at_time;
        if constexpr (Levels > 1)
            at = of_hit = {};
    }
    // The outermost page is another: of what changes, so far into its interval of time.
    void change(const Page& page, float fraction) {
        in->page = page, in->has_changing = page.changes(), in->fraction = fraction;
    }
    // Into a page that stands as instance `place` of its level, with the ray as it runs there, and back from
    // it; false = it is in the outermost.
    void enter(uint32_t place, const Ray& inner, const Page& page) {
        in[1].ray = inner;
        in[1].traced = TracedRay(inner);
        if (in[1].traced.traceable)
            go_on(place, page, time);
    }
    // Which lies in the level as it is.
    void enter(uint32_t place, const Page& page) { enter(place, page, time); }
    // Likewise, of what changes: so far into the page's interval of time.
    void enter(uint32_t place, const Page& page, float fraction) {
        in[1].ray = in->ray, in[1].traced = in->traced;
        go_on(place, page, fraction);
    }
    bool leave() {
        if (Levels == 1 || at.depth == 0)
            return false;
        stack.close(in->outer);
        in--;
        at.instance[--at.depth] = 0;
        in->traced.t_max = hit.t;
        stack.keep_before(hit.t);
        return true;
    }
    // It looks at nothing more.
    void end() {
        in = frame, stack.clear();
        if constexpr (Levels > 1)
            at = {};
    }

  private:
    void go_on(uint32_t place, const Page& page, float fraction) {
        in++;
        in->page = page, in->has_changing = page.changes(), in->fraction = fraction;
        in->outer = stack.open(page.header().root);
        at.instance[at.depth++] = place;
    }
};

// Slots by what they look at next: no branch says which, as that cannot be foreseen.
template <int Levels, int Slots>
class Waiting {
  public:
    // Fetched: what was looked at once, and whose matrix or path is on its way from memory. Solids: likewise
    // a place, of surfaces that bound some.
    enum Next : uint8_t {
        Node,
        Leaf,
        ChangingNode,
        MovingNode,
        Instance,
        InstanceFetched,
        Moving,
        MovingFetched,
        Solids,
        End,
        Kinds
    };

    std::span<Slot<Levels>* const> of(Next next) const { return {m_slot[next], size_t(m_count[next])}; }
    bool any() const { return m_any; }
    void clear() {
        m_any = false;
        for (int& count : m_count)
            count = 0;
    }
    void add(Slot<Levels>& slot, Kind kind) { add(slot, Next(next_of[uint32_t(kind)])); }
    void add(Slot<Levels>& slot, Next next) {
        m_slot[next][m_count[next]++] = &slot;
        m_any = true;
    }

  private:
    static constexpr Next next_of[16] = {Node, Leaf, Leaf,     Leaf,   Leaf,         Leaf,       Leaf, Leaf,
                                         Leaf, Leaf, Instance, Moving, ChangingNode, MovingNode, End,  End};
    bool m_any = false;
    int m_count[Kinds] = {};
    Slot<Levels>* m_slot[Kinds][Slots];
};

} // namespace kanuka::hierarchy
