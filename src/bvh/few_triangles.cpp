#include "bvh/few_triangles.h"

#include "base/rows.h"
#include "bvh/presence.h"

namespace kanuka::bvh {

namespace {

using hierarchy::Query;
using Row = FewTriangles::Row;

// Columns of a table of rows.
enum Column { Shape, Prim, NgX, NgY, NgZ, Flips, CellColumn, CellRow, Columns, Rows, Partly, Words = 12 };
static_assert(sizeof(Row) == Words * sizeof(float));

// Where u or v is in a grid, by the operations of PageScene::place_of(): one cell has it as it is.
template <int W>
Float<W> in_grid(Float<W> x, Mask<W> flips, Float<W> cell, Float<W> cells) {
    return (cell + select(flips, Float<W>(1.0f) - x, x)) / cells;
}

template <int W>
hierarchy::RayLanes<W> lanes_of(const RayPacket<W>& rays, Float<W> t_max, Mask<W> active) {
    return {rays.o, rays.d, rays.t_min, select(active & (t_max > Float<W>(0.0f)), t_max, Float<W>(-1.0f))};
}

// Which lanes the surface is there for.
template <int W>
class Presence {
  public:
    Presence(const store::Store& store, std::span<const Row> rows, const RayPacket<W>& rays)
        : m_store(store), m_rows(rows), m_rays(rays) {}

    uint32_t operator()(uint32_t lanes, size_t triangle, const hierarchy::Depths<W>& depths) const {
        const Row& row = m_rows[triangle];
        if (!row.partly)
            return lanes;
        uint32_t there = 0;
        const Mask<W> flips(row.flips != 0);
        const Float<W> u = in_grid<W>(depths.u, flips, row.column, row.columns),
                       v = in_grid<W>(depths.v, flips, row.row, row.rows);
        for (; lanes != 0; lanes &= lanes - 1) {
            const int i = __builtin_ctz(lanes);
            const Vec3f d(m_rays.d.x[i], m_rays.d.y[i], m_rays.d.z[i]);
            const Beholder beholder{m_rays.seed[i], m_rays.passes[i], m_rays.camera[i], m_rays.level[i],
                                    m_rays.passages ? m_rays.passages + i : nullptr};
            if (!is_back(m_store, row.shape, row.Ng, d) &&
                is_present(m_store, row.shape, row.prim, u[i], v[i], depths.t[i], beholder))
                there |= 1u << i;
        }
        return there;
    }

  private:
    const store::Store& m_store;
    std::span<const Row> m_rows;
    const RayPacket<W>& m_rays;
};

} // namespace

FewTriangles::FewTriangles(const store::Store& store, hierarchy::TriangleList list, std::vector<Row> rows)
    : m_store(store), m_list(std::move(list)), m_rows(std::move(rows)),
      m_partly(std::ranges::any_of(m_rows, [](const Row& row) { return row.partly != 0; })) {}

template <Query Asked, int W>
hierarchy::ListHits<W> FewTriangles::trace(const RayPacket<W>& packet,
                                           const hierarchy::RayLanes<W>& rays) const {
    if (!m_partly) {
        hierarchy::AcceptsAll all;
        return hierarchy::ListTracer<W, Asked, hierarchy::AcceptsAll>(m_list, rays, all).run();
    }
    Presence<W> presence(m_store, m_rows, packet);
    return hierarchy::ListTracer<W, Asked, Presence<W>>(m_list, rays, presence).run();
}

template <int W>
void FewTriangles::intersect(std::span<const RayPacket<W>> rays, std::span<HitPacket<W>> hits) const {
    for (size_t i = 0; i < rays.size(); i++) {
        HitPacket<W>& to = hits[i];
        const Float<W> t_max = select(to.hit, to.t, rays[i].t_max);
        const hierarchy::ListHits<W> found =
            trace<Query::Closest>(rays[i], lanes_of<W>(rays[i], t_max, rays[i].active));
        const Mask<W> hit = found.triangle >= Int<W>(0);
        if (none(hit))
            continue;
        const kanuka::Row<W, Words> row =
            load_rows<Words, W>(m_rows.data(), select(hit, found.triangle, Int<W>(0)) * Int<W>(Words));
        const auto number = [&](Column c) { return bitcast_int(row[c]); };
        const Mask<W> flips = number(Flips) != Int<W>(0);
        to.hit |= hit;
        to.t = select(hit, found.t, to.t);
        to.u = select(hit, in_grid(found.u, flips, row[CellColumn], row[Columns]), to.u);
        to.v = select(hit, in_grid(found.v, flips, row[CellRow], row[Rows]), to.v);
        to.Ng = select(hit, Vec3<Float<W>>{row[NgX], row[NgY], row[NgZ]}, to.Ng);
        to.shape = select(hit, number(Shape), to.shape);
        to.prim = select(hit, number(Prim), to.prim);
        const Int<W> zero(0);
        to.instanced = select(hit, zero, to.instanced);
        to.variation = select(hit, zero, to.variation);
        to.slot_shift = select(hit, zero, to.slot_shift);
        to.magnitude = select(hit, Float<W>(0.0f), to.magnitude);
    }
}

template <int W>
void FewTriangles::find_occluded(std::span<const RayPacket<W>> rays, std::span<Mask<W>> hidden) const {
    for (size_t i = 0; i < rays.size(); i++) {
        const Mask<W> active = rays[i].active & !hidden[i];
        hidden[i] |=
            trace<Query::Any>(rays[i], lanes_of<W>(rays[i], rays[i].t_max, active)).triangle >= Int<W>(0);
    }
}

template void FewTriangles::intersect<1>(std::span<const RayPacket<1>>, std::span<HitPacket<1>>) const;
template void FewTriangles::intersect<8>(std::span<const RayPacket<8>>, std::span<HitPacket<8>>) const;
template void FewTriangles::intersect<16>(std::span<const RayPacket<16>>, std::span<HitPacket<16>>) const;
template void FewTriangles::find_occluded<1>(std::span<const RayPacket<1>>, std::span<Mask<1>>) const;
template void FewTriangles::find_occluded<8>(std::span<const RayPacket<8>>, std::span<Mask<8>>) const;
template void FewTriangles::find_occluded<16>(std::span<const RayPacket<16>>, std::span<Mask<16>>) const;

} // namespace kanuka::bvh
