#include "color/uplift_fit.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/tasks.h"

namespace kanuka::color {

namespace {

using V3 = std::array<double, 3>;

// S = 1/2 + f / (2 sqrt(n + f^2)) for the polynomial f = q0 l^2 + q1 l + q2: the sigmoid of Jakob and Hanika
// (2019), eq. 3 and 4, with coefficients c = q / sqrt(n). With n = m (1 - m), m the mean of the components, q
// stays finite and smooth from black to white, where c itself runs to infinity; for greys q is (0, 0, m -
// 1/2).
struct Model {
    const Response& response;
    V3 target;
    double largest; // residuals are relative to it, so that dark colours are met as well as bright ones
    double mean;
    double n; // mean (1 - mean)

    // Four wavelengths at a time: all of the fit's time goes here.
    V3 residual(const V3& q, std::array<V3, 3>& jacobian) const {
        std::array<D4, 3> sum{};
        std::array<std::array<D4, 3>, 3> slope{};
        for (int i = 0; i < LambdaCount; i += 4) {
            const D4 l = (D4{0, 1, 2, 3} + double(i)) / double(LambdaCount - 1);
            const D4 f = (q[0] * l + q[1]) * l + q[2];
            const D4 root = sqrt(n + f * f), size = f < 0 ? -f : f;
            const auto finite = root > 0;
            const D4 safe = finite ? root : 1.0;
            const D4 small = finite ? 0.5 * n / (safe * (safe + size)) : 0.5; // no cancellation
            const D4 s = f < 0 ? small : 1 - small;
            const D4 ds = finite ? 0.5 * n / (safe * safe * safe) : 0.0;
            for (int c = 0; c < 3; c++) {
                const D4 w = four(response[c], i);
                sum[c] += w * s;
                const D4 dw = w * ds, dwl = dw * l;
                slope[c][0] += dwl * l;
                slope[c][1] += dwl;
                slope[c][2] += dw;
            }
        }
        V3 left;
        for (int c = 0; c < 3; c++) {
            left[c] = (total(sum[c]) - target[c]) / largest;
            for (int k = 0; k < 3; k++)
                jacobian[c][k] = total(slope[c][k]) / largest;
        }
        return left;
    }

  private:
    typedef double D4 __attribute__((vector_size(32)));
    static D4 sqrt(D4 x) {
        for (int k = 0; k < 4; k++)
            x[k] = std::sqrt(x[k]);
        return x;
    }
    static double total(const D4& x) { return (x[0] + x[1]) + (x[2] + x[3]); }
    // Zero past the last wavelength.
    static D4 four(const std::vector<double>& of, int i) {
        D4 r{};
        if (i + 4 <= LambdaCount)
            std::memcpy(&r, of.data() + i, sizeof r);
        else
            std::memcpy(&r, of.data() + i, size_t(LambdaCount - i) * sizeof(double));
        return r;
    }
};

double norm2(const V3& v) {
    return v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
}

// Solves the symmetric 3x3 system a x = b by Cramer's rule; false where a is singular.
bool solve(const std::array<V3, 3>& a, const V3& b, V3& x) {
    const auto det = [](const V3& u, const V3& v, const V3& w) {
        return u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) +
               u[2] * (v[0] * w[1] - v[1] * w[0]);
    };
    const double d = det(a[0], a[1], a[2]); // a is symmetric: rows are columns
    if (!(std::abs(d) > 0))
        return false;
    x = {det(b, a[1], a[2]) / d, det(a[0], b, a[2]) / d, det(a[0], a[1], b) / d};
    return std::isfinite(norm2(x));
}

constexpr double Accepted = 1e-6; // residual

// Gauss–Newton with Levenberg–Marquardt damping, from q; returns the largest residual.
double fit(const Model& model, V3& q, int max_steps = 60) {
    std::array<V3, 3> j;
    V3 r = model.residual(q, j);
    double damping = 1e-6;
    for (int step = 0; step < max_steps && norm2(r) > 0.01 * Accepted * Accepted; step++) {
        std::array<V3, 3> jtj{};
        V3 jtr{};
        for (int a = 0; a < 3; a++)
            for (int c = 0; c < 3; c++) {
                jtr[a] -= j[c][a] * r[c];
                for (int b = 0; b < 3; b++)
                    jtj[a][b] += j[c][a] * j[c][b];
            }
        for (int a = 0; a < 3; a++)
            jtj[a][a] *= 1 + damping;
        V3 d;
        if (!solve(jtj, jtr, d))
            break;
        const V3 next{q[0] + d[0], q[1] + d[1], q[2] + d[2]};
        std::array<V3, 3> next_j;
        const V3 next_r = model.residual(next, next_j);
        if (norm2(next_r) < norm2(r)) {
            q = next;
            r = next_r;
            j = next_j;
            damping = std::max(damping * 0.1, 1e-12);
        } else {
            damping *= 10;
            if (damping > 1e12)
                break;
        }
    }
    return std::max({std::abs(r[0]), std::abs(r[1]), std::abs(r[2])});
}

// The darkest plane serves all colours darker still, down to black, with one q: the sigmoid of f / sqrt(n)
// goes to 0 with n only where f < 0. Elsewhere f may well be positive beyond the reds, where little is seen:
// that is how a quadratic makes reds and magentas, and without it they come out grey.
bool stays_dark(const Model& wanted, const V3& q) {
    constexpr double Below = -0.02;
    if (wanted.largest > 1.5 * UpliftDarkest)
        return true;
    const auto f = [&](double l) { return (q[0] * l + q[1]) * l + q[2]; };
    const double vertex = q[0] != 0 ? std::clamp(-0.5 * q[1] / q[0], 0.0, 1.0) : 0;
    return std::max({f(0), f(1), f(vertex)}) < Below;
}

// A target beyond reach is moved towards the grey of its mean, by bisection from grey (whose answer is known)
// to the last place that the fit still reaches.
double fit_nearest(const Model& wanted, V3& q) {
    const auto towards = [&](double t) {
        Model m = wanted;
        for (double& v : m.target)
            v = wanted.mean + t * (v - wanted.mean);
        m.largest = std::max({m.target[0], m.target[1], m.target[2]});
        return m;
    };
    double reached = 0, beyond = 1, error = 0;
    q = {0, 0, wanted.mean - 0.5};
    for (int i = 0; i < 10; i++) {
        const double t = 0.5 * (reached + beyond);
        V3 trial = q;
        const double e = fit(towards(t), trial, 25);
        if (e <= Accepted && stays_dark(wanted, trial)) {
            q = trial;
            reached = t;
            error = e;
        } else
            beyond = t;
    }
    return error;
}

} // namespace

std::vector<float> fit_uplift_table(const Response& response, int resolution, bool wide, double& residual) {
    const int n = resolution;
    const auto knot = [&](int m, int z, int y, int x) { return ((size_t(m) * n + z) * n + y) * n + x; };
    const auto model = [&](int m, double largest, int y, int x) {
        const double steps = double(n - 1) * (n - 1);
        V3 rgb;
        rgb[m] = largest;
        rgb[(m + 1) % 3] = largest * x * x / steps;
        rgb[(m + 2) % 3] = largest * y * y / steps;
        const double mean = (rgb[0] + rgb[1] + rgb[2]) / 3;
        return Model{response, rgb, largest, mean, mean * (1 - mean)};
    };
    std::vector<V3> solved(size_t(3) * n * n * n);
    std::vector<double> worst(size_t(3) * n * n, 0.0);

    // 1. A middling plane of each table, from grey (x = y = 1), whose answer is known, outwards: each knot
    // starts at its solved neighbour's answer, so that all lie on one branch of solutions and interpolate
    // well.
    int middle = 0;
    while (middle < n - 1 && uplift_scale(middle, n) < 0.25)
        middle++;
    tasks::parallel_for(3, [&](size_t m) {
        for (int y = n - 1; y >= 0; y--)
            for (int x = n - 1; x >= 0; x--) {
                const Model wanted = model(int(m), uplift_scale(middle, n), y, x);
                V3& q = solved[knot(int(m), middle, y, x)];
                if (x == n - 1 && y == n - 1)
                    q = {0, 0, wanted.mean - 0.5};
                else
                    q = solved[x < n - 1 ? knot(int(m), middle, y, x + 1) : knot(int(m), middle, y + 1, x)];
                double error = fit(wanted, q);
                if (wide && (error > Accepted || !stays_dark(wanted, q)))
                    error = fit_nearest(wanted, q);
                worst[(m * n + y) * n + x] = error;
            }
    });

    // 2. From there each column to darker and to brighter knots, in smaller steps where needed: there are
    // other branches, which hide a pole of the sigmoid beyond the visible range.
    tasks::parallel_for(size_t(3) * n * n, [&](size_t column) {
        const int m = int(column) / (n * n), y = int(column) / n % n, x = int(column) % n;
        for (const int direction : {-1, 1})
            for (int z = middle + direction; z >= 0 && z < n; z += direction) {
                V3& q = solved[knot(m, z, y, x)];
                const double from = uplift_scale(z - direction, n), to = uplift_scale(z, n);
                if (x == n - 1 && y == n - 1) {
                    q = {0, 0, to - 0.5};
                    continue;
                }
                double error = 1;
                for (int steps = 1; steps <= (wide ? 1 : 8) && error > Accepted; steps *= 2) {
                    q = solved[knot(m, z - direction, y, x)];
                    for (int i = 1; i <= steps; i++)
                        error = fit(model(m, from * std::pow(to / from, double(i) / steps), y, x), q);
                }
                if (const Model wanted = model(m, to, y, x);
                    wide && (error > Accepted || !stays_dark(wanted, q)))
                    error = fit_nearest(wanted, q);
                worst[column] = std::max(worst[column], error);
            }
    });
    residual = *std::max_element(worst.begin(), worst.end());

    std::vector<float> table(solved.size() * 3);
    for (int m = 0; m < 3; m++)
        for (int z = 0; z < n; z++)
            for (int y = 0; y < n; y++)
                for (int x = 0; x < n; x++) {
                    const double grey = model(m, uplift_scale(z, n), y, x).mean - 0.5;
                    const V3& q = solved[knot(m, z, y, x)];
                    for (int k = 0; k < 3; k++)
                        table[knot(m, z, y, x) * 3 + k] = float(q[k] - (k == 2 ? grey : 0));
                }
    return table;
}

} // namespace kanuka::color
