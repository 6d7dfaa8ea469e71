// Meshes as leaves of up to eight triangles, or of four quads, which are kept together.
#pragma once

#include <vector>

#include "hierarchy/build.h"
#include "hierarchy/encode.h"
#include "hierarchy/leaf_groups.h"

namespace kanuka::hierarchy {

class MeshLeaves {
  public:
    // Of those meshes whose faces have so many sides.
    MeshLeaves(std::span<const MeshView> meshes, int sides, const Lattice& lattice, const Lattice& of_grids);

    const LargeVector<Group>& groups() const { return m_leaves.groups; } // `source` numbers their leaves
    // At an end of the interval, 0 or 1.
    void write(const Group& group, int i, uint8_t* to, int end = 0) const;
    Bounds3f box(const Group& group, int i, int end) const;
    // Triangles of a leaf, counted through all meshes; the last is repeated.
    void names(const Group& group, int i, uint32_t (&to)[LeafTriangles]) const;

    static void vote(const MeshView& mesh, size_t triangle, bool fine, StepVotes& votes);

  private:
    struct Corners {
        Vec3f at[3];
    };
    size_t mesh_of(uint32_t triangle) const;
    uint32_t triangle(const LeafGroups::Leaf& leaf, uint32_t k) const;
    struct Points {
        Vec3f at[3 * LeafTriangles]; // corner by corner, as they are stored; the last triangle is repeated
        uint32_t count;
    };
    bool find(uint32_t triangle, int end, Corners& to) const; // false = it is nowhere then
    bool is_there(uint32_t triangle) const;                   // at all times
    Points points(const LeafGroups::Leaf& leaf, int end) const;
    Kind kind_of_group(const Group& group) const;

    std::span<const MeshView> m_meshes;
    Lattice m_lattice, m_of_grids;
    Lattice m_finest;              // of the two: points of either stand on it
    uint32_t m_each;               // triangles a face: one or two
    int m_ends;                    // 2: they change
    std::vector<uint64_t> m_first; // triangle of each mesh
    LeafGroups m_leaves;           // of faces, by their first triangles
};

} // namespace kanuka::hierarchy
