#include "bvh/page_solids.h"

#include <algorithm>
#include <vector>

#include "bvh/page_hits.h"
#include "hierarchy/queue.h"

namespace kanuka::bvh {

// What a ray has crossed; Crossing::place is the number of the hit.
class PageScene::Crossed {
  public:
    std::vector<Crossing> all;
    std::vector<hierarchy::InstanceHit> hits;
    std::vector<uint8_t> partly; // of the hits: there for some rays alone

    void clear() { all.clear(), hits.clear(), partly.clear(); }
    void put_in_order(const SolidTrees& trees, const hierarchy::Ray& ray) {
        std::erase_if(all, [&](const Crossing& c) { return !trees.holds(c.solid); });
        order_crossings(all, {ray.o, ray.d});
    }
};

// Rays of one page's surfaces, from where they start to infinity: that tells where they start. As a filter it
// takes every hit down, and the ray goes on.
class PageScene::Solids::Rays {
  public:
    static constexpr bool Filters = true;

    std::vector<hierarchy::Ray> rays;
    std::vector<float> times, levels;
    std::vector<Crossed> crossed;

    void start(const PageScene& scene) {
        rays.clear(), times.clear(), levels.clear();
        m_scene = &scene, m_count = 0;
    }
    void add(hierarchy::Ray ray, float time, float level) {
        ray.t_max = 1e30f;
        rays.push_back(ray), times.push_back(time), levels.push_back(level);
        if (crossed.size() <= m_count)
            crossed.emplace_back();
        crossed[m_count++].clear();
    }

    bool accepts(const hierarchy::Candidate& c) {
        const Vec3f Ng = hierarchy::normal_of(c.page, c.here, c.hit, c.fraction);
        const float cosine = dot(Ng, c.here.d);
        const Place place = m_scene->place_of(c.page, c.hit);
        const int solid = m_scene->solid_of(c.page, place.shape);
        if (solid < 0 || cosine == 0) // seen from the side, it is passed where its neighbours are
            return false;
        Crossed& to = crossed[c.ray];
        to.all.push_back({c.hit.t, place.u, place.v, Ng, cosine < 0, solid, 0, uint32_t(place.prim),
                          place.shape, int(to.hits.size())});
        to.hits.push_back({c.hit, c.path});
        to.partly.push_back(place.partly);
        return false;
    }

  private:
    const PageScene* m_scene = nullptr;
    size_t m_count = 0;
};

int PageScene::solid_of(const hierarchy::Page& page, int shape) const {
    const std::vector<GroupDesc::Range>& ranges =
        m_groups[size_t(m_owner_of_page[page.number()].group)].ranges;
    const auto after = std::ranges::upper_bound(ranges, shape, {}, &GroupDesc::Range::first);
    return after == ranges.begin() ? -1 : (after - 1)->solid;
}

void PageScene::Solids::gather(uint32_t page, Rays& rays) const {
    const hierarchy::World& world = m_scene.m_world;
    hierarchy::RayQueue<8, hierarchy::Query::Closest, Rays, hierarchy::MostNesting + 1>(
        world, page, rays.rays, rays, rays.times, rays.levels)
        .run_alone([](size_t, const hierarchy::Hit&, const hierarchy::InstancePath&) {});
    const SolidTrees& trees = m_scene.m_solids.at(page);
    for (size_t i = 0; i < rays.rays.size(); i++)
        rays.crossed[i].put_in_order(trees, rays.rays[i]);
}

// Those of one page at once, and again those that start inside of something, or passed a crack: what is
// behind them tells.
void PageScene::Solids::resolve(std::span<const hierarchy::SolidQuery> queries,
                                std::span<hierarchy::InstanceHit> hits) const {
    // Queries follow each other by the thousand: their memory is made once.
    static thread_local Rays ahead, behind;
    static thread_local std::vector<size_t> here, odd; // queries; of those
    for (size_t first = 0; first < queries.size(); first++) {
        const uint32_t page = queries[first].page;
        if (std::ranges::any_of(queries.first(first), [&](const auto& q) { return q.page == page; }))
            continue;
        here.clear(), odd.clear(), ahead.start(m_scene), behind.start(m_scene);
        const auto add = [&](Rays& to, const hierarchy::SolidQuery& query, const hierarchy::Ray& ray) {
            to.add(ray, query.time, m_levels.empty() ? 0.5f : m_levels[query.ray]);
        };
        for (size_t q = first; q < queries.size(); q++)
            if (queries[q].page == page)
                here.push_back(q), add(ahead, queries[q], queries[q].here);
        gather(page, ahead);
        for (size_t i = 0; i < here.size(); i++)
            if (any_odd(ahead.crossed[i].all)) {
                const hierarchy::Ray& ray = queries[here[i]].here;
                odd.push_back(i);
                add(behind, queries[here[i]], {ray.o + ray.d * ray.t_min, 0, -ray.d});
            }
        if (!odd.empty())
            gather(page, behind);
        for (size_t i = 0; i < odd.size(); i++)
            drop_unpaired(ahead.crossed[odd[i]].all, behind.crossed[i].all);
        for (size_t i = 0; i < here.size(); i++)
            find(queries[here[i]], ahead.crossed[i], hits[here[i]]);
    }
}

void PageScene::Solids::find(const hierarchy::SolidQuery& query, const Crossed& crossed,
                             hierarchy::InstanceHit& hit) const {
    const SolidTrees& trees = m_scene.m_solids.at(query.page);
    const hierarchy::Ray& ray = query.here;
    const Crossing* const found = first_boundary(trees, crossed.all, {ray.o, ray.d}, [&](const Crossing& c) {
        return c.t > ray.t_max || // and so are all that come
               !crossed.partly[size_t(c.place)] ||
               is_present(m_scene.m_store, c.shape, int(c.primitive), c.u, c.v, c.t, m_beholders[query.ray]);
    });
    if (found && found->t <= ray.t_max)
        hit = crossed.hits[size_t(found->place)];
}

} // namespace kanuka::bvh
