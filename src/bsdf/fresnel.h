// How much an interface reflects: dielectrics, metals, thin films. All for unpolarised light.
#pragma once

#include "base/lanes_math.h"

namespace kanuka::bsdf {

// Fresnel reflectance of a dielectric; eta = index behind / index on the side of the incident direction. One
// beyond the critical angle. cos_i >= 0.
template <int W>
Float<W> fresnel_dielectric(Float<W> cos_i, Float<W> eta, Float<W>& cos_t) {
    const Float<W> one(1.0f), sin2_t = (one - cos_i * cos_i) / (eta * eta);
    cos_t = sqrt(max(one - sin2_t, Float<W>(0.0f)));
    const Float<W> parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    const Float<W> perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    const Float<W> r = Float<W>(0.5f) * fma(parallel, parallel, perpendicular * perpendicular);
    return kanuka::select(sin2_t >= one, one, r);
}

// Schlick's weight (1 - cos)^5.
template <int W>
Float<W> schlick_weight(Float<W> cosine) {
    const Float<W> m = clamp(Float<W>(1.0f) - cosine, Float<W>(0.0f), Float<W>(1.0f)), m2 = m * m;
    return m2 * m2 * m;
}

// cos (1 - cos)^6, the dip of real metals near 82 degrees below Schlick's curve (Lazányi and Szirmay-Kalos
// 2005), over its largest value, at cos = 1/7.
inline constexpr float DipCosine = 1 / 7.0f;
inline constexpr float DipScale = 17.6512576f; // 7^7 / 6^6
template <int W>
Float<W> dip_weight(Float<W> cosine) {
    return schlick_weight(cosine) * max(Float<W>(1.0f) - cosine, Float<W>(0.0f)) * cosine *
           Float<W>(DipScale);
}

template <int W>
struct Complex {
    Float<W> re, im;
    friend Complex operator+(const Complex& a, const Complex& b) { return {a.re + b.re, a.im + b.im}; }
    friend Complex operator-(const Complex& a, const Complex& b) { return {a.re - b.re, a.im - b.im}; }
    friend Complex operator*(const Complex& a, const Complex& b) {
        return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
    }
    friend Complex operator*(const Complex& a, Float<W> s) { return {a.re * s, a.im * s}; }
    Float<W> norm() const { return re * re + im * im; }
};
template <int W>
Complex<W> operator/(const Complex<W>& a, const Complex<W>& b) {
    const Float<W> inv = Float<W>(1.0f) / max(b.norm(), Float<W>(1e-30f));
    return {(a.re * b.re + a.im * b.im) * inv, (a.im * b.re - a.re * b.im) * inv};
}
// The root in the first quadrant, for numbers of the upper half plane.
template <int W>
Complex<W> sqrt(const Complex<W>& z) {
    const Float<W> size = sqrt(z.norm()), half(0.5f), zero(0.0f);
    return {sqrt(max(half * (size + z.re), zero)), sqrt(max(half * (size - z.re), zero))};
}

// Reflectance of a film of index n1 and thickness d on a base of index n2 + i k2, seen from vacuum at a
// cosine: Airy's sum of all reflections in the film, for each polarisation at one wavelength (Born and Wolf,
// 7.6). d over the wavelength; without a film, n1 = 1 and d = 0. Normal wave numbers p stand for n cos.
template <int W>
Float<W> film_reflectance(Float<W> cosine, Float<W> n1, Float<W> d_over_lambda, Float<W> n2, Float<W> k2) {
    const Float<W> one(1.0f), zero(0.0f);
    const Float<W> sin2 = max(one - cosine * cosine, zero), e1 = n1 * n1;
    const Complex<W> e2{n2 * n2 - k2 * k2, Float<W>(2.0f) * n2 * k2};
    const Float<W> p0 = cosine, p1 = sqrt(max(e1 - sin2, Float<W>(1e-12f)));
    const Complex<W> p2 = sqrt(Complex<W>{e2.re - sin2, e2.im});
    const Float<W> s01 = (p0 - p1) / (p0 + p1), p01 = (e1 * p0 - p1) / (e1 * p0 + p1);
    const Complex<W> c1{p1, zero};
    const Complex<W> s12 = (c1 - p2) / (c1 + p2);
    const Complex<W> p12 = (e2 * p1 - p2 * e1) / (e2 * p1 + p2 * e1);
    Float<W> s, c;
    const Float<W> turns = Float<W>(2.0f) * p1 * d_over_lambda;
    sincos_2pi(turns - floor(turns), s, c);
    const Complex<W> phase{c, s};
    const auto airy = [&](Float<W> outer, const Complex<W>& inner) {
        const Complex<W> back = inner * phase, first{outer, zero}, unit{one, zero};
        return ((first + back) / (unit + back * outer)).norm();
    };
    return min(Float<W>(0.5f) * (airy(s01, s12) + airy(p01, p12)), one);
}

} // namespace kanuka::bsdf
