// Oracles of microfacets: reflection and transmission of Walter et al. 2007, *Microfacet Models for
// Refraction through Rough Surfaces*, with the masking and shadowing of Heitz 2014, *Understanding the
// Masking-Shadowing Function in Microfacet-Based BRDFs*.
#pragma once

#include <algorithm>
#include <map>

#include "bsdf/oracles/optics.h"

namespace kanuka::bsdf::oracle {

// Slopes over ax and ay; tail: 1/2 GGX, 0 Beckmann, else Student's t with gamma = 1 / tail (Ribardière et al.
// 2017, *STD: Student's t-Distribution of Slopes for Microfacet Based BSDFs*).
struct Facets {
    double ax, ay, tail = 0.5;

    bool ggx() const { return tail == 0.5; }
    double D(Dir m) const {
        if (m.z <= 0)
            return 0;
        const double c4 = std::pow(m.z, 4),
                     s2 = (std::pow(m.x / ax, 2) + std::pow(m.y / ay, 2)) / (m.z * m.z);
        if (ggx()) // Heitz, eq. 85
            return 1 / (HalfTau * ax * ay * c4 * (1 + s2) * (1 + s2));
        if (tail == 0) // eq. 79
            return std::exp(-s2) / (HalfTau * ax * ay * c4);
        const double gamma = 1 / tail; // Ribardière, eqs. 11 and 30
        return std::pow(1 + s2 / (gamma - 1), -gamma) / (HalfTau * ax * ay * c4);
    }
    // Lambda by a = cotangent over the width along w (Heitz, eqs. 80, 86; 73 where there is no closed form).
    double lambda(Dir w) const {
        const double width = std::hypot(ax * w.x, ay * w.y);
        if (width < 1e-12)
            return 0;
        return of_cotangent(std::abs(w.z) / width, tail);
    }
    static double of_cotangent(double a, double tail) {
        if (tail == 0.5)
            return 0.5 * (std::sqrt(1 + 1 / (a * a)) - 1);
        if (tail == 0)
            return std::exp(-a * a) / (2 * a * std::sqrt(HalfTau)) - 0.5 * std::erfc(a);
        static std::map<std::pair<double, double>, double> known;
        const auto [at, made] = known.try_emplace({a, tail}, 0.0);
        if (made) {
            const double gamma = 1 / tail;
            // The integral over both slopes of (x - a) P22 where x > a.
            const auto column = [&](double x) {
                return 2 * to_infinity([&](double y) {
                           return std::pow(1 + (x * x + y * y) / (gamma - 1), -gamma) / HalfTau;
                       });
            };
            at->second = to_infinity([&](double s) { return s * column(a + s); }) / a;
        }
        return at->second;
    }
};

// Reflection of Fresnel 1, times the cosine of wi (Walter, eq. 20), with masking and shadowing correlated by
// height (Heitz, eq. 99), where Walter has the product.
inline double reflected(const Facets& facets, Dir wo, Dir wi) {
    const double G = 1 / (1 + facets.lambda(wo) + facets.lambda(wi));
    return facets.D(unit(wo + wi)) * G / (4 * wo.z);
}
// The same of transmission of 1 - F = 1 to wi below, eta = index there over that above (Walter, eqs. 16, 17
// and 21; i = wi, o = wo). Walter's f is of radiance; ours of radiance over the index squared, which
// interfaces leave as it is: times eta^2.
inline double transmitted(const Facets& facets, double eta, Dir wo, Dir wi) {
    const Dir h = unit((-1.0 * wo) + (-eta * wi)); // eq. 16, on the side of the denser one
    const Dir m = h.z < 0 ? -1.0 * h : h;
    const double oh = inner(wo, m), ih = inner(wi, m);
    if (oh <= 0 || ih >= 0)
        return 0;
    const double G = 1 / (1 + facets.lambda(wo) + facets.lambda(wi));
    const double f = std::abs(ih * oh / (wi.z * wo.z)) * G * facets.D(m) / std::pow(eta * ih + oh, 2);
    return f * eta * eta * std::abs(wi.z);
}
inline double cosine_of_facet(double eta, Dir wo, Dir wi) { // wo . m
    return std::abs(inner(wo, unit(wi.z < 0 ? wo + eta * wi : wo + wi)));
}

// Densities of normals: as GGX of the same widths is seen from wo (Heitz 2018, *Sampling the GGX Distribution
// of Visible Normals*, eq. 1); where tails are longer than GGX's, half of them D cos.
inline double normals(const Facets& facets, Dir wo, Dir m) {
    const Facets ggx{facets.ax, facets.ay};
    const double seen = std::max(inner(wo, m), 0.0) * ggx.D(m) / (wo.z * (1 + ggx.lambda(wo)));
    return facets.tail > 0.505 ? 0.5 * (seen + facets.D(m) * m.z) : seen;
}
inline double reflected_density(const Facets& facets, Dir wo, Dir wi) { // Walter, eq. 14
    const Dir m = unit(wo + wi);
    return normals(facets, wo, m) / (4 * inner(wo, m));
}
inline double transmitted_density(const Facets& facets, double eta, Dir wo, Dir wi) { // Walter, eq. 17
    const Dir h = unit(wo + eta * wi), m = h.z < 0 ? -1.0 * h : h;
    const double oh = inner(wo, m), ih = inner(wi, m);
    return oh <= 0 || ih >= 0
               ? 0
               : normals(facets, wo, m) * eta * eta * std::abs(ih) / std::pow(eta * ih + oh, 2);
}

// Schlick 1994 between two colours, less a dip at 82 degrees (Lazányi and Szirmay-Kalos 2005, scaled as Kutz
// et al. 2021, *Novel Aspects of the Adobe Standard Material*, eq. 2): what lies there is tint times
// Schlick's.
inline double tinted_schlick(double f0, double f90, double tint, double cosine) {
    const auto curve = [&](double c) { return f0 + (f90 - f0) * std::pow(1 - c, 5); };
    const double at = 1 / 7.0, b = curve(at) * (1 - tint) / (at * std::pow(1 - at, 6));
    return std::max(curve(cosine) - b * cosine * std::pow(1 - cosine, 6), 0.0);
}
// Cauchy's two terms through n_d with the Abbe number (n_d - 1) / (n_F - n_C).
inline double glass_index(double n_d, double abbe, double nm) {
    if (abbe <= 0)
        return n_d;
    const double d = 587.56, F = 486.13, C = 656.28;
    const double B = (n_d - 1) / abbe / (1 / (F * F) - 1 / (C * C));
    return n_d + B * (1 / (nm * nm) - 1 / (d * d));
}

} // namespace kanuka::bsdf::oracle
