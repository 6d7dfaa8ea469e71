// Phase functions: densities over the sphere of where light goes on, by the cosine between its direction
// before and after. What is evaluated is what is sampled, so a sample's weight is one.
#pragma once

#include "base/lanes_math.h"

namespace kanuka::bsdf {

enum class PhaseKind : uint8_t { Isotropic, HenyeyGreenstein, DoubleHenyeyGreenstein, Rayleigh, Draine, Mie };

// Parameters at a place, by kind: HenyeyGreenstein g; DoubleHenyeyGreenstein g of both, share of the second;
// Draine g, alpha; Mie those of its two parts, see mie_phase.
template <int W>
struct Phase {
    PhaseKind kind = PhaseKind::Isotropic;
    Float<W> g{0.0f}, other_g{0.0f}, share{0.0f}, alpha{0.0f};
};

inline constexpr float InvFourPi = InvPi / 4;

// (1 - g^2) / (1 + g^2 - 2 g c)^(3/2) / 4 pi (Henyey and Greenstein 1941). 1 + g^2 - 2 g c is written as (1 -
// |g|)^2 + 2 |g| (1 - c), with c turned about where g < 0, which keeps its digits in narrow peaks either way.
template <int W>
Float<W> henyey_greenstein(Float<W> g, Float<W> cosine) {
    const Float<W> one(1.0f), h = abs(g), away = one - copysign(one, g) * cosine;
    const Float<W> d = max((one - h) * (one - h) + Float<W>(2.0f) * h * away, Float<W>(1e-12f));
    return Float<W>(InvFourPi) * (one - h) * (one + h) / (d * sqrt(d));
}
template <int W>
Float<W> sample_henyey_greenstein(Float<W> g, Float<W> u) {
    const Float<W> one(1.0f), two(2.0f), zero(0.0f);
    const Mask<W> backwards = g < zero, even = abs(g) < Float<W>(1e-3f);
    const Float<W> h = kanuka::select(even, Float<W>(1e-3f), abs(g));
    const Float<W> flat = fma(two, kanuka::select(backwards, one - u, u), Float<W>(-1.0f));
    // 1 - c in place of c, for the same reason.
    const Float<W> s = (one - h * h) / max(fma(h, flat, one), Float<W>(1e-12f));
    const Float<W> t = (s * s - (one - h) * (one - h)) / (two * h); // 1 - c
    const Float<W> c = kanuka::select(even, flat, clamp(one - t, Float<W>(-1.0f), one));
    return kanuka::select(backwards, -c, c);
}

// Draine's (2003): Henyey and Greenstein's times 1 + alpha c^2; alpha = 1, g = 0 is Rayleigh's.
template <int W>
Float<W> draine(Float<W> g, Float<W> alpha, Float<W> cosine) {
    const Float<W> one(1.0f);
    const Float<W> norm = one + alpha * fma(Float<W>(2.0f) * g, g, one) * Float<W>(1 / 3.0f);
    return henyey_greenstein(g, cosine) * fma(alpha, cosine * cosine, one) / norm;
}

// Inverts the distribution of t = sqrt(1 + g^2 - 2 g c) in [1 - g, 1 + g], which is that of a polynomial over
// t: with A = 1 + g^2, B = alpha / 4 g^2, the integral of (1 + B (A - t^2)^2) / t^2. Newton's steps, kept
// between bounds that close in. g from 0.05 up: digits are few below.
template <int W>
Float<W> sample_draine(Float<W> g, Float<W> alpha, Float<W> u) {
    using F = Float<W>;
    const F one(1.0f), two(2.0f);
    const F h = max(g, F(0.05f)), A = fma(h, h, one), B = alpha / (F(4.0f) * h * h);
    const auto primitive = [&](F t) {
        return fma(B * t, fma(t * t, F(1 / 3.0f), -(two * A)), -(fma(B * A, A, one) / t));
    };
    F low = one - h, high = one + h;
    const F bottom = primitive(low), whole = primitive(high) - bottom;
    const F goal = fma(one - u, whole, bottom); // large t is backwards
    F t = fma(one - u, high - low, low);
    for (int i = 0; i < 20; i++) {
        const F value = primitive(t) - goal, q = A - t * t;
        const F slope = fma(B * q, q, one) / (t * t);
        low = kanuka::select(value < F(0.0f), t, low);
        high = kanuka::select(value < F(0.0f), high, t);
        const F next = t - value / slope, middle = F(0.5f) * (low + high);
        t = kanuka::select((next > low) & (next < high), next, middle);
    }
    return clamp((A - t * t) / (two * h), F(-1.0f), one);
}

// 3 (1 + c^2) / 16 pi. Its distribution is a cubic with one real root.
template <int W>
Float<W> rayleigh(Float<W> cosine) {
    return Float<W>(0.75f * InvFourPi) * fma(cosine, cosine, Float<W>(1.0f));
}
template <int W>
Float<W> sample_rayleigh(Float<W> u) {
    const Float<W> q = fma(Float<W>(4.0f), u, Float<W>(-2.0f)), a = abs(q); // c^3 + 3 c = 2 q
    const Float<W> A = exp2(log2(a + sqrt(fma(a, a, Float<W>(1.0f)))) * Float<W>(1 / 3.0f));
    return copysign(clamp(A - Float<W>(1.0f) / A, Float<W>(0.0f), Float<W>(1.0f)), q);
}

// Water droplets of 5 to 50 micrometres: Henyey and Greenstein's forward peak beside Draine's (Jendersie and
// d'Eon 2023, eqs. 4 to 7). Smaller and larger ones take the nearest of these sizes.
template <int W>
Phase<W> mie_phase(Float<W> diameter_um) {
    using F = Float<W>;
    const F d = clamp(diameter_um, F(5.0f), F(50.0f));
    Phase<W> p;
    p.kind = PhaseKind::Mie;
    p.g = exp(F(-0.0990567f) / (d - F(1.67154f)));
    p.other_g = exp(F(-2.20679f) / (d + F(3.91029f)) - F(0.428934f));
    p.alpha = exp(F(3.62489f) - F(8.29288f) / (d + F(5.52825f)));
    p.share = exp(F(-0.599085f) / (d - F(0.641583f)) - F(0.665888f));
    return p;
}

// Density over the sphere; the kind is the same for all lanes.
template <int W>
Float<W> eval_phase(const Phase<W>& p, Float<W> cosine) {
    const Float<W> one(1.0f);
    switch (p.kind) {
    case PhaseKind::HenyeyGreenstein:
        return henyey_greenstein(p.g, cosine);
    case PhaseKind::DoubleHenyeyGreenstein:
        return fma(p.share, henyey_greenstein(p.other_g, cosine),
                   (one - p.share) * henyey_greenstein(p.g, cosine));
    case PhaseKind::Rayleigh:
        return rayleigh(cosine);
    case PhaseKind::Draine:
        return draine(p.g, p.alpha, cosine);
    case PhaseKind::Mie:
        return fma(p.share, draine(p.other_g, p.alpha, cosine),
                   (one - p.share) * henyey_greenstein(p.g, cosine));
    default:
        return Float<W>(InvFourPi);
    }
}

// Where light that travels along `d` goes on; u_choice picks between two parts.
template <int W>
Vec3<Float<W>> sample_phase(const Phase<W>& p, const Vec3<Float<W>>& d, Float<W> u_choice, Float<W> u0,
                            Float<W> u1) {
    using F = Float<W>;
    const Mask<W> second = u_choice < p.share;
    F c;
    switch (p.kind) {
    case PhaseKind::HenyeyGreenstein:
        c = sample_henyey_greenstein(p.g, u1);
        break;
    case PhaseKind::DoubleHenyeyGreenstein:
        c = sample_henyey_greenstein(kanuka::select(second, p.other_g, p.g), u1);
        break;
    case PhaseKind::Rayleigh:
        c = sample_rayleigh(u1);
        break;
    case PhaseKind::Draine:
        c = sample_draine(p.g, p.alpha, u1);
        break;
    case PhaseKind::Mie:
        c = kanuka::select(second, sample_draine(p.other_g, p.alpha, u1), sample_henyey_greenstein(p.g, u1));
        break;
    default:
        c = fma(F(2.0f), u1, F(-1.0f));
        break;
    }
    F s, co;
    sincos_2pi(u0, s, co);
    const F r = sqrt(max(F(1.0f) - c * c, F(0.0f)));
    Vec3<F> t, b;
    coordinate_frame(d, t, b);
    return t * (r * co) + b * (r * s) + d * c;
}

} // namespace kanuka::bsdf
