// Diffuse lobes: Lambert, energy-preserving Oren and Nayar, Burley, and sheen.
#pragma once

#include "bsdf/lobe_inputs.h"

namespace kanuka::bsdf {

template <int W>
struct LambertLobe {
    static constexpr int Part = color_of(LobeId::LambertBrdf, "diffuseReflectance");
    static_assert(Part == color_of(LobeId::LambertBtdf, "diffuseTransmittance"));

    static LobeValue<W> eval(const LobeInputs<W>& in, const Vec3<Float<W>>& wi, bool transmits) {
        const Float<W> cosine = max(transmits ? -wi.z : wi.z, Float<W>(0.0f));
        const Float<W> pdf = cosine * Float<W>(InvPi);
        return {in.color[Part] * pdf, Spectrum<W>(pdf)};
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

// ---- Oren and Nayar's microfacets, as Fujii approximated them, with the energy of interreflections: EON
// (Portsmouth, Kutz and Hill 2025). Sampled by a cosine lobe that a linear map bends towards the view, cut at
// the horizon, beside uniform directions.

template <int W>
struct OrenNayarLobe {
    using F = Float<W>;
    using V = Vec3<F>;
    static constexpr int Reflectance = color_of(LobeId::OrenNayarBrdf, "diffuseReflectance"),
                         Roughness = number_of(LobeId::OrenNayarBrdf, "roughness");
    static constexpr float C1 = 0.5f - 2 / (3 * Pi), C2 = 2 / 3.0f - 28 / (15 * Pi);

    // Albedo of what scatters once, for reflectance 1: closed form. (sin / cos) (1 - sin^3), as it stands in
    // the paper, is written without cancellation.
    static F once(F cosine, F r) {
        const F one(1.0f), mu = clamp(cosine, F(0.0f), one);
        const F sine = sqrt(max(one - mu * mu, F(0.0f))), theta = acos_over_pi(mu) * F(Pi);
        const F cubed = sine * mu * (one + sine + sine * sine) / (one + sine);
        const F G = sine * (theta - sine * mu) + F(2 / 3.0f) * (cubed - sine);
        return (one + r * G * F(InvPi)) / fma(F(C1), r, one);
    }
    static F once_mean(F r) { return fma(F(C2), r, F(1.0f)) / fma(F(C1), r, F(1.0f)); }
    // Interreflections of a reflectance, over those of reflectance 1.
    static F many(F reflectance, F r) {
        const F mean = once_mean(r), one(1.0f);
        return reflectance * reflectance * mean / max(one - reflectance * (one - mean), F(1e-6f));
    }
    static void prepare(LobeInputs<W>& in, const V& wo) { in.balance = once(wo.z, in.number[Roughness]); }

    static Spectrum<W> albedo(const LobeInputs<W>& in) {
        Spectrum<W> a;
        for (int i = 0; i < Wavelengths; i++)
            a[i] = in.color[Reflectance][i] * in.balance +
                   many(in.color[Reflectance][i], in.number[Roughness]) * (F(1.0f) - in.balance);
        return a;
    }
    [[gnu::noinline]] static LobeValue<W> eval(const LobeInputs<W>& in, const V& wo, const V& wi) {
        const F zero(0.0f), one(1.0f), r = in.number[Roughness];
        const Mask<W> valid = (wi.z > zero) & (wo.z > zero);
        const F s = fma(wi.x, wo.x, wi.y * wo.y);
        const F t = kanuka::select(s > zero, max(max(wi.z, wo.z), F(1e-6f)), one);
        const F first = fma(r, s / t, one) / fma(F(C1), r, one);
        const F mean = once_mean(r);
        const F more = (one - in.balance) * (one - once(wi.z, r)) / max(one - mean, F(1e-6f));
        const F scale = kanuka::select(valid, wi.z * F(InvPi), zero);
        LobeValue<W> v;
        for (int i = 0; i < Wavelengths; i++)
            v.f[i] =
                max(fma(in.color[Reflectance][i], first, many(in.color[Reflectance][i], r) * more), zero) *
                scale;
        const Bend bend(wo, r);
        const F pdf = fma(bend.uniform, F(0.5f * InvPi), (one - bend.uniform) * bend.density(wi));
        v.pdf = Spectrum<W>(kanuka::select(valid, pdf, zero));
        return v;
    }
    [[gnu::noinline]] static LobeSample<W> sample(const LobeInputs<W>& in, const V& wo, F u_choice, F u0,
                                                  F u1) {
        const Bend bend(wo, in.number[Roughness]);
        const Mask<W> uniform = u_choice < bend.uniform;
        F s, c;
        sincos_2pi(u0, s, c);
        const F r = sqrt(max(F(1.0f) - u1 * u1, F(0.0f)));
        LobeSample<W> out =
            sample_of(kanuka::select(uniform, V(r * c, r * s, max(u1, F(1e-6f))), bend.sample(u0, u1)));
        out.valid = out.wi.z > F(0.0f);
        return out;
    }

  private:
    // The linear map M = (a 0 b; 0 c 0; d 0 1) of a cosine lobe, in the frame where wo lies at y = 0, x > 0,
    // and how often directions are uniform instead: fits of the paper's section 4.
    struct Bend {
        F a, b, c, d, uniform, kept; // kept: the share of the lobe that stays above the horizon
        F x, y;                      // of wo, normalised

        Bend(const V& wo, F r) {
            const F one(1.0f), mu = clamp(wo.z, F(0.0f), one), zero(0.0f);
            a = one + r * (F(0.303392f) + (F(-0.518982f) + F(0.111709f) * mu) * mu +
                           (F(-0.276266f) + F(0.335918f) * mu) * r);
            b = r * (F(-1.16407f) + F(1.15859f) * mu + (F(0.150815f) - F(0.150105f) * mu) * r) /
                (mu * mu * mu - F(1.43545f));
            c = one + (F(0.20013f) + (F(-0.506373f) + F(0.261777f) * mu) * mu) * r;
            d = min((F(0.540852f) + (F(-1.01625f) + F(0.475392f) * mu) * mu) * r /
                        (F(-1.0743f) + (F(0.0725628f) + mu) * mu),
                    zero);
            const F tenth = exp2(log2(max(r, F(1e-9f))) * F(0.1f));
            uniform = kanuka::select(
                r > F(1e-6f),
                max(tenth * (F(0.162925f) + mu * (F(-0.372058f) + (F(0.538233f) - F(0.290822f) * mu) * mu)),
                    zero),
                zero);
            kept = fma(F(0.5f), one / sqrt(fma(d, d, one)), F(0.5f));
            const F length = sqrt(fma(wo.x, wo.x, wo.y * wo.y)), inv = one / max(length, F(1e-12f));
            const Mask<W> straight = length < F(1e-6f);
            x = kanuka::select(straight, one, wo.x * inv);
            y = kanuka::select(straight, zero, wo.y * inv);
        }
        // Of the bent lobe at w: its cosine lobe at M^-1 w, times the Jacobian.
        F density(const V& w) const {
            const F wx = fma(w.x, x, w.y * y), wy = fma(w.y, x, -(w.x * y)), det = c * (a - b * d);
            const V h(c * (wx - b * w.z), (a - b * d) * wy, c * (a * w.z - d * wx)); // det M^-1 w
            const F l2 = dot(h, h);
            return det * det * max(h.z, F(0.0f)) / (kept * F(Pi) * max(l2 * l2, F(1e-20f)));
        }
        // The disk below the lobe, less the lune that M takes below the horizon: chords are squeezed.
        V sample(F u0, F u1) const {
            F s, co;
            sincos_2pi(u0, s, co);
            const F radius = sqrt(u1), one(1.0f), zero(0.0f);
            const F q = radius * s, chord = sqrt(max(one - q * q, zero));
            const F p = -fma(kept, radius * co - chord, chord);
            const F z = sqrt(max(one - p * p - q * q, zero));
            const V w = normalize(V(fma(a, p, b * z), c * q, fma(d, p, z)));
            return {fma(w.x, x, -(w.y * y)), fma(w.x, y, w.y * x), w.z};
        }
    };
};

// ---- Burley's diffuse lobe (2012), scaled so that it gives back no more than it gets (Lagarde and de
// Rousiers 2014)

template <int W>
struct BurleyLobe {
    using F = Float<W>;
    using V = Vec3<F>;
    static constexpr int Reflectance = color_of(LobeId::BurleyBrdf, "diffuseReflectance"),
                         Roughness = number_of(LobeId::BurleyBrdf, "roughness");

    // f cos of reflectance 1.
    static F shape(F roughness, const V& wo, const V& wi) {
        const F zero(0.0f), one(1.0f);
        const F cos_d2 = F(0.5f) * max(one + dot(wo, wi), zero); // half of the angle between
        const F edge = fma(F(2.0f) * cos_d2, roughness, F(0.5f) * roughness) - one;
        const F i = fma(edge, schlick_weight(wi.z), one), o = fma(edge, schlick_weight(wo.z), one);
        const F factor = fma(roughness, F(1 / 1.51f - 1), one);
        const Mask<W> valid = (wi.z > zero) & (wo.z > zero);
        return kanuka::select(valid, i * o * factor * wi.z * F(InvPi), zero);
    }
    static Spectrum<W> albedo(const LobeInputs<W>& in, F cosine) {
        const F r = in.number[Roughness];
        return in.color[Reflectance] * TableCell<W>(cosine, r * r * r * r).lookup(lobe_tables().burley);
    }
    [[gnu::noinline]] static LobeValue<W> eval(const LobeInputs<W>& in, const V& wo, const V& wi) {
        return {in.color[Reflectance] * shape(in.number[Roughness], wo, wi),
                Spectrum<W>(max(wi.z, F(0.0f)) * F(InvPi))};
    }
};

// ---- Sheen: fibres that stand up, D = (2 + 1/r) sin^(1/r) / 2 pi (Estevez and Kulla 2017), but with the
// masking that this D itself has (Smith), from a table, in place of a fit.

template <int W>
struct SheenLobe {
    using F = Float<W>;
    using V = Vec3<F>;
    static constexpr int Reflectance = color_of(LobeId::SheenBrdf, "reflectance"),
                         Roughness = number_of(LobeId::SheenBrdf, "roughness");
    static constexpr float MinRoughness = 0.05f;

    // Tables go on below the least roughness, so that what lies between their knots is right at it.
    static constexpr float LeastTabulated = 0.02f;
    static F held(F roughness) { return max(roughness, F(MinRoughness)); }
    static F D(F roughness, F cosine) {
        const F n = F(1.0f) / max(roughness, F(LeastTabulated));
        const F sine2 = max(F(1.0f) - cosine * cosine, F(1e-20f));
        return (F(2.0f) + n) * exp2(log2(sine2) * F(0.5f) * n) * F(0.5f * InvPi);
    }
    // cos (1 + Lambda): fibres' area as seen. Half of cos, as from either side of a surface, and an even part
    // that goes with the root of 1 / r: the table has the latter, times that root.
    static F seen(F roughness, F cosine) {
        const F r = max(roughness, F(LeastTabulated));
        const F even = TableCell<W>(cosine, r * r * r * r).lookup(lobe_tables().sheen_seen);
        return max(fma(cosine, F(0.5f), even / sqrt(r)), cosine);
    }
    static Spectrum<W> albedo(const LobeInputs<W>& in, F cosine) {
        const F r = held(in.number[Roughness]);
        return in.color[Reflectance] * TableCell<W>(cosine, r * r * r * r).lookup(lobe_tables().sheen);
    }
    static F shape(F roughness, const V& wo, const V& wi) {
        const F zero(0.0f), both = wo.z * wi.z;
        const V m = normalize(wo + wi);
        const F masking = seen(roughness, wo.z) * wi.z + seen(roughness, wi.z) * wo.z - both;
        const Mask<W> valid = (wi.z > zero) & (wo.z > zero) & (masking > zero);
        const F f = F(0.25f) * D(roughness, m.z) * wi.z / max(masking, F(1e-12f));
        return kanuka::select(valid, f, zero);
    }
    [[gnu::noinline]] static LobeValue<W> eval(const LobeInputs<W>& in, const V& wo, const V& wi) {
        const F pdf = kanuka::select(wi.z > F(0.0f), F(0.5f * InvPi), F(0.0f));
        return {in.color[Reflectance] * shape(held(in.number[Roughness]), wo, wi), Spectrum<W>(pdf)};
    }
    // Uniform directions: sheen is brightest along the surface.
    static LobeSample<W> sample(F u0, F u1) {
        F s, c;
        sincos_2pi(u0, s, c);
        const F z = max(u1, F(1e-6f)), r = sqrt(max(F(1.0f) - z * z, F(0.0f)));
        return sample_of(V(r * c, r * s, z));
    }
};

} // namespace kanuka::bsdf
