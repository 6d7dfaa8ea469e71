// Irregular faces with surroundings that are alike have one map from control points to their surface: Bezier
// patches on quarters, on their quarters and so on, and Gregory patches beside extraordinary vertices, which
// is what OpenSubdiv's Bfr makes of such a face. The map is taken from Bfr's stencils once and kept as
// matrices, one a part. Only subdivision*.cpp include this.
#pragma once

#include <functional>

#include "geom/subdivision_patch.h"

namespace kanuka::geom {

// A face's control points for one kind of data, component by component and relative to the first of them.
class ControlValues {
  public:
    // values: `width` floats a point of the mesh.
    ControlValues(const float* values, int width, const int* points, int count);
    const float* component(int c) const { return m_data + size_t(c) * m_count; }
    float origin(int c) const { return m_origin[c]; }
    int count() const { return m_count; }
    ControlValues(const ControlValues&) = delete;

  private:
    static constexpr int Small = 16 * 8, SmallWidth = 16;
    int m_count;
    float m_small[Small], m_small_origin[SmallWidth];
    std::vector<float> m_large;
    float *m_data, *m_origin;
};

// Sixteen control points of a uniform bicubic B-spline, row by row: `width` = `count` floats each of a
// mesh's.
void fill_bspline(const float* values, const int* points, Line u, Line v, const PatchTarget* targets,
                  int count, int pitch);
// Positions along a side of it, in grid::Edge order: t as side and not as edge, rising or falling.
void bspline_side(const float* xyz, const int* points, int side, Line t, float* out, int stride);
void fill_bspline(const ControlValues& points, Line u, Line v, const PatchTarget* targets, int count,
                  int pitch);

class PatchKind {
  public:
    // Null where the surface has parts that are neither after some halvings: infinitely sharp features.
    static std::unique_ptr<PatchKind> make(const osd::Bfr::Surface<double>& surface, int corner);
    void fill(const ControlValues& points, Line u, Line v, const PatchTarget* targets, int count,
              int pitch) const;

  private:
    struct Part {
        int first_child = -1; // of four: (0, 0), (1, 0), (0, 1), (1, 1); -1 = none
        bool gregory = false;
        size_t matrix = 0; // Terms floats for every control point
    };
    struct Region {
        int i0, i1, j0, j1; // of the lattice
        float u0, v0, size;
    };
    class Fitter;
    class Evaluation;
    std::vector<Part> m_parts;
    std::vector<float> m_matrices;
    int m_points = 0;
};

// What kind each face is, for one kind of data. Kinds that few faces have are not made: Bfr evaluates those.
class PatchKinds {
  public:
    using DoubleSurface = osd::Bfr::Surface<double>;
    struct Face {
        int base, corner; // of the cage; the quad at that corner, or negative
    };
    using Init = std::function<bool(int, DoubleSurface&)>;
    // init(base, surface): false where there is none; skip(face): it is regular.
    void find(const std::vector<Face>& faces, const Init& init, const std::function<bool(int)>& skip);
    // Null = none.
    const PatchKind* kind(int face) const {
        return m_of.empty() || m_of[face] < 0 ? nullptr : m_kinds[m_of[face]].get();
    }
    const int* points(int face) const { return m_points.data() + m_first[face]; }
    int point_count(int face) const { return m_count[m_of[face]]; }

  private:
    void find_points(const std::vector<Face>& faces, const std::vector<int>& irregular,
                     const std::vector<int>& kinds, const std::vector<int>& counts, const Init& init);
    std::vector<int> m_of, m_count;
    std::vector<size_t> m_first;
    std::vector<int> m_points;
    std::vector<std::unique_ptr<PatchKind>> m_kinds;
};

} // namespace kanuka::geom
