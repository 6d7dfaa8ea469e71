// What stands where, by published formulas in double: rays against quadrics and polygons, and fine meshes of
// parametric and subdivision surfaces. Shares nothing with geom.
#pragma once

#include <map>
#include <numeric>

#include "dice/test_coverage.h"

namespace kanuka::dice::test {

constexpr double Turn = 6.283185307179586;

// ---- quadrics: RISpec 3.2, 5.4. `a` holds their arguments, angles in degrees.

inline bool in_sweep(double x, double y, double degrees) {
    double phi = std::atan2(y, x) * (360 / Turn);
    if (degrees < 0)
        phi = -phi, degrees = -degrees;
    return degrees >= 360 || (phi < 0 ? phi + 360 : phi) <= degrees;
}

// A real t with A t^2 + B t + C = 0 whose point `inside` accepts.
template <class Inside>
bool any_root(double A, double B, double C, const D3& o, const D3& d, Inside inside) {
    const auto at = [&](double t) { return inside(o + d * t); };
    if (std::abs(A) < 1e-14 * (std::abs(B) + std::abs(C)))
        return B != 0 && at(-C / B);
    const double D = B * B - 4 * A * C;
    if (D < 0)
        return false;
    const double q = -0.5 * (B + std::copysign(std::sqrt(D), B));
    return at(q / A) || (q != 0 && at(C / q));
}

inline Hit hit_quadric(scene::Quadric::Kind kind, std::vector<float> f) {
    using Kind = scene::Quadric::Kind;
    const std::vector<double> a(f.begin(), f.end());
    const double sweep = a.back();
    const auto between = [](double z, double p, double q) {
        return z >= std::min(p, q) && z <= std::max(p, q);
    };
    return [=](const D3& o, const D3& d) {
        const double dxy = d.x * d.x + d.y * d.y, oxy = o.x * o.x + o.y * o.y, od = o.x * d.x + o.y * d.y;
        switch (kind) {
        case Kind::Sphere:
            return any_root(dot(d, d), 2 * dot(o, d), dot(o, o) - a[0] * a[0], o, d, [&](const D3& p) {
                return between(p.z, std::max(a[1], -a[0]), std::min(a[2], a[0])) && in_sweep(p.x, p.y, sweep);
            });
        case Kind::Cylinder:
            return any_root(dxy, 2 * od, oxy - a[0] * a[0], o, d, [&](const D3& p) {
                return between(p.z, a[1], a[2]) && in_sweep(p.x, p.y, sweep);
            });
        case Kind::Cone: {
            const double k = a[1] / a[0] * a[1] / a[0], z = a[0] - o.z; // r = k (h - z)
            return any_root(dxy - k * d.z * d.z, 2 * (od + k * z * d.z), oxy - k * z * z, o, d,
                            [&](const D3& p) { return between(p.z, 0, a[0]) && in_sweep(p.x, p.y, sweep); });
        }
        case Kind::Paraboloid: {
            const double k = a[0] * a[0] / a[2]; // r^2 = k z
            return any_root(dxy, 2 * od - k * d.z, oxy - k * o.z, o, d, [&](const D3& p) {
                return between(p.z, a[1], a[2]) && in_sweep(p.x, p.y, sweep);
            });
        }
        case Kind::Disk: {
            const D3 p = o + d * ((a[0] - o.z) / d.z);
            return p.x * p.x + p.y * p.y <= a[1] * a[1] && in_sweep(p.x, p.y, sweep);
        }
        default:
            return false;
        }
    };
}

// ---- polygons

using Loop2 = std::vector<std::array<double, 2>>;

// Even-odd, in the plane z = 0.
inline Hit hit_polygon(std::vector<Loop2> loops) {
    return [=](const D3& o, const D3& d) {
        const double t = -o.z / d.z, x = o.x + t * d.x, y = o.y + t * d.y;
        bool in = false;
        for (const Loop2& l : loops)
            for (size_t i = 0, j = l.size() - 1; i < l.size(); j = i++)
                if ((l[i][1] > y) != (l[j][1] > y) &&
                    x < (l[j][0] - l[i][0]) * (y - l[i][1]) / (l[j][1] - l[i][1]) + l[i][0])
                    in = !in;
        return in;
    };
}

// ---- parametric surfaces as fine meshes

template <class At>
void add_sheet(Soup& soup, int nu, int nv, At at) {
    std::vector<D3> row, before;
    for (int j = 0; j <= nv; j++) {
        row.clear();
        for (int i = 0; i <= nu; i++)
            row.push_back(at(double(i) / nu, double(j) / nv));
        for (int i = 0; i < nu && j > 0; i++) {
            soup.push_back({before[i], before[i + 1], row[i + 1]});
            soup.push_back({before[i], row[i + 1], row[i]});
        }
        std::swap(row, before);
    }
}

// RISpec 5.4.4: the line from p1 to p2 turned about z; its torus, phi from phimin to phimax.
inline D3 turned(const D3& p, double degrees) {
    const double c = std::cos(degrees * Turn / 360), s = std::sin(degrees * Turn / 360);
    return {p.x * c - p.y * s, p.x * s + p.y * c, p.z};
}
inline Soup hyperboloid(const std::vector<float>& f) {
    const std::vector<double> a(f.begin(), f.end());
    Soup soup;
    add_sheet(soup, 180, 48, [&](double u, double v) {
        const D3 p{a[0], a[1], a[2]}, q{a[3], a[4], a[5]};
        return turned(p + (q - p) * v, a[6] * u);
    });
    return soup;
}
inline Soup torus(const std::vector<float>& f) {
    const std::vector<double> a(f.begin(), f.end());
    Soup soup;
    add_sheet(soup, 180, 100, [&](double u, double v) {
        const double phi = (a[2] + (a[3] - a[2]) * v) * Turn / 360;
        return turned({a[0] + a[1] * std::cos(phi), 0, a[1] * std::sin(phi)}, a[4] * u);
    });
    return soup;
}

using M4 = std::array<std::array<double, 4>, 4>;

// Weights of the four control points at t: (t^3 t^2 t 1) M, with the matrices of RISpec 5.3's table.
inline M4 basis_matrix(const std::string& name) {
    if (name == "bezier")
        return {{{-1, 3, -3, 1}, {3, -6, 3, 0}, {-3, 3, 0, 0}, {1, 0, 0, 0}}};
    if (name == "b-spline")
        return {{{-1 / 6., 3 / 6., -3 / 6., 1 / 6.},
                 {3 / 6., -6 / 6., 3 / 6., 0},
                 {-3 / 6., 0, 3 / 6., 0},
                 {1 / 6., 4 / 6., 1 / 6., 0}}};
    if (name == "catmull-rom")
        return {{{-.5, 1.5, -1.5, .5}, {1, -2.5, 2, -.5}, {-.5, 0, .5, 0}, {0, 1, 0, 0}}};
    if (name == "hermite") // value, slope, value, slope
        return {{{2, 1, -2, 1}, {-3, -2, 3, -1}, {0, 1, 0, 0}, {1, 0, 0, 0}}};
    return {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}}; // power
}
inline std::array<double, 4> basis_weights(const M4& m, double t) {
    std::array<double, 4> w;
    for (int k = 0; k < 4; k++)
        w[k] = ((m[0][k] * t + m[1][k]) * t + m[2][k]) * t + m[3][k];
    return w;
}

// Cox-de Boor's recursion as it stands (The NURBS Book, eq. 2.5); the last span is closed.
inline double bspline(const std::vector<double>& k, int i, int order, double t) {
    if (order == 1) {
        const bool last = t == k.back() && k[i] < k[i + 1] && k[i + 1] == k.back();
        return (t >= k[i] && t < k[i + 1]) || last;
    }
    const double l = k[i + order - 1] - k[i], r = k[i + order] - k[i + 1];
    return (l > 0 ? (t - k[i]) / l * bspline(k, i, order - 1, t) : 0) +
           (r > 0 ? (k[i + order] - t) / r * bspline(k, i + 1, order - 1, t) : 0);
}

// ---- subdivision meshes

struct Cage {
    std::vector<D3> points;
    std::vector<std::vector<int>> faces;
    std::map<std::pair<int, int>, double> creases; // by lower and higher vertex; from 10 on infinite
    std::map<int, double> corners;
    bool loop = false;
};

// Catmull and Clark 1978, Loop 1987; semi-sharp creases by DeRose et al. 1998, section 3; boundaries are
// infinitely sharp, and boundary corners of one face too (interpolateboundary 1).
inline Cage refined(const Cage& c) {
    struct Side {
        int faces = 0, point = -1;
        double sharp = 0;
        D3 centers, opposite;
    };
    constexpr double Infinite = 10;
    const auto key = [](int a, int b) { return std::pair(std::min(a, b), std::max(a, b)); };
    std::map<std::pair<int, int>, Side> sides;
    const size_t n = c.points.size();
    std::vector<D3> centers;
    std::vector<int> valence(n, 0);
    std::vector<D3> face_sum(n), edge_sum(n);
    for (const auto& f : c.faces) {
        D3 center;
        for (const int v : f)
            center = center + c.points[v] * (1.0 / double(f.size()));
        centers.push_back(center);
        for (size_t k = 0; k < f.size(); k++) {
            Side& s = sides[key(f[k], f[(k + 1) % f.size()])];
            s.faces++;
            s.centers = s.centers + center;
            s.opposite = s.opposite + c.points[f[(k + 2) % f.size()]];
            face_sum[f[k]] = face_sum[f[k]] + center;
            valence[f[k]]++;
        }
    }
    Cage out;
    out.loop = c.loop;
    struct Around {
        int edges = 0, sharp = 0;
        double total = 0;
        D3 ends;
    };
    std::vector<Around> around(n);
    for (auto& [k, s] : sides) {
        const auto found = c.creases.find(k);
        s.sharp = s.faces < 2 ? Infinite : found == c.creases.end() ? 0 : found->second;
        for (const auto& [v, w] : {k, std::pair(k.second, k.first)}) {
            edge_sum[v] = edge_sum[v] + c.points[w];
            Around& a = around[v];
            a.edges++;
            if (s.sharp > 0) {
                a.sharp++;
                a.total += std::min(s.sharp, Infinite);
                a.ends = a.ends + c.points[w];
            }
        }
    }
    for (size_t v = 0; v < n; v++) {
        const D3 p = c.points[v];
        const double k = around[v].edges;
        D3 smooth;
        if (c.loop) {
            const double m = 3 / 8. + std::cos(Turn / k) / 4, beta = (5 / 8. - m * m) / k;
            smooth = p * (1 - k * beta) + edge_sum[v] * beta;
        } else {
            smooth = (face_sum[v] + edge_sum[v]) * (1 / (k * k)) + p * ((k - 2) / k);
        }
        const D3 crease = p * 0.75 + around[v].ends * 0.125;
        const auto corner = c.corners.find(int(v));
        double at = corner == c.corners.end() ? 0 : corner->second; // of a corner
        if (valence[v] == 1)
            at = Infinite;
        const int sharp = around[v].sharp;
        D3 q = smooth;
        const auto mix = [](const D3& a, const D3& b, double t) { return a + (b - a) * std::min(1.0, t); };
        if (at > 0 || sharp > 2) {
            // Back to what it would be a level later where this sharpness ends.
            const double t = at > 0 ? at : around[v].total / sharp;
            q = mix(sharp == 2 ? crease : smooth, p, t);
        } else if (sharp == 2) {
            q = mix(smooth, crease, around[v].total / 2);
        }
        out.points.push_back(q);
        if (at > 0)
            out.corners[int(v)] = at >= Infinite ? at : at - 1;
    }
    for (auto& [k, s] : sides) {
        s.point = int(out.points.size());
        const D3 ends = c.points[k.first] + c.points[k.second], middle = ends * 0.5;
        const D3 smooth = c.loop ? ends * (3 / 8.) + s.opposite * (1 / 8.) : (ends + s.centers) * 0.25;
        out.points.push_back(s.sharp >= 1  ? middle
                             : s.sharp > 0 ? smooth + (middle - smooth) * s.sharp
                                           : smooth);
        const double left = s.sharp >= Infinite ? s.sharp : s.sharp - 1;
        if (left > 0)
            for (const int v : {k.first, k.second})
                out.creases[key(v, s.point)] = left;
    }
    for (size_t i = 0; i < c.faces.size(); i++) {
        const auto& f = c.faces[i];
        const auto side = [&](size_t k) { return sides[key(f[k % f.size()], f[(k + 1) % f.size()])].point; };
        if (c.loop) {
            for (size_t k = 0; k < 3; k++)
                out.faces.push_back({f[k], side(k), side(k + 2)});
            out.faces.push_back({side(0), side(1), side(2)});
            continue;
        }
        const int center = int(out.points.size());
        out.points.push_back(centers[i]);
        for (size_t k = 0; k < f.size(); k++)
            out.faces.push_back({f[k], side(k), center, side(k + f.size() - 1)});
    }
    return out;
}

inline Soup triangles_of(const Cage& c) {
    Soup soup;
    for (const auto& f : c.faces)
        for (size_t k = 1; k + 1 < f.size(); k++)
            soup.push_back({c.points[f[0]], c.points[f[k]], c.points[f[k + 1]]});
    return soup;
}
inline Soup limit_surface(Cage c, size_t least_faces) {
    while (c.faces.size() < least_faces)
        c = refined(c);
    return triangles_of(c);
}

} // namespace kanuka::dice::test
