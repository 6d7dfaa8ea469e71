// Scenes of a few triangles, such as a room: rays in lanes test all of them (hierarchy/triangle_list.h). What
// is told of hits is read from a table, for all lanes at once.
#pragma once

#include "bvh/bvh.h"
#include "hierarchy/triangle_list.h"

namespace kanuka::bvh {

class FewTriangles {
  public:
    // Null where the scene has more than `most`, or anything else. Vertices are those of the store.
    static std::unique_ptr<FewTriangles> of(const store::Store& store, std::span<const GroupDesc> groups,
                                            uint64_t most);

    Bounds3f bounds() const;
    uint64_t bytes() const;
    // As of PageScene.
    template <int W>
    void intersect(std::span<const RayPacket<W>> rays, std::span<HitPacket<W>> hits) const;
    template <int W>
    void find_occluded(std::span<const RayPacket<W>> rays, std::span<Mask<W>> hidden) const;

    struct alignas(16) Row { // of a triangle: what hits on it have to tell
        int32_t shape, prim;
        Vec3f Ng;
        int32_t flips;                    // 1: u and v begin at the corner on the other side of a quad
        float column, row, columns, rows; // where the triangle's cell is in its grid
        int32_t partly;                   // it is there for some rays alone
        int32_t unused;
    };

  private:
    explicit FewTriangles(const store::Store& store) : m_store(store) {}
    void add(int shape);
    template <hierarchy::Query Asked, int W, class RaysOf, class Take>
    void trace(std::span<const RayPacket<W>> packets, const RaysOf& rays_of, const Take& take) const;
    template <int W>
    void put(const hierarchy::ListHits<W>& found, HitPacket<W>& to) const;

    const store::Store& m_store;
    hierarchy::TriangleList m_list;
    std::vector<Row> m_rows;
    bool m_partly = false; // some of them are
};

} // namespace kanuka::bvh
