// Rays through a page, many of them in turn: while memory brings what one needs next, others go on.
//
//     rays ──► slots ──┬─► those whose next is a node ──► test of eight boxes ──► stack ──┐
//               ▲      ├─► those whose next is a leaf ──► test of its triangles ──────────┤
//               │      ├─► those at a place of a page ──► its matrix is fetched ──► in ───┤
//               │      └─► those at the end of a page ──► back to the page around it ─────┤
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
#include "hierarchy/packet.h"
#include "hierarchy/page.h"
#include "hierarchy/ray.h"
#include "hierarchy/ray_slot.h"
#include "hierarchy/solid_query.h"
#include "hierarchy/world.h"

namespace kanuka::hierarchy {

// Levels: how deep pages may stand in pages, themselves counted.
template <int W, Query Asked, class Filter, int Levels = 1>
class RayQueue {
  public:
    static constexpr int Slots = 16;

    RayQueue(const Page& page, std::span<const Ray> rays, Filter& filter)
        : m_root(page), m_rays(rays), m_filter(filter) {}
    // `times` of the shutter, by ray: none = all begin with it; `levels` of detail that rays see: none = all
    // see all. `intervals`: of time, each of which has a page, from the root on; 0: that is no page of what
    // changes. `solids`: null = there are none.
    RayQueue(const World& world, uint32_t root, std::span<const Ray> rays, Filter& filter,
             std::span<const float> times = {}, std::span<const float> levels = {}, uint32_t intervals = 0,
             const SolidResolver* solids = nullptr)
        : m_root(world.page(root)), m_intervals(intervals), m_pages(world.pages()), m_runs(world.runs()),
          m_rays(rays), m_times(times), m_levels(levels), m_solids(solids), m_filter(filter) {}

    // done(ray, hit, path) is called once for each, in the order in which they end. Of Query::Any the hit is
    // any. What runs side by side goes together, where no instances are, and no more than one interval of
    // time.
    template <class Done>
    void run(Done&& done) {
        if ((Levels > 1 && m_intervals != 1) || m_root.header().root == NoRef)
            return run_alone(done);
        RayGroups& groups = RayGroups::of_thread();
        groups.sort(m_rays, m_root.bounds().hi - m_root.bounds().lo);
        m_alone = groups.alone();
        trace_alone(done);
        if (!groups.packets().empty())
            PacketQueue<W, Asked, Filter, std::conditional_t<(Levels > 1), ChangingNode, Node>>(
                m_root, m_rays, m_filter, m_times)
                .run(groups.packets(), done);
    }
    // The same hits, each ray by itself.
    template <class Done>
    void run_alone(Done&& done) {
        m_alone = RayGroups::of_thread().all(m_rays.size());
        trace_alone(done);
    }

  private:
    using Slot = hierarchy::Slot<Levels>;
    using Waiting = hierarchy::Waiting<Levels, Slots>;

    template <class Done>
    void trace_alone(Done& done) {
        Waiting lists[2];
        Waiting *now = lists, *then = lists + 1;
        m_next = 0;
        Slot* const slots = slots_of_thread();
        for (int i = 0; i < Slots && start(slots[i], done); i++)
            wait(*now, slots[i]);
        while (now->any()) {
            then->clear();
            meet_nodes<Node, 1>(now->of(Waiting::Node), *then);
            for (Slot* s : now->of(Waiting::Leaf)) {
                meet_leaf(*s, s->stack.pop());
                wait(*then, *s);
            }
            if constexpr (Levels > 1) {
                meet_nodes<ChangingNode, 2>(now->of(Waiting::ChangingNode), *then);
                meet_nodes<ChangingNode, 1>(now->of(Waiting::MovingNode), *then);
                for (Slot* s : now->of(Waiting::Instance))
                    meet_instance(*s, *then);
                for (Slot* s : now->of(Waiting::InstanceFetched)) {
                    enter_instance(*s, s->stack.pop());
                    wait(*then, *s);
                }
                for (Slot* s : now->of(Waiting::Moving))
                    meet_moving(*s, *then);
                for (Slot* s : now->of(Waiting::MovingFetched)) {
                    enter_moving(*s, s->stack.pop());
                    wait(*then, *s);
                }
                if (const std::span<Slot* const> at_solids = now->of(Waiting::Solids); !at_solids.empty())
                    meet_solids(at_solids, *then);
            }
            for (Slot* s : now->of(Waiting::End)) {
                s->stack.pop();
                if (!s->leave()) {
                    done(s->number, s->hit, s->path_of_hit());
                    if (!start(*s, done))
                        continue;
                }
                wait(*then, *s);
            }
            std::swap(now, then);
        }
    }

    // In three loops. A ray at a node waits for the result of each operation before the next, a hundred
    // cycles in all, and what others do meanwhile is as much as the processor looks ahead: of short steps
    // more rays.
    // Ends: 2 where leaves are as an interval begins and as it ends.
    template <class NodeKind, uint32_t Ends>
    void meet_nodes(std::span<Slot* const> slots, Waiting& then) {
        const NodeKind* node[Slots];
        PlanesAlong<NodeKind> planes[Slots];
        Entered entered[Slots];
        for (size_t k = 0; k < slots.size(); k++) {
            const Frame& in = *slots[k]->in;
            node[k] = &in.page.template at<NodeKind>(slots[k]->stack.pop());
            planes[k].set(*node[k], in.traced, in.fraction);
        }
        for (size_t k = 0; k < slots.size(); k++)
            entered[k] = planes[k].enter(*node[k], slots[k]->in->traced);
        for (size_t k = 0; k < slots.size(); k++) {
            const Entered sorted = entered[k].sorted();
            slots[k]->stack.push(sorted, refs_of(sorted, Ends));
            wait(then, *slots[k]);
        }
    }

    // Queries follow each other by the thousand: their memory is made once.
    static Slot* slots_of_thread() {
        static thread_local const std::unique_ptr<Slot[]> slots(new Slot[Slots]);
        return slots.get();
    }

    // Gives a slot its next ray; false = there is none.
    template <class Done>
    bool start(Slot& s, Done& done) {
        while (m_next < m_alone.size()) {
            const uint32_t number = m_alone[m_next++];
            const float time = m_times.empty() ? 0 : shutter_time(m_times[number]);
            s.start(m_root, m_rays[number], number, time);
            if (Levels > 1 && m_intervals > 0) {
                const Interval interval(time, m_intervals);
                s.change(m_pages[m_root.number() + interval.number], interval.fraction);
            }
            const Ref root = s.in->page.header().root;
            if (s.in->traced.traceable && root != NoRef) {
                s.stack.start(root);
                return true;
            }
            done(number, s.hit, s.path_of_hit());
        }
        return false;
    }
    void wait(Waiting& waiting, Slot& s) {
        const Ref ref = s.stack.top();
        const char* const at = reinterpret_cast<const char*>(s.in->page.bytes() + byte_of(ref));
        _mm_prefetch(at, _MM_HINT_T0);
        _mm_prefetch(at + 64 * is_leaf(ref), _MM_HINT_T0); // a leaf has two lines
        if (s.is_in_changing())                            // or four
            _mm_prefetch(at + 128, _MM_HINT_T0), _mm_prefetch(at + 192, _MM_HINT_T0);
        waiting.add(s, kind_of(ref));
    }

    // What stands at a place. Its matrix is fetched before: other rays go on meanwhile.
    void meet_instance(Slot& s, Waiting& then) {
        const InstanceLeaf& place = s.in->page.template at<InstanceLeaf>(s.stack.top());
        if (sees(s, place))
            return reach_instance(s, place, then);
        s.stack.pop();
        wait(then, s);
    }
    void reach_instance(Slot& s, const InstanceLeaf& place, Waiting& then) {
        const Placements& run = m_runs[place.run];
        if (!run.stays()) {
            run.world_from_page.prefetch_matrix(place.matrix);
            return then.add(s, Waiting::InstanceFetched);
        }
        if (run.bounds_solids)
            return then.add(s, Waiting::Solids);
        s.stack.pop();
        s.enter(place.number, m_pages[run.page]);
        wait(then, s);
    }
    void enter_instance(Slot& s, Ref leaf) {
        const InstanceLeaf& place =
            s.in->page.template at<InstanceLeaf>(leaf); // a moving leaf begins with one
        const Placements& run = m_runs[place.run];
        const PageFromWorld inward(run.world_from_page, place.matrix);
        // World::add() has seen to it that the page is not empty, and not too deep.
        s.enter(place.number, inward.inner(s.in->ray, s.in->traced.t_max), m_pages[run.page]);
    }
    bool sees(const Slot& s, const InstanceLeaf& place) const {
        return m_levels.empty() || place.seen.holds(m_levels[s.number]);
    }
    // What moves or changes at a place, or has neighbours that do.
    void meet_moving(Slot& s, Waiting& then) {
        const MovingLeaf& moving = s.in->page.template at<MovingLeaf>(s.stack.top());
        if (sees(s, moving.place)) {
            if (moving.stands_still())
                return reach_instance(s, moving.place, then);
            if (moving.is_met_by(s.in->traced, s.time)) {
                if (!moving.changes()) {
                    moving.fetch_path();
                    return then.add(s, Waiting::MovingFetched);
                }
                s.stack.pop();
                enter_interval(s, moving);
                return wait(then, s);
            }
        }
        s.stack.pop();
        wait(then, s);
    }
    void enter_moving(Slot& s, Ref leaf) {
        const MovingLeaf& moving = s.in->page.template at<MovingLeaf>(leaf);
        if (const PageFromWorld inward = moving.page_from_world(s.time); inward.is_held())
            s.enter(moving.place.number, inward.inner(s.in->ray, s.in->traced.t_max),
                    m_pages[m_runs[moving.place.run].page]);
    }
    void enter_interval(Slot& s, const MovingLeaf& changing) {
        const Interval interval(s.time, changing.times - 1);
        const Page& page = m_pages[m_runs[changing.place.run].page + interval.number];
        if (page.header().root != NoRef) // else all of it is nowhere meanwhile
            s.enter(changing.place.number, page, interval.fraction);
    }

    // Whoever resolves them has a queue of its own, of as many rays as wait here at the most.
    void meet_solids(std::span<Slot* const> slots, Waiting& then) {
        const InstanceLeaf* place[Slots];
        SolidQuery queries[Slots];
        InstanceHit hits[Slots];
        for (size_t k = 0; k < slots.size(); k++) {
            Slot& s = *slots[k];
            // A moving leaf begins with one of what stands still.
            place[k] = &s.in->page.template at<InstanceLeaf>(s.stack.pop());
            queries[k] = {s.number, m_runs[place[k]->run].page, s.in->ray, s.time};
            queries[k].here.t_max = s.in->traced.t_max;
        }
        if (m_solids)
            m_solids->resolve({queries, slots.size()}, {hits, slots.size()});
        for (size_t k = 0; k < slots.size(); k++) {
            if (hits[k].hit.found())
                take_solid(*slots[k], place[k]->number, hits[k]);
            wait(then, *slots[k]);
        }
    }
    void take_solid(Slot& s, uint32_t place, const InstanceHit& found) {
        InstancePath path = s.at;
        path.instance[path.depth++] = place;
        for (uint32_t i = 0; i < found.path.depth; i++)
            path.instance[path.depth++] = found.path.instance[i];
        const Hit& hit = found.hit;
        if (hit.t == s.hit.t && s.hit.found() &&
            std::tie(s.of_hit, s.hit.leaf, s.hit.primitive) < std::tie(path, hit.leaf, hit.primitive))
            return;
        s.hit = hit, s.of_hit = path;
        s.in->traced.t_max = hit.t;
        if (Asked == Query::Any)
            s.end();
        else
            s.stack.keep_before(hit.t);
    }

    void meet_leaf(Slot& s, Ref leaf) {
        bool closer = false;
        Frame& here = *s.in;
        // By this name: where leaves' functions stay calls, GCC 12 takes a write by way of the slot for none
        // to the ray that they are given, and they go on with an old t_max (-fno-ipa-modref and
        // -fno-strict-aliasing are right).
        TracedRay& ray = here.traced;
        const auto found = [&](uint32_t primitive, float t, float u, float v) {
            const Hit candidate{t, u, v, leaf, primitive};
            // Of hits at one distance that of the lowest number counts, whatever the order of their lanes.
            if (t == s.hit.t && s.hit.found() &&
                std::tie(s.path_of_hit(), s.hit.leaf, s.hit.primitive) < std::tie(s.path(), leaf, primitive))
                return false;
            if (Filter::Filters && !m_filter.accepts(Candidate{s.number, here.page, here.ray, candidate,
                                                               s.path(), here.fraction}))
                return false;
            s.hit = candidate;
            if constexpr (Levels > 1)
                s.of_hit = s.at;
            ray.t_max = t;
            closer = true;
            return Asked == Query::Any;
        };
        if (s.is_in_changing())
            read_changing_leaf<W, false>(
                here.page, leaf, [&](const auto& at) { trace_leaf<W>(at(here.fraction), ray, found); });
        else
            read_leaf<W, false>(here.page, leaf,
                                [&](const auto& content) { trace_leaf<W>(content, ray, found); });
        if (!closer)
            return;
        if (Asked == Query::Any)
            s.end();
        else
            s.stack.keep_before(s.hit.t);
    }

    const Page m_root;
    const uint32_t m_intervals = 0;
    std::span<const Page> m_pages;
    std::span<const Placements> m_runs;
    std::span<const Ray> m_rays;
    std::span<const float> m_times, m_levels;
    const SolidResolver* m_solids = nullptr;
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
    RayQueue<W, Query::Closest, Filter, MostNesting + 1>(world, root, rays, filter, times)
        .run([&](size_t i, const Hit& h, const InstancePath& path) { hits[i] = {h, path}; });
}
template <int W, class Filter>
void find_any(const World& world, uint32_t root, std::span<const Ray> rays, std::span<uint8_t> hidden,
              Filter& filter, std::span<const float> times = {}) {
    RayQueue<W, Query::Any, Filter, MostNesting + 1>(world, root, rays, filter, times)
        .run([&](size_t i, const Hit& h, const InstancePath&) { hidden[i] = h.found(); });
}

} // namespace kanuka::hierarchy
