// What transport knows of a tracer: closest hits and occlusion, for packets of any number of lanes.
#pragma once

#include "bvh/bvh.h"

namespace kanuka::transport {

class RayQuery {
  public:
    RayQuery() = default;
    explicit RayQuery(const bvh::Scene* scene) : m_scene(scene) {}

    // Thread safety: any thread may call.
    template <int W>
    void intersect(const bvh::RayPacket<W>& rays, bvh::HitPacket<W>& hits) const {
        m_scene->intersect(rays, hits);
    }
    // Many packets at once.
    template <int W>
    void intersect(std::span<const bvh::RayPacket<W>> rays, std::span<bvh::HitPacket<W>> hits) const {
        m_scene->intersect<W>(rays, hits);
    }
    template <int W>
    void find_occluded(std::span<const bvh::RayPacket<W>> rays, std::span<Mask<W>> hidden) const {
        m_scene->find_occluded<W>(rays, hidden);
    }
    template <int W>
    Mask<W> occluded(const bvh::RayPacket<W>& rays) const {
        return m_scene->occluded(rays);
    }

  private:
    const bvh::Scene* m_scene = nullptr;
};

} // namespace kanuka::transport
