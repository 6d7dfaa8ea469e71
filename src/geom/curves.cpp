// Curves to ribbons (or tubes) of quads: rings of vertices along every curve, joined one by one. Hair has two
// vertices a ring; curves that are wide in the picture have as many as the rate asks.
#include <cmath>

#include "base/tasks.h"
#include "geom/traced_mesh.h"

namespace kanuka::geom {
namespace {

constexpr int Samples = 9;             // a segment, to find how finely it must be cut
constexpr float ChordTolerance = 0.1f; // pixels
constexpr float TurnTolerance = 12;    // degrees a cut
constexpr float LengthPerCut = 8;      // micropolygon edges: colour changes slowly along a hair
constexpr float Wide = 2;              // micropolygon edges: wider curves are surfaces, cut at the full rate

// A whole number of at least `least`; what is beyond single precision is that.
int whole(float x, float least, float most) {
    return int(std::isfinite(x) && x > least ? std::min(std::ceil(x), most) : least);
}

struct Curve {
    size_t first_vertex = 0, first_varying = 0; // in the primvars
    int vertices = 0, segments = 0, varying = 0;
    std::vector<int> cuts; // per segment
    int across = 2;        // vertices of a ring
    size_t first = 0;      // vertex of the mesh
    int rings = 0;
};

class CurveMesher {
  public:
    CurveMesher(const scene::Primitive& primitive, const scene::Curves& curves, const Transform& m,
                const Viewpoint& view)
        : m_curves(curves), m_view(view), m_points(control_points(primitive, m)), m_widths(primitive, m) {
        m_order = curves.cubic ? 4 : 2;
        m_step = curves.cubic ? std::max(1, curves.basis->step) : 1;
        m_tube = !view.has_camera();
    }

    bool read(const scene::Primitive& primitive, const Transform& m, Journal& journal) {
        Dropped dropped;
        size_t vertex = 0, varying = 0;
        for (const int n : m_curves.vertices_per_curve) {
            Curve c;
            c.first_vertex = vertex;
            c.first_varying = varying;
            c.vertices = n;
            c.segments = m_curves.periodic ? n / m_step : (n - m_order) / m_step + 1;
            c.varying = m_curves.periodic ? c.segments : c.segments + 1;
            const bool good =
                n >= (m_curves.periodic ? 1 : m_order) && c.segments > 0 && vertex + n <= m_points.size();
            if (!good) {
                dropped.bad_index++;
                c.segments = 0;
                if (n < 0 || vertex + n > m_points.size())
                    break;
            } else {
                varying += c.varying;
                for (int i = 0; i < n; i++)
                    if (!m_points.finite(vertex + i)) {
                        dropped.non_finite++;
                        c.segments = 0;
                        break;
                    }
            }
            vertex += n;
            m_list.push_back(std::move(c));
        }
        const size_t total = m_curves.vertices_per_curve.size();
        dropped.report(total, "curves", primitive.where, journal);
        m_primvars = collect_primvars(primitive, m, {total, varying, m_points.size(), varying}, journal);
        if (m_widths.varying()) {
            const scene::Detail detail = m_widths.varying()->detail;
            const size_t need = detail == scene::Detail::Vertex    ? m_points.size()
                                : detail == scene::Detail::Uniform ? total
                                                                   : varying;
            if (m_widths.varying()->floats.size() < need) {
                journal.warning(primitive.where, "curves have " +
                                                     std::to_string(m_widths.varying()->floats.size()) +
                                                     " widths where " + std::to_string(need) +
                                                     " are needed; the first is used for all");
                m_first_width_only = true;
            }
        }
        return true;
    }

    void choose_all_cuts() {
        tasks::parallel_chunks(m_list.size(), 64, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; i++)
                choose_cuts(i);
        });
    }
    // Of the same curves in another shape.
    void take_cuts(const CurveMesher& first) {
        for (size_t i = 0; i < m_list.size() && i < first.m_list.size(); i++) {
            Curve& c = m_list[i];
            const Curve& f = first.m_list[i];
            if (c.vertices != f.vertices || c.segments != f.segments) { // a vertex became NaN
                c.segments = c.rings = 0;
                continue;
            }
            c.cuts = f.cuts;
            c.across = f.across;
            c.rings = f.rings;
        }
    }

    bool build(const scene::Primitive& primitive, MeshParts& out) {
        size_t vertices = 0, quads = 0, needed = 0; // whatever the rate
        std::vector<size_t> first_quad;
        for (Curve& c : m_list) {
            needed += 2 * size_t(c.segments + 1);
            c.first = vertices;
            first_quad.push_back(quads);
            vertices += size_t(c.rings) * c.across;
            quads += c.rings > 1 ? size_t(c.rings - 1) * (m_tube ? c.across : c.across - 1) : 0;
        }
        out.too_many = double(vertices) > std::max(m_view.most_vertices(), 4.0 * double(needed));
        if (quads == 0 || out.too_many)
            return false;
        allocate_mesh(out, vertices, m_primvars);
        out.mesh.vertices_per_face = 4;
        out.mesh.indices.resize(4 * quads);
        const scene::Attributes* a = primitive.attributes.get();
        const std::array<float, 8> tc = a ? a->texture_coordinates : scene::Attributes{}.texture_coordinates;
        tasks::parallel_chunks(m_list.size(), 64, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; i++) {
                fill(i, tc, out.vertices);
                connect(m_list[i], &out.mesh.indices[4 * first_quad[i]]);
            }
        });
        return true;
    }

  private:
    struct Place {
        int segment;
        float t;
        std::array<float, 4> value, slope; // of the basis
        std::array<size_t, 4> vertex;
    };

    Place place(const Curve& c, int segment, float t) const {
        Place p;
        p.segment = segment;
        p.t = t;
        Weights w(m_order, 1);
        if (m_curves.cubic)
            cubic_weights({&t, 1}, m_curves.basis->m, w);
        else
            linear_weights({&t, 1}, w);
        for (int k = 0; k < m_order; k++) {
            p.value[k] = w.value(k)[0];
            p.slope[k] = w.slope(k)[0];
            p.vertex[k] = c.first_vertex + size_t(segment * m_step + k) % c.vertices;
        }
        return p;
    }
    template <class Value>
    float blend(const std::array<float, 4>& w, const Place& p, Value value) const {
        float sum = 0;
        for (int k = 0; k < m_order; k++)
            sum = fma(w[k], value(p.vertex[k]), sum);
        return sum;
    }
    Vec3f blend_points(const std::array<float, 4>& w, const Place& p) const {
        Vec3f r;
        for (int c = 0; c < 3; c++)
            r[c] = blend(w, p, [&](size_t v) { return m_points.xyz[3 * v + c]; });
        return r;
    }
    Vec3f at(const Curve& c, int segment, float t) const {
        const Place p = place(c, segment, t);
        return blend_points(p.value, p);
    }
    template <class Value>
    float blend_varying(const Curve& c, const Place& p, Value value) const {
        const size_t a = c.first_varying + p.segment, b = c.first_varying + size_t(p.segment + 1) % c.varying;
        return value(a) + (value(b) - value(a)) * p.t;
    }

    float value(const Primvar& v, size_t curve, const Place& p, int c) const {
        if (v.detail == scene::Detail::Uniform)
            return v(curve, c);
        if (v.detail == scene::Detail::Vertex)
            return blend(p.value, p, [&](size_t i) { return v(i, c); });
        return blend_varying(m_list[curve], p, [&](size_t i) { return v(i, c); });
    }

    float width(size_t curve, const Place& p) const {
        const scene::Value* w = m_widths.varying();
        if (!w || m_first_width_only)
            return m_widths.at(0);
        const auto at = [&](size_t i) { return m_widths.at(i); };
        if (w->detail == scene::Detail::Uniform)
            return at(curve);
        return w->detail == scene::Detail::Vertex ? blend(p.value, p, at)
                                                  : blend_varying(m_list[curve], p, at);
    }

    // Micropolygon edges across the widest place.
    float widest(size_t index) const {
        const Curve& c = m_list[index];
        float cells = 0;
        for (int s = 0; s <= c.segments; s++) {
            const Place at = place(c, std::min(s, c.segments - 1), s < c.segments ? 0.0f : 1.0f);
            const Vec3f p = blend_points(at.value, at), eye = m_view.towards_camera(p);
            const Vec3f side = cross(eye, abs(eye.x) < abs(eye.y) ? Vec3f(1, 0, 0) : Vec3f(0, 1, 0));
            const float l = length(side);
            cells = std::max(cells, m_view.cells(p, p + side * (l > 0 ? width(index, at) / l : 0)));
        }
        return cells;
    }

    void choose_cuts(size_t index) {
        Curve& c = m_list[index];
        c.cuts.clear();
        c.rings = c.segments > 0 ? 1 : 0;
        if (c.segments == 0)
            return;
        const float wide = widest(index);
        if (m_tube)
            c.across = wide < Wide ? 3 : whole(wide, 6, 32);
        else
            c.across = wide < Wide ? 2 : 1 + whole(wide, 2, 256);
        const float length_per_cut = wide < Wide ? LengthPerCut : 1;
        for (int s = 0; s < c.segments; s++) {
            int n = 1;
            if (m_curves.cubic) {
                Vec3f p[Samples];
                for (int i = 0; i < Samples; i++)
                    p[i] = at(c, s, float(i) / (Samples - 1));
                float cells = 0, off = 0, turn = 0;
                for (int i = 1; i < Samples; i++)
                    cells += m_view.cells(p[i - 1], p[i]);
                for (int i = 1; i + 1 < Samples; i++) {
                    off = std::max(off, length(p[i] - lerp(float(i) / (Samples - 1), p[0], p[Samples - 1])));
                    const Vec3f a = p[i] - p[i - 1], b = p[i + 1] - p[i];
                    turn += std::atan2(length(cross(a, b)), dot(a, b));
                }
                off *= m_view.pixels_per_unit(p[Samples / 2]);
                const float shape =
                    std::max(std::sqrt(off / ChordTolerance), turn * (180 / Pi) / TurnTolerance);
                n = whole(std::max(std::min(shape, cells), cells / length_per_cut), 1, 256);
            } else {
                const float cells = m_view.cells(at(c, s, 0), at(c, s, 1));
                n = whole(cells / length_per_cut, 1, 256);
            }
            c.cuts.push_back(n);
            c.rings += n;
        }
    }

    void fill(size_t index, const std::array<float, 8>& tc, grid::Grid& g) const {
        const Curve& c = m_list[index];
        if (c.segments == 0)
            return;
        const Primvar* normals = m_primvars.normals ? normal_primvar() : nullptr;
        Vec3f tangent(0), side(0);
        int ring = 0;
        for (int s = 0; s < c.segments; s++)
            for (int k = s == 0 ? 0 : 1; k <= c.cuts[s]; k++, ring++) {
                const Place at = place(c, s, float(k) / float(c.cuts[s]));
                const Vec3f p = blend_points(at.value, at);
                Vec3f d = blend_points(at.slope, at);
                if (!(length_squared(d) > 0)) // doubled control points: the last direction, or the chord
                    d = ring > 0 ? tangent : this->at(c, s, 1) - p;
                tangent = length_squared(d) > 0 ? normalize(d) : Vec3f(0, 0, 1);
                Vec3f across;
                if (normals)
                    across = cross(Vec3f(value(*normals, index, at, 0), value(*normals, index, at, 1),
                                         value(*normals, index, at, 2)),
                                   tangent);
                else if (!m_tube)
                    across = cross(m_view.towards_camera(p), tangent);
                else // carried along the curve, so that the tube does not twist
                    across = ring > 0 ? side - tangent * dot(side, tangent) : Vec3f(0);
                const float l = length(across);
                if (l > 1e-6f)
                    side = across * (1 / l);
                else if (ring == 0 || !(length_squared(side) > 0))
                    side = normalize(cross(abs(tangent.x) < 0.9f ? Vec3f(1, 0, 0) : Vec3f(0, 1, 0), tangent));
                const Vec3f out = cross(tangent, side);
                const float half = 0.5f * width(index, at), v = (float(s) + at.t) / float(c.segments);
                for (int x = 0; x < c.across; x++) {
                    const size_t i = c.first + size_t(ring) * c.across + x, n = size_t(g.stride);
                    const float u = float(x) / float(m_tube ? c.across : c.across - 1), angle = u * 2 * Pi;
                    const Vec3f arm =
                        m_tube ? side * std::cos(angle) + out * std::sin(angle) : side * (2 * u - 1);
                    const Vec3f q = p + arm * half, normal = m_tube ? arm : out;
                    const Vec3f length_wise = d * float(c.segments), cross_wise = side * (2 * half);
                    for (int e = 0; e < 3; e++) {
                        g.P[i + e * n] = q[e];
                        g.N[i + e * n] = g.Ng[i + e * n] = normal[e];
                        g.dPdu[i + e * n] = cross_wise[e];
                        g.dPdv[i + e * n] = length_wise[e];
                    }
                    g.u[i] = u;
                    g.v[i] = v;
                    g.s[i] =
                        (1 - u) * (1 - v) * tc[0] + u * (1 - v) * tc[2] + (1 - u) * v * tc[4] + u * v * tc[6];
                    g.t[i] =
                        (1 - u) * (1 - v) * tc[1] + u * (1 - v) * tc[3] + (1 - u) * v * tc[5] + u * v * tc[7];
                    for (const Primvar& primvar : m_primvars.list)
                        for (int e = 0; e < primvar.components; e++)
                            primvar.destination(g, e)[i] = value(primvar, index, at, e);
                }
            }
    }

    void connect(const Curve& c, uint32_t* to) const {
        const uint32_t n = uint32_t(c.across);
        for (int r = 0; r + 1 < c.rings; r++) {
            const uint32_t a = uint32_t(c.first) + uint32_t(r) * n, b = a + n;
            for (uint32_t x = 0; x < (m_tube ? n : n - 1); x++) {
                const uint32_t y = (x + 1) % n;
                for (const uint32_t i : {a + x, a + y, b + y, b + x})
                    *to++ = i;
            }
        }
    }

    const Primvar* normal_primvar() const {
        for (const Primvar& p : m_primvars.list)
            if (p.target == Primvar::Target::Normal)
                return &p;
        return nullptr;
    }

    const scene::Curves& m_curves;
    const Viewpoint& m_view;
    ControlPoints m_points;
    Widths m_widths;
    Primvars m_primvars;
    std::vector<Curve> m_list;
    int m_order = 4, m_step = 1;
    bool m_tube = false, m_first_width_only = false;
};

} // namespace

bool mesh_from_curves(const scene::Primitive& primitive, const scene::Curves& curves, const Transform& m,
                      const Viewpoint& view, Journal& journal, MeshParts& out,
                      const scene::Primitive* first) {
    CurveMesher mesher(primitive, curves, m, view);
    if (!mesher.read(primitive, m, journal))
        return false;
    if (first) {
        CurveMesher first_mesher(*first, curves, m, view);
        if (!first_mesher.read(*first, m, journal))
            return false;
        first_mesher.choose_all_cuts();
        mesher.take_cuts(first_mesher);
    } else {
        mesher.choose_all_cuts();
    }
    return mesher.build(primitive, out);
}

} // namespace kanuka::geom
