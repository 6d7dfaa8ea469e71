// Oracles of diffuse lobes: f of reflectance `rho`, times the cosine of wi; both directions above.
#pragma once

#include <algorithm>
#include <map>

#include "bsdf/oracles/optics.h"

namespace kanuka::bsdf::oracle {

// ---- EON: Portsmouth, Kutz and Hill 2025, *EON: A Practical Energy-Preserving Rough Diffuse BRDF*, JCGT
// 14(1): the Fujii model (eq. 5 f.) with the energy that it loses given back. Albedos are taken by quadrature
// of the model, not by the paper's closed forms.

inline double eon_single(double r, double s, double cos_i, double cos_o) { // pi f of reflectance 1
    const double A = 1 / (1 + (0.5 - 4 / (3 * Tau)) * r);
    return A * (1 + r * (s > 0 ? s / std::max(cos_i, cos_o) : s));
}
inline double eon_albedo(double r, double cos_o) {
    static std::map<std::pair<double, double>, double> known;
    const auto [at, made] = known.try_emplace({r, cos_o}, 0.0);
    if (made) {
        const double sin_o = std::sqrt(1 - cos_o * cos_o);
        // s = sin sin cos(phi): half of the azimuths have s > 0, where t is the larger cosine.
        const auto over_azimuth = [&](double cos_i) {
            const double ss = sin_o * std::sqrt(std::max(0.0, 1 - cos_i * cos_i));
            const auto f = [&](double phi) { return eon_single(r, ss * std::cos(phi), cos_i, cos_o); };
            return 2 * (integral(0, Tau / 4, 2, f) + integral(Tau / 4, Tau / 2, 2, f)) * cos_i / HalfTau;
        };
        // cos = sin t: smooth at both ends; the kink lies at cos_o.
        const auto g = [&](double t) { return over_azimuth(std::sin(t)) * std::cos(t); };
        const double kink = std::asin(cos_o);
        at->second = integral(0, kink, 6, g) + integral(kink, Tau / 4, 6, g);
    }
    return at->second;
}
inline double eon_mean(double r) {
    static std::map<double, double> known;
    const auto [at, made] = known.try_emplace(r, 0.0);
    if (made)
        at->second = integral(0, 1, 12, [&](double c) { return 2 * c * eon_albedo(r, c); });
    return at->second;
}
inline double eon(double rho, double r, Dir wo, Dir wi) {
    const double s = inner(wo, wi) - wo.z * wi.z, mean = eon_mean(r);
    const double many = rho * rho * mean / (1 - rho * (1 - mean));
    const double more = (1 - eon_albedo(r, wo.z)) * (1 - eon_albedo(r, wi.z)) / std::max(1 - mean, 1e-12);
    return (rho * eon_single(r, s, wi.z, wo.z) + (r > 0 ? many * more : 0)) * wi.z / HalfTau;
}
// Its sampling, section 4 and listings 2 and 3: with a chance P_u uniform, else a cosine lobe bent by a
// linear map and cut at the horizon. The density goes back through the inverse of the whole matrix.
inline double eon_density(double r, Dir wo, Dir wi) {
    const double mu = wo.z, n = std::hypot(wo.x, wo.y);
    const double cx = n > 1e-6 ? wo.x / n : 1, sx = n > 1e-6 ? wo.y / n : 0;
    const double a =
        1 + r * (0.303392 - 0.518982 * mu + 0.111709 * mu * mu - 0.276266 * r + 0.335918 * mu * r);
    const double b =
        r * (-1.16407 + 1.15859 * mu + 0.150815 * r - 0.150105 * mu * r) / (mu * mu * mu - 1.43545);
    const double c = 1 + r * (0.20013 - 0.506373 * mu + 0.261777 * mu * mu);
    const double d = std::min(0.0, r * (0.540852 - 1.01625 * mu + 0.475392 * mu * mu) /
                                       (-1.0743 + 0.0725628 * mu + mu * mu));
    const double uniform =
        r > 0 ? std::max(0.0, std::pow(r, 0.1) *
                                  (0.162925 - 0.372058 * mu + 0.538233 * mu * mu - 0.290822 * mu * mu * mu))
              : 0;
    // M = (a 0 b; 0 c 0; d 0 1) takes the cosine lobe's w' to w.
    const double x = cx * wi.x + sx * wi.y, y = cx * wi.y - sx * wi.x, det = a - b * d;
    const Dir back{(x - b * wi.z) / det, y / c, (a * wi.z - d * x) / det};
    const double length = std::sqrt(inner(back, back)), kept = 0.5 * (1 + 1 / std::sqrt(1 + d * d));
    const double lobe =
        std::max(back.z, 0.0) / length / (HalfTau * kept) / std::abs(c * det) / std::pow(length, 3);
    return uniform / Tau + (1 - uniform) * lobe;
}

// ---- Burley 2012, *Physically-Based Shading at Disney*, 5.3, as Lagarde and de Rousiers (2014, *Moving
// Frostbite to Physically Based Rendering*, listing 1) scale it.
inline double burley(double rho, double roughness, Dir wo, Dir wi) {
    const auto schlick = [](double f90, double u) { return 1 + (f90 - 1) * std::pow(1 - u, 5); };
    const double cos_d = inner(unit(wo + wi), wi);
    const double f90 = 0.5 * roughness + 2 * cos_d * cos_d * roughness;
    const double factor = (1 - roughness) + roughness / 1.51;
    return rho * schlick(f90, wi.z) * schlick(f90, wo.z) * factor / HalfTau * wi.z;
}

// ---- Estevez and Kulla 2017, *Production Friendly Microfacet Sheen BRDF*, eq. 2, with Smith's masking of
// that very distribution (Heitz 2014, eqs. 32 and 99), by quadrature, where the paper fits a curve.

inline double charlie(double r, double cosine) {
    return (2 + 1 / r) * std::pow(1 - cosine * cosine, 0.5 / r) / Tau;
}
// Area of the facets as seen from a cosine: integral of D(m) max(w . m, 0). Over the azimuth of m:
// A = cos cos, B = sin sin: integral of max(A + B cos phi, 0).
inline double charlie_seen(double r, double cosine) {
    static std::map<std::pair<double, double>, double> known;
    const auto [at, made] = known.try_emplace({r, cosine}, 0.0);
    if (made) {
        const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
        const auto ring = [&](double theta) {
            const double A = cosine * std::cos(theta), B = sine * std::sin(theta);
            const double limit = A >= B ? HalfTau : std::acos(-A / B);
            return 2 * (A * limit + (A >= B ? 0 : B * std::sin(limit)));
        };
        const auto f = [&](double theta) {
            return charlie(r, std::cos(theta)) * std::sin(theta) * ring(theta);
        };
        const double kink = std::acos(sine); // where A = B
        at->second = integral(0, kink, 24, f) + integral(kink, Tau / 4, 24, f);
    }
    return at->second;
}
inline double sheen(double rho, double roughness, Dir wo, Dir wi) {
    const double r = std::max(roughness, 0.05);
    const double lambda_o = charlie_seen(r, wo.z) / wo.z - 1, lambda_i = charlie_seen(r, wi.z) / wi.z - 1;
    return rho * charlie(r, unit(wo + wi).z) / (1 + lambda_o + lambda_i) / (4 * wo.z * wi.z) * wi.z;
}

} // namespace kanuka::bsdf::oracle
