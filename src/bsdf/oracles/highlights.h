// Oracles of highlights, gratings and phase functions, from their publications.
#pragma once

#include <algorithm>

#include "bsdf/oracles/optics.h"

namespace kanuka::bsdf::oracle {

struct Shape {
    double f, pdf; // f times the cosine of wi
};
inline double power(double base, double n) {
    return base > 0 ? std::pow(base, n) : 0;
}

// Lafortune and Willems 1994, *Using the Modified Phong Reflectance Model for Physically Based Rendering*,
// eq. 8; sampled by eq. 10.
inline Shape phong(double n, Dir wo, Dir wi) {
    const double c = inner({-wo.x, -wo.y, wo.z}, wi), p = power(c, n);
    return c > 0 ? Shape{(n + 2) / Tau * p * wi.z, (n + 1) / Tau * p} : Shape{0, 0};
}
// Ashikhmin and Shirley 2000, *An Anisotropic Phong BRDF Model*, eq. 4 with n_u = n_v and F = 1; sampled by
// eqs. 6 and 8.
inline Shape blinn(double n, Dir wo, Dir wi) {
    const Dir h = unit(wo + wi);
    const double p = power(h.z, n), k = inner(h, wo);
    return {(n + 1) / (4 * Tau) * p / (k * std::max(wo.z, wi.z)) * wi.z, (n + 1) / Tau * p / (4 * k)};
}
// The RenderMan Interface 3.2, section 15.6: specular() and phong(); held to what reflects all light: 1 over
// the integral of cos^n / pi around its axis. Densities as above.
inline Shape highlight(double height, double n, bool mirror, Dir wo, Dir wi) {
    const Dir h = unit(wo + wi);
    const double c = mirror ? inner({-wo.x, -wo.y, wo.z}, wi) : h.z, p = power(c, n);
    // dwi = 4 (h . w) dh (Torrance and Sparrow 1967), head-on h . w is the cosine itself.
    const double most = mirror ? HalfTau * (n + 1) / Tau : HalfTau * (n + 2) / (4 * Tau);
    const double pdf = (n + 1) / Tau * p / (mirror ? 1 : 4 * inner(h, wo));
    return {std::min(height, most) * p / HalfTau, pdf};
}

// A phase grating of square grooves, half as wide as their period (Goodman, *Introduction to Fourier Optics*,
// 4.4, for a binary phase of depth phi): orders by their Fourier coefficients. We take orders up to 5 for all
// (`odd`: the sum of those, of (2 / m pi)^2), and blur each by a Gaussian over direction cosines.
inline double grating(double roughness, double period, double depth, double turn, double wavelength, Dir wo,
                      Dir wi) {
    const double a = std::max(roughness * roughness / 3, 0.003), x = std::cos(Tau * turn),
                 y = std::sin(Tau * turn);
    // Along the grooves nothing changes; across them the sum of direction cosines is m lambda / period.
    const double along = x * (wo.x + wi.x) + y * (wo.y + wi.y),
                 across = x * (wo.y + wi.y) - y * (wo.x + wi.x);
    const double half = Tau * depth / wavelength; // of phi = 4 pi depth / lambda
    const auto coefficient = [](int m) { return std::pow(2 / (m * HalfTau), 2); };
    const double odd = 2 * (coefficient(1) + coefficient(3) + coefficient(5));
    double sum = 0;
    for (int m = -5; m <= 5; m++) {
        if (m % 2 == 0 && m != 0)
            continue;
        const double part =
            m == 0 ? std::pow(std::cos(half), 2) : std::pow(std::sin(half), 2) * coefficient(m) / odd;
        const double off = across - m * wavelength / period;
        sum += part * std::exp(-(along * along + off * off) / (a * a)) / (HalfTau * a * a);
    }
    return sum * wi.z;
}

// ---- phase functions, over solid angle, of the cosine c between the directions before and after

// Henyey and Greenstein 1941, eq. 2.
inline double henyey_greenstein_phase(double g, double c) {
    return (1 - g * g) / (2 * Tau * std::pow(1 + g * g - 2 * g * c, 1.5));
}
// Draine 2003, *Scattering by Interstellar Dust Grains I*, eq. 5.
inline double draine_phase(double g, double alpha, double c) {
    return henyey_greenstein_phase(g, c) * (1 + alpha * c * c) / (1 + alpha * (1 + 2 * g * g) / 3);
}
// Rayleigh 1871.
inline double rayleigh_phase(double c) {
    return 3 * (1 + c * c) / (8 * Tau);
}
// Jendersie and d'Eon 2023, *An Approximate Mie Scattering Function for Fog and Cloud Rendering*, eqs. 4
// to 7.
inline double mie_phase(double d, double c) {
    const double g_hg = std::exp(-0.0990567 / (d - 1.67154));
    const double g_d = std::exp(-2.20679 / (d + 3.91029) - 0.428934);
    const double alpha = std::exp(3.62489 - 8.29288 / (d + 5.52825));
    const double w = std::exp(-0.599085 / (d - 0.641583) - 0.665888);
    return (1 - w) * henyey_greenstein_phase(g_hg, c) + w * draine_phase(g_d, alpha, c);
}

} // namespace kanuka::bsdf::oracle
