// Meshes cut into patches that shade by themselves. On a grid the vertices beside one are its neighbours in
// the arrays; on a mesh they are found through the faces, and differences to them become sums with weights
// (Stencils). A patch is a few thousand vertices that lie together, with rings of neighbours around them, so
// that patches shade side by side and nothing of this is kept for a whole mesh.
#pragma once

#include "grid/grid.h"
#include "grid/layering.h"

namespace kanuka::grid {

// Fills dPdu and dPdv where both are zero, from the first face of the vertex: per unit of its own u and v,
// which run over a quad from 0 to 1, and over a triangle as over a quad whose far side is its last corner.
void complete_frames(Grid& vertices, const TracedMesh& mesh);
// u and v of corner k of a face so; `triangle`: of three corners.
std::array<float, 2> corner_parameters(bool triangle, int k);

// The least-squares gradient over the edges at a vertex (weights 1 / d^2; Mavriplis 2003), in the tangent
// plane of its faces, along dPdu and dPdv; as far as the vertex reaches: the mean of its faces, a triangle
// for two, divided along the two as its edges are. Over a regular lattice these are the central differences
// of grids.
class MeshPatches {
  public:
    // `rest`: the positions that tell neighbours apart, laid out as Grid::P, those before displacement. All
    // arguments must outlive this.
    MeshPatches(const Grid& vertices, const TracedMesh& mesh, const std::vector<float>& rest, int rings);
    size_t count() const { return (m_order.size() + Own - 1) / Own; }
    // All arrays of the patch, its own vertices first; `vertices`: their numbers in the mesh.
    void cut(size_t patch, Grid& out, std::vector<uint32_t>& vertices) const;

  private:
    static constexpr size_t Own = 4096;
    void sort_vertices();
    void list_faces();
    int corners(uint32_t face) const;
    // Along a fibre; v itself where it ends.
    uint32_t before(uint32_t v) const { return v > 0 && m_goes_on[v - 1] ? v - 1 : v; }
    uint32_t after(uint32_t v) const { return m_goes_on[v] && v + 1 < m_goes_on.size() ? v + 1 : v; }
    Vec3f rest(uint32_t v) const { return {m_rest[v], m_rest[v + m_stride], m_rest[v + 2 * m_stride]}; }

    class Lookup;
    class Ring;
    void add_neighbours(std::vector<uint32_t>& vertices, size_t begin, size_t end, Lookup& lookup) const;

    const Grid& m_grid;
    const TracedMesh& m_mesh;
    const std::vector<float>& m_rest;
    const size_t m_stride;
    const int m_rings;
    std::vector<uint32_t> m_order;              // vertices that lie together are together
    std::vector<uint32_t> m_first_face, m_face; // faces by vertex
    std::vector<char> m_goes_on;                // of fibres: a segment begins at the vertex
};

// What shading made of the own vertices of a patch, into what there is of the whole mesh. The first call
// takes the layout. Not thread safe.
class MeshInputs {
  public:
    explicit MeshInputs(const Grid& whole) : m_whole(whole) {}
    void add(const VertexInputs& from, const std::vector<uint32_t>& vertices, size_t own, VertexInputs& to);

  private:
    void add(const std::vector<SlotValues>& from, int stride, const std::vector<uint32_t>& vertices,
             size_t own, std::vector<SlotValues>& to);
    void spread(SlotValues& slot, size_t components);
    const Grid& m_whole;
};

} // namespace kanuka::grid
