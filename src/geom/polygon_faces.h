// The faces of a PolygonMesh as they stand in the scene, with offsets, and with what cannot be used left out.
#pragma once

#include "geom/surface.h"

namespace kanuka::geom {

// Corners are counted over the whole primitive, in the order of facevarying data.
class PolygonFaces {
  public:
    PolygonFaces(const scene::PolygonMesh& mesh, size_t points);

    size_t count() const { return m_count; }
    size_t corners() const { return m_corners; }
    int sides() const { return m_sides; } // of every face, if all have one loop of equal length; else 0
    size_t first_corner(size_t face) const { return m_sides ? face * m_sides : m_first_corner[face]; }
    size_t corner_count(size_t face) const {
        return m_sides ? size_t(m_sides) : m_first_corner[face + 1] - m_first_corner[face];
    }
    // Loops of a face: their first corners, and the end of the last.
    std::vector<int> loops(size_t face) const;
    bool one_loop(size_t face) const {
        return m_first_loop.empty() || m_first_loop[face + 1] - m_first_loop[face] == 1;
    }
    // Index of a corner's point; -1 = out of range.
    int vertex(size_t corner) const {
        const int v = m_mesh.vertices.empty() ? int(corner) : m_mesh.vertices[corner];
        return uint32_t(v) < m_points ? v : -1;
    }
    ItemCounts item_counts() const { return {m_count, m_points, m_points, m_corners}; }
    bool truncated() const { return m_truncated; } // the counts ask for more corners than there are

  private:
    const scene::PolygonMesh& m_mesh;
    size_t m_count = 0, m_corners = 0, m_points = 0;
    int m_sides = 0;
    bool m_truncated = false;
    std::vector<size_t> m_first_corner; // per face, if sides vary
    std::vector<size_t> m_first_loop;   // per face, if loops are given
};

// Faces cut to triangles and convex polygons of at most eight corners.
struct Pieces {
    std::vector<int> first;  // of piece f in `corner`, and the end
    std::vector<int> corner; // corner numbers
    std::vector<int> face;   // the face it came from
};
Pieces cut_polygons(const PolygonFaces& faces, const ControlPoints& points, bool triangles_only,
                    Dropped& dropped);

} // namespace kanuka::geom
