// Scenes of a few triangles, such as a room: rays in lanes test all of them (hierarchy/triangle_list.h), and
// what is told of hits is read from a table, for all lanes at once.
#pragma once

#include "bvh/bvh.h"
#include "hierarchy/triangle_list.h"

namespace kanuka::bvh {

class FewTriangles {
  public:
    struct alignas(16) Row { // of a triangle: what hits on it have to tell
        int32_t shape, prim;
        Vec3f Ng;
        int32_t flips;                    // 1: u and v are those from the other corner of a quad
        float column, row, columns, rows; // where the triangle's cell is in its grid
        int32_t partly;                   // it is there for some rays alone
        int32_t unused;
    };
    // `rows`: one for each triangle.
    FewTriangles(const store::Store& store, hierarchy::TriangleList list, std::vector<Row> rows);

    // As of PageScene.
    template <int W>
    void intersect(std::span<const RayPacket<W>> rays, std::span<HitPacket<W>> hits) const;
    template <int W>
    void find_occluded(std::span<const RayPacket<W>> rays, std::span<Mask<W>> hidden) const;

  private:
    template <hierarchy::Query Asked, int W>
    hierarchy::ListHits<W> trace(const RayPacket<W>& packet, const hierarchy::RayLanes<W>& rays) const;

    const store::Store& m_store;
    hierarchy::TriangleList m_list;
    std::vector<Row> m_rows;
    bool m_partly; // some of them are
};

} // namespace kanuka::bvh
