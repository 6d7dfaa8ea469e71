// Curves: rings of vertices along every one. Where `N` is given they are ribbons of quads across it (RISpec);
// else they are as wide from everywhere. Thin ones are fibres, one vertex a ring, which the ray tracer
// rounds. Curves that are wide in the picture are tubes of quads with as many vertices as the rate asks, and
// so are all where the surface must be made of polygons. Of a tube the half that faces the camera has u from
// 0 to 1, as a ribbon that is turned there would have it; the other half goes back.
#include <cmath>

#include "base/tasks.h"
#include "geom/curve_ring.h"
#include "geom/traced_mesh.h"

namespace kanuka::geom {
namespace {

constexpr int Samples = 9;             // a segment, to find how finely it must be cut
constexpr float ChordTolerance = 0.1f; // pixels
constexpr float TurnTolerance = 12;    // degrees a cut
constexpr float LengthPerCut = 8;      // micropolygon edges: colour changes slowly along a hair
constexpr float Widest = 1e15f;
constexpr float Wide = 2; // micropolygon edges: wider curves are surfaces, cut at the full rate

// A whole number of at least `least`; what is beyond single precision is that.
int whole(float x, float least, float most) {
    return int(std::isfinite(x) && x > least ? std::min(std::ceil(x), most) : least);
}

struct Curve {
    size_t first_vertex = 0, first_varying = 0; // in the primvars
    int vertices = 0, segments = 0, varying = 0;
    std::vector<int> cuts; // per segment
    int wide = 0;          // micropolygon edges across, of wide ones
    int across = 1;        // vertices of a ring
    size_t first = 0;      // vertex of the mesh
    int rings = 0;
};

class CurveMesher {
  public:
    CurveMesher(const scene::Primitive& primitive, const scene::Curves& curves, const Transform& m,
                const Viewpoint& view, bool polygons)
        : m_curves(curves), m_view(view), m_points(control_points(primitive, m)), m_widths(primitive, m),
          m_kind(polygons ? Kind::Tube : Kind::Fibre) {
        m_order = curves.cubic ? 4 : 2;
        m_step = curves.cubic ? std::max(1, curves.basis->step) : 1;
    }

    bool read(const scene::Primitive& primitive, const Transform& m, Journal& journal) {
        for (size_t k = 0; k < 4 && m_curves.cubic; k++) {
            const std::array<float, 4>& row = m_curves.basis->m[k]; // of t^(3-k)
            if (std::abs(row[0] + row[1] + row[2] + row[3] - (k == 3 ? 1.0f : 0.0f)) > 1e-4f)
                m_origin = Vec3f(float(m.m[0][3]), float(m.m[1][3]), float(m.m[2][3]));
        }
        Dropped dropped;
        size_t vertex = 0, varying = 0;
        for (const int n : m_curves.vertices_per_curve) {
            Curve c;
            c.first_vertex = vertex;
            c.first_varying = varying;
            c.vertices = n;
            c.segments = m_curves.periodic ? n / m_step : (std::max(n, 0) - m_order) / m_step + 1;
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
        if (m_primvars.normals)
            m_kind = Kind::Ribbon;
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
        choose_kind();
    }
    // Of the same curves in another shape.
    void take_cuts(const CurveMesher& first) {
        m_kind = first.m_kind;
        for (size_t i = 0; i < m_list.size() && i < first.m_list.size(); i++) {
            Curve& c = m_list[i];
            const Curve& f = first.m_list[i];
            if (c.vertices != f.vertices || c.segments != f.segments) { // a vertex became NaN
                c.segments = c.rings = 0;
                continue;
            }
            c.cuts = f.cuts;
            c.wide = f.wide;
            c.across = f.across;
            c.rings = f.rings;
        }
    }

    bool build(const scene::Primitive& primitive, MeshParts& out) {
        size_t vertices = 0, faces = 0, needed = 0; // whatever the rate
        std::vector<size_t> first_face;
        for (Curve& c : m_list) {
            needed += 2 * size_t(c.segments + 1);
            c.first = vertices;
            first_face.push_back(faces);
            vertices += size_t(c.rings) * c.across;
            faces += c.rings > 1 ? size_t(c.rings - 1) * faces_of_ring(c) : 0;
        }
        out.too_many = double(vertices) > std::max(m_view.most_vertices(), 4.0 * double(needed));
        if (faces == 0 || out.too_many)
            return false;
        allocate_mesh(out, vertices, m_primvars);
        const size_t corners = m_kind == Kind::Fibre ? 1 : 4;
        out.mesh.vertices_per_face = int(corners);
        out.mesh.indices.resize(corners * faces);
        out.mesh.radius.resize(m_kind == Kind::Fibre ? vertices : 0);
        out.mesh.around = m_kind != Kind::Ribbon;
        const scene::Attributes* a = primitive.attributes.get();
        const std::array<float, 8> tc = a ? a->texture_coordinates : scene::Attributes{}.texture_coordinates;
        tasks::parallel_chunks(m_list.size(), 64, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; i++) {
                fill(i, tc, out);
                connect(m_list[i], &out.mesh.indices[corners * first_face[i]]);
            }
        });
        return true;
    }

  private:
    enum class Kind { Ribbon, Fibre, Tube };

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
    // Where the basis' weights do not sum to one (Hermite, power), what they make is moved, not what they
    // weigh.
    Vec3f m_origin{0, 0, 0};
    Vec3f blend_points(const std::array<float, 4>& w, const Place& p) const {
        Vec3f r;
        for (int c = 0; c < 3; c++)
            r[c] = blend(w, p, [&](size_t v) { return m_points.xyz[3 * v + c] - m_origin[c]; });
        return &w == &p.value ? r + m_origin : r;
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

    // Not negative, and in the ray tracer's range.
    float width(size_t curve, const Place& p) const {
        const float w = std::abs(raw_width(curve, p));
        return std::isfinite(w) ? std::min(w, Widest) : 0;
    }
    float raw_width(size_t curve, const Place& p) const {
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
        c.wide = wide < Wide ? 0 : whole(wide, 2, 256);
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

    // Wide curves show what varies across them, which fibres do not have: tubes, unless they are few among
    // thin ones.
    void choose_kind() {
        size_t rings = 0, wide = 0;
        for (const Curve& c : m_list) {
            rings += size_t(c.rings);
            wide += c.wide > 0 ? size_t(c.rings) : 0;
        }
        if (m_kind == Kind::Fibre && 2 * wide > rings)
            m_kind = Kind::Tube;
        for (Curve& c : m_list)
            c.across = m_kind == Kind::Fibre    ? 1
                       : m_kind == Kind::Ribbon ? 1 + std::max(c.wide, 1)
                                                : Ring::size(front_of(c));
    }
    static int front_of(const Curve& c) { return c.wide == 0 ? 0 : std::max(c.wide, 6); }
    size_t faces_of_ring(const Curve& c) const {
        return size_t(m_kind == Kind::Ribbon ? c.across - 1 : c.across);
    }

    void fill(size_t index, const std::array<float, 8>& tc, MeshParts& out_parts) const {
        const Curve& c = m_list[index];
        if (c.segments == 0)
            return;
        grid::Grid& g = out_parts.vertices;
        const Primvar* normals = m_primvars.normals ? normal_primvar() : nullptr;
        const Ring around(m_kind == Kind::Tube ? front_of(c) : 0);
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
                else if (m_view.has_camera())
                    across = cross(m_view.towards_camera(p), tangent);
                else // carried along the curve, so that it does not twist
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
                    Vec3f q = p, normal = out, along = side;
                    float u = 0.5f;
                    if (m_kind == Kind::Ribbon) {
                        u = float(x) / float(c.across - 1);
                        q = p + side * ((2 * u - 1) * half);
                    } else if (m_kind == Kind::Tube) {
                        const float cosine = std::cos(around.angle[size_t(x)]),
                                    sine = std::sin(around.angle[size_t(x)]);
                        u = 0.5f - 0.5f * cosine;
                        normal = out * sine - side * cosine;
                        along = side * sine + out * cosine;
                        q = p + normal * (half * around.scale);
                    } else {
                        out_parts.mesh.radius[i] = half;
                    }
                    const Vec3f length_wise = d * float(c.segments), cross_wise = along * (2 * half);
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
        if (m_kind == Kind::Fibre && !m_curves.periodic)
            draw_in(c, out_parts);
    }

    // The ray tracer ends a fibre with half a ball: drawn in, so that from the side it covers what a blunt
    // one would.
    void draw_in(const Curve& c, MeshParts& parts) const {
        if (c.rings < 2)
            return;
        grid::Grid& g = parts.vertices;
        const size_t last = c.first + size_t(c.rings) - 1, n = size_t(g.stride);
        for (const auto& [end, next] : {std::pair{c.first, c.first + 1}, {last, last - 1}}) {
            const Vec3f to = g.position(int(next)) - g.position(int(end));
            const float l = length(to), by = std::min(Pi / 4 * parts.mesh.radius[end], l / 4);
            for (size_t e = 0; e < 3 && l > 0; e++)
                g.P[end + e * n] += to[int(e)] * (by / l);
        }
    }

    void connect(const Curve& c, uint32_t* to) const {
        const uint32_t n = uint32_t(c.across), faces = uint32_t(faces_of_ring(c));
        for (int r = 0; r + 1 < c.rings; r++) {
            const uint32_t a = uint32_t(c.first) + uint32_t(r) * n, b = a + n;
            if (m_kind == Kind::Fibre) {
                *to++ = a;
                continue;
            }
            for (uint32_t x = 0; x < faces; x++) { // wound to the outside
                const uint32_t y = (x + 1) % n;
                for (const uint32_t i : {a + x, b + x, b + y, a + y})
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
    Kind m_kind;
    bool m_first_width_only = false;
};

} // namespace

bool mesh_from_curves(const scene::Primitive& primitive, const scene::Curves& curves, const Transform& m,
                      const Viewpoint& view, bool polygons, Journal& journal, MeshParts& out,
                      const scene::Primitive* first) {
    CurveMesher mesher(primitive, curves, m, view, polygons);
    if (!mesher.read(primitive, m, journal))
        return false;
    if (first) {
        CurveMesher first_mesher(*first, curves, m, view, polygons);
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
