// Shapes of the store as pages of the hierarchy are made of them.
#pragma once

#include <map>

#include "hierarchy/build.h"
#include "store/store.h"

namespace kanuka::bvh {

inline bool is_mesh(const store::ShapeRecord& s) {
    return s.flags & store::ShapeRecord::Mesh;
}
// Its vertices stand where those of grids do: a mesh that trim curves cut out of some meets the others.
inline bool stands_with_grids(const store::ShapeRecord& s) {
    return !is_mesh(s) || s.flags & store::ShapeRecord::OfGrids;
}
// Vertices as they are at a step of what changes, and at the next; null: it stands still.
struct Vertices {
    const float *now, *later;

    Vertices(const store::Store& store, const store::ShapeRecord& s, int step)
        : now(store.floats(s) + s.positions + ptrdiff_t(step) * s.motion_stride),
          later(step < s.motion_segments ? now + s.motion_stride : nullptr) {}
};
inline bool is_fibre(const store::ShapeRecord& s) {
    return s.flags & store::ShapeRecord::Fibre;
}
inline hierarchy::FibreView fibre_view(const store::Store& store, const store::ShapeRecord& s, int step) {
    const Vertices vertices(store, s, step);
    return {vertices.now, size_t(s.mu),   store.words(s) + s.indices,
            size_t(s.mv), vertices.later, (s.flags & store::ShapeRecord::Balls) != 0};
}
inline hierarchy::MeshView mesh_view(const store::Store& store, const store::ShapeRecord& s, int step) {
    const Vertices vertices(store, s, step);
    return {vertices.now,
            size_t(s.mu),
            store.words(s) + s.indices,
            size_t(s.mv),
            s.flags & store::ShapeRecord::Quads ? 4 : 3,
            stands_with_grids(s),
            vertices.later};
}

// Leaves of 4x4 cells would be mostly empty: eight triangles of any make better ones.
inline bool has_few_cells(const store::ShapeRecord& s) {
    const auto leaves = [](int cells) { return (int64_t(cells) + 3) / 4; };
    return int64_t(s.mu) * s.mv * 10 < leaves(s.mu) * leaves(s.mv) * 16 * 3;
}

// A lamp that shines in a cone does so about the normals of its facets. Those of few cells are large, and
// what a step of the lattice turns them by shows in how bright they are: their steps are so much finer.
inline constexpr int LampSteps = 64;

inline hierarchy::GridView grid_view(const store::Store& store, const store::ShapeRecord& s, int step) {
    const int finer = std::max(s.nu / std::max(s.mu, 1), s.nv / std::max(s.mv, 1));
    const bool lamp = s.emitter >= 0 && has_few_cells(s);
    const Vertices vertices(store, s, step);
    return {vertices.now, s.mu, s.mv, lamp ? finer * LampSteps : finer, vertices.later};
}

// Cells as quads. Grids of one size have the same corners.
class CellCorners {
  public:
    hierarchy::MeshView mesh_view(const store::Store& store, const store::ShapeRecord& s, int step) {
        std::vector<uint32_t>& corners = m_of_size[{s.mu, s.mv}];
        const uint32_t row = uint32_t(s.mu) + 1;
        if (corners.empty())
            for (uint32_t j = 0; j < uint32_t(s.mv); j++)
                for (uint32_t k = j * row; k < j * row + uint32_t(s.mu); k++)
                    corners.insert(corners.end(), {k, k + 1, k + row + 1, k + row});
        const Vertices vertices(store, s, step);
        return {vertices.now,
                size_t(row) * size_t(s.mv + 1),
                corners.data(),
                size_t(s.mu) * size_t(s.mv),
                4,
                true,
                vertices.later};
    }

  private:
    std::map<std::pair<int, int>, std::vector<uint32_t>> m_of_size;
};

// Of what pages may have, 2 GiB each, at the most that a polygon or an instance takes.
inline constexpr uint64_t MostBytes = uint64_t(1) << 31;
inline constexpr uint64_t BytesACell = 24, BytesATriangle = 48, BytesASegment = 44, BytesAnInstance = 88,
                          BytesAMovingOne = 152;

inline uint64_t page_bytes(const store::ShapeRecord& s) {
    const uint64_t ends = s.motion_segments > 0 ? 2 : 1;
    if (is_fibre(s))
        return ends * uint64_t(s.mv) * BytesASegment;
    if (is_mesh(s))
        return ends * 2 * uint64_t(s.mv) * BytesATriangle;
    const uint64_t cells = uint64_t(s.mu) * uint64_t(s.mv);
    return ends * (has_few_cells(s) ? 2 * cells * BytesATriangle : cells * BytesACell);
}

} // namespace kanuka::bvh
