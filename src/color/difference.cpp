#include "color/difference.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kanuka::color {

namespace {

constexpr double Pi2 = 2 * std::numbers::pi, Degree = std::numbers::pi / 180;

double hue(double a, double b) { // radians in [0, 2 pi)
    if (a == 0 && b == 0)
        return 0;
    const double h = std::atan2(b, a);
    return h < 0 ? h + Pi2 : h;
}

double pow7(double x) {
    return x * x * x * x * x * x * x;
}

} // namespace

Vector3 lab_from_xyz(const Vector3& xyz, const Vector3& white) {
    const auto f = [](double t) {
        constexpr double d = 6.0 / 29;
        return t > d * d * d ? std::cbrt(t) : t / (3 * d * d) + 4.0 / 29;
    };
    const double x = f(xyz[0] / white[0]), y = f(xyz[1] / white[1]), z = f(xyz[2] / white[2]);
    return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

double delta_e_2000(const Vector3& p, const Vector3& q) {
    // 1. Chroma and hue, with a stretched near the grey axis (eq. 2 to 7).
    const double mean_c = 0.5 * (std::hypot(p[1], p[2]) + std::hypot(q[1], q[2]));
    const double g = 0.5 * (1 - std::sqrt(pow7(mean_c) / (pow7(mean_c) + pow7(25.0))));
    const double a1 = (1 + g) * p[1], a2 = (1 + g) * q[1];
    const double c1 = std::hypot(a1, p[2]), c2 = std::hypot(a2, q[2]);
    const double h1 = hue(a1, p[2]), h2 = hue(a2, q[2]);

    // 2. Differences (eq. 8 to 11).
    double dh = h2 - h1;
    if (c1 * c2 == 0)
        dh = 0;
    else if (dh > std::numbers::pi)
        dh -= Pi2;
    else if (dh < -std::numbers::pi)
        dh += Pi2;
    const double dl = q[0] - p[0], dc = c2 - c1, dH = 2 * std::sqrt(c1 * c2) * std::sin(0.5 * dh);

    // 3. Weights at the mean (eq. 12 to 21).
    double h = h1 + h2;
    if (c1 * c2 != 0)
        h = std::abs(h1 - h2) <= std::numbers::pi ? 0.5 * h : h < Pi2 ? 0.5 * (h + Pi2) : 0.5 * (h - Pi2);
    const double l = 0.5 * (p[0] + q[0]), c = 0.5 * (c1 + c2), l50 = (l - 50) * (l - 50);
    const double t = 1 - 0.17 * std::cos(h - 30 * Degree) + 0.24 * std::cos(2 * h) +
                     0.32 * std::cos(3 * h + 6 * Degree) - 0.20 * std::cos(4 * h - 63 * Degree);
    const double bell = (h / Degree - 275) / 25;
    const double turn = 30 * Degree * std::exp(-bell * bell);
    const double rc = 2 * std::sqrt(pow7(c) / (pow7(c) + pow7(25.0)));
    const double sl = 1 + 0.015 * l50 / std::sqrt(20 + l50), sc = 1 + 0.045 * c, sh = 1 + 0.015 * c * t;
    const double x = dl / sl, y = dc / sc, z = dH / sh;
    return std::sqrt(std::max(x * x + y * y + z * z - std::sin(2 * turn) * rc * y * z, 0.0));
}

} // namespace kanuka::color
