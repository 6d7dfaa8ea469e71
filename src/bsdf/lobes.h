// The lobes of grid/lobe_schema.h: evaluation, sampling, density, albedo. Local frame: +z is the shading
// normal on the side of wo, so wo.z > 0; wi.z < 0 is transmission. Values are f(wo, wi) |cos wi|; densities
// are over solid angle of wi, one a wavelength, since dispersion bends each its own way.
#pragma once

#include "bsdf/albedo_table.h"
#include "bsdf/microfacet.h"
#include "bsdf/spectral.h"
#include "grid/lobe_schema.h"

namespace kanuka::bsdf {

using grid::LobeId;

// A lobe's inputs at a hit, decoded. Which fields a lobe uses: see decode_lobe in layering.h.
template <int W>
struct LobeInputs {
    Spectrum<W> a, b; // reflectance; edge reflectance or transmittance
    Float<W> alpha;
    Spectrum<W> eta; // index behind / index on the side of wo, per wavelength
    bool dispersive = false;
};

template <int W>
struct LobeValue {
    Spectrum<W> f; // f |cos wi|
    Spectrum<W> pdf;
};

template <int W>
struct LobeSample {
    Vec3<Float<W>> wi;
    Mask<W> valid;
    Mask<W> delta;      // f and pdf are those of a single direction: only their ratio has meaning
    LobeValue<W> value; // for delta lanes; others are evaluated with all lobes of the material
};

template <int W>
Vec3<Float<W>> sample_cosine(Float<W> u0, Float<W> u1) {
    Float<W> s, c;
    sincos_2pi(u0, s, c);
    const Float<W> r = sqrt(u1);
    return {r * c, r * s, sqrt(max(Float<W>(1.0f) - u1, Float<W>(1e-8f)))};
}

// ---- Lambert
// -----------------------------------------------------------------------------------------------------------

template <int W>
struct LambertLobe {
    static LobeValue<W> eval(const LobeInputs<W>& in, const Vec3<Float<W>>& wi, bool transmits) {
        const Float<W> cosine = max(transmits ? -wi.z : wi.z, Float<W>(0.0f));
        const Float<W> pdf = cosine * Float<W>(InvPi);
        return {in.a * pdf, Spectrum<W>(pdf)};
    }
    static LobeSample<W> sample(Float<W> u0, Float<W> u1, bool transmits) {
        LobeSample<W> s;
        s.wi = sample_cosine(u0, u1);
        if (transmits)
            s.wi.z = -s.wi.z;
        s.valid = Mask<W>(true);
        s.delta = Mask<W>(false);
        return s;
    }
};

// ---- microfacet reflection: conductor, and dielectric without transmission
// --------------------------------------------

template <int W, bool Conductor>
struct MicrofacetLobe {
    using V = Vec3<Float<W>>;

    static Spectrum<W> fresnel(const LobeInputs<W>& in, Float<W> cosine) {
        if constexpr (Conductor) {
            const Float<W> w = schlick_weight(cosine);
            return in.a * (Float<W>(1.0f) - w) + in.b * w;
        } else {
            Float<W> cos_t;
            return in.a * fresnel_dielectric(cosine, in.eta[0], cos_t);
        }
    }
    static LobeValue<W> eval(const LobeInputs<W>& in, const V& wo, const V& wi) {
        const Ggx<W> ggx{max(in.alpha, Float<W>(SmoothAlpha))};
        const V m = normalize(wo + wi);
        const Mask<W> valid =
            (wi.z > Float<W>(0.0f)) & (wo.z > Float<W>(0.0f)) & (in.alpha >= Float<W>(SmoothAlpha));
        const Float<W> lo = ggx.lambda(wo), li = ggx.lambda(wi), d = ggx.D(m) / (Float<W>(4.0f) * wo.z);
        const Float<W> zero(0.0f);
        const Float<W> pdf = kanuka::select(valid, d / (Float<W>(1.0f) + lo), zero);
        const Float<W> f = kanuka::select(valid, d / (Float<W>(1.0f) + lo + li), zero);
        // Opposite directions have no half vector: max() turns its NaN into 0.
        return {fresnel(in, max(dot(wo, m), zero)) * f, Spectrum<W>(pdf)};
    }
    static LobeSample<W> sample(const LobeInputs<W>& in, const V& wo, Float<W> u0, Float<W> u1) {
        const Mask<W> smooth = in.alpha < Float<W>(SmoothAlpha);
        const Ggx<W> ggx{max(in.alpha, Float<W>(SmoothAlpha))};
        V m = ggx.sample_visible(wo, u0, u1);
        m = kanuka::select(smooth, V(Float<W>(0.0f), Float<W>(0.0f), Float<W>(1.0f)), m);
        LobeSample<W> s;
        s.wi = reflect(wo, m);
        s.valid = s.wi.z > Float<W>(0.0f);
        s.delta = smooth;
        s.value = {fresnel(in, wo.z), Spectrum<W>(Float<W>(1.0f))};
        return s;
    }
};

// ---- dielectric interface
// ----------------------------------------------------------------------------------------------

template <int W>
struct DielectricLobe {
    using V = Vec3<Float<W>>;

    // Half vector of a pair of directions, on the side of wo; generalised for transmission (Walter et al.
    // 2007, eq. 16).
    static V half_vector(const V& wo, const V& wi, Float<W> eta, Mask<W> transmits) {
        const V h = normalize(kanuka::select(transmits, wo + wi * eta, wo + wi));
        return h * copysign(Float<W>(1.0f), h.z);
    }
    static LobeValue<W> eval(const LobeInputs<W>& in, const V& wo, const V& wi) {
        const Ggx<W> ggx{max(in.alpha, Float<W>(SmoothAlpha))};
        const Mask<W> transmits = wi.z < Float<W>(0.0f), rough = in.alpha >= Float<W>(SmoothAlpha);
        const Float<W> lo = ggx.lambda(wo), li = ggx.lambda(wi), zero(0.0f);
        LobeValue<W> r;
        for (int i = 0; i < (in.dispersive ? Wavelengths : 1); i++) {
            const V m = half_vector(wo, wi, in.eta[i], transmits);
            const Float<W> om = dot(wo, m), im = dot(wi, m);
            // Reflection wants wi on wo's side of the microfacet, transmission on the other.
            const Mask<W> valid =
                rough & (om > zero) & ((transmits & (im < zero)) | ((!transmits) & (im > zero)));
            Float<W> cos_t;
            const Float<W> F = fresnel_dielectric(max(om, zero), in.eta[i], cos_t), D = ggx.D(m);
            const Float<W> visible = D / (wo.z * (Float<W>(1.0f) + lo)); // pdf_visible / (wo . m)
            const Float<W> both = D / (wo.z * (Float<W>(1.0f) + lo + li));
            const Float<W> q = fma(im, in.eta[i], om); // eq. 17, over eta
            const Float<W> jacobian_t = om * abs(im) * in.eta[i] * in.eta[i] / max(q * q, Float<W>(1e-12f));
            const Float<W> jr = Float<W>(0.25f);
            const Float<W> scale = kanuka::select(transmits, (Float<W>(1.0f) - F) * jacobian_t, F * jr);
            r.pdf[i] = kanuka::select(valid, visible * scale, zero);
            // Radiance is not scaled by eta^2: paths carry basic radiance L / n^2, which interfaces leave as
            // it is.
            r.f[i] = kanuka::select(valid, both * scale, zero);
        }
        if (!in.dispersive)
            for (int i = 1; i < Wavelengths; i++)
                r.pdf[i] = r.pdf[0], r.f[i] = r.f[0];
        r.f *= select(transmits, in.b, in.a);
        return r;
    }
    // u_choice picks reflection or transmission by the hero wavelength's Fresnel term.
    static LobeSample<W> sample(const LobeInputs<W>& in, const V& wo, Float<W> u_choice, Float<W> u0,
                                Float<W> u1) {
        const Mask<W> smooth = in.alpha < Float<W>(SmoothAlpha);
        const Ggx<W> ggx{max(in.alpha, Float<W>(SmoothAlpha))};
        V m = ggx.sample_visible(wo, u0, u1);
        m = kanuka::select(smooth, V(Float<W>(0.0f), Float<W>(0.0f), Float<W>(1.0f)), m);
        Float<W> cos_t;
        const Float<W> om = max(dot(wo, m), Float<W>(0.0f));
        const Float<W> F = fresnel_dielectric(om, in.eta[0], cos_t);
        const Mask<W> reflects = u_choice < F;
        LobeSample<W> s;
        s.wi = kanuka::select(reflects, reflect(wo, m), refract(wo, m, in.eta[0], cos_t));
        s.valid = (reflects & (s.wi.z > Float<W>(0.0f))) | ((!reflects) & (s.wi.z < Float<W>(0.0f)));
        s.delta = smooth;
        // Smooth: reflection goes one way for all wavelengths, each with its own Fresnel term; refraction
        // bends the hero alone, the density of the others there is zero.
        const Float<W> zero(0.0f);
        for (int i = 0; i < Wavelengths; i++) {
            Float<W> unused;
            const Float<W> Fi = in.dispersive && i > 0 ? fresnel_dielectric(om, in.eta[i], unused) : F;
            const Float<W> Ti = in.dispersive && i > 0 ? zero : Float<W>(1.0f) - F;
            s.value.pdf[i] = kanuka::select(reflects, Fi, Ti);
            s.value.f[i] = s.value.pdf[i] * kanuka::select(reflects, in.a[i], in.b[i]);
        }
        return s;
    }
};

// ---- any lobe
// ----------------------------------------------------------------------------------------------------------
// `id` is the same for all lanes: hits are grouped by layering program.

template <int W>
LobeValue<W> eval_lobe(LobeId id, const LobeInputs<W>& in, const Vec3<Float<W>>& wo,
                       const Vec3<Float<W>>& wi) {
    switch (id) {
    case LobeId::LambertBrdf:
        return LambertLobe<W>::eval(in, wi, false);
    case LobeId::LambertBtdf:
        return LambertLobe<W>::eval(in, wi, true);
    case LobeId::MicrofacetConductorBrdf:
        return MicrofacetLobe<W, true>::eval(in, wo, wi);
    case LobeId::MicrofacetDielectricBrdf:
        return MicrofacetLobe<W, false>::eval(in, wo, wi);
    case LobeId::MicrosurfaceDielectricBsdfRgb_v1:
        return DielectricLobe<W>::eval(in, wo, wi);
    default:
        return {Spectrum<W>(Float<W>(0.0f)), Spectrum<W>(Float<W>(0.0f))};
    }
}

template <int W>
LobeSample<W> sample_lobe(LobeId id, const LobeInputs<W>& in, const Vec3<Float<W>>& wo, Float<W> u_choice,
                          Float<W> u0, Float<W> u1) {
    switch (id) {
    case LobeId::LambertBrdf:
        return LambertLobe<W>::sample(u0, u1, false);
    case LobeId::LambertBtdf:
        return LambertLobe<W>::sample(u0, u1, true);
    case LobeId::MicrofacetConductorBrdf:
        return MicrofacetLobe<W, true>::sample(in, wo, u0, u1);
    case LobeId::MicrofacetDielectricBrdf:
        return MicrofacetLobe<W, false>::sample(in, wo, u0, u1);
    case LobeId::MicrosurfaceDielectricBsdfRgb_v1:
        return DielectricLobe<W>::sample(in, wo, u_choice, u0, u1);
    default: {
        LobeSample<W> s{};
        s.wi = {Float<W>(0.0f), Float<W>(0.0f), Float<W>(1.0f)};
        s.valid = s.delta = Mask<W>(false);
        return s;
    }
    }
}

// Fraction of light from wo that the lobe scatters: what a coat keeps from its base, and how lobes share
// samples.
template <int W>
Spectrum<W> albedo_of_lobe(LobeId id, const LobeInputs<W>& in, Float<W> cos_o) {
    switch (id) {
    case LobeId::LambertBrdf:
    case LobeId::LambertBtdf:
        return in.a;
    case LobeId::MicrofacetConductorBrdf: {
        // Fresnel's mean over the visible normals: a black face still has its bright edges.
        const Float<W> edge = albedo_table().schlick(cos_o, in.alpha);
        return in.a * (albedo_table().ggx(cos_o, in.alpha) - edge) + in.b * edge;
    }
    case LobeId::MicrofacetDielectricBrdf:
        return in.a * albedo_table().dielectric(cos_o, in.alpha, in.eta[0]);
    case LobeId::MicrosurfaceDielectricBsdfRgb_v1: {
        Float<W> cos_t;
        const Float<W> F = fresnel_dielectric(cos_o, in.eta[0], cos_t);
        return in.a * F + in.b * (Float<W>(1.0f) - F);
    }
    default:
        return Spectrum<W>(Float<W>(0.0f));
    }
}

} // namespace kanuka::bsdf
