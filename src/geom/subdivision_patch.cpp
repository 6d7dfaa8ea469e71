// Patches of a subdivision surface on lattices. A regular patch is a bicubic (or bilinear) polynomial and
// goes through the vectorised loops that patch meshes use. Bfr refines the others towards their extraordinary
// corner and has Gregory patches there; what it refines to is bicubic on quarters, on their quarters and so
// on. Where enough of the lattice lies in such a part, its polynomial is interpolated from 16 values and
// checked at others.
#include "geom/subdivision_patch.h"

#include <algorithm>

namespace kanuka::geom {
namespace {

using osd::Bfr::Parameterization;

// Chebyshev's nodes on [0, 1] for cubics.
constexpr std::array<float, 4> Nodes{0.03806023f, 0.30865828f, 0.69134172f, 0.96193977f};
// Not nodes, one in each quarter.
constexpr float Checks[4][2] = {{0.19f, 0.14f}, {0.86f, 0.23f}, {0.29f, 0.81f}, {0.66f, 0.71f}};
constexpr float Agrees =
    4e-6f; // of the part's extent; slopes of neighbouring parts agree to a few times that
constexpr int LeastPoints = 24; // of the lattice in a part: fewer are evaluated one by one
constexpr int DeepestPart = 3;

// values[4 * j + i] at (Nodes[i], Nodes[j]) to Bezier control points, in place.
void interpolate(std::array<float, 16>& values) {
    static const auto inverse = [] {
        double a[4][8] = {};
        for (int r = 0; r < 4; r++) {
            const double t = double(Nodes[r]), s = 1 - t;
            const double b[4] = {s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t};
            std::copy_n(b, 4, a[r]);
            a[r][4 + r] = 1;
        }
        for (int k = 0; k < 4;
             k++) { // Gauss and Jordan; the matrix is totally positive and needs no pivoting
            const double d = a[k][k];
            for (double& x : a[k])
                x /= d;
            for (int r = 0; r < 4; r++) {
                const double f = a[r][k];
                for (int c = 0; c < 8 && r != k; c++)
                    a[r][c] -= f * a[k][c];
            }
        }
        std::array<std::array<double, 4>, 4> m;
        for (int r = 0; r < 4; r++)
            std::copy_n(a[r] + 4, 4, m[r].begin());
        return m;
    }();
    double half[4][4] = {};
    for (int j = 0; j < 4; j++)
        for (int i = 0; i < 4; i++)
            for (int k = 0; k < 4; k++)
                half[j][i] += inverse[i][k] * double(values[4 * j + k]);
    for (int j = 0; j < 4; j++)
        for (int i = 0; i < 4; i++) {
            double sum = 0;
            for (int k = 0; k < 4; k++)
                sum += inverse[j][k] * half[k][i];
            values[4 * j + i] = float(sum);
        }
}

float at_bezier(const std::array<float, 16>& control, float u, float v) {
    const auto weights = [](float t) {
        const float s = 1 - t;
        return std::array<float, 4>{s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t};
    };
    const std::array<float, 4> a = weights(u), b = weights(v);
    float sum = 0;
    for (int j = 0; j < 4; j++)
        for (int i = 0; i < 4; i++)
            sum = fma(a[i] * b[j], control[4 * j + i], sum);
    return sum;
}

class Filler {
  public:
    Filler(const FacePatch& patch, const FaceChart& chart, Line u, Line v,
           const std::vector<PatchTarget>& targets, int pitch)
        : m_patch(patch), m_chart(chart), m_u(u), m_v(v), m_targets(targets), m_pitch(pitch),
          m_values(3 * targets.size()) {}

    void bspline() {
        const size_t n = m_targets.size();
        float control[16];
        const TensorLattice lattice(m_u, &BsplineBasis, m_v, &BsplineBasis);
        for (size_t c = 0; c < n; c++) {
            for (size_t k = 0; k < 16; k++)
                control[k] = m_patch.points[k * n + c];
            lattice.slopes(control, m_targets[c].value, m_targets[c].du, m_targets[c].dv, m_pitch);
        }
    }

    // Regular, at a border or beside a sharp edge: by Hermite data of the corners.
    void regular() {
        const size_t n = m_targets.size(), size = 6 * n;
        std::vector<float> corner(4 * size);
        for (int k = 0; k < 4; k++) {
            const float uv[2] = {float(k & 1), float(k >> 1)};
            float* d = corner.data() + k * size;
            m_patch.surface.Evaluate(uv, m_patch.points.data(), m_patch.layout, d, d + n, d + 2 * n,
                                     d + 3 * n, d + 4 * n, d + 5 * n);
        }
        const TensorLattice lattice(m_u, &BezierBasis, m_v, &BezierBasis);
        float control[16];
        for (size_t c = 0; c < n; c++) {
            for (int j = 0; j < 4; j++)
                for (int i = 0; i < 4; i++) {
                    // Value, both slopes and the twist at the nearest corner.
                    const float* d = corner.data() + ((i > 1) + 2 * (j > 1)) * size + c;
                    const float a = i == 1 ? 1.0f / 3 : i == 2 ? -1.0f / 3 : 0;
                    const float b = j == 1 ? 1.0f / 3 : j == 2 ? -1.0f / 3 : 0;
                    control[4 * j + i] = d[0] + a * d[n] + b * d[2 * n] + a * b * d[4 * n];
                }
            lattice.slopes(control, m_targets[c].value, m_targets[c].du, m_targets[c].dv, m_pitch);
        }
    }

    // Columns i0 … i1 - 1 and rows j0 … j1 - 1, which lie in the square of side `size` at (u0, v0).
    void part(int i0, int i1, int j0, int j1, float u0, float v0, float size, int depth) {
        if (i0 >= i1 || j0 >= j1)
            return;
        if ((i1 - i0) * (j1 - j0) < LeastPoints || depth > DeepestPart) {
            one_by_one(i0, i1, j0, j1);
            return;
        }
        if (depth > 0 && polynomial(i0, i1, j0, j1, u0, v0, size))
            return;
        const float half = size / 2;
        const int i = int(std::lower_bound(m_u.data + i0, m_u.data + i1, u0 + half) - m_u.data);
        const int j = int(std::lower_bound(m_v.data + j0, m_v.data + j1, v0 + half) - m_v.data);
        part(i0, i, j0, j, u0, v0, half, depth + 1);
        part(i, i1, j0, j, u0 + half, v0, half, depth + 1);
        part(i0, i, j, j1, u0, v0 + half, half, depth + 1);
        part(i, i1, j, j1, u0 + half, v0 + half, half, depth + 1);
    }

    void one_by_one(int i0, int i1, int j0, int j1) {
        const size_t n = m_targets.size();
        float *p = m_values.data(), *pu = p + n, *pv = pu + n;
        const bool slopes = m_targets[0].du != nullptr;
        for (int j = j0; j < j1; j++)
            for (int i = i0; i < i1; i++) {
                const FaceChart::Place at = m_chart(m_u[i], m_v[j]);
                const size_t to = size_t(j) * m_pitch + i;
                if (slopes)
                    m_patch.surface.Evaluate(at.uv, m_patch.points.data(), m_patch.layout, p, pu, pv);
                else
                    m_patch.surface.Evaluate(at.uv, m_patch.points.data(), m_patch.layout, p);
                for (size_t c = 0; c < n; c++) {
                    m_targets[c].value[to] = p[c];
                    if (!m_targets[c].du)
                        continue;
                    m_targets[c].du[to] = fma(pu[c], at.du[0], pv[c] * at.du[1]);
                    m_targets[c].dv[to] = fma(pu[c], at.dv[0], pv[c] * at.dv[1]);
                }
            }
    }

  private:
    void value(float u, float v) {
        const FaceChart::Place at = m_chart(u, v);
        m_patch.surface.Evaluate(at.uv, m_patch.points.data(), m_patch.layout, m_values.data());
    }

    // False: it is none, and nothing has been written.
    bool polynomial(int i0, int i1, int j0, int j1, float u0, float v0, float size) {
        const size_t n = m_targets.size();
        m_controls.resize(n);
        for (int k = 0; k < 16; k++) {
            value(u0 + size * Nodes[k % 4], v0 + size * Nodes[k / 4]);
            for (size_t c = 0; c < n; c++)
                m_controls[c][k] = m_values[c];
        }
        m_extents.resize(n);
        for (size_t c = 0; c < n; c++) {
            const auto [low, high] = std::minmax_element(m_controls[c].begin(), m_controls[c].end());
            // What the values are rounded to counts too, far from the origin.
            m_extents[c] = std::max(*high - *low, 0.1f * std::max(abs(*low), abs(*high)));
            interpolate(m_controls[c]);
        }
        // One coordinate may hardly change where the others do.
        if (m_targets[0].du) // the coordinates: one of them may hardly change
            m_extents[0] = m_extents[1] = m_extents[2] = std::max({m_extents[0], m_extents[1], m_extents[2]});
        for (const auto& [x, y] : Checks) {
            value(u0 + size * x, v0 + size * y);
            for (size_t c = 0; c < n; c++)
                if (!(abs(at_bezier(m_controls[c], x, y) - m_values[c]) <= Agrees * m_extents[c]))
                    return false;
        }
        m_line.resize(size_t(i1 - i0) + size_t(j1 - j0));
        float *us = m_line.data(), *vs = us + (i1 - i0);
        for (int i = i0; i < i1; i++)
            us[i - i0] = (m_u[i] - u0) / size;
        for (int j = j0; j < j1; j++)
            vs[j - j0] = (m_v[j] - v0) / size;
        const TensorLattice lattice({us, i1 - i0}, &BezierBasis, {vs, j1 - j0}, &BezierBasis);
        const size_t at = size_t(j0) * m_pitch + i0;
        for (size_t c = 0; c < n; c++) {
            const PatchTarget& t = m_targets[c];
            lattice.slopes(m_controls[c].data(), t.value + at, t.du ? t.du + at : nullptr,
                           t.dv ? t.dv + at : nullptr, m_pitch);
            for (int j = j0; j < j1 && t.du; j++)
                for (int i = i0; i < i1; i++) {
                    t.du[size_t(j) * m_pitch + i] /= size;
                    t.dv[size_t(j) * m_pitch + i] /= size;
                }
        }
        return true;
    }

    const FacePatch& m_patch;
    const FaceChart& m_chart;
    Line m_u, m_v;
    const std::vector<PatchTarget>& m_targets;
    int m_pitch;
    std::vector<float> m_values, m_extents, m_line;
    std::vector<std::array<float, 16>> m_controls;
};

} // namespace

bool FacePatch::is_bspline() const {
    if (!surface.IsRegular() || surface.GetNumControlPoints() != 16)
        return false;
    std::array<int, 16> indices;
    surface.GetControlPointIndices(indices.data());
    std::sort(indices.begin(), indices.end());
    return std::adjacent_find(indices.begin(), indices.end()) == indices.end();
}

FaceChart::Place FaceChart::operator()(float u, float v) const {
    if (whole())
        return {{u, v}, {1, 0}, {0, 1}};
    Place out;
    if (is_triangle()) {
        // Bilinear between the corner, the middles of its two edges and the centre.
        float c[3][2];
        for (int i = 0; i < 3; i++)
            m_parameters.GetVertexCoord((m_corner + i) % 3, c[i]);
        for (int d = 0; d < 2; d++) {
            const float a = c[0][d], b = (c[0][d] + c[1][d]) / 2, e = (c[0][d] + c[2][d]) / 2,
                        m = (c[0][d] + c[1][d] + c[2][d]) / 3;
            out.uv[d] = (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * e + u * m);
            out.du[d] = (1 - v) * (b - a) + v * (m - e);
            out.dv[d] = (1 - u) * (e - a) + u * (m - b);
        }
        return out;
    }
    const float local[2] = {u, v};
    m_parameters.ConvertNormalizedSubFaceToCoord(m_corner, local, out.uv);
    return {{out.uv[0], out.uv[1]}, {0.5f, 0}, {0, 0.5f}};
}

void fill_lattice(const FacePatch& patch, const FaceChart& chart, Line u, Line v,
                  const std::vector<PatchTarget>& targets, int pitch) {
    constexpr int Few = 12; // points, evaluated one by one in less time than the corners
    Filler filler(patch, chart, u, v, targets, pitch);
    if (chart.whole() && patch.is_bspline())
        filler.bspline();
    else if (chart.whole() && patch.surface.IsRegular() && u.count * v.count > Few)
        filler.regular();
    else if (patch.surface.IsRegular() || chart.is_triangle())
        filler.one_by_one(0, u.count, 0, v.count);
    else
        filler.part(0, u.count, 0, v.count, 0, 0, 1, 0);
}

} // namespace kanuka::geom
