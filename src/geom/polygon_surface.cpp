// Polygons as quad-domain faces: convex quads as they are, triangles and n-gons cut to a quad at every corner
// (corner, middle of an edge, centre, middle of the other edge), small triangles as quads with a collapsed
// side. On all of them linear data stay linear. Triangles that are halves of a flat quad are joined again.
#include "geom/kinds.h"
#include "geom/pair_triangles.h"

namespace kanuka::geom {
namespace {

class PolygonSurface : public Surface {
  public:
    PolygonSurface(const scene::Primitive& primitive, const scene::PolygonMesh& mesh, const Transform& m,
                   SurfaceHints hints)
        : Surface(primitive, m), m_hints(hints), m_mesh(mesh), m_points(control_points(primitive, m)),
          m_polygons(m_mesh, m_points.size()) {
        m_bulges = false;
    }

    bool prepare(const scene::Primitive& primitive, Journal& journal) {
        Dropped dropped;
        m_pieces = cut_polygons(m_polygons,
                                m_hints.first ? control_points(*m_hints.first, m_page_from_object) : m_points,
                                false, dropped);
        if (m_polygons.truncated())
            dropped.bad_index++;
        dropped.report(m_polygons.count(), "polygons", primitive.where, journal);
        if (m_pieces.face.empty())
            return false;
        m_primvars = collect_primvars(primitive, m_page_from_object, m_polygons.item_counts(), journal);
        texture_from_position(primitive);
        if (!m_hints.small_triangles && !m_hints.moving)
            pair_triangles(m_polygons, m_points, m_primvars, m_pieces);
        build_topology();
        return true;
    }

    void positions(int face, Line u, Line v, float* out, int stride) const override {
        const TensorLattice lattice(u, nullptr, v, nullptr);
        for (int c = 0; c < 3; c++) {
            float q[4];
            corner_values(
                face, [&](int corner) { return m_points.xyz[3 * m_polygons.vertex(corner) + c]; }, q);
            lattice.values(q, out + size_t(c) * stride, u.count);
        }
    }
    bool own_parameters() const override { return true; }
    int uniform_index(int face) const override { return m_pieces.face[m_quads[face].piece]; }

  protected:
    void shape(int face, Line u, Line v, Lattice out) const override {
        const TensorLattice lattice(u, nullptr, v, nullptr);
        grid::Grid& g = out.grid;
        float q[4];
        for (int c = 0; c < 3; c++) {
            corner_values(
                face, [&](int corner) { return m_points.xyz[3 * m_polygons.vertex(corner) + c]; }, q);
            const size_t at = size_t(c) * g.stride + out.base;
            lattice.slopes(q, &g.P[at], &g.dPdu[at], &g.dPdv[at], out.pitch);
        }
        if (owns_normals(face)) {
            const int* c = &m_pieces.corner[m_pieces.first[m_quads[face].piece]];
            const Vec3f n = cross(point(c[1]) - point(c[0]), point(c[2]) - point(c[0]));
            const Vec3f unit =
                n * ((m_flips ? -1.0f : 1.0f) / length(n)); // triangles without area have been dropped
            for (int k = 0; k < 3; k++)
                for (int j = 0; j < v.count; j++)
                    std::fill_n(&g.Ng[size_t(k) * g.stride + out.base + size_t(j) * out.pitch], u.count,
                                unit[k]);
        }
        const size_t polygon = m_pieces.face[m_quads[face].piece];
        for (const Primvar& p : m_primvars.list)
            for (int c = 0; c < p.components; c++) {
                corner_values(
                    face,
                    [&](int corner) {
                        switch (p.detail) {
                        case scene::Detail::Uniform:
                            return p(polygon, c);
                        case scene::Detail::FaceVarying:
                        case scene::Detail::FaceVertex:
                            return p(corner, c);
                        default:
                            return p(m_polygons.vertex(corner), c);
                        }
                    },
                    q);
                lattice.values(q, p.destination(g, c) + out.base, out.pitch);
            }
    }

    // Triangles are flat: one normal, exact where a side is collapsed too.
    bool owns_normals(int face) const override { return corners(m_quads[face].piece) == 3; }

  private:
    int corners(int piece) const { return m_pieces.first[piece + 1] - m_pieces.first[piece]; }
    Vec3f point(int corner) const { return m_points[m_polygons.vertex(corner)]; }

    // Values at (0,0), (1,0), (0,1), (1,1).
    template <class Value>
    void corner_values(int face, Value value, float q[4]) const {
        const PieceQuad quad = m_quads[face];
        const int* c = &m_pieces.corner[m_pieces.first[quad.piece]];
        const int n = corners(quad.piece), k = quad.corner;
        if (k < 0) {
            q[0] = value(c[0]), q[1] = value(c[1]), q[3] = value(c[2]),
            q[2] = k == PieceQuad::Triangle ? q[3] : value(c[3]);
            return;
        }
        float sum = 0;
        for (int i = 0; i < n; i++)
            sum += value(c[i]);
        q[0] = value(c[k]);
        q[1] = (q[0] + value(c[(k + 1) % n])) * 0.5f;
        q[2] = (q[0] + value(c[(k + n - 1) % n])) * 0.5f;
        q[3] = sum / float(n);
    }

    // RISpec 3.2, 5.1: polygons take (x, y) of object space where no texture coordinates are given.
    void texture_from_position(const scene::Primitive& primitive) {
        const scene::Value* p = primitive.primvars.find("P");
        for (int c = 0; c < 2; c++) {
            if (c == 0 ? m_primvars.s : m_primvars.t)
                continue;
            std::vector<float> values(m_points.size());
            for (size_t i = 0; i < values.size(); i++)
                values[i] = p ? p->floats[3 * i + c] : 0;
            Primvar& st = m_primvars.list.emplace_back();
            st.name = std::string(1, c == 0 ? 's' : 't');
            st.detail = scene::Detail::Vertex;
            st.target = c == 0 ? Primvar::Target::S : Primvar::Target::T;
            st.values = std::move(values);
        }
    }

    void build_topology() {
        std::vector<int> vertices(m_pieces.corner.size());
        for (size_t i = 0; i < vertices.size(); i++)
            vertices[i] = m_polygons.vertex(m_pieces.corner[i]);
        m_topology = polygon_topology(m_pieces.first, vertices, int(m_points.size()), m_hints.small_triangles,
                                      m_quads);
    }

    const SurfaceHints m_hints;
    const scene::PolygonMesh m_mesh; // shares its buffers with the scene's
    ControlPoints m_points;
    PolygonFaces m_polygons;
    Pieces m_pieces;
    std::vector<PieceQuad> m_quads; // per face
};

} // namespace

SurfacePtr make_polygons(const scene::Primitive& primitive, const scene::PolygonMesh& mesh,
                         const Transform& m, Journal& journal, SurfaceHints hints) {
    auto surface = std::make_unique<PolygonSurface>(primitive, mesh, m, hints);
    return surface->prepare(primitive, journal) ? std::move(surface) : nullptr;
}

} // namespace kanuka::geom
