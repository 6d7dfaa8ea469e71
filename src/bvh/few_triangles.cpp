#include "bvh/few_triangles.h"

#include <cstring>

#include "base/cpu.h"
#include "base/rows.h"
#include "bvh/page_views.h"
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

std::unique_ptr<FewTriangles> FewTriangles::of(const store::Store& store, std::span<const GroupDesc> groups,
                                               uint64_t most) {
    most = std::min<uint64_t>(most, hierarchy::TriangleList::Most);
    if (groups.empty() || !groups.back().instances.empty() || !groups.back().solids.empty())
        return {};
    uint64_t triangles = 0;
    for (const auto& range : groups.back().shapes)
        for (int shape = range.first; shape < range.first + range.count; shape++) {
            const store::ShapeRecord& s = store.shapes()[size_t(shape)];
            if (range.solid >= 0 || is_fibre(s) || s.motion_segments > 0)
                return {};
            triangles +=
                is_mesh(s) ? mesh_view(store, s, 0).triangles() : 2 * uint64_t(s.mu) * uint64_t(s.mv);
            if (triangles > most)
                return {};
        }
    if (triangles == 0)
        return {};
    std::unique_ptr<FewTriangles> few(new FewTriangles(store));
    for (const auto& range : groups.back().shapes)
        for (int shape = range.first; shape < range.first + range.count; shape++)
            few->add(shape);
    return few;
}

// Quads and cells as HitPacket has them: u and v of the second triangle begin at its first corner.
void FewTriangles::add(int shape) {
    const store::ShapeRecord& s = m_store.shapes()[size_t(shape)];
    CellCorners cells;
    const hierarchy::MeshView mesh = is_mesh(s) ? mesh_view(m_store, s, 0) : cells.mesh_view(m_store, s, 0);
    for (size_t i = 0; i < mesh.triangles(); i++) {
        Vec3f corners[3];
        if (!hierarchy::corners_of_triangle(mesh, i, 0, corners))
            continue; // it is nowhere
        const bool is_quad = mesh.sides == 4;
        const int face = int(is_quad ? i / 2 : i);
        Row row{shape,
                face,
                cross(corners[1] - corners[0], corners[2] - corners[0]),
                is_quad && i % 2 == 1,
                0,
                0,
                1,
                1,
                is_partly_there(m_store, s)};
        if (!is_mesh(s)) {
            row.prim = 0;
            const int grid_row = face / s.mu;
            row.column = float(face - grid_row * s.mu), row.row = float(grid_row);
            row.columns = float(s.mu), row.rows = float(s.mv);
        }
        m_partly |= row.partly != 0;
        m_list.add(corners);
        m_rows.push_back(row);
    }
}

Bounds3f FewTriangles::bounds() const {
    Bounds3f all;
    for (const hierarchy::TriangleList::Vertex& v : m_list.vertices())
        all.extend(Vec3f(v.at[0], v.at[1], v.at[2]));
    return all;
}

uint64_t FewTriangles::bytes() const {
    return m_list.vertices().size_bytes() + m_list.triangles().size_bytes() + m_rows.size() * sizeof(Row);
}

namespace {

// Two packets as one, and back.
Float<16> joined(Float<8> a, Float<8> b) {
    return Float<16>(__builtin_shufflevector(a.v, b.v, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15));
}
hierarchy::RayLanes<16> joined(const hierarchy::RayLanes<8>& a, const hierarchy::RayLanes<8>& b) {
    hierarchy::RayLanes<16> both;
    for (int c = 0; c < 3; c++)
        both.o[c] = joined(a.o[c], b.o[c]), both.d[c] = joined(a.d[c], b.d[c]);
    both.t_min = joined(a.t_min, b.t_min), both.t_max = joined(a.t_max, b.t_max);
    return both;
}
template <class V8, class V16>
V8 half(const V16& both, size_t which) {
    V8 of;
    std::memcpy(&of.v, reinterpret_cast<const char*>(&both.v) + which * sizeof of.v, sizeof of.v);
    return of;
}
hierarchy::ListHits<8> half(const hierarchy::ListHits<16>& both, size_t which) {
    return {half<Float<8>>(both.t, which), half<Float<8>>(both.u, which), half<Float<8>>(both.v, which),
            half<Int<8>>(both.triangle, which)};
}

} // namespace

// rays_of(i): of a packet; take(i, hits).
template <Query Asked, int W, class RaysOf, class Take>
void FewTriangles::trace(std::span<const RayPacket<W>> packets, const RaysOf& rays_of,
                         const Take& take) const {
    size_t i = 0;
    if constexpr (W == 8)
        if (!m_partly && has_avx512())
            for (; i + 1 < packets.size(); i += 2) {
                const hierarchy::ListHits<16> both =
                    hierarchy::list_hits_16(m_list, joined(rays_of(i), rays_of(i + 1)), Asked);
                take(i, half(both, 0)), take(i + 1, half(both, 1));
            }
    for (; i < packets.size(); i++) {
        const hierarchy::RayLanes<W> rays = rays_of(i);
        if (m_partly) {
            Presence<W> presence(m_store, m_rows, packets[i]);
            take(i, hierarchy::ListTracer<W, Asked, Presence<W>>(m_list, rays, presence).run());
        } else {
            hierarchy::AcceptsAll all;
            take(i, hierarchy::ListTracer<W, Asked, hierarchy::AcceptsAll>(m_list, rays, all).run());
        }
    }
}

template <int W>
void FewTriangles::intersect(std::span<const RayPacket<W>> rays, std::span<HitPacket<W>> hits) const {
    const auto rays_of = [&](size_t i) {
        return lanes_of<W>(rays[i], select(hits[i].hit, hits[i].t, rays[i].t_max), rays[i].active);
    };
    trace<Query::Closest, W>(rays, rays_of,
                             [&](size_t i, const hierarchy::ListHits<W>& found) { put(found, hits[i]); });
}

template <int W>
void FewTriangles::put(const hierarchy::ListHits<W>& found, HitPacket<W>& to) const {
    const Mask<W> hit = found.triangle >= Int<W>(0);
    if (none(hit))
        return;
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

template <int W>
void FewTriangles::find_occluded(std::span<const RayPacket<W>> rays, std::span<Mask<W>> hidden) const {
    const auto rays_of = [&](size_t i) {
        return lanes_of<W>(rays[i], rays[i].t_max, rays[i].active & !hidden[i]);
    };
    trace<Query::Any, W>(rays, rays_of, [&](size_t i, const hierarchy::ListHits<W>& found) {
        hidden[i] |= found.triangle >= Int<W>(0);
    });
}

template void FewTriangles::intersect<1>(std::span<const RayPacket<1>>, std::span<HitPacket<1>>) const;
template void FewTriangles::intersect<8>(std::span<const RayPacket<8>>, std::span<HitPacket<8>>) const;
template void FewTriangles::intersect<16>(std::span<const RayPacket<16>>, std::span<HitPacket<16>>) const;
template void FewTriangles::find_occluded<1>(std::span<const RayPacket<1>>, std::span<Mask<1>>) const;
template void FewTriangles::find_occluded<8>(std::span<const RayPacket<8>>, std::span<Mask<8>>) const;
template void FewTriangles::find_occluded<16>(std::span<const RayPacket<16>>, std::span<Mask<16>>) const;

} // namespace kanuka::bvh
