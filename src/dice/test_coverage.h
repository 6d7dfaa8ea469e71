// What is traced of a primitive, seen from a point (or along a direction) and compared with what an oracle
// says stands there. Everything in double, over a raster of samples, and nothing shared with dicing.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "dice/dice.h"

namespace kanuka::dice::test {

struct D3 {
    double x = 0, y = 0, z = 0;
    friend D3 operator+(const D3& a, const D3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    friend D3 operator-(const D3& a, const D3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    friend D3 operator*(const D3& a, double s) { return {a.x * s, a.y * s, a.z * s}; }
    friend bool operator==(const D3&, const D3&) = default;
};
inline double dot(const D3& a, const D3& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline D3 cross(const D3& a, const D3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(const D3& a) {
    return std::sqrt(dot(a, a));
}
inline D3 unit(const D3& a) {
    return a * (1 / length(a));
}

using Soup = std::vector<std::array<D3, 3>>;

inline D3 transformed(const Transform& t, const D3& p, double w = 1) {
    const auto& m = t.m;
    return {m[0][0] * p.x + m[0][1] * p.y + m[0][2] * p.z + w * m[0][3],
            m[1][0] * p.x + m[1][1] * p.y + m[1][2] * p.z + w * m[1][3],
            m[2][0] * p.x + m[2][1] * p.y + m[2][2] * p.z + w * m[2][3]};
}

// The triangles that are traced at a step: 0, or one of those in `later`.
inline Soup traced_triangles(const Diced& d, size_t step) {
    Soup out;
    const auto add = [&](const D3& a, const D3& b, const D3& c) {
        if (!(a == b) && !(b == c) && !(c == a))
            out.push_back({a, b, c});
    };
    const auto vertex = [&](const grid::Grid& g, size_t i) {
        const std::vector<float>& P = step > 0                         ? g.later[step - 1].P
                                      : d.is_mesh && !d.mesh.P.empty() ? d.mesh.P
                                                                       : g.P;
        const size_t n = size_t(g.stride);
        return D3{double(P[i]), double(P[i + n]), double(P[i + 2 * n])};
    };
    for (size_t k = 0; k < d.traced.size(); k++) {
        if (!d.trimmed.empty() && !d.trimmed[k].indices.empty()) {
            const grid::TrimmedMesh& m = d.trimmed[k];
            const auto at = [&](uint32_t i) {
                const grid::TrimmedMesh::Vertex& v = m.vertices[i];
                const D3 a = vertex(d.grids[k], v.a);
                return a + (vertex(d.grids[k], v.b) - a) * double(v.wb) +
                       (vertex(d.grids[k], v.c) - a) * double(v.wc);
            };
            for (size_t i = 0; i < m.indices.size(); i += 3)
                add(at(m.indices[i]), at(m.indices[i + 1]), at(m.indices[i + 2]));
            continue;
        }
        const grid::TracedGrid& t = d.traced[k];
        const std::vector<float>& P = step == 0 ? t.P : t.later[step - 1];
        const auto at = [&](int i, int j) {
            const float* p = &P[3 * size_t(j * (t.mu + 1) + i)];
            return D3{double(p[0]), double(p[1]), double(p[2])};
        };
        for (int j = 0; j < t.mv; j++)
            for (int i = 0; i < t.mu; i++) {
                add(at(i, j), at(i + 1, j), at(i, j + 1));
                add(at(i + 1, j + 1), at(i, j + 1), at(i + 1, j));
            }
    }
    if (d.is_mesh) {
        const std::vector<uint32_t>& x = d.mesh.indices;
        const auto at = [&](size_t i) { return vertex(d.mesh_vertices, x[i]); };
        if (d.mesh.vertices_per_face == 3)
            for (size_t i = 0; i < x.size(); i += 3)
                add(at(i), at(i + 1), at(i + 2));
        else
            for (size_t i = 0; i < x.size(); i += 4) {
                add(at(i), at(i + 1), at(i + 3));
                add(at(i + 2), at(i + 3), at(i + 1));
            }
    }
    return out;
}

// Where it is seen from: a square of samples on a plane, fit around a ball.
class View {
  public:
    static constexpr int Samples = 224; // each way

    View(const Transform& page_from_camera, bool orthographic, const D3& center, double radius)
        : m_orthographic(orthographic) {
        m_eye = transformed(page_from_camera, {}, 1);
        const D3 axis = transformed(page_from_camera, {0, 0, 1}, 0);
        m_z = unit(orthographic ? axis : center - m_eye);
        m_x = unit(cross(m_z, std::abs(m_z.x) < 0.6 ? D3{1, 0, 0} : D3{0, 1, 0}));
        m_y = cross(m_z, m_x);
        const double d = length(center - m_eye), ball = 1.01 * radius;
        m_half = orthographic ? ball : ball / std::sqrt(std::max(d * d - ball * ball, 1e-12));
        if (orthographic)
            m_eye = center - m_z * (4 * radius);
        m_distance = orthographic ? 1 : d;
    }

    double spacing() const { return 2 * m_half / Samples; } // on the plane: tangents, or units
    double distance() const { return m_distance; }
    D3 eye() const { return m_eye; }
    // A sample's ray. Odd offsets, so that no sample lies on a line that a test would draw.
    void ray(int i, int j, D3& o, D3& d) const {
        const double x = (i + OffsetX) * spacing() - m_half, y = (j + OffsetY) * spacing() - m_half;
        if (m_orthographic)
            o = m_eye + m_x * x + m_y * y, d = m_z;
        else
            o = m_eye, d = m_z + m_x * x + m_y * y;
    }
    // In samples.
    std::array<double, 2> project(const D3& p) const {
        const D3 q = p - m_eye;
        const double w = m_orthographic ? 1 : std::max(dot(q, m_z), 1e-12);
        return {(dot(q, m_x) / w + m_half) / spacing() - OffsetX,
                (dot(q, m_y) / w + m_half) / spacing() - OffsetY};
    }

  private:
    static constexpr double OffsetX = 0.41421356, OffsetY = 0.57735027;
    bool m_orthographic;
    D3 m_eye, m_x, m_y, m_z;
    double m_half = 1, m_distance = 1;
};

// How many layers cover each sample.
using Raster = std::vector<uint16_t>;

inline Raster rasterize(const View& view, const Soup& soup) {
    constexpr int N = View::Samples;
    Raster out(size_t(N) * N, 0);
    using P2 = std::array<double, 2>;
    // Twice the area beside an edge, the same number (but for its sign) from either of its triangles.
    const auto beside = [](const P2& a, const P2& b, double x, double y) {
        const bool turn = b < a;
        const P2 &p = turn ? b : a, &q = turn ? a : b;
        const double e = (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
        return turn ? -e : e;
    };
    for (const auto& t : soup) {
        P2 p[3] = {view.project(t[0]), view.project(t[1]), view.project(t[2])};
        if (beside(p[0], p[1], p[2][0], p[2][1]) < 0)
            std::swap(p[1], p[2]);
        const auto least = [&](int c) { return std::min({p[0][c], p[1][c], p[2][c]}); };
        const auto most = [&](int c) { return std::max({p[0][c], p[1][c], p[2][c]}); };
        const int x0 = std::max(0, int(std::ceil(least(0)))), x1 = std::min(N - 1, int(std::floor(most(0))));
        const int y0 = std::max(0, int(std::ceil(least(1)))), y1 = std::min(N - 1, int(std::floor(most(1))));
        for (int y = y0; y <= y1; y++)
            for (int x = x0; x <= x1; x++) {
                const double a = beside(p[0], p[1], x, y), b = beside(p[1], p[2], x, y),
                             c = beside(p[2], p[0], x, y);
                if (a > 0 && b > 0 && c > 0)
                    out[size_t(y) * N + x]++;
            }
    }
    return out;
}

// An answer to "does this ray meet it", in object space.
using Hit = std::function<bool(const D3& o, const D3& d)>;

inline Raster trace(const View& view, const Hit& hit, const Transform& page_from_object) {
    constexpr int N = View::Samples;
    const Transform inverse = page_from_object.inverse();
    Raster out(size_t(N) * N, 0);
    for (int j = 0; j < N; j++)
        for (int i = 0; i < N; i++) {
            D3 o, d;
            view.ray(i, j, o, d);
            out[size_t(j) * N + i] = hit(transformed(inverse, o), transformed(inverse, d, 0));
        }
    return out;
}

struct Difference {
    double area = 0, missing = 0, extra = 0, twice = 0; // in samples
    double outline = 0;                                 // length of the oracle's, in samples
};

inline Difference compare(const Raster& traced, const Raster& truth) {
    constexpr int N = View::Samples;
    Difference d;
    size_t crossings = 0;
    for (int j = 0; j < N; j++)
        for (int i = 0; i < N; i++) {
            const size_t k = size_t(j) * N + i;
            const bool t = truth[k] > 0;
            d.area += t;
            d.missing += t && traced[k] == 0;
            d.extra += !t && traced[k] > 0;
            d.twice += traced[k] > 1;
            crossings += i + 1 < N && t != (truth[k + 1] > 0);
            crossings += j + 1 < N && t != (truth[k + N] > 0);
        }
    d.outline = double(crossings) * (3.14159265358979 / 4); // Cauchy-Crofton, of two directions
    return d;
}

} // namespace kanuka::dice::test
