// Phong's and Blinn's highlights, scaled to be physical: reciprocal, and never more than they get; and as
// RISpec has them.
#pragma once

#include "bsdf/lobe_inputs.h"

namespace kanuka::bsdf {

// cos^n, as an elementary function of lanes.
template <int W>
Float<W> cosine_power(Float<W> cosine, Float<W> n) {
    return exp2(log2(max(cosine, Float<W>(1e-30f))) * n);
}
// A direction around +z with density (n + 1) / 2 pi cos^n.
template <int W>
Vec3<Float<W>> sample_cosine_power(Float<W> n, Float<W> u0, Float<W> u1) {
    Float<W> s, c;
    sincos_2pi(u0, s, c);
    const Float<W> one(1.0f);
    const Float<W> z = min(exp2(log2(max(one - u1, Float<W>(1e-7f))) / (n + one)), one);
    const Float<W> r = sqrt(max(one - z * z, Float<W>(0.0f)));
    return {r * c, r * s, z};
}
// The axis of the tables of both: as wide as GGX would be, Walter et al. 2007.
template <int W>
Float<W> width_of_exponent(Float<W> n) {
    return sqrt(Float<W>(2.0f) / (n + Float<W>(2.0f)));
}

// Around the mirror direction: f = (n + 2) / 2 pi cos^n (Lafortune and Willems 1994).
template <int W>
struct PhongLobe {
    using F = Float<W>;
    using V = Vec3<F>;
    static constexpr int Reflectance = color_of(LobeId::PhongBrdf, "reflectance"),
                         Exponent = number_of(LobeId::PhongBrdf, "exponent");

    static F shape(F n, const V& wo, const V& wi) {
        const F zero(0.0f), c = wo.z * wi.z - wo.x * wi.x - wo.y * wi.y;
        const F f = (n + F(2.0f)) * F(0.5f * InvPi) * cosine_power(c, n) * wi.z;
        return kanuka::select((wi.z > zero) & (c > zero), f, zero);
    }
    static Spectrum<W> albedo(const LobeInputs<W>& in, F cosine) {
        return in.color[Reflectance] *
               TableCell<W>(cosine, width_of_exponent(in.number[Exponent])).lookup(lobe_tables().phong);
    }
    [[gnu::noinline]] static LobeValue<W> eval(const LobeInputs<W>& in, const V& wo, const V& wi) {
        const F n = in.number[Exponent], f = shape(n, wo, wi);
        const F pdf = f * (n + F(1.0f)) / ((n + F(2.0f)) * max(wi.z, F(1e-12f)));
        return {in.color[Reflectance] * f, Spectrum<W>(pdf)};
    }
    [[gnu::noinline]] static LobeSample<W> sample(const LobeInputs<W>& in, const V& wo, F u0, F u1) {
        const V w = sample_cosine_power(in.number[Exponent], u0, u1), mirror(-wo.x, -wo.y, wo.z);
        V t, b;
        coordinate_frame(mirror, t, b);
        LobeSample<W> s = sample_of(t * w.x + b * w.y + mirror * w.z);
        s.valid = s.wi.z > F(0.0f);
        return s;
    }
};

// Around the half vector: f = (n + 1) / 8 pi cos^n / (h . wi max(cos, cos')), Ashikhmin and Shirley's (2000)
// scale.
template <int W>
struct BlinnLobe {
    using F = Float<W>;
    using V = Vec3<F>;
    static constexpr int Reflectance = color_of(LobeId::BlinnBrdf, "reflectance"),
                         Exponent = number_of(LobeId::BlinnBrdf, "exponent");

    static F density(F n, const V& wo, const V& h) {
        return (n + F(1.0f)) * F(InvPi / 8) * cosine_power(h.z, n) / max(dot(wo, h), F(1e-7f));
    }
    static F shape(F n, const V& wo, const V& wi) {
        const F zero(0.0f);
        const F f = density(n, wo, normalize(wo + wi)) * wi.z / max(max(wo.z, wi.z), F(1e-7f));
        return kanuka::select((wi.z > zero) & (wo.z > zero), f, zero);
    }
    static Spectrum<W> albedo(const LobeInputs<W>& in, F cosine) {
        return in.color[Reflectance] *
               TableCell<W>(cosine, width_of_exponent(in.number[Exponent])).lookup(lobe_tables().blinn);
    }
    [[gnu::noinline]] static LobeValue<W> eval(const LobeInputs<W>& in, const V& wo, const V& wi) {
        const F zero(0.0f), pdf = density(in.number[Exponent], wo, normalize(wo + wi));
        return {in.color[Reflectance] * shape(in.number[Exponent], wo, wi),
                Spectrum<W>(kanuka::select(wi.z > zero, pdf, zero))};
    }
    [[gnu::noinline]] static LobeSample<W> sample(const LobeInputs<W>& in, const V& wo, F u0, F u1) {
        const V h = sample_cosine_power(in.number[Exponent], u0, u1);
        LobeSample<W> s = sample_of(reflect(wo, h));
        s.valid = (s.wi.z > F(0.0f)) & (dot(wo, h) > F(0.0f));
        return s;
    }
};

// specular() and phong() of RISpec 3.2 (section 15.6) are Cl cos^n, without the cosine of the light: a light
// of Cl, which a white matte surface shows as Cl when it faces it, shows as Cl on the highlight's axis
// whatever the exponent and the view. So f |cos wi| = height / pi cos^n: not reciprocal, and above an
// exponent of about 5 (mirror: 1) less than comes in. Densities are Blinn's and Phong's.
template <int W>
struct HighlightLobe {
    using F = Float<W>;
    using V = Vec3<F>;
    static constexpr int Height = color_of(LobeId::HighlightBrdf, "height"),
                         Exponent = number_of(LobeId::HighlightBrdf, "exponent"),
                         About = number_of(LobeId::HighlightBrdf, "about");

    static Mask<W> about_mirror(const LobeInputs<W>& in) { return in.number[About] > F(0.5f); }
    // The height that reflects all light around the axis, were there no horizon: 1 over the integral of
    // cos^n / pi.
    static F most(const LobeInputs<W>& in) {
        const F n = in.number[Exponent];
        return kanuka::select(about_mirror(in), (n + F(1.0f)) * F(0.5f), (n + F(2.0f)) * F(0.125f));
    }
    static void prepare(LobeInputs<W>& in) {
        const F limit = most(in);
        for (int k = 0; k < Wavelengths; k++)
            in.color[Height][k] = min(in.color[Height][k], limit);
    }
    static Spectrum<W> albedo(const LobeInputs<W>& in, F cosine) {
        const TableCell<W> cell(cosine, width_of_exponent(in.number[Exponent]));
        const Mask<W> mirror = about_mirror(in);
        const F share = kanuka::select(mirror, cell.lookup(lobe_tables().highlight[1]),
                                       cell.lookup(lobe_tables().highlight[0]));
        return in.color[Height] * (share / most(in));
    }
    [[gnu::noinline]] static LobeValue<W> eval(const LobeInputs<W>& in, const V& wo, const V& wi) {
        const F zero(0.0f), n = in.number[Exponent];
        const V h = normalize(wo + wi);
        const Mask<W> mirror = about_mirror(in);
        const F c = kanuka::select(mirror, wo.z * wi.z - wo.x * wi.x - wo.y * wi.y, h.z);
        const Mask<W> lit = (wi.z > zero) & (c > zero);
        const F power = kanuka::select(lit, cosine_power(c, n) * F(InvPi), zero);
        const F pdf = power * kanuka::select(mirror, (n + F(1.0f)) * F(0.5f),
                                             (n + F(1.0f)) * F(0.125f) / max(dot(wo, h), F(1e-7f)));
        return {in.color[Height] * power, Spectrum<W>(pdf)};
    }
    [[gnu::noinline]] static LobeSample<W> sample(const LobeInputs<W>& in, const V& wo, F u0, F u1) {
        const V w = sample_cosine_power(in.number[Exponent], u0, u1), mirrored(-wo.x, -wo.y, wo.z);
        V t, b;
        coordinate_frame(mirrored, t, b);
        const V about = t * w.x + b * w.y + mirrored * w.z, half = reflect(wo, w);
        const Mask<W> mirror = about_mirror(in);
        LobeSample<W> s =
            sample_of(V(kanuka::select(mirror, about.x, half.x), kanuka::select(mirror, about.y, half.y),
                        kanuka::select(mirror, about.z, half.z)));
        s.valid = (s.wi.z > F(0.0f)) & (mirror | (dot(wo, w) > F(0.0f)));
        return s;
    }
};

} // namespace kanuka::bsdf
