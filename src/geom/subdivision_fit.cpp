// Making a patch kind: a map that agrees with OpenSubdiv's stencils, part by part.
#include <cmath>

#include "geom/gregory.h"
#include "geom/subdivision_kinds.h"

namespace kanuka::geom {
namespace {

constexpr int NodesAcross = 6, Nodes = NodesAcross * NodesAcross;
constexpr double Agrees = 1e-7; // sum of the stencil weights' errors
constexpr int DeepestPart = 3;

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

} // namespace

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

} // namespace kanuka::geom
