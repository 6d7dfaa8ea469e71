// Subdivision surfaces: limit points and derivatives by OpenSubdiv's Bfr, face by face.
#include "geom/kinds.h"
#include "geom/subdivision_edits.h"
#include "geom/subdivision_kinds.h"
#include "geom/subdivision_regular.h"

namespace kanuka::geom {
namespace {

class SubdivisionSurface : public Surface {
  public:
    SubdivisionSurface(const scene::Primitive& primitive, const Transform& m)
        : Surface(primitive, m), m_points(control_points(primitive, m)) {
        m_bulges = false;
    }

    bool prepare(const scene::Primitive& primitive, const scene::SubdivisionMesh& mesh, Journal& journal,
                 SurfaceHints hints) {
        if (!read_cage(primitive, mesh, m_points, m_cage, journal))
            return false;
        m_primvars =
            collect_primvars(primitive, m_page_from_object,
                             {m_cage.faces, m_points.size(), m_points.size(), m_cage.corners}, journal);
        if (has_edits(mesh))
            apply_edits(primitive, mesh, m_page_from_object, m_cage, m_points, m_primvars, journal);
        if (hints.shape_alone)
            m_primvars.keep_normals();
        gather_data();
        const PolygonEdges edges = find_edges(m_cage.first, m_cage.vertices, int(m_points.size()));
        m_regular.find(m_cage, m_points.size(), edges);
        // OpenSubdiv's tables cost as much as many small faces: there are none where all are regular.
        const bool all_regular =
            m_regular.count() == m_cage.sizes.size() && m_channels.empty() && m_varying_width == 0;
        if (!all_regular && !make_factory(primitive.where, journal)) {
            journal.error(primitive.where, "the topology of a subdivision mesh is refused by OpenSubdiv");
            return false;
        }
        for (size_t f = 0; f < m_cage.sizes.size(); f++)
            if (m_regular.has(int(f)) || m_factory->FaceHasLimitSurface(int(f)))
                m_face.push_back(int(f));
        if (m_face.empty()) {
            journal.warning(primitive.where,
                            "no face of a subdivision mesh has a surface; a mesh with a boundary needs "
                            "the tag \"interpolateboundary\"");
            return false;
        }
        make_topology(edges);
        find_kinds();
        return true;
    }

    void positions(int face, Line u, Line v, float* out, int stride) const override {
        PatchTarget targets[3];
        for (int c = 0; c < 3; c++)
            targets[c].value = out + size_t(c) * stride;
        evaluate_data(face, Vertex, m_points.xyz.data(), u, v, targets, 3, u.count);
    }
    void edge_positions(int edge, Line t, float* out, int stride) const override {
        const Topology::Edge& e = m_topology.edges[edge];
        constexpr int Few = 16;
        const int face = e.face[0], base_face = face >= 0 ? m_face[m_quads[face].piece] : -1;
        if (face < 0 || face != e.face[1] || t.count > Few || !m_regular.has(base_face)) {
            Surface::edge_positions(edge, t, out, stride);
            return;
        }
        float x[Few];
        for (int i = 0; i < t.count; i++)
            x[i] = side_parameter(m_topology.faces[face].sides[e.side[0]], t[i]);
        int points[16];
        m_regular.points_of_vertices(base_face, m_cage.vertices.data(), points);
        bspline_side(m_points.xyz.data(), points, e.side[0], {x, t.count}, out, stride);
    }
    int uniform_index(int face) const override { return m_cage.face[m_face[m_quads[face].piece]]; }

    bool own_parameters() const override { return true; }
    bool joins_smoothly(int face) const override {
        return m_continuous && m_regular.has(m_face[m_quads[face].piece]);
    }

  protected:
    void shape(int face, Line u, Line v, Lattice out) const override {
        const int base_face = m_face[m_quads[face].piece];
        fill(face, Vertex, m_vertex_data, m_vertex_targets, u, v, out);
        if (m_varying_width > 0)
            fill(face, Varying, m_varying_data, m_varying_targets, u, v, out);
        for (size_t k = 0; k < m_channels.size(); k++)
            fill(face, int(k), m_channels[k].values, m_channel_targets[k], u, v, out);
        const size_t value = m_cage.own_uniform ? size_t(base_face) : size_t(m_cage.face[base_face]);
        for (const Primvar& p : m_primvars.list)
            if (p.detail == scene::Detail::Uniform)
                for (int c = 0; c < p.components; c++)
                    for (int j = 0; j < v.count; j++)
                        std::fill_n(p.destination(out.grid, c) + out.base + size_t(j) * out.pitch, u.count,
                                    p(value, c));
    }

    FaceRange range(int face) const override {
        const PieceQuad& quad = m_quads[face];
        return m_cage.ranges.empty() || quad.corner >= 0 ? FaceRange{} : m_cage.ranges[m_face[quad.piece]];
    }

  private:
    // A component of a primvar; of P where `primvar` is -1.
    struct Component {
        int primvar, component;
    };
    using Components = std::vector<Component>;

    // Kinds of data: these, and the face-varying channels by number.
    static constexpr int Vertex = -1, Varying = -2;

    bool init(int base_face, int data, auto& surface) const {
        return data == Vertex    ? m_factory->InitVertexSurface(base_face, &surface)
               : data == Varying ? m_factory->InitVaryingSurface(base_face, &surface)
                                 : m_factory->InitFaceVaryingSurface(base_face, &surface, data);
    }

    void evaluate_data(int face, int data, const float* values, Line u, Line v, const PatchTarget* targets,
                       int count, int pitch) const {
        const int base_face = m_face[m_quads[face].piece];
        if (data != Varying) {
            if (m_regular.has(base_face) && (data == Vertex || m_smooth_channels)) {
                int points[16];
                bool joined = true;
                if (data == Vertex)
                    m_regular.points_of_vertices(base_face, m_cage.vertices.data(), points);
                else
                    joined = m_regular.points(base_face, m_channels[data].indices.data(), points);
                if (joined) {
                    fill_bspline(values, points, u, v, targets, count, pitch);
                    return;
                }
            }
            const PatchKinds& kinds = data == Vertex ? m_kinds : m_channel_kinds[data];
            if (const PatchKind* kind = kinds.kind(face)) {
                kind->fill(ControlValues(values, count, kinds.points(face), kinds.point_count(face)), u, v,
                           targets, count, pitch);
                return;
            }
        }
        FacePatch patch;
        if (!init(base_face, data, patch.surface))
            return;
        patch.prepare(values, count);
        fill_lattice(patch, {patch.surface.GetParameterization(), m_quads[face].corner}, u, v,
                     {targets, targets + count}, pitch);
    }

    void fill(int face, int data, const std::vector<float>& values, const Components& components, Line u,
              Line v, Lattice out) const {
        constexpr size_t Few = 16;
        PatchTarget few[Few];
        std::vector<PatchTarget> many(components.size() > Few ? components.size() : 0);
        PatchTarget* const targets = many.empty() ? few : many.data();
        grid::Grid& g = out.grid;
        for (size_t k = 0; k < components.size(); k++) {
            const Component& c = components[k];
            if (c.primvar >= 0) {
                targets[k].value = m_primvars.list[c.primvar].destination(g, c.component) + out.base;
                continue;
            }
            const size_t at = size_t(c.component) * g.stride + out.base;
            targets[k] = {&g.P[at], &g.dPdu[at], &g.dPdv[at]};
        }
        evaluate_data(face, data, values.data(), u, v, targets, int(components.size()), out.pitch);
    }

    void make_topology(const PolygonEdges& edges) {
        const int points = int(m_points.size());
        if (m_face.size() == m_cage.sizes.size()) {
            m_topology = polygon_topology(m_cage.first, m_cage.vertices, points, false, edges, m_quads);
            return;
        }
        std::vector<int> first{0}, vertices;
        for (const int f : m_face) {
            vertices.insert(vertices.end(), m_cage.vertices.begin() + m_cage.first[f],
                            m_cage.vertices.begin() + m_cage.first[f + 1]);
            first.push_back(int(vertices.size()));
        }
        m_topology = polygon_topology(first, vertices, points, false, m_quads);
    }

    void find_kinds() {
        m_smooth_channels = m_cage.options.GetFVarLinearInterpolation() != osd::Sdc::Options::FVAR_LINEAR_ALL;
        m_channel_kinds.resize(m_channels.size());
        if (m_regular.count() == m_cage.sizes.size())
            return;
        std::vector<PatchKinds::Face> faces;
        for (const PieceQuad& q : m_quads)
            faces.push_back({m_face[q.piece], q.corner});
        const auto skip = [&](int face) { return m_regular.has(faces[face].base); };
        for (int data = Vertex; data < int(m_channels.size()); data++)
            (data == Vertex ? m_kinds : m_channel_kinds[data])
                .find(
                    faces, [&](int base, PatchKinds::DoubleSurface& s) { return init(base, data, s); }, skip);
    }

    // Interleaves what is interpolated alike.
    void gather_data() {
        for (int c = 0; c < 3; c++)
            m_vertex_targets.push_back({-1, c});
        for (size_t i = 0; i < m_primvars.list.size(); i++) {
            const Primvar& p = m_primvars.list[i];
            if (p.detail == scene::Detail::FaceVarying || p.detail == scene::Detail::FaceVertex) {
                m_channels.push_back(join_face_varying(m_cage, p, m_points.size()));
                m_channel_targets.emplace_back();
            }
            Components& to = p.detail == scene::Detail::Vertex    ? m_vertex_targets
                             : p.detail == scene::Detail::Varying ? m_varying_targets
                             : p.detail == scene::Detail::Uniform ? m_uniform_targets
                                                                  : m_channel_targets.back();
            for (int c = 0; c < p.components; c++)
                to.push_back({int(i), c});
        }
        m_continuous = m_channels.empty() && m_uniform_targets.empty();
        m_vertex_width = int(m_vertex_targets.size());
        m_varying_width = int(m_varying_targets.size());
        const size_t n = m_points.size();
        m_vertex_data.resize(n * m_vertex_width);
        m_varying_data.resize(n * m_varying_width);
        for (size_t i = 0; i < n; i++) {
            for (int k = 0; k < m_vertex_width; k++) {
                const Component& c = m_vertex_targets[k];
                m_vertex_data[i * m_vertex_width + k] = c.primvar < 0
                                                            ? m_points.xyz[3 * i + c.component]
                                                            : m_primvars.list[c.primvar](i, c.component);
            }
            for (int k = 0; k < m_varying_width; k++)
                m_varying_data[i * m_varying_width + k] =
                    m_primvars.list[m_varying_targets[k].primvar](i, m_varying_targets[k].component);
        }
    }

    bool make_factory(const Location& where, Journal& journal) {
        m_refiner = make_refiner(m_cage, m_points.size(), m_channels);
        if (m_refiner && leave_out_overlaps(m_cage, m_refiner->GetLevel(0), where, journal))
            m_refiner = make_refiner(m_cage, m_points.size(), m_channels);
        if (!m_refiner)
            return false;
        SurfaceFactory::Options options;
        if (!m_channels.empty())
            options.SetDefaultFVarID(0);
        m_factory = std::make_unique<SurfaceFactory>(*m_refiner, options);
        return true;
    }

    ControlPoints m_points;
    Cage m_cage;
    std::vector<PieceQuad> m_quads;
    std::vector<int> m_face; // cage face of a piece
    Components m_vertex_targets, m_varying_targets, m_uniform_targets;
    std::vector<Components> m_channel_targets;
    int m_vertex_width = 3, m_varying_width = 0;
    std::vector<float> m_vertex_data, m_varying_data;
    std::vector<FaceVaryingChannel> m_channels;
    bool m_smooth_channels = true; // inside, at least
    bool m_continuous = true;      // no primvar changes from face to face
    RegularFaces m_regular;
    PatchKinds m_kinds; // of vertex data
    std::vector<PatchKinds> m_channel_kinds;
    std::unique_ptr<osd::Far::TopologyRefiner> m_refiner;
    std::unique_ptr<SurfaceFactory> m_factory;
};

} // namespace

SurfacePtr make_subdivision(const scene::Primitive& primitive, const scene::SubdivisionMesh& mesh,
                            const Transform& m, Journal& journal, SurfaceHints hints) {
    auto surface = std::make_unique<SubdivisionSurface>(primitive, m);
    return surface->prepare(primitive, mesh, journal, hints) ? std::move(surface) : nullptr;
}

} // namespace kanuka::geom
