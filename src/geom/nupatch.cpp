// NuPatch: rational B-spline surfaces. Every knot span is a face. Trim curves are kept for dicing.
#include "geom/kinds.h"
#include "geom/lattice_surface.h"

namespace kanuka::geom {
namespace {

constexpr int MaxOrder = 32;

struct Span {
    int knot;        // basis functions knot - order + 1 … knot are non-zero here
    double from, to; // parameters
    int segment;     // counted over all knot intervals, also those of no length, for varying and uniform data
    // Part of the knot interval that the range leaves: varying data are of all of it.
    double first = 0, last = 1;
};

// One direction: order, knots and the spans that lie inside [lo, hi].
struct Direction {
    int count = 0, order = 0;
    std::vector<double> knots;
    double lo = 0, hi = 1;
    std::vector<Span> spans;
    int segments = 0;

    std::string prepare(int n, int k, const scene::Buffer<float>& given, double from, double to,
                        const char* name) {
        count = n, order = k, lo = from, hi = to;
        knots.assign(given.begin(), given.end());
        if (order < 2 || order > MaxOrder || count < order)
            return std::string("its ") + name + " direction has " + std::to_string(n) +
                   " control points of order " + std::to_string(k) +
                   "; order must be 2 to 32 and at most that number";
        if (knots.size() < size_t(count + order))
            return std::string("its ") + name + " direction needs " + std::to_string(count + order) +
                   " knots, found " + std::to_string(knots.size());
        for (int i = 1; i < count + order; i++)
            if (!(knots[i] >= knots[i - 1]) || !std::isfinite(knots[i]))
                return std::string("its ") + name + " knots are not in rising order";
        lo = std::max(lo, knots[order - 1]);
        hi = std::min(hi, knots[count]);
        if (!(hi > lo))
            return std::string("its ") + name + " range is empty";
        for (int i = order - 1; i < count; i++) {
            if (!(knots[i + 1] > knots[i]))
                continue;
            const double a = std::max(lo, knots[i]), b = std::min(hi, knots[i + 1]);
            const double length = knots[i + 1] - knots[i];
            if (b > a)
                spans.push_back({i, a, b, i - (order - 1), (a - knots[i]) / length, (b - knots[i]) / length});
        }
        segments = count - order + 1;
        return {};
    }

    // The span at a parameter in [0, 1] (clamped) of the whole range, and where it is in that.
    int find(double t, float& within) const {
        const double x = lo + (hi - lo) * std::clamp(t, 0.0, 1.0);
        size_t i = 0;
        while (i + 1 < spans.size() && x >= spans[i].to)
            i++;
        within = std::clamp(float((x - spans[i].from) / (spans[i].to - spans[i].from)), 0.0f, 1.0f);
        return int(i);
    }

    // Cox-de Boor (The NURBS Book, A2.2 and eq. 2.7) at parameters given within the span, in double.
    void weights(const Span& span, Line t, Weights& w) const {
        const int p = order - 1;
        const double* k = knots.data();
        for (int s = 0; s < t.count; s++) {
            const double x = span.from + (span.to - span.from) * double(t[s]);
            double n[MaxOrder], lower[MaxOrder] = {};
            n[0] = 1;
            for (int d = 1; d <= p; d++) {
                if (d == p)
                    std::copy_n(n, p, lower);
                double saved = 0;
                for (int r = 0; r < d; r++) {
                    const double right = k[span.knot + r + 1], left = k[span.knot + 1 - d + r];
                    const double f = n[r] / (right - left);
                    n[r] = saved + (right - x) * f;
                    saved = (x - left) * f;
                }
                n[d] = saved;
            }
            const int i0 = span.knot - p;
            for (int r = 0; r <= p; r++) {
                const double before = r > 0 ? lower[r - 1] / (k[i0 + r + p] - k[i0 + r]) : 0;
                const double after = r < p ? lower[r] / (k[i0 + r + p + 1] - k[i0 + r + 1]) : 0;
                w.value(r)[s] = float(n[r]);
                w.slope(r)[s] = float(p * (before - after) * (span.to - span.from));
            }
        }
    }
};

class NurbsSurface : public Surface {
  public:
    NurbsSurface(const scene::Primitive& primitive, const Transform& m)
        : Surface(primitive, m), m_points(control_points(primitive, m)) {}

    bool prepare(const scene::Primitive& primitive, const scene::NuPatch& patch, Journal& journal) {
        std::string why = m_u.prepare(patch.nu, patch.u_order, patch.u_knots, patch.u_min, patch.u_max, "u");
        if (why.empty())
            why = m_v.prepare(patch.nv, patch.v_order, patch.v_knots, patch.v_min, patch.v_max, "v");
        const size_t need = size_t(std::max(0, patch.nu)) * std::max(0, patch.nv);
        if (why.empty() && m_points.size() < need)
            why = "it needs " + std::to_string(need) + " control points, found " +
                  std::to_string(m_points.size());
        if (!why.empty()) {
            journal.error(primitive.where, "a NURBS patch was left out: " + why);
            return false;
        }
        const int spans = int(m_u.spans.size() * m_v.spans.size());
        const auto lattice_vertex = [&](int f, int k) { return vertex(span_u(f), span_v(f), k); };
        if (!m_finite.find(m_points, need, spans, m_u.order * m_v.order, lattice_vertex,
                           "knot spans of a NURBS patch", primitive.where, journal))
            return false;
        m_trim = patch.trim;
        ItemCounts counts;
        counts.uniform = size_t(m_u.segments) * m_v.segments;
        counts.varying = counts.facevarying = size_t(m_u.segments + 1) * (m_v.segments + 1);
        counts.vertex = need;
        m_primvars = collect_primvars(primitive, m_page_from_object, counts, journal);
        FiniteFaces finite = std::exchange(m_finite, {}); // of the whole lattice first
        const LatticeShape shape = find_lattice(*this, {int(m_u.spans.size()), int(m_v.spans.size())});
        m_finite = std::move(finite);
        set_lattice(shape);
        return true;
    }
    void set_lattice(const LatticeShape& shape) override {
        Surface::set_lattice(shape);
        m_finite.keep(m_topology);
    }

    void positions(int face, Line u, Line v, float* out, int stride) const override {
        places(span_u(face), span_v(face), u, v, out, stride);
    }

    FaceRange range(int face) const override {
        const Span &a = span_u(face), &b = span_v(face);
        const double wu = m_u.hi - m_u.lo, wv = m_v.hi - m_v.lo;
        return {float((a.from - m_u.lo) / wu), float((a.to - m_u.lo) / wu), float((b.from - m_v.lo) / wv),
                float((b.to - m_v.lo) / wv)};
    }
    int uniform_index(int face) const override {
        return span_v(face).segment * m_u.segments + span_u(face).segment;
    }

    const scene::TrimCurves* trim() const override { return m_trim.get(); }
    ParameterRange parameters() const override { return {m_u.lo, m_u.hi, m_v.lo, m_v.hi}; }
    Vec3f at_parameters(double u, double v) const override {
        float fu, fv;
        const int i = m_u.find(u, fu), j = m_v.find(v, fv);
        float p[3];
        places(m_u.spans[size_t(i)], m_v.spans[size_t(j)], {&fu, 1}, {&fv, 1}, p,
               1); // of those left out, too
        return {p[0], p[1], p[2]};
    }

  protected:
    void shape(int face, Line u, Line v, Lattice out) const override {
        Weights wu(m_u.order, u.count), wv(m_v.order, v.count), lu(2, u.count), lv(2, v.count);
        shape_points(span_u(face), span_v(face), u, v, out, wu, wv);
        linear_weights(span_u(face), u, lu);
        linear_weights(span_v(face), v, lv);
        std::vector<float> q(size_t(m_u.order) * m_v.order + 4);
        const int columns = m_u.segments + 1;
        for (const Primvar& p : m_primvars.list)
            for (int c = 0; c < p.components; c++) {
                float* to = p.destination(out.grid, c) + out.base;
                if (p.detail == scene::Detail::Vertex) {
                    for (int k = 0; k < m_u.order * m_v.order; k++)
                        q[k] = p(vertex(span_u(face), span_v(face), k), c);
                    tensor_values(q.data(), wu, wv, to, out.pitch);
                    continue;
                }
                for (int k = 0; k < 4; k++) // corners of the whole knot interval
                    q[k] =
                        p.detail == scene::Detail::Uniform
                            ? p(uniform_index(face), c)
                            : p(size_t(span_v(face).segment + k / 2) * columns + span_u(face).segment + k % 2,
                                c);
                tensor_values(q.data(), lu, lv, to, out.pitch);
            }
    }

  private:
    static void linear_weights(const Span& span, Line t, Weights& w) {
        std::vector<float> within(size_t(t.count));
        for (int i = 0; i < t.count; i++)
            within[size_t(i)] = float(span.first + (span.last - span.first) * double(t[i]));
        geom::linear_weights({within.data(), t.count}, w);
    }
    const Span& span_u(int face) const { return m_u.spans[m_finite.in_lattice(face) % m_u.spans.size()]; }
    const Span& span_v(int face) const { return m_v.spans[m_finite.in_lattice(face) / m_u.spans.size()]; }
    size_t vertex(const Span& a, const Span& b, int k) const {
        const int i = a.knot - m_u.order + 1 + k % m_u.order;
        const int j = b.knot - m_v.order + 1 + k / m_u.order;
        return size_t(j) * m_u.count + i;
    }

    void places(const Span& a, const Span& b, Line u, Line v, float* out, int stride) const {
        grid::Grid scratch;
        scratch.stride = u.count * v.count;
        scratch.P.resize(size_t(3) * scratch.stride);
        scratch.dPdu.resize(scratch.P.size());
        scratch.dPdv.resize(scratch.P.size());
        Weights wu(m_u.order, u.count), wv(m_v.order, v.count);
        shape_points(a, b, u, v, {scratch, 0, u.count}, wu, wv);
        for (int c = 0; c < 3; c++)
            std::copy_n(scratch.P.data() + size_t(c) * scratch.stride, scratch.stride,
                        out + size_t(c) * stride);
    }

    void shape_points(const Span& a, const Span& b, Line u, Line v, Lattice out, Weights& wu,
                      Weights& wv) const {
        m_u.weights(a, u, wu);
        m_v.weights(b, v, wv);
        grid::Grid& g = out.grid;
        const int n = m_u.order * m_v.order;
        std::vector<float> q(n);
        for (int c = 0; c < 3; c++) {
            for (int k = 0; k < n; k++)
                q[k] = m_points.xyz[3 * vertex(a, b, k) + c];
            const size_t at = size_t(c) * g.stride + out.base;
            tensor_slopes(q.data(), wu, wv, &g.P[at], &g.dPdu[at], &g.dPdv[at], out.pitch);
        }
        if (m_points.weights.empty())
            return;
        for (int k = 0; k < n; k++)
            q[k] = m_points.weights[vertex(a, b, k)];
        const size_t count = size_t(u.count) * v.count;
        std::vector<float> w(3 * count);
        tensor_slopes(q.data(), wu, wv, w.data(), w.data() + count, w.data() + 2 * count, u.count);
        divide_rational(w.data(), w.data() + count, w.data() + 2 * count, u.count, v.count, out);
    }

    Direction m_u, m_v;
    ControlPoints m_points;
    FiniteFaces m_finite;
    std::shared_ptr<const scene::TrimCurves> m_trim;
};

} // namespace

SurfacePtr make_nupatch(const scene::Primitive& primitive, const scene::NuPatch& patch, const Transform& m,
                        Journal& journal) {
    auto surface = std::make_unique<NurbsSurface>(primitive, m);
    return surface->prepare(primitive, patch, journal) ? std::move(surface) : nullptr;
}

} // namespace kanuka::geom
