// How far a point with a colour is from the planes of some faces, and its colour from theirs: Hoppe 1999, New
// Quadric Metric for Simplifying Meshes with Appearance Attributes. Sums over faces, weighted by area.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

namespace kanuka::geom {

struct Vec3d {
    double x = 0, y = 0, z = 0;
    Vec3d operator+(const Vec3d& o) const { return {x + o.x, y + o.y, z + o.z}; }
    Vec3d operator-(const Vec3d& o) const { return {x - o.x, y - o.y, z - o.z}; }
    Vec3d operator*(double s) const { return {x * s, y * s, z * s}; }
};
inline double dot(const Vec3d& a, const Vec3d& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vec3d cross(const Vec3d& a, const Vec3d& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

class QuadricError {
  public:
    // The squared distance to the plane dot(n, p) + d = 0, times the area; n has length 1.
    void add_plane(const Vec3d& n, double d, double area) {
        add_outer(n, area);
        m_b = m_b + n * (d * area);
        m_c += d * d * area;
    }
    // The squared difference to a colour channel that is dot(g, p) + d at p.
    void add_channel(size_t channel, const Vec3d& g, double d, double area) {
        add_plane(g, d, area);
        m_g[channel] = m_g[channel] + g * area;
        m_d[channel] += d * area;
    }
    void add_area(double area) { m_area += area; }

    QuadricError& operator+=(const QuadricError& o) {
        for (size_t i = 0; i < 6; i++)
            m_a[i] += o.m_a[i];
        m_b = m_b + o.m_b;
        m_c += o.m_c;
        for (size_t k = 0; k < 3; k++)
            m_g[k] = m_g[k] + o.m_g[k], m_d[k] += o.m_d[k];
        m_area += o.m_area;
        return *this;
    }

    double area() const { return m_area; }
    // Of p with the colours that are best there.
    double at(const Vec3d& p) const {
        double sum = dot(p, times(m_a, p)) + 2 * dot(m_b, p) + m_c;
        if (m_area > 0)
            for (size_t k = 0; k < 3; k++) {
                const double s = dot(m_g[k], p) + m_d[k];
                sum -= s * s / m_area;
            }
        return std::max(sum, 0.0);
    }
    std::array<double, 3> colors(const Vec3d& p) const {
        std::array<double, 3> s{};
        for (size_t k = 0; k < 3 && m_area > 0; k++)
            s[k] = (dot(m_g[k], p) + m_d[k]) / m_area;
        return s;
    }
    // Where the error is least. Where many points are as good, as on a plane: the one that is nearest to
    // `near`. False = there is none in sight.
    bool best(const Vec3d& near, Vec3d& p) const {
        std::array<double, 6> a = m_a;
        Vec3d b = m_b;
        if (m_area > 0)
            for (size_t k = 0; k < 3; k++) {
                const Vec3d& g = m_g[k];
                const double w = 1 / m_area;
                a[0] -= g.x * g.x * w, a[1] -= g.x * g.y * w, a[2] -= g.x * g.z * w;
                a[3] -= g.y * g.y * w, a[4] -= g.y * g.z * w, a[5] -= g.z * g.z * w;
                b = b - g * (m_d[k] * w);
            }
        const double slight = 1e-5 * (a[0] + a[3] + a[5]);
        if (!(slight > 0))
            return false;
        a[0] += slight, a[3] += slight, a[5] += slight;
        const Vec3d right = near * slight - b;
        // Cramer's rule, by cofactors.
        const double c0 = a[3] * a[5] - a[4] * a[4], c1 = a[2] * a[4] - a[1] * a[5],
                     c2 = a[1] * a[4] - a[2] * a[3];
        const double det = a[0] * c0 + a[1] * c1 + a[2] * c2;
        if (!(std::abs(det) > 0))
            return false;
        const double c3 = a[0] * a[5] - a[2] * a[2], c4 = a[1] * a[2] - a[0] * a[4],
                     c5 = a[0] * a[3] - a[1] * a[1];
        p = times({c0, c1, c2, c3, c4, c5}, right) * (1 / det);
        return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
    }

  private:
    static Vec3d times(const std::array<double, 6>& a, const Vec3d& v) { // symmetric: xx xy xz yy yz zz
        return {a[0] * v.x + a[1] * v.y + a[2] * v.z, a[1] * v.x + a[3] * v.y + a[4] * v.z,
                a[2] * v.x + a[4] * v.y + a[5] * v.z};
    }
    void add_outer(const Vec3d& n, double w) {
        m_a[0] += n.x * n.x * w, m_a[1] += n.x * n.y * w, m_a[2] += n.x * n.z * w;
        m_a[3] += n.y * n.y * w, m_a[4] += n.y * n.z * w, m_a[5] += n.z * n.z * w;
    }

    std::array<double, 6> m_a{};
    Vec3d m_b;
    double m_c = 0, m_area = 0;
    std::array<Vec3d, 3> m_g{};
    std::array<double, 3> m_d{};
};

} // namespace kanuka::geom
