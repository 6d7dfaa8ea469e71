// Surfaces as quad-domain faces that can be evaluated over lattices: every kind of geometry that is diced
// becomes one.
#pragma once

#include <memory>
#include <span>

#include "geom/primvars.h"
#include "geom/tensor.h"
#include "geom/topology.h"
#include "geom/trim.h"

namespace kanuka::geom {

// A lattice inside a grid: vertex (i, j) = base + j * pitch + i.
struct Lattice {
    grid::Grid& grid;
    int base, pitch;
};

// Part of the primitive's parameter space that a face covers.
struct FaceRange {
    float u0 = 0, u1 = 1, v0 = 0, v1 = 1;
};

// Control points are in the page's space (render/page_frame.h) from the start; a face's (u, v) run over
// [0, 1]^2.
// Thread safety: const members may run at the same time.
class Surface {
  public:
    virtual ~Surface() = default;
    const Topology& topology() const { return m_topology; }
    int faces() const { return int(m_topology.faces.size()); }
    // Of faces in rows and columns; none of both = they are not.
    const LatticeShape& lattice() const { return m_lattice; }
    virtual void set_lattice(const LatticeShape& shape) { m_topology = lattice_topology(m_lattice = shape); }

    // Positions alone: out[c * stride + j * u.count + i].
    virtual void positions(int face, Line u, Line v, float* out, int stride) const = 0;
    // Everything: P, N, Ng, dPdu, dPdv, u, v, s, t and the primvars.
    void evaluate(int face, Line u, Line v, Lattice out) const;
    // Positions at parameters t of an edge: out[c * stride + i].
    virtual void edge_positions(int edge, Line t, float* out, int stride) const;

    void allocate_channels(grid::Grid& grid) const { m_primvars.allocate_channels(grid); }
    bool flips() const { return m_flips; }
    bool has_texture() const {
        return m_primvars.s || m_primvars.t;
    } // s and t are given, not made from u and v
    // u and v are those of each face by itself, not of the whole primitive.
    virtual bool own_parameters() const { return false; }
    // Interior lines of a face may be much longer than its sides.
    bool bulges() const { return m_bulges; }
    virtual int uniform_index(int face) const { return face; }
    // Normals and primvars of the face are its neighbours' where they meet.
    virtual bool joins_smoothly(int) const { return false; }
    // What cuts parts of it away, in the parameters of the whole surface, and those; null = nothing.
    virtual const scene::TrimCurves* trim() const { return nullptr; }
    virtual ParameterRange parameters() const { return {}; }
    virtual Vec3f at_parameters(double, double) const { return Vec3f(0.0f); } // in [0, 1]

  protected:
    Surface(const scene::Primitive& primitive, const Transform& page_from_object);
    // Fills P, dPdu, dPdv (per unit of the face's own u and v) and all primvars, and Ng if it owns normals:
    // unit length, outside.
    virtual void shape(int face, Line u, Line v, Lattice out) const = 0;
    virtual bool owns_normals(int) const { return false; }
    virtual FaceRange range(int) const { return {}; }

    Topology m_topology;
    LatticeShape m_lattice{0, 0};
    Primvars m_primvars;
    Transform m_page_from_object;
    std::array<float, 8> m_texture_coordinates;
    bool m_flips, m_bulges = true;

  private:
    void frame(int face, Line u, Line v, Lattice out) const;
    Vec3f normal_beside(int face, float u, float v) const;
};

// Null where nothing of it can be diced; the reason has gone to the journal. Curves and Points are not
// surfaces in this sense: see ribbons.h and points.h.
struct SurfaceHints {
    bool small_triangles =
        false; // a face becomes few micropolygons: triangles are better one collapsed quad than three
    bool shape_alone = false; // nobody reads primvars, but for normals
    bool moving = false;      // it has later shapes: faces must not depend on where points are
    // The primitive as it was first, where this is a later shape of it: concave polygons are cut as they were
    // there.
    const scene::Primitive* first = nullptr;
};
std::unique_ptr<Surface> make_surface(const scene::Primitive& primitive, const Transform& page_from_object,
                                      Journal& journal, SurfaceHints hints = {});
// One lattice for all steps of a shape that changes: sides are one point, or meet, if they always do. Of
// sides that meet for a time alone the edges are twins.
void share_lattice(Surface& first, std::span<const std::unique_ptr<Surface>> later);

// "P" (or "Pw" as four floats) in the page's space; `weights` is filled for Pw alone. Non-finite points are
// kept.
struct ControlPoints {
    std::vector<float> xyz;     // homogeneous (wx, wy, wz) where there are weights
    std::vector<float> weights; // empty = not rational
    size_t size() const { return xyz.size() / 3; }
    Vec3f operator[](size_t i) const { return {xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]}; }
    // In reach of the tracer, which knows nothing of what is farther.
    static bool in_reach(float x) { return std::abs(x) <= Farthest; }
    static constexpr float Farthest = 1e18f;
    bool finite(size_t i) const {
        return in_reach(xyz[3 * i]) && in_reach(xyz[3 * i + 1]) && in_reach(xyz[3 * i + 2]) &&
               (weights.empty() || (std::isfinite(weights[i]) && weights[i] != 0));
    }
};
ControlPoints control_points(const scene::Primitive& primitive, const Transform& page_from_object);

// Faces left out, and why: one message each.
struct Dropped {
    size_t non_finite = 0, bad_index = 0, degenerate = 0, copies = 0;
    void report(size_t total, std::string_view what, const Location& where, Journal& journal) const;
};

} // namespace kanuka::geom
