#include "geom/subdivision_kinds.h"

#include <bit>
#include <cmath>
#include <optional>
#include <unordered_map>

#include "base/tasks.h"

namespace kanuka::geom {
namespace {

constexpr int NodesAcross = 6, Nodes = NodesAcross * NodesAcross;
constexpr int Bicubic = 16, Gregory = 20; // terms; Gregory patches have two control points for one inside
constexpr int Terms = 24;                 // of a matrix's rows, for whole vectors
constexpr double Agrees = 1e-7;           // sum of the stencil weights' errors
constexpr int DeepestPart = 3;
constexpr int LeastFaces = 32; // of a kind: making it costs as much as evaluating so many faces

constexpr int Inner[4][2] = {{1, 1}, {2, 1}, {2, 2}, {1, 2}};

// How much of a Gregory patch's inner control points is the first one of the two (Loop et al. 2009, section
// 3): each goes from one to the other about its corner.
template <class T>
void gregory_weights(T s, T t, T* g) {
    const T a = 1 - s, b = 1 - t;
    const auto over = [](T x, T y) { return x / std::max(x + y, T(1e-30)); };
    g[0] = over(s, t);
    g[1] = over(t, a);
    g[2] = over(a, b);
    g[3] = over(b, s);
}

void bezier(double t, double* b) {
    const double s = 1 - t;
    b[0] = s * s * s, b[1] = 3 * s * s * t, b[2] = 3 * s * t * t, b[3] = t * t * t;
}

double node(int i) { // Chebyshev's, on [0, 1]
    return 0.5 - 0.5 * std::cos((2 * i + 1) * 3.14159265358979323846 / (2 * NodesAcross));
}

// All terms at a place: 16 of Bezier's, and what the second inner control points have beyond the first.
void terms_at(double s, double t, double* out) {
    double bs[4], bt[4], g[4];
    bezier(s, bs);
    bezier(t, bt);
    for (int k = 0; k < 16; k++)
        out[k] = bs[k % 4] * bt[k / 4];
    gregory_weights(s, t, g);
    for (int k = 0; k < 4; k++)
        out[16 + k] = bs[Inner[k][0]] * bt[Inner[k][1]] * g[k];
}

// Least squares on the nodes: terms = solve * values, by Gram and Schmidt (twice, which is as good as
// Householder).
struct LeastSquares {
    std::vector<double> terms; // [node][count]
    std::vector<double> solve; // [count][node]
    explicit LeastSquares(int count) : terms(size_t(Nodes) * count), solve(size_t(count) * Nodes) {
        std::vector<double> q(size_t(count) * Nodes), r(size_t(count) * count, 0.0);
        for (int n = 0; n < Nodes; n++) {
            double all[Gregory];
            terms_at(node(n % NodesAcross), node(n / NodesAcross), all);
            std::copy_n(all, count, &terms[size_t(n) * count]);
        }
        for (int k = 0; k < count; k++) {
            double* column = &q[size_t(k) * Nodes];
            for (int n = 0; n < Nodes; n++)
                column[n] = terms[size_t(n) * count + k];
            for (int pass = 0; pass < 2; pass++)
                for (int j = 0; j < k; j++) {
                    double d = 0;
                    for (int n = 0; n < Nodes; n++)
                        d += q[size_t(j) * Nodes + n] * column[n];
                    r[size_t(j) * count + k] += d;
                    for (int n = 0; n < Nodes; n++)
                        column[n] -= d * q[size_t(j) * Nodes + n];
                }
            double l = 0;
            for (int n = 0; n < Nodes; n++)
                l += column[n] * column[n];
            l = std::sqrt(l);
            r[size_t(k) * count + k] = l;
            for (int n = 0; n < Nodes; n++)
                column[n] /= l;
        }
        for (int n = 0; n < Nodes; n++) // R x = Q^T e_n from the last row up
            for (int k = count - 1; k >= 0; k--) {
                double x = q[size_t(k) * Nodes + n];
                for (int j = k + 1; j < count; j++)
                    x -= r[size_t(k) * count + j] * solve[size_t(j) * Nodes + n];
                solve[size_t(k) * Nodes + n] = x / r[size_t(k) * count + k];
            }
    }
};

const LeastSquares& fit_of(int count) {
    static const LeastSquares bicubic(Bicubic), gregory(Gregory);
    return count == Bicubic ? bicubic : gregory;
}

// Local coordinates and weights of lattice lines in a part. Slopes are per unit of the face's own.
struct LocalLine {
    static constexpr int Short = 40;
    LocalLine(Line line, float origin, float size)
        : large(line.count > Short ? line.count : 0), at(large.empty() ? small : large.data()),
          weights(4, line.count) {
        for (int i = 0; i < line.count; i++)
            at[i] = (line[i] - origin) / size;
    }
    // Few lattice points in a small range of it: the control points' rounding would be seen.
    bool wide() const { return weights.count() == 1 || at[weights.count() - 1] - at[0] >= 0.25f; }
    float small[Short];
    std::vector<float> large;
    float* at;
    Weights weights;
};

void scale_slopes(Weights& w, float by) {
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < w.count(); i++)
            w.slope(k)[i] *= by;
}

void add(float* to, int columns, int rows, int pitch, float value) {
    for (int j = 0; j < rows; j++)
        for (int i = 0; i < columns; i++)
            to[size_t(j) * pitch + i] += value;
}

void scale(float* to, int columns, int rows, int pitch, float by) {
    for (int j = 0; j < rows; j++)
        for (int i = 0; i < columns; i++)
            to[size_t(j) * pitch + i] *= by;
}

} // namespace

ControlValues::ControlValues(const float* values, int width, const int* points, int count) : m_count(count) {
    if (size_t(count) * width > Small || width > SmallWidth) {
        m_large.resize(size_t(count + 1) * width);
        m_data = m_large.data();
        m_origin = m_data + size_t(count) * width;
    } else {
        m_data = m_small;
        m_origin = m_small_origin;
    }
    const float* first = values + size_t(points[0]) * width;
    for (int c = 0; c < width; c++)
        m_origin[c] = first[c];
    for (int k = 0; k < count; k++) {
        const float* p = values + size_t(points[k]) * width;
        for (int c = 0; c < width; c++)
            m_data[size_t(c) * count + k] = p[c] - m_origin[c];
    }
}

void fill_bspline(const ControlValues& points, Line u, Line v, const PatchTarget* targets, int count,
                  int pitch) {
    LocalLine lu(u, 0, 1), lv(v, 0, 1);
    const auto each = [&](auto&& evaluate) {
        for (int c = 0; c < count; c++) {
            evaluate(points.component(c), targets[c]);
            add(targets[c].value, u.count, v.count, pitch, points.origin(c));
        }
    };
    if (lu.wide() && lv.wide()) {
        cubic_weights({lu.at, u.count}, BsplineBasis, lu.weights);
        cubic_weights({lv.at, v.count}, BsplineBasis, lv.weights);
        each([&](const float* control, const PatchTarget& t) {
            tensor_slopes(control, lu.weights, lv.weights, t.value, t.du, t.dv, pitch);
        });
        return;
    }
    const TensorLattice lattice(u, &BsplineBasis, v, &BsplineBasis);
    each([&](const float* control, const PatchTarget& t) {
        lattice.slopes(control, t.value, t.du, t.dv, pitch);
    });
}

// ---- making a kind ----------------------------------------------------------------------------------

class PatchKind::Fitter {
  public:
    Fitter(const osd::Bfr::Surface<double>& surface, int corner, PatchKind& kind)
        : m_surface(surface), m_parameters(surface.GetParameterization()), m_corner(corner), m_kind(kind),
          m_points(surface.GetNumControlPoints()) {
        kind.m_points = m_points;
        kind.m_parts.emplace_back();
    }

    bool split(int part, double u0, double v0, double size, int depth) {
        if (depth > DeepestPart)
            return false;
        const int first = int(m_kind.m_parts.size());
        m_kind.m_parts[part].first_child = first;
        m_kind.m_parts.resize(size_t(first) + 4);
        const double half = size / 2;
        for (int k = 0; k < 4; k++) {
            const double u = u0 + half * (k & 1), v = v0 + half * (k >> 1);
            if (!fits(first + k, u, v, half) && !split(first + k, u, v, half, depth + 1))
                return false;
        }
        return true;
    }

  private:
    void stencil(double u, double v, double* out) const {
        double uv[2] = {u, v};
        if (m_corner >= 0) {
            const double local[2] = {u, v};
            m_parameters.ConvertNormalizedSubFaceToCoord(m_corner, local, uv);
        }
        m_surface.EvaluateStencil(uv, out);
    }

    bool fits(int part, double u0, double v0, double size) {
        m_stencils.resize(size_t(Nodes) * m_points);
        for (int n = 0; n < Nodes; n++)
            stencil(u0 + size * node(n % NodesAcross), v0 + size * node(n / NodesAcross),
                    &m_stencils[size_t(n) * m_points]);
        return fits(part, Bicubic) || fits(part, Gregory);
    }

    bool fits(int part, int count) {
        const LeastSquares& fit = fit_of(count);
        std::vector<double> terms(size_t(count) * m_points, 0.0);
        for (int k = 0; k < count; k++)
            for (int n = 0; n < Nodes; n++) {
                const double w = fit.solve[size_t(k) * Nodes + n];
                for (int p = 0; p < m_points; p++)
                    terms[size_t(k) * m_points + p] += w * m_stencils[size_t(n) * m_points + p];
            }
        for (int n = 0; n < Nodes; n++) {
            double error = 0;
            for (int p = 0; p < m_points; p++) {
                double sum = 0;
                for (int k = 0; k < count; k++)
                    sum += fit.terms[size_t(n) * count + k] * terms[size_t(k) * m_points + p];
                error += std::abs(sum - m_stencils[size_t(n) * m_points + p]);
            }
            if (!(error <= Agrees))
                return false;
        }
        Part& to = m_kind.m_parts[part];
        to.gregory = count == Gregory;
        to.matrix = m_kind.m_matrices.size();
        m_kind.m_matrices.resize(to.matrix + size_t(Terms) * m_points, 0.0f);
        for (int p = 0; p < m_points; p++)
            for (int k = 0; k < count; k++)
                m_kind.m_matrices[to.matrix + size_t(p) * Terms + k] = float(terms[size_t(k) * m_points + p]);
        return true;
    }

    const osd::Bfr::Surface<double>& m_surface;
    osd::Bfr::Parameterization m_parameters;
    int m_corner;
    PatchKind& m_kind;
    int m_points;
    std::vector<double> m_stencils;
};

std::unique_ptr<PatchKind> PatchKind::make(const osd::Bfr::Surface<double>& surface, int corner) {
    auto kind = std::make_unique<PatchKind>();
    Fitter fitter(surface, corner, *kind);
    if (!fitter.split(0, 0, 0, 1, 1))
        return nullptr;
    return kind;
}

// ---- evaluating -------------------------------------------------------------------------------------

class PatchKind::Evaluation {
  public:
    Evaluation(const PatchKind& kind, const ControlValues& points, Line u, Line v, const PatchTarget* targets,
               int count, int pitch)
        : m_kind(kind), m_points(points), m_u(u), m_v(v), m_targets(targets), m_count(count), m_pitch(pitch) {
    }

    void visit(int part, const Region& r) {
        if (r.i0 >= r.i1 || r.j0 >= r.j1)
            return;
        const int child = m_kind.m_parts[part].first_child;
        if (child < 0) {
            evaluate(m_kind.m_parts[part], r);
            return;
        }
        const float half = r.size / 2, u = r.u0 + half, v = r.v0 + half;
        const int i = int(std::lower_bound(m_u.data + r.i0, m_u.data + r.i1, u) - m_u.data);
        const int j = int(std::lower_bound(m_v.data + r.j0, m_v.data + r.j1, v) - m_v.data);
        visit(child, {r.i0, i, r.j0, j, r.u0, r.v0, half});
        visit(child + 1, {i, r.i1, r.j0, j, u, r.v0, half});
        visit(child + 2, {r.i0, i, j, r.j1, r.u0, v, half});
        visit(child + 3, {i, r.i1, j, r.j1, u, v, half});
    }

  private:
    void terms(const Part& part, int component, float* out) const {
        const float* x = m_points.component(component);
        const float* m = m_kind.m_matrices.data() + part.matrix;
        const int count = part.gregory ? Terms : Bicubic;
        float sum[Terms] = {};
        for (int p = 0; p < m_kind.m_points; p++, m += Terms)
            for (int k = 0; k < count; k++)
                sum[k] = fma(m[k], x[p], sum[k]);
        std::copy_n(sum, Terms, out);
    }

    void evaluate(const Part& part, const Region& r) {
        const int columns = r.i1 - r.i0, rows = r.j1 - r.j0;
        const size_t at = size_t(r.j0) * m_pitch + r.i0;
        LocalLine u({m_u.data + r.i0, columns}, r.u0, r.size), v({m_v.data + r.j0, rows}, r.v0, r.size);
        const bool wide = u.wide() && v.wide(), slopes = m_targets[0].du != nullptr;
        const float per_unit = 1 / r.size;
        std::optional<TensorLattice> narrow;
        if (!wide)
            narrow.emplace(Line{u.at, columns}, &BezierBasis, Line{v.at, rows}, &BezierBasis);
        if (wide || part.gregory) {
            cubic_weights({u.at, columns}, BezierBasis, u.weights);
            cubic_weights({v.at, rows}, BezierBasis, v.weights);
            if (slopes) {
                scale_slopes(u.weights, per_unit);
                scale_slopes(v.weights, per_unit);
            }
        }
        m_terms.resize(size_t(m_count) * Terms);
        for (int c = 0; c < m_count; c++) {
            float* control = &m_terms[size_t(c) * Terms];
            terms(part, c, control);
            const PatchTarget& t = m_targets[c];
            float *value = t.value + at, *du = t.du ? t.du + at : nullptr, *dv = t.dv ? t.dv + at : nullptr;
            if (wide) {
                tensor_slopes(control, u.weights, v.weights, value, du, dv, m_pitch);
            } else {
                narrow->slopes(control, value, du, dv, m_pitch);
                for (float* slope : {du, dv})
                    if (slope)
                        scale(slope, columns, rows, m_pitch, per_unit);
            }
            add(value, columns, rows, m_pitch, m_points.origin(c));
        }
        if (part.gregory)
            add_gregory(u, v, at);
    }

    // What the inner control points are beyond the first of two. Slopes take them for constants, as
    // OpenSubdiv does: on the borders that is exact.
    void add_gregory(const LocalLine& u, const LocalLine& v, size_t at) {
        const int columns = u.weights.count(), rows = v.weights.count();
        m_line.resize(size_t(8) * columns);
        for (int j = 0; j < rows; j++) {
            for (int i = 0; i < columns; i++) {
                float g[4];
                gregory_weights(u.at[i], v.at[j], g);
                for (int k = 0; k < 4; k++) {
                    m_line[size_t(k) * columns + i] = g[k] * u.weights.value(Inner[k][0])[i];
                    m_line[size_t(4 + k) * columns + i] = g[k] * u.weights.slope(Inner[k][0])[i];
                }
            }
            const float *a = m_line.data(), *d = a + size_t(4) * columns;
            const size_t row = at + size_t(j) * m_pitch;
            for (int c = 0; c < m_count; c++) {
                const PatchTarget& t = m_targets[c];
                float w[4], s[4];
                for (int k = 0; k < 4; k++) {
                    const float more = m_terms[size_t(c) * Terms + 16 + k];
                    w[k] = more * v.weights.value(Inner[k][1])[j];
                    s[k] = more * v.weights.slope(Inner[k][1])[j];
                }
                const auto mix = [&](const float* x, const float* by, float* to) {
                    for (int i = 0; i < columns; i++)
                        to[i] += fma(x[i], by[0],
                                     fma(x[columns + i], by[1],
                                         fma(x[2 * columns + i], by[2], x[3 * columns + i] * by[3])));
                };
                mix(a, w, t.value + row);
                if (t.du) {
                    mix(d, w, t.du + row);
                    mix(a, s, t.dv + row);
                }
            }
        }
    }

    const PatchKind& m_kind;
    const ControlValues& m_points;
    Line m_u, m_v;
    const PatchTarget* m_targets;
    int m_count, m_pitch;
    std::vector<float> m_terms, m_line;
};

void PatchKind::fill(const ControlValues& points, Line u, Line v, const PatchTarget* targets, int count,
                     int pitch) const {
    Evaluation(*this, points, u, v, targets, count, pitch).visit(0, {0, u.count, 0, v.count, 0, 0, 1});
}

// ---- what kind faces are ----------------------------------------------------------------------------

namespace {

using Signature = std::pair<uint64_t, uint64_t>;
struct SignatureHash {
    size_t operator()(const Signature& s) const { return s.first; }
};

// Two maps that agree bit for bit at a point without symmetries are the same.
Signature signature(const osd::Bfr::Surface<double>& surface, int corner, std::vector<double>& stencil) {
    double uv[2] = {0.371283, 0.617349};
    if (corner >= 0) {
        const double local[2] = {uv[0], uv[1]};
        surface.GetParameterization().ConvertNormalizedSubFaceToCoord(corner, local, uv);
    }
    stencil.resize(surface.GetNumControlPoints());
    surface.EvaluateStencil(uv, stencil.data());
    uint64_t a = stencil.size(), b = ~a;
    for (const double w : stencil) {
        a = (a ^ std::bit_cast<uint64_t>(w)) * 0x9e3779b97f4a7c15ull;
        a ^= a >> 29;
        b = (b + std::bit_cast<uint64_t>(w)) * 0xd6e8feb86659fd93ull;
        b ^= b >> 32;
    }
    return {a, b};
}

} // namespace

void PatchKinds::find(const std::vector<Face>& faces, const std::function<bool(int, DoubleSurface&)>& init,
                      const std::function<bool(int)>& skip) {
    constexpr size_t Grain = 64;
    std::vector<int> irregular;
    for (size_t f = 0; f < faces.size(); f++)
        if (!skip(int(f)))
            irregular.push_back(int(f));
    // Step 1: signatures.
    std::vector<Signature> signatures(irregular.size());
    std::vector<int> counts(irregular.size(), 0);
    tasks::parallel_chunks(irregular.size(), Grain, [&](size_t begin, size_t end) {
        std::vector<double> stencil;
        DoubleSurface surface;
        for (size_t i = begin; i < end; i++) {
            const Face& face = faces[irregular[i]];
            if (!init(face.base, surface) || surface.IsRegular() ||
                surface.GetParameterization().GetType() == osd::Bfr::Parameterization::TRI)
                continue;
            signatures[i] = signature(surface, face.corner, stencil);
            counts[i] = surface.GetNumControlPoints();
        }
    });
    // Step 2: kinds that many faces have.
    struct Group {
        int faces = 0, kind = -1;
        size_t first = 0;
    };
    std::unordered_map<Signature, Group, SignatureHash> groups;
    for (size_t i = 0; i < irregular.size(); i++)
        if (counts[i] > 0) {
            Group& g = groups[signatures[i]];
            if (g.faces++ == 0)
                g.first = i;
        }
    std::vector<size_t> examples;
    for (size_t i = 0; i < irregular.size(); i++)
        if (counts[i] > 0) {
            Group& g = groups[signatures[i]];
            if (g.first == i && g.faces >= LeastFaces) {
                g.kind = int(examples.size());
                examples.push_back(i);
            }
        }
    if (examples.empty())
        return;
    m_kinds.resize(examples.size());
    m_count.resize(examples.size());
    tasks::parallel_chunks(examples.size(), 1, [&](size_t begin, size_t end) {
        DoubleSurface surface;
        for (size_t k = begin; k < end; k++) {
            const Face& face = faces[irregular[examples[k]]];
            init(face.base, surface);
            m_kinds[k] = PatchKind::make(surface, face.corner);
            m_count[k] = counts[examples[k]];
        }
    });
    // Step 3: their faces' control points.
    m_of.assign(faces.size(), -1);
    m_first.assign(faces.size(), 0);
    size_t total = 0;
    for (size_t i = 0; i < irregular.size(); i++) {
        const int kind = counts[i] > 0 ? groups[signatures[i]].kind : -1;
        if (kind < 0 || !m_kinds[kind])
            continue;
        const int f = irregular[i];
        m_of[f] = kind;
        // The quads of an n-gon lie side by side and have the same control points.
        const bool same = i > 0 && irregular[i - 1] == f - 1 && m_of[f - 1] >= 0 &&
                          faces[f - 1].base == faces[f].base && counts[i - 1] == counts[i];
        m_first[f] = same ? m_first[f - 1] : total;
        total += same ? 0 : size_t(counts[i]);
    }
    m_points.resize(total);
    tasks::parallel_chunks(irregular.size(), Grain, [&](size_t begin, size_t end) {
        DoubleSurface surface;
        for (size_t i = begin; i < end; i++) {
            const int f = irregular[i];
            const bool shared = f > 0 && m_of[f] >= 0 && m_of[f - 1] >= 0 && m_first[f] == m_first[f - 1] &&
                                faces[f - 1].base == faces[f].base;
            if (m_of[f] >= 0 && !shared && init(faces[f].base, surface))
                surface.GetControlPointIndices(m_points.data() + m_first[f]);
        }
    });
}

} // namespace kanuka::geom
