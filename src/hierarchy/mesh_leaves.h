// Meshes as leaves of up to eight triangles, or of four quads, which are kept together.
#pragma once

#include <vector>

#include "hierarchy/build.h"
#include "hierarchy/encode.h"
#include "hierarchy/nodes.h"

namespace kanuka::hierarchy {

class MeshLeaves {
  public:
    // Of those meshes whose faces have so many sides.
    MeshLeaves(std::span<const MeshView> meshes, int sides, const Lattice& lattice, const Lattice& of_grids);

    const LargeVector<Group>& groups() const { return m_groups; } // `source` numbers them
    void write(const Group& group, int i, uint8_t* to) const;
    // Triangles of a leaf, counted through all meshes; the last is repeated.
    void names(const Group& group, int i, uint32_t (&to)[LeafTriangles]) const;

    static void vote(const MeshView& mesh, size_t triangle, bool fine, StepVotes& votes);

  private:
    struct Corners {
        Vec3f at[3];
    };
    struct Leaf {
        uint32_t begin, end; // of m_faces
    };
    size_t mesh_of(uint32_t triangle) const;
    uint32_t triangle(const Leaf& leaf, uint32_t k, Corners& corners) const;
    struct Points {
        Vec3f at[3 * LeafTriangles]; // corner by corner, as they are stored; the last triangle is repeated
        uint32_t count;
    };
    bool find(uint32_t triangle, Corners& to) const; // false = it is nowhere
    Points points(const Leaf& leaf) const;
    Kind kind_of_group(const Group& group) const;
    void collect(const SplitTree& tree, int32_t branch, Group& group);

    std::span<const MeshView> m_meshes;
    Lattice m_lattice, m_of_grids;
    Lattice m_finest;              // of the two: points of either stand on it
    uint32_t m_each;               // triangles a face: one or two
    std::vector<uint64_t> m_first; // triangle of each mesh
    LargeVector<uint32_t> m_faces; // their first triangles, in the order of leaves
    LargeVector<Leaf> m_leaves;    // those of a group one behind the other
    LargeVector<Group> m_groups;
};

} // namespace kanuka::hierarchy
