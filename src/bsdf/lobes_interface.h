// Interfaces that light passes: rough and smooth dielectrics (Walter et al. 2007).
#pragma once

#include "bsdf/lobes_reflection.h"

namespace kanuka::bsdf {

template <int W>
struct InterfaceLobe {
    using V = Vec3<Float<W>>;
    static constexpr LobeId Id = LobeId::MicrosurfaceDielectricBsdfRgb_v1;
    static constexpr int Reflectance = color_of(Id, "reflectance"),
                         Transmittance = color_of(Id, "transmittance");

    [[gnu::noinline]] static LobeValue<W> eval(const LobeInputs<W>& in, const V& wo, const V& wi) {
        return in.stretched ? eval_with(stretched_of(in), in, to_axis(in, wo), to_axis(in, wi))
                            : eval_with(ggx_of(in), in, wo, wi);
    }
    // u_choice picks reflection or transmission by the hero wavelength's Fresnel term; where a film colours
    // it, by the mean.
    [[gnu::noinline]] static LobeSample<W> sample(const LobeInputs<W>& in, const V& wo, Float<W> u_choice,
                                                  Float<W> u0, Float<W> u1) {
        if (!in.stretched)
            return sample_with(ggx_of(in), in, wo, u_choice, u0, u1);
        LobeSample<W> s = sample_with(stretched_of(in), in, to_axis(in, wo), u_choice, u0, u1);
        s.wi = from_axis(in, s.wi);
        return s;
    }

  private:
    // Half vector of a pair of directions, on the side of wo; generalised for transmission (Walter et al.
    // 2007, eq. 16).
    static V half_vector(const V& wo, const V& wi, Float<W> eta, Mask<W> transmits) {
        const V h = normalize(kanuka::select(transmits, wo + wi * eta, wo + wi));
        return h * copysign(Float<W>(1.0f), h.z);
    }
    // Fresnel's term at a facet for the waves of which index `i` decides the direction: one, or all four
    // where they go the same way but a film reflects them differently; chosen: what sampling goes by.
    static void fresnel(const LobeInputs<W>& in, Float<W> cosine, int i, Spectrum<W>& F, Float<W>& chosen,
                        Float<W>& cos_t) {
        chosen = fresnel_dielectric(cosine, in.eta[i], cos_t);
        if (!in.has_film) {
            F = Spectrum<W>(chosen);
            return;
        }
        // A film without loss reflects as much from inside as from outside (Stokes), at refracted angles.
        const Float<W> one(1.0f);
        const Mask<W> from_inside = in.eta[i] < one, total = chosen >= one;
        const Float<W> outer = kanuka::select(from_inside, cos_t, cosine);
        const Float<W> index = kanuka::select(from_inside, one / in.eta[i], in.eta[i]);
        for (int k = 0; k < Wavelengths; k++)
            F[k] = kanuka::select(
                total, one,
                film_reflectance(outer, in.film_index, in.film / in.wavelength(k), index, Float<W>(0.0f)));
        chosen = kanuka::select(in.disperses, F[i], mean(F));
    }

    template <class Facets>
    static LobeValue<W> eval_with(const Facets& facets, const LobeInputs<W>& in, const V& wo, const V& wi) {
        const Mask<W> transmits = wi.z < Float<W>(0.0f), rough = in.alpha >= Float<W>(SmoothAlpha);
        const Float<W> lo = facets.lambda(wo), li = facets.lambda(wi), zero(0.0f), one(1.0f);
        LobeValue<W> r;
        for (int i = 0; i < (in.dispersive ? Wavelengths : 1); i++) {
            const V m = half_vector(wo, wi, in.eta[i], transmits);
            const Float<W> om = dot(wo, m), im = dot(wi, m);
            // Reflection wants wi on wo's side of the microfacet, transmission on the other.
            const Mask<W> valid =
                rough & (om > zero) & ((transmits & (im < zero)) | ((!transmits) & (im > zero)));
            Float<W> cos_t, chosen;
            Spectrum<W> F;
            fresnel(in, max(om, zero), i, F, chosen, cos_t);
            const Float<W> D = facets.D(m), visible = facets.sampled(wo, m, D, lo);
            const Float<W> both = D / (wo.z * (one + lo + li));
            const Float<W> q = fma(im, in.eta[i], om); // eq. 17, over eta
            const Float<W> jacobian_t = om * abs(im) * in.eta[i] * in.eta[i] / max(q * q, Float<W>(1e-12f));
            const Float<W> jr(0.25f);
            const auto scale = [&](Float<W> reflected) {
                return kanuka::select(transmits, (one - reflected) * jacobian_t, reflected * jr);
            };
            // Radiance is not scaled by eta^2: paths carry basic radiance L / n^2, which interfaces leave as
            // it is.
            const Float<W> pdf = kanuka::select(valid, visible * scale(chosen), zero);
            for (int k = in.dispersive ? i : 0; k < (in.dispersive ? i + 1 : Wavelengths); k++) {
                r.pdf[k] = pdf;
                r.f[k] = kanuka::select(valid, both * scale(F[k]), zero);
            }
        }
        if (in.compensated) {
            const Float<W> many = loss_at(in, wi) * abs(wi.z);
            for (int i = 0; i < Wavelengths; i++) // each is reciprocal by its own index
                r.f[i] =
                    fma(many,
                        kanuka::select(transmits, in.many_across * in.eta[i] / in.balance_eta, in.many_back),
                        r.f[i]);
        }
        if (in.has_walks)
            walk(in, wo, wi, transmits, r);
        if (in.has_spread) {
            const Float<W> side = kanuka::select(transmits, in.below, one - in.below);
            r.pdf = r.pdf * (one - in.spread) + Spectrum<W>(in.spread * side * abs(wi.z) * Float<W>(InvPi));
        }
        r.f *= select(transmits, in.color[Transmittance], in.color[Reflectance]);
        return r;
    }

    // Light that passes over one facet is part of the walk, too: it leaves at another height than it came.
    static void walk(const LobeInputs<W>& in, const V& wo, const V& wi, Mask<W> transmits, LobeValue<W>& r) {
        const Float<W> zero(0.0f);
        for (int i = 0; i < (in.dispersive ? Wavelengths : 1); i++) {
            const Float<W> many = walk_through_interface(microsurface_of(in), wo, wi, in.eta[i], in.walks);
            for (int k = in.dispersive ? i : 0; k < (in.dispersive ? i + 1 : Wavelengths); k++)
                r.f[k] = kanuka::select(in.walks & transmits, zero, r.f[k]) + many;
        }
    }

    template <class Facets>
    static LobeSample<W> sample_with(const Facets& facets, const LobeInputs<W>& in, const V& wo,
                                     Float<W> u_choice, Float<W> u0, Float<W> u1) {
        const Mask<W> spreads = in.has_spread ? split(in.spread, u1) : Mask<W>(false);
        const V m = sample_facet(facets, in, wo, u0, u1);
        const Float<W> om = max(dot(wo, m), Float<W>(0.0f)), zero(0.0f), one(1.0f);
        Float<W> cos_t, chosen;
        Spectrum<W> F;
        fresnel(in, om, 0, F, chosen, cos_t);
        const Mask<W> reflects = u_choice < chosen;
        LobeSample<W> s =
            sample_of(kanuka::select(reflects, reflect(wo, m), refract(wo, m, in.eta[0], cos_t)));
        s.valid = (reflects & (s.wi.z > zero)) | ((!reflects) & (s.wi.z < zero));
        if (in.has_spread) {
            V w = sample_cosine(u0, u1);
            w.z = kanuka::select(u_choice < one - in.below, w.z, -w.z);
            s.wi = kanuka::select(spreads, w, s.wi);
            s.valid |= spreads;
        }
        s.delta = in.alpha < Float<W>(SmoothAlpha);
        s.value = no_value<W>();
        if (!any(s.delta))
            return s;
        // Smooth: reflection goes one way for all wavelengths, each with its own Fresnel term; refraction
        // bends the hero alone where indices differ, the density of the others there is zero.
        for (int i = 0; i < Wavelengths; i++) {
            Float<W> Fi = F[i], pi = chosen, unused;
            Float<W> Ti = one - Fi, qi = one - pi;
            if (in.dispersive && i > 0) {
                Spectrum<W> all;
                Float<W> own;
                fresnel(in, om, i, all, own, unused);
                Fi = kanuka::select(in.disperses, own, Fi), pi = kanuka::select(in.disperses, own, pi);
                Ti = kanuka::select(in.disperses, zero, Ti), qi = kanuka::select(in.disperses, zero, qi);
            }
            s.value.pdf[i] = kanuka::select(reflects, pi, qi);
            s.value.f[i] =
                kanuka::select(reflects, Fi * in.color[Reflectance][i], Ti * in.color[Transmittance][i]);
        }
        return s;
    }

  public:
    // What one facet does not send on of light from w. The index at 587.6 nm stands for all.
    static Float<W> loss_at(const LobeInputs<W>& in, const V& w) {
        const Float<W> eta =
            kanuka::select(w.z < Float<W>(0.0f), Float<W>(1.0f) / in.balance_eta, in.balance_eta);
        return in.stretched ? cell(in, eta).loss(w) : loss_of_glass(abs(w.z), in.alpha, eta);
    }
    // The mean of it over directions, from the side whose index is `eta`.
    static Float<W> mean_loss(const LobeInputs<W>& in, Float<W> eta) {
        return in.stretched ? cell(in, eta).mean() : mean_loss_of_glass(in.alpha, eta);
    }

  private:
    static StretchedGlassCell<W> cell(const LobeInputs<W>& in, Float<W> eta) {
        return {in.tail, clamp(in.number[number_of(Id, "anisotropy")], Float<W>(0.0f), Float<W>(1.0f)),
                in.alpha, eta};
    }
};

// Indices of refraction at the hero wavelengths: Cauchy's n = A + B / lambda^2 through n_d and the Abbe
// number V_d = (n_d - 1) / (n_F - n_C), Fraunhofer lines d 587.6, F 486.1, C 656.3 nm.
template <int W>
Spectrum<W> index_of_refraction(Float<W> n_d, Float<W> abbe, const Float<W> l[Wavelengths]) {
    constexpr float InvD2 = 1 / (587.56f * 587.56f), InvF2 = 1 / (486.13f * 486.13f),
                    InvC2 = 1 / (656.28f * 656.28f);
    const Mask<W> disperses = abbe > Float<W>(0.0f);
    const Float<W> B = kanuka::select(
        disperses, (n_d - Float<W>(1.0f)) / (max(abbe, Float<W>(1.0f)) * Float<W>(InvF2 - InvC2)),
        Float<W>(0.0f));
    Spectrum<W> n;
    for (int i = 0; i < Wavelengths; i++) {
        const Float<W> lambda = fma(l[i], Float<W>(470.0f), Float<W>(360.0f));
        n[i] = fma(B, Float<W>(1.0f) / (lambda * lambda) - Float<W>(InvD2), n_d);
    }
    return n;
}

// An interface between equals neither bends nor reflects; its half vectors have no direction.
template <int W>
Float<W> next_to_one(Float<W> index) {
    const Float<W> one(1.0f), least(1.0001f);
    return kanuka::select(index >= one, max(index, least), min(index, one / least));
}

// Light that meets several facets leaves by a cosine lobe on either side, less where one facet does more:
// f = c L(wo) L(wi), L being what one facet does not send on (Kulla and Conty 2017, *Revisiting physically
// based shading at Imageworks*). Of it T x goes through: T is what a smooth interface lets through of diffuse
// light, x as much as reciprocity leaves, n_o^2 c_oi = n_i^2 c_io, with no c below zero. Samples are of it as
// often as it has light. Between facets of walks light goes either way.
template <int W>
void prepare_many(LobeInputs<W>& in, const Vec3<Float<W>>& wo) {
    const Float<W> zero(0.0f), one(1.0f), least(1e-6f), eta = in.balance_eta;
    const Mask<W> outside = eta >= one;
    const Float<W> loss =
        kanuka::select(in.rough, InterfaceLobe<W>::loss_at(in, in.stretched ? to_axis(in, wo) : wo), zero);
    const Float<W> here = max(InterfaceLobe<W>::mean_loss(in, eta), least),
                   there = max(InterfaceLobe<W>::mean_loss(in, one / eta), least);
    const Float<W> passes = one - dielectric_mean(kanuka::select(outside, eta, one / eta));
    const Float<W> below = passes * min(one, eta * eta * there / here);
    in.spread = min(loss, Float<W>(0.9f));
    in.below = below;
    in.many_back = loss * (one - below) / here * Float<W>(InvPi);
    in.many_across = loss * below / there * Float<W>(InvPi);
    if (!in.has_film) { // walks do not know films
        const Float<W> spread = in.spread;
        prepare_walks<InterfaceLobe<W>::Id>(in, wo, 0.5f);
        if (in.has_walks) {
            in.spread = kanuka::select(in.walks, in.spread, spread);
            in.below = kanuka::select(in.walks, Float<W>(0.5f), below);
            in.many_back = kanuka::select(in.walks, zero, in.many_back);
            in.many_across = kanuka::select(in.walks, zero, in.many_across);
        }
    }
    in.has_spread = any(in.spread > zero);
}

template <int W>
void prepare_interface(LobeInputs<W>& in, const Vec3<Float<W>>& wo, Mask<W> outside) {
    constexpr LobeId Id = InterfaceLobe<W>::Id;
    constexpr int Abbe = number_of(Id, "abbe");
    prepare_facets<Id>(in, mean(in.color[color_of(Id, "roughness")]));
    prepare_film<Id>(in);
    in.disperses = in.has(input_of(Id, "abbe")) ? in.number[Abbe] > Float<W>(0.0f) : Mask<W>(false);
    in.dispersive = any(in.disperses);
    const Float<W> one(1.0f);
    Float<W> n_d = max(in.number[number_of(Id, "ior")], Float<W>(1.0001f));
    Spectrum<W> index = in.dispersive ? index_of_refraction(n_d, in.number[Abbe], in.l) : Spectrum<W>(n_d);
    if (in.outer) { // within another medium: the index is relative, and may lie below one
        n_d = next_to_one(n_d / *in.outer);
        for (int i = 0; i < Wavelengths; i++)
            index[i] = next_to_one(index[i] / *in.outer);
    }
    for (int i = 0; i < Wavelengths; i++)
        in.eta[i] = kanuka::select(outside, index[i], one / index[i]);
    if (in.compensated) {
        in.balance_eta = kanuka::select(outside, n_d, one / n_d);
        prepare_many(in, wo);
    }
}

// Nothing is lost: what a rough interface does not reflect, it lets through. Each wavelength by its own
// index: lobes share samples by the mean, which must not depend on which of the four leads.
template <int W>
Spectrum<W> albedo_of_interface(const LobeInputs<W>& in, Float<W> cos_o) {
    const Float<W> one(1.0f);
    Spectrum<W> albedo;
    Float<W> F(0.0f);
    for (int i = 0; i < Wavelengths; i++) {
        if (i == 0 || in.dispersive) {
            Float<W> cos_t;
            const Float<W> n = in.eta[i], smooth = fresnel_dielectric(cos_o, n, cos_t);
            Float<W> rough = dielectric_albedo(cos_o, in.alpha, n);
            if (in.has_spread)
                rough += in.spread * (one - in.below);
            rough = min(rough, one);
            F = kanuka::select(in.rough & (n > one), rough, smooth);
        }
        albedo[i] = in.color[InterfaceLobe<W>::Reflectance][i] * F +
                    in.color[InterfaceLobe<W>::Transmittance][i] * (one - F);
    }
    return albedo;
}

} // namespace kanuka::bsdf
