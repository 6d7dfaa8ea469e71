// Rays through surfaces of solids that lie in pages: all that a ray crosses is noted, and put in order
// (solids.h).
#pragma once

#include "bvh/page_scene.h"
#include "hierarchy/solid_query.h"

namespace kanuka::bvh {

class PageScene::Solids final : public hierarchy::SolidResolver {
  public:
    // `levels`, `beholders`: by ray; none = as of RayQueue, and where all is there for all.
    Solids(const PageScene& scene, std::span<const float> levels, std::span<const Beholder> beholders)
        : m_scene(scene), m_levels(levels), m_beholders(beholders) {}

    void resolve(std::span<const hierarchy::SolidQuery> queries,
                 std::span<hierarchy::InstanceHit> hits) const override;

  private:
    class Rays;
    void gather(uint32_t page, Rays& rays) const;
    void find(const hierarchy::SolidQuery& query, const Crossed& crossed, hierarchy::InstanceHit& hit) const;

    const PageScene& m_scene;
    std::span<const float> m_levels;
    std::span<const Beholder> m_beholders;
};

} // namespace kanuka::bvh
