// What pages know of a hit.
#pragma once

#include "bvh/page_scene.h"
#include "hierarchy/decode.h"

namespace kanuka::bvh {

// A part of those who call it: what calls return in memory is read back before it is whole.
[[gnu::always_inline]] inline PageScene::Place PageScene::place_of(const hierarchy::Page& page,
                                                                   const hierarchy::Hit& hit) const {
    const Owner& owner = m_owner_of_page[page.number()];
    const Own& own = m_groups[size_t(owner.group)].owns[size_t(owner.own)];
    const hierarchy::Kind kind = hierarchy::kind_of(hit.leaf);
    if (hierarchy::is_of_grids(kind)) {
        const hierarchy::Cell cell = hierarchy::cell_of(page, hit.leaf, hit.primitive / 2);
        const int shape = own.grids.shapes[cell.grid];
        const store::ShapeRecord& s = m_store.shapes()[size_t(shape)];
        return {shape, 0, (float(cell.column) + hit.u) / float(s.mu), (float(cell.row) + hit.v) / float(s.mv),
                own.grids.partly[cell.grid] != 0};
    }
    if (hierarchy::is_of_fibres(kind)) {
        const Numbered::Part segment = own.fibres.part(page.name(hit.leaf, int(hit.primitive / 2)));
        return {segment.shape, segment.number, hit.u, 0, segment.partly};
    }
    const auto [shape, number, partly] = own.meshes.part(page.name(hit.leaf, int(hit.primitive)));
    const store::ShapeRecord& s = m_store.shapes()[size_t(shape)];
    const bool is_mesh = s.flags & store::ShapeRecord::Mesh;
    if (is_mesh && !(s.flags & store::ShapeRecord::Quads))
        return {shape, number, hit.u, hit.v, partly};
    const bool second = number % 2;
    const float u = second ? 1 - hit.u : hit.u, v = second ? 1 - hit.v : hit.v;
    if (is_mesh)
        return {shape, number / 2, u, v, partly};
    const int cell = number / 2, row = cell / s.mu;
    return {shape, 0, (float(cell - row * s.mu) + u) / float(s.mu), (float(row) + v) / float(s.mv), partly};
}

} // namespace kanuka::bvh
