// One face of a subdivision surface on a lattice. Only subdivision*.cpp include this.
#pragma once

#include "geom/subdivision.h"
#include "geom/tensor.h"

namespace kanuka::geom {

inline constexpr BasisMatrix BsplineBasis{{{-1.0f / 6, 0.5f, -0.5f, 1.0f / 6},
                                           {0.5f, -1, 0.5f, 0},
                                           {-0.5f, 0, 0.5f, 0},
                                           {1.0f / 6, 4.0f / 6, 1.0f / 6, 0}}};

using BfrSurface = osd::Bfr::Surface<float>;

// One face's patch for one kind of data.
struct FacePatch {
    BfrSurface surface;
    std::vector<float> points;
    BfrSurface::PointDescriptor layout;

    void prepare(const float* mesh, int width) {
        layout = BfrSurface::PointDescriptor(width);
        points.resize(size_t(surface.GetNumPatchPoints()) * width);
        surface.PreparePatchPoints(mesh, layout, points.data(), layout);
    }
    int width() const { return layout.size; }
    // A uniform bicubic B-spline of its 16 points, row by row: regular, away from borders and infinitely
    // sharp edges, whose patches repeat points in place of those that are not there.
    bool is_bspline() const;
};

// Coordinates of ours on a face, (u, v) in [0, 1]², as Bfr's own. `corner`: the quad at that corner of an
// n-gon, or negative for the whole quad.
class FaceChart {
  public:
    struct Place {
        float uv[2];
        float du[2], dv[2]; // d(uv)/du, d(uv)/dv
    };
    FaceChart(const osd::Bfr::Parameterization& parameters, int corner)
        : m_parameters(parameters), m_corner(corner) {}
    Place operator()(float u, float v) const;
    bool whole() const { return m_corner < 0; }
    // Triangles of Loop's scheme are quartic, and bent by the bilinear way into them.
    bool is_triangle() const { return m_parameters.GetType() == osd::Bfr::Parameterization::TRI; }

  private:
    osd::Bfr::Parameterization m_parameters;
    int m_corner;
};

// Where a component of the data goes: vertex (i, j) of the lattice at value + j * pitch + i. Slopes are per
// unit of u and v, null where they are not wanted.
struct PatchTarget {
    float* value = nullptr;
    float *du = nullptr, *dv = nullptr;
};
void fill_lattice(const FacePatch& patch, const FaceChart& chart, Line u, Line v,
                  const std::vector<PatchTarget>& targets, int pitch);

} // namespace kanuka::geom
