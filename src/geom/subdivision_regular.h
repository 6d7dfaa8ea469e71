// Faces of a Catmull-Clark cage whose surface is one uniform bicubic B-spline: quads among quads with four
// faces at every corner and nothing sharp there. They are found, and their 16 control points are, from the
// cage alone: no table of OpenSubdiv's is made for them. Only subdivision*.cpp include this.
#pragma once

#include "geom/subdivision.h"

namespace kanuka::geom {

class RegularFaces {
  public:
    void find(const Cage& cage, size_t points, const PolygonEdges& edges);
    bool has(int face) const { return !m_regular.empty() && m_regular[face]; }
    size_t count() const { return m_count; }
    // Control points of a regular face, row by row, as numbers that the corners of faces have: vertices, or
    // values of face-varying data. False where those do not join around the face.
    bool points(int face, const int* of_corner, int* out) const;
    // Those of vertices, which always join.
    void points_of_vertices(int face, const int* of_corner, int* out) const;

  private:
    template <bool Check>
    bool find_points(int face, const int* of_corner, int* out) const;
    static constexpr uint32_t None = ~0u;
    std::vector<uint32_t> m_twin; // of the side that begins at a corner: first corner of its face * 4 + which
    std::vector<int> m_first;     // corner of each face
    std::vector<char> m_regular;
    size_t m_count = 0;
};

} // namespace kanuka::geom
