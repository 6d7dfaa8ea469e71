// For tests: a face of a surface against formulas in double.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <random>

#include "geom/test_surfaces.h"

namespace kanuka::geom::testing {

using Place = std::array<double, 3>;

inline Place cross_of(const Place& a, const Place& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double length_of(const Place& a) {
    return std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
}

// What a face should be: places over its own u and v (formulas that go on beyond 0 and 1), the part of the
// surface's parameters that it covers, and what its primitive variables are worth.
struct Expected {
    std::function<Place(double, double)> place;
    double u0 = 0, u1 = 1, v0 = 0, v1 = 1;
    std::vector<std::function<double(double, double)>> data;

    Place slope(double u, double v, bool along_u) const {
        constexpr double H = 1e-4;
        const Place a = along_u ? place(u - H, v) : place(u, v - H),
                    b = along_u ? place(u + H, v) : place(u, v + H);
        Place s;
        for (size_t c = 0; c < 3; c++)
            s[c] = (b[c] - a[c]) / (2 * H);
        return s;
    }
    // Where it vanishes, on a collapsed side, that of a place just inside.
    Place normal(double u, double v) const {
        Place n = cross_of(slope(u, v, true), slope(u, v, false));
        if (length_of(n) < 1e-6 * length_of(slope(0.4, 0.6, true)) * length_of(slope(0.4, 0.6, false)))
            return normal(u + 1e-3 * (0.5 - u), v + 1e-3 * (0.5 - v));
        const double l = length_of(n);
        return {n[0] / l, n[1] / l, n[2] / l};
    }
};

inline constexpr std::array<float, 8> Corners{0.1f, 0.2f, 2.3f, -0.4f, -0.5f, 3.6f, 1.7f, 2.8f};
inline std::shared_ptr<scene::Attributes> with_corners() {
    auto a = std::make_shared<scene::Attributes>();
    a->texture_coordinates = Corners;
    return a;
}

// Lattices of few and of many places, of wide and of small ranges; single lines.
inline std::vector<std::vector<float>> lines() {
    const auto line = [](int count, float from, float to) {
        std::vector<float> t;
        for (int i = 0; i < count; i++)
            t.push_back(count == 1 ? from : from + (to - from) * float(i) / float(count - 1));
        return t;
    };
    return {line(5, 0, 1), line(4, 0.6f, 0.63f), line(12, 0, 1), line(45, 0.25f, 1), line(1, 0.7f, 0)};
}

inline void expect_face(const Surface& s, int face, const Expected& e, const std::string& what,
                        double normal_slack = 1e-4) {
    const auto all = lines();
    const double size = length_of(e.slope(0.5, 0.5, true)) + length_of(e.slope(0.5, 0.5, false)) +
                        length_of(e.place(0.5, 0.5));
    double off[5] = {};
    for (const auto& [a, b] :
         std::vector<std::pair<size_t, size_t>>{{0, 0}, {1, 1}, {2, 2}, {3, 0}, {0, 3}, {4, 2}, {1, 4}}) {
        const std::vector<float>&us = all[a], &vs = all[b];
        const grid::Grid g = evaluate(s, face, us, vs);
        const size_t n = size_t(g.stride);
        std::vector<float> alone(3 * us.size() * vs.size());
        s.positions(face, {us.data(), int(us.size())}, {vs.data(), int(vs.size())}, alone.data(),
                    int(us.size() * vs.size()));
        ASSERT_EQ(g.primvars.size(), e.data.size());
        for (size_t j = 0; j < vs.size(); j++)
            for (size_t i = 0; i < us.size(); i++) {
                const size_t at = j * us.size() + i;
                const double x = double(us[i]), y = double(vs[j]);
                const Place p = e.place(x, y), m = e.normal(x, y);
                Place du = e.slope(x, y, true), dv = e.slope(x, y, false);
                // Short or nearly parallel slopes have fewer digits of a normal; none, that of what is
                // beside.
                const double across = length_of(cross_of(du, dv)),
                             certain =
                                 across > 1e-6 * size * size ? std::min(1.0, 50 * across / (size * size)) : 1;
                for (size_t c = 0; c < 3; c++) {
                    du[c] /= e.u1 - e.u0, dv[c] /= e.v1 - e.v0;
                    const double sign = s.flips() ? -1 : 1;
                    off[0] =
                        std::max({off[0], std::abs(double(g.P[at + c * n]) - p[c]) / size,
                                  std::abs(double(alone[at + c * us.size() * vs.size()]) - p[c]) / size});
                    off[1] =
                        std::max({off[1], std::abs(double(g.dPdu[at + c * n]) - du[c]) * (e.u1 - e.u0) / size,
                                  std::abs(double(g.dPdv[at + c * n]) - dv[c]) * (e.v1 - e.v0) / size});
                    off[2] = std::max(off[2], certain * std::abs(double(g.Ng[at + c * n]) - sign * m[c]));
                    EXPECT_EQ(g.N[at + c * n], g.Ng[at + c * n]);
                }
                const double u = e.u0 + (e.u1 - e.u0) * x, v = e.v0 + (e.v1 - e.v0) * y;
                const auto corner = [&](int c) {
                    return (1 - v) *
                               ((1 - u) * double(Corners[size_t(c)]) + u * double(Corners[size_t(2 + c)])) +
                           v * ((1 - u) * double(Corners[size_t(4 + c)]) +
                                u * double(Corners[size_t(6 + c)]));
                };
                off[3] =
                    std::max({off[3], std::abs(double(g.u[at]) - u), std::abs(double(g.v[at]) - v),
                              std::abs(double(g.s[at]) - corner(0)), std::abs(double(g.t[at]) - corner(1))});
                for (size_t d = 0; d < e.data.size(); d++)
                    off[4] =
                        std::max(off[4], std::abs(double(g.primvars[d].component(0)[at]) - e.data[d](x, y)));
            }
    }
    EXPECT_LT(off[0], 2e-6) << what << " face " << face << ": places";
    EXPECT_LT(off[1], 1e-4) << what << " face " << face << ": slopes";
    EXPECT_LT(off[2], normal_slack) << what << " face " << face << ": normals";
    EXPECT_LT(off[3], 3e-6) << what << " face " << face << ": parameters";
    EXPECT_LT(off[4], 2e-5) << what << " face " << face << ": data";
}

class Random {
  public:
    explicit Random(uint32_t seed) : m_engine(seed) {}
    float one() { return float(m_engine() >> 8) * 0x1p-24f; }
    std::vector<float> some(size_t count) {
        std::vector<float> v(count);
        for (float& x : v)
            x = 2 * one() - 1;
        return v;
    }

  private:
    std::mt19937 m_engine;
};

} // namespace kanuka::geom::testing
