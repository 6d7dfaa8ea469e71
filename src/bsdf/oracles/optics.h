// What the oracles share: vectors, Fresnel's equations and films in double, written after textbooks and apart
// from the lobes. Nothing of src/bsdf or base is used here, so that no mistake is made twice.
#pragma once

#include <cmath>
#include <complex>
#include <functional>

namespace kanuka::bsdf::oracle {

inline constexpr double Tau = 6.283185307179586476925, HalfTau = Tau / 2;
using Complex = std::complex<double>;

struct Dir {
    double x, y, z;
};
inline Dir operator+(Dir a, Dir b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Dir operator*(double s, Dir a) {
    return {s * a.x, s * a.y, s * a.z};
}
inline double inner(Dir a, Dir b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Dir unit(Dir a) {
    return (1 / std::sqrt(inner(a, a))) * a;
}

// Reflectance of a half space of complex index n - ik under a film, from a medium of index `outer`, for
// unpolarised light: the film's characteristic matrix for each polarisation (Born and Wolf, Principles of
// Optics, 7th ed., 1.6.2 and 14.4; signs as Macleod has them). turns: thickness over the wavelength.
inline double layered_reflectance(double cosine, double outer, Complex film, double turns, Complex base) {
    const double sine = outer * std::sqrt(std::max(0.0, 1 - cosine * cosine));
    const auto cosine_in = [&](Complex n) { // decays into the medium
        const Complex p = std::sqrt(1.0 - (sine / n) * (sine / n));
        return std::imag(n * p) > 0 || (std::imag(n * p) == 0 && std::real(p) < 0) ? -p : p;
    };
    const Complex cos_film = cosine_in(film), cos_base = cosine_in(base), i(0, 1);
    const Complex delta = Tau * film * turns * cos_film;
    double sum = 0;
    for (const bool s : {true, false}) {
        const auto admittance = [&](Complex n, Complex c) { return s ? n * c : n / c; };
        const Complex y0 = admittance(outer, cosine), y1 = admittance(film, cos_film);
        const Complex y2 = admittance(base, cos_base);
        const Complex B = std::cos(delta) + i * std::sin(delta) * y2 / y1;
        const Complex C = i * y1 * std::sin(delta) + std::cos(delta) * y2;
        sum += std::norm((y0 * B - C) / (y0 * B + C));
    }
    return 0.5 * sum;
}
inline double metal_reflectance(double cosine, double n, double k) {
    return layered_reflectance(cosine, 1, 1.0, 0, Complex(n, -k));
}

// A dielectric by the angles of incidence and refraction: Fresnel's sine and tangent laws (Born and Wolf,
// 1.5.2, eq. 21a). eta: index behind over in front.
inline double glass_reflectance(double cosine, double eta) {
    const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
    if (sine >= eta)
        return 1;
    if (sine < 1e-4) // both laws are 0 / 0; their difference from head-on is of the fourth order
        return (eta - 1) * (eta - 1) / ((eta + 1) * (eta + 1));
    const double i = std::atan2(sine, cosine), t = std::asin(sine / eta);
    const double s = std::sin(i - t) / std::sin(i + t), p = std::tan(i - t) / std::tan(i + t);
    return 0.5 * (s * s + p * p);
}

// A sheet of two such sides: what passes, over all reflections inside, one by one (Stokes 1862).
inline double sheet_reflectance(double cosine, double eta) {
    const double R = glass_reflectance(cosine, eta);
    double reflected = R, inside = (1 - R) * R; // on its way back to the first side
    for (int k = 0; k < 100000 && inside > 1e-13; k++) {
        reflected += inside * (1 - R);
        inside *= R * R;
    }
    return reflected;
}

// Integral over [a, b], Gauss-Legendre of eight points on each of n parts.
inline double integral(double a, double b, int n, const std::function<double(double)>& f) {
    constexpr double X[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
    constexpr double H[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};
    double sum = 0;
    const double half = 0.5 * (b - a) / n;
    for (int k = 0; k < n; k++)
        for (int j = 0; j < 4; j++) {
            const double middle = a + (2 * k + 1) * half;
            sum += H[j] * (f(middle - half * X[j]) + f(middle + half * X[j]));
        }
    return sum * half;
}

// Integral over [0, infinity), x = exp(pi / 2 sinh t): what falls as a power of x falls doubly exponentially
// (Takahasi and Mori 1974).
template <class Function>
double to_infinity(const Function& f) {
    constexpr double Step = 1 / 16.0;
    double sum = 0;
    for (int k = -60; k <= 76; k++) {
        const double t = k * Step, x = std::exp(HalfTau / 2 * std::sinh(t));
        sum += f(x) * x * HalfTau / 2 * std::cosh(t) * Step;
    }
    return sum;
}

} // namespace kanuka::bsdf::oracle
