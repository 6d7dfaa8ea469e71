// Rays through pages: all of a call in one queue, whatever packets they come in.
#include <algorithm>
#include <limits>

#include "base/paged_memory.h"
#include "bvh/fibre_joints.h"
#include "bvh/matrix.h"
#include "bvh/page_hits.h"
#include "bvh/page_solids.h"
#include "hierarchy/decode.h"
#include "hierarchy/queue.h"

namespace kanuka::bvh {

namespace {

// Of the rays of a call; kept by each thread.
struct Rays {
    std::vector<hierarchy::Ray> rays;
    std::vector<uint32_t> lanes; // packet * W + lane
    std::vector<float> times;    // where something moves
    std::vector<float> levels;   // where some do not see something
    std::vector<Beholder> beholders;

    static Rays& of_thread() {
        static thread_local Rays rays;
        rays.rays.clear(), rays.lanes.clear(), rays.times.clear(), rays.levels.clear(),
            rays.beholders.clear();
        return rays;
    }
};

// Batches have rows of sixteen pixels: of those, rays four by four run side by side better than sixteen by
// one.
constexpr uint32_t Row = 16, Tile = 4;
uint32_t by_tiles(uint32_t n) {
    const uint32_t x = n / (Tile * Tile) % (Row / Tile) * Tile + n % Tile,
                   y = n / (Row * Tile) * Tile + n / Tile % Tile;
    return y * Row + x;
}

// `left(packet, lane)`: up to where the lane's ray goes; 0 or less = it does not.
template <int W, class Left>
void add_rays(Rays& to, std::span<const RayPacket<W>> packets, const hierarchy::World& world, bool moves,
              bool beholders, const Left& left) {
    const uint32_t count = uint32_t(packets.size()) * W, in_tiles = count / (Row * Tile) * (Row * Tile);
    for (uint32_t n = 0; n < count; n++) {
        const uint32_t lane = n < in_tiles ? by_tiles(n) : n;
        const int i = int(lane % W);
        const RayPacket<W>& r = packets[lane / W];
        const float t_max = r.active[i] ? left(lane / W, i) : 0;
        if (t_max <= 0)
            continue;
        to.rays.push_back(
            {{r.o.x[i], r.o.y[i], r.o.z[i]}, r.t_min[i], {r.d.x[i], r.d.y[i], r.d.z[i]}, t_max});
        to.lanes.push_back(lane);
        if (moves)
            to.times.push_back(r.time[i]);
        if (world.fades())
            to.levels.push_back(r.level[i]);
        if (beholders)
            to.beholders.push_back(
                {r.seed[i], r.passes[i], r.camera[i], r.level[i], r.passages ? r.passages + i : nullptr});
    }
}

// Whoever takes the hits: one kind for all numbers of lanes, so that the traversal is compiled once.
class Sink {
  public:
    virtual void take(size_t ray, const hierarchy::Hit& hit, const hierarchy::InstancePath& path) = 0;

  protected:
    ~Sink() = default;
};

struct Root { // what rays go through
    const hierarchy::World& world;
    uint32_t page, intervals; // as of RayQueue
    const hierarchy::SolidResolver* solids;
};

template <hierarchy::Query Asked, class Filter>
void trace_by(const Root& root, const Rays& rays, Filter& filter, Sink& sink) {
    const auto done = [&](size_t i, const hierarchy::Hit& hit, const hierarchy::InstancePath& path) {
        sink.take(i, hit, path);
    };
    using hierarchy::RayQueue;
    const auto& [world, page, intervals, solids] = root;
    if (world.nesting(page) == 0 && intervals == 0)
        RayQueue<8, Asked, Filter>(world.page(page), rays.rays, filter).run(done);
    else
        RayQueue<8, Asked, Filter, hierarchy::MostNesting + 1>(world, page, rays.rays, filter, rays.times,
                                                               rays.levels, intervals, solids)
            .run(done);
}

// `presence`: null = everything is there.
template <hierarchy::Query Asked, class Presence>
void trace(const Root& root, const Rays& rays, Presence* presence, Sink& sink) {
    hierarchy::EverythingIsThere everything;
    if (presence)
        trace_by<Asked>(root, rays, *presence, sink);
    else
        trace_by<Asked>(root, rays, everything, sink);
}

} // namespace

class PageScene::Presence {
  public:
    static constexpr bool Filters = true;
    Presence(const PageScene& scene, const Rays& rays) : m_scene(scene), m_rays(rays) {}

    bool accepts(const hierarchy::Candidate& c) const {
        const Place place = m_scene.place_of(c.page, c.hit);
        if (!place.partly)
            return true;
        const store::Store& store = m_scene.m_store;
        const Vec3f Ng = hierarchy::normal_of(c.page, c.here, c.hit, c.fraction);
        return !is_back(store, place.shape, Ng, c.here.d) && !is_in_next_segment(place, c) &&
               is_present(store, place.shape, place.prim, place.u, place.v, c.hit.t, m_rays.beholders[c.ray]);
    }

  private:
    // Of a fibre: does it lie inside, where another segment goes on?
    bool is_in_next_segment(const Place& place, const hierarchy::Candidate& c) const {
        return hierarchy::is_of_fibres(hierarchy::kind_of(c.hit.leaf)) &&
               is_inside_fibre(m_scene.m_store, place.shape, place.prim,
                               {m_scene.interval_of(c.page), c.fraction}, c.here.o, c.here.d, c.hit.t);
    }

    const PageScene& m_scene;
    const Rays& m_rays;
};

uint32_t PageScene::interval_of(const hierarchy::Page& page) const {
    const Owner& owner = m_owner_of_page[page.number()];
    return page.number() - m_groups[size_t(owner.group)].owns[size_t(owner.own)].page;
}

Matrix PageScene::Run::place(uint32_t number, float time) const {
    if (paths.empty())
        return places[number];
    Matrix m;
    paths[number].at(double(hierarchy::shutter_time(time)), m.data());
    return m;
}

template <class Step>
PageScene::Owner PageScene::follow(const hierarchy::InstancePath& path, const Step& step) const {
    int at = int(m_groups.size()) - 1;
    for (uint32_t k = 0; k < path.depth; k++) {
        const Group& group = m_groups[size_t(at)];
        const uint32_t number = path.instance[k];
        if (number < group.owns.size())
            return {at, int(number)}; // a page of the group's own, which lies in it as it is
        if (group.surfaces >= 0 && number == group.owns.size()) {
            at = group.surfaces; // likewise
            continue;
        }
        const Run& run = *(std::upper_bound(group.runs.begin(), group.runs.end(), number,
                                            [](uint32_t n, const Run& r) { return n < r.first; }) -
                           1);
        step(run, number - run.first);
        at = run.group;
    }
    return {at, 0};
}

template <int W>
void PageScene::put(const RayPacket<W>& rays, int lane, const hierarchy::Hit& hit,
                    const hierarchy::InstancePath& path, HitPacket<W>& hits) const {
    Matrix world_from_here = Identity;
    Vec3f at(rays.o.x[lane] + hit.t * rays.d.x[lane], rays.o.y[lane] + hit.t * rays.d.y[lane],
             rays.o.z[lane] + hit.t * rays.d.z[lane]),
        rounding(0.0f);
    int slot = 0, instanced = 0, variation = 0;
    const Owner owner = follow(path, [&](const Run& run, uint32_t number) {
        const Matrix up = run.place(number, rays.time[lane]);
        Matrix down{};
        invert(up.data(), down.data());
        const Matrix world_from_parent = world_from_here;
        world_from_here = concat(world_from_parent, up.data());
        const Vec3f parent = at;
        at = apply(down.data(), parent, 1);
        rounding += rounding_of(up.data(), down.data(), world_from_parent, world_from_here, parent, at);
        slot = slot < 0 || run.first_slot < 0
                   ? GroupDesc::Unnumbered
                   : slot + run.first_slot + int(number) * m_groups[size_t(run.group)].slots;
        if (!run.variations.empty() && run.variations[number] != 0)
            variation = run.variations[number];
        instanced = 1;
    });
    const Group& group = m_groups[size_t(owner.group)];
    const Own& own = group.owns[size_t(owner.own)];
    const hierarchy::Interval interval(rays.time[lane], std::max(own.intervals, 1u));
    const hierarchy::Page& page = m_world.page(own.page + interval.number);
    const Place place = place_of(page, hit);
    hierarchy::Ray here{{rays.o.x[lane], rays.o.y[lane], rays.o.z[lane]},
                        0,
                        {rays.d.x[lane], rays.d.y[lane], rays.d.z[lane]},
                        0};
    if (instanced &&
        hierarchy::is_of_fibres(hierarchy::kind_of(hit.leaf))) { // whose normals depend on the ray
        Matrix down{};
        invert(world_from_here.data(), down.data());
        here.o = apply(down.data(), here.o, 1), here.d = apply(down.data(), here.d, 0);
    }
    const Vec3f Ng = hierarchy::normal_of(page, here, hit, interval.fraction);
    hits.hit.v[lane] = -1;
    hits.t.v[lane] = hit.t, hits.u.v[lane] = place.u, hits.v.v[lane] = place.v;
    hits.Ng.x.v[lane] = Ng.x, hits.Ng.y.v[lane] = Ng.y, hits.Ng.z.v[lane] = Ng.z;
    hits.shape.v[lane] = place.shape, hits.prim.v[lane] = place.prim;
    hits.instanced.v[lane] = instanced;
    hits.variation.v[lane] = variation;
    hits.magnitude.v[lane] = 0, hits.slot_shift.v[lane] = 0;
    if (!instanced)
        return;
    for (size_t k = 0; k < 12; k++)
        hits.world_from_shape[k][lane] = world_from_here[k];
    hits.magnitude.v[lane] = std::max({rounding.x, rounding.y, rounding.z});
    hits.slot_shift.v[lane] = slot < 0 || group.first_emitter < 0 ? std::numeric_limits<int32_t>::min()
                                                                  : slot - group.first_emitter;
}

template <int W>
void PageScene::intersect(std::span<const RayPacket<W>> packets, std::span<HitPacket<W>> hits) const {
    if (empty())
        return;
    Rays& rays = Rays::of_thread();
    add_rays(rays, packets, m_world, m_world.moves() || root_intervals() > 0, m_partly,
             [&](size_t packet, int lane) {
                 return hits[packet].hit[lane] ? hits[packet].t[lane] : packets[packet].t_max[lane];
             });
    class Hits final : public Sink {
      public:
        Hits(const PageScene& scene, const Rays& rays, std::span<const RayPacket<W>> packets,
             std::span<HitPacket<W>> hits)
            : m_scene(scene), m_rays(rays), m_packets(packets), m_hits(hits) {}
        void take(size_t ray, const hierarchy::Hit& hit, const hierarchy::InstancePath& path) override {
            if (!hit.found())
                return;
            const uint32_t at = m_rays.lanes[ray];
            m_scene.put(m_packets[at / W], int(at % W), hit, path, m_hits[at / W]);
        }

      private:
        const PageScene& m_scene;
        const Rays& m_rays;
        std::span<const RayPacket<W>> m_packets;
        std::span<HitPacket<W>> m_hits;
    } sink(*this, rays, packets, hits);
    Presence presence(*this, rays);
    const Solids solids(*this, rays.levels, rays.beholders);
    trace<hierarchy::Query::Closest>({m_world, m_root, root_intervals(), &solids}, rays,
                                     m_partly ? &presence : nullptr, sink);
    paged_memory::keep_within_bound();
}

template <int W>
void PageScene::find_occluded(std::span<const RayPacket<W>> packets, std::span<Mask<W>> hidden) const {
    if (empty())
        return;
    Rays& rays = Rays::of_thread();
    add_rays(
        rays, packets, m_world, m_world.moves() || root_intervals() > 0, m_partly,
        [&](size_t packet, int lane) { return hidden[packet][lane] ? 0.0f : packets[packet].t_max[lane]; });
    class Hidden final : public Sink {
      public:
        Hidden(const Rays& rays, std::span<Mask<W>> hidden) : m_rays(rays), m_hidden(hidden) {}
        void take(size_t ray, const hierarchy::Hit& hit, const hierarchy::InstancePath&) override {
            if (hit.found())
                m_hidden[m_rays.lanes[ray] / W].v[m_rays.lanes[ray] % W] = -1;
        }

      private:
        const Rays& m_rays;
        std::span<Mask<W>> m_hidden;
    } sink(rays, hidden);
    Presence presence(*this, rays);
    const Solids solids(*this, rays.levels, rays.beholders);
    trace<hierarchy::Query::Any>({m_world, m_root, root_intervals(), &solids}, rays,
                                 m_partly ? &presence : nullptr, sink);
    paged_memory::keep_within_bound();
}

template void PageScene::intersect<1>(std::span<const RayPacket<1>>, std::span<HitPacket<1>>) const;
template void PageScene::intersect<8>(std::span<const RayPacket<8>>, std::span<HitPacket<8>>) const;
template void PageScene::intersect<16>(std::span<const RayPacket<16>>, std::span<HitPacket<16>>) const;
template void PageScene::find_occluded<1>(std::span<const RayPacket<1>>, std::span<Mask<1>>) const;
template void PageScene::find_occluded<8>(std::span<const RayPacket<8>>, std::span<Mask<8>>) const;
template void PageScene::find_occluded<16>(std::span<const RayPacket<16>>, std::span<Mask<16>>) const;

} // namespace kanuka::bvh
