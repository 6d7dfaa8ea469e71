// Geometry that is traced as a mesh and shaded at its vertices: polygon meshes finer than the rate, curves
// and points.
#pragma once

#include "geom/polygon_faces.h"

namespace kanuka::geom {

struct MeshParts {
    grid::Grid vertices; // nu = vertices - 1, nv = 0
    grid::TracedMesh mesh;
    bool too_many = false; // nothing was made, since the rate asks for more vertices than there may be
};

// What curves and points need to know of the view. Thread safety: const members may run at the same time.
class Viewpoint {
  public:
    virtual ~Viewpoint() = default;
    virtual float cells(const Vec3f& a, const Vec3f& b) const = 0; // micropolygon edges from a to b
    virtual float pixels_per_unit(const Vec3f& p) const = 0;
    virtual float edge_pixels() const { return 1; }      // of a micropolygon
    virtual float chord_pixels() const { return 0.25f; } // what chords may be off by
    virtual Vec3f towards_camera(const Vec3f& p) const = 0;
    virtual bool has_camera() const = 0;                             // false: seen from anywhere (instances)
    virtual double most_vertices() const { return double(1 << 25); } // of a mesh that is cut by its size
};

// Allocates the vertices' arrays, in parallel; also the primvar channels.
void allocate_mesh(MeshParts& parts, size_t vertices, const Primvars& primvars);
void allocate_mesh(MeshParts& parts, size_t vertices, const Surface& surface);

// The polygons as they are. Vertices are the scene's, split where face-varying or uniform data differ. Pairs
// of triangles become quads where nine in ten do (see grid::TracedMesh), which changes no point of the
// surface. False = nothing left.
// `parameters`: u and v are read, so that every face has vertices of its own; else they are left zero.
// `first`, here and below: of a later shape, the primitive as it was first; faces and counts of vertices are
// made from that.
bool mesh_from_polygons(const scene::Primitive& primitive, const scene::PolygonMesh& mesh, const Transform& m,
                        bool parameters, Journal& journal, MeshParts& out,
                        const scene::Primitive* first = nullptr);
// Calls visit(points, count) for the outlines of about `samples` faces spread over the mesh, in the page's
// space.
template <class Visit>
void sample_polygons(const scene::Primitive& primitive, const scene::PolygonMesh& mesh, const Transform& m,
                     size_t samples, Visit visit);

// Ribbons across "N" where it is given; else fibres, or tubes of quads: wide ones, and all if there must be
// `polygons`.
bool mesh_from_curves(const scene::Primitive& primitive, const scene::Curves& curves, const Transform& m,
                      const Viewpoint& view, bool polygons, Journal& journal, MeshParts& out,
                      const scene::Primitive* first = nullptr);
// Spheres: balls, if most are small in the picture and nothing asks for `polygons`; else octahedra, refined
// as their size asks, whose mean silhouette has the sphere's area. Disks, squares and blobs.
bool mesh_from_points(const scene::Primitive& primitive, const Transform& m, const Viewpoint& view,
                      bool polygons, Journal& journal, MeshParts& out,
                      const scene::Primitive* first = nullptr);

// Implicit surfaces, at one cell a micropolygon, smaller where chords would leave the tolerance. False also
// for a later shape: it has other cells.
bool mesh_from_blobby(const scene::Primitive& primitive, const scene::Blobby& blobby, const Transform& m,
                      const Viewpoint& view, Journal& journal, MeshParts& out,
                      const scene::Primitive* first = nullptr);

// Where the vertices of a smooth mesh stand off to, so that what is traced has its outline on the mean
// (dice/outline.h): P of `vertices`, and for each edge a part of its second difference. Ng need not be unit.
std::vector<float> standing_off(const grid::Grid& vertices, const grid::TracedMesh& mesh);

// Area-weighted vertex normals of the mesh, unit length (zero where there is no area), oriented as cross
// products of the faces are, turned around by `flips`. Deterministic. `to` has 3 * stride floats.
void vertex_normals(const grid::Grid& vertices, const grid::TracedMesh& mesh, bool flips,
                    std::vector<float>& to);

// "width" or "constantwidth", in units of the page's space.
class Widths {
  public:
    Widths(const scene::Primitive& primitive, const Transform& m);
    const scene::Value* varying() const { return m_varying; }
    float at(size_t item) const { return m_scale * (m_varying ? m_varying->floats[item] : m_constant); }
    float scaled(float width) const { return m_scale * width; }

  private:
    const scene::Value* m_varying = nullptr;
    float m_constant = 1, m_scale = 1;
};

// ---------------------------------------------------------------------------------------------------------------------

template <class Visit>
void sample_polygons(const scene::Primitive& primitive, const scene::PolygonMesh& mesh, const Transform& m,
                     size_t samples, Visit visit) {
    const scene::Value* p = primitive.primvars.find("P");
    if (!p)
        return;
    const PolygonFaces faces(mesh, p->floats.size() / 3);
    const size_t step = std::max<size_t>(1, faces.count() / std::max<size_t>(1, samples));
    std::vector<Vec3f> outline;
    for (size_t f = 0; f < faces.count(); f += step) {
        const std::vector<int> loops = faces.loops(f);
        outline.clear();
        for (int c = loops[0]; c < loops[1]; c++)
            if (const int v = faces.vertex(c); v >= 0)
                outline.push_back(m.point({p->floats[3 * v], p->floats[3 * v + 1], p->floats[3 * v + 2]}));
        visit(outline.data(), int(outline.size()));
    }
}

} // namespace kanuka::geom
