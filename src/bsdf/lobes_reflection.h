// Microfacets that reflect: metals by colour or by complex index, dielectrics without transmission, and
// reflection back to where light comes from.
#pragma once

#include <iterator>

#include "bsdf/lobe_inputs.h"
#include "bsdf/microsurface.h"

namespace kanuka::bsdf {

// ---- what all microfacet lobes share

inline constexpr float FewFacets = 0.01f; // below this width next to no light meets a second facet

template <LobeId Lobe, int W>
void prepare_facets(LobeInputs<W>& in, Float<W> roughness) {
    constexpr int Anisotropy = number_of(Lobe, "anisotropy"), Rotation = number_of(Lobe, "rotation"),
                  Tail = number_of(Lobe, "tail");
    in.alpha = roughness * roughness;
    in.stretched = in.has(input_of(Lobe, "anisotropy")) || in.has(input_of(Lobe, "tail"));
    in.rough = in.alpha > Float<W>(FewFacets);
    in.compensated = any(in.rough);
    if (in.stretched) {
        const Float<W> anisotropy = clamp(in.number[Anisotropy], Float<W>(0.0f), Float<W>(1.0f));
        in.along = stretched_width(in.alpha, anisotropy);
        in.tail = in.number[Tail];
        Float<W> s, c;
        const Float<W> turn = in.number[Rotation];
        sincos_2pi(turn - floor(turn), s, c);
        in.axis_x = c, in.axis_y = s;
        in.cell = StretchedCell<W>(in.tail, anisotropy, in.alpha);
    }
    in.balance_alpha = in.stretched ? in.cell.round_alpha() : in.alpha;
}

template <int W>
Vec3<Float<W>> to_axis(const LobeInputs<W>& in, const Vec3<Float<W>>& w) {
    return {fma(in.axis_x, w.x, in.axis_y * w.y), fma(in.axis_x, w.y, -(in.axis_y * w.x)), w.z};
}
template <int W>
Vec3<Float<W>> from_axis(const LobeInputs<W>& in, const Vec3<Float<W>>& w) {
    return {fma(in.axis_x, w.x, -(in.axis_y * w.y)), fma(in.axis_x, w.y, in.axis_y * w.x), w.z};
}

template <int W>
Ggx<W> ggx_of(const LobeInputs<W>& in) {
    return {max(in.alpha, Float<W>(SmoothAlpha))};
}
template <int W>
StretchedFacets<W> stretched_of(const LobeInputs<W>& in) {
    return {in.along, max(in.alpha, Float<W>(SmoothAlpha)), in.tail};
}

// s of lobe_tables.h, of a direction in the frame of the axis.
template <int W>
Float<W> balance_of(const LobeInputs<W>& in, const Vec3<Float<W>>& w) {
    if (!in.compensated)
        return Float<W>(1.0f);
    const Float<W> s = in.stretched ? in.cell.balance(w) : ggx_balance(abs(w.z), in.alpha);
    return kanuka::select(in.rough, s, Float<W>(1.0f));
}

// f of reflection by facets of reflectance 1, and its density.
template <int W>
struct FacetTerms {
    Vec3<Float<W>> m;
    Float<W> cos_m, f, pdf;
    Mask<W> valid;
};
template <int W, class Facets>
FacetTerms<W> facet_reflection(const Facets& facets, const LobeInputs<W>& in, const Vec3<Float<W>>& wo,
                               const Vec3<Float<W>>& wi) {
    const Float<W> zero(0.0f), one(1.0f), quarter(0.25f);
    FacetTerms<W> t;
    t.m = normalize(wo + wi);
    t.valid = (wi.z > zero) & (wo.z > zero) & (in.alpha >= Float<W>(SmoothAlpha));
    t.cos_m = max(dot(wo, t.m), zero); // opposite directions have no half vector: max() turns its NaN into 0
    const Float<W> D = facets.D(t.m), lo = facets.lambda(wo), li = facets.lambda(wi);
    const Float<W> f = quarter * D / (wo.z * (one + lo + li));
    t.f = kanuka::select(t.valid & (f >= zero), f, zero);
    const Float<W> pdf = quarter * facets.sampled(wo, t.m, D, lo);
    t.pdf = kanuka::select(t.valid & (pdf >= zero), pdf, zero);
    return t;
}

// A facet's normal for a direction sampled from wo; smooth lanes have +z.
template <int W, class Facets>
Vec3<Float<W>> sample_facet(const Facets& facets, const LobeInputs<W>& in, const Vec3<Float<W>>& wo,
                            Float<W> u0, Float<W> u1) {
    const Mask<W> smooth = in.alpha < Float<W>(SmoothAlpha);
    const Vec3<Float<W>> up(Float<W>(0.0f), Float<W>(0.0f), Float<W>(1.0f));
    return kanuka::select(smooth, up, facets.sample(wo, u0, u1));
}

// 1 + c (s s' - 1).
template <int W>
Spectrum<W> compensation(const LobeInputs<W>& in, const Vec3<Float<W>>& wi) {
    const Float<W> more = fma(in.balance, balance_of(in, wi), Float<W>(-1.0f));
    Spectrum<W> r;
    for (int i = 0; i < Wavelengths; i++)
        r[i] = fma(in.gain[i], more, Float<W>(1.0f));
    return r;
}

// ---- light between facets

// share: of samples for what more than one facet scatters, over that a mirror loses to it.
template <LobeId Lobe, int W>
void prepare_walks(LobeInputs<W>& in, const Vec3<Float<W>>& wo, float share) {
    if (!in.has(input_of(Lobe, "walks")) || !in.compensated)
        return;
    in.walks = in.rough & (in.number[number_of(Lobe, "walks")] > Float<W>(0.5f));
    in.has_walks = any(in.walks);
    if (!in.has_walks)
        return;
    if (in.stretched) // walks know GGX's facets alone
        in.tail = kanuka::select(in.walks, Float<W>(0.5f), in.tail);
    const Float<W> lost = Float<W>(1.0f) - ggx_albedo(wo.z, in.alpha);
    in.spread = kanuka::select(in.walks, clamp(Float<W>(share) * lost, Float<W>(0.02f), Float<W>(0.9f)),
                               Float<W>(0.0f));
}
template <int W>
Microsurface<W> microsurface_of(const LobeInputs<W>& in) {
    const Float<W> alpha = max(in.alpha, Float<W>(SmoothAlpha));
    return {in.stretched ? in.along : alpha, alpha};
}
// Where u falls into the first `share` of [0, 1), and what it is within its part.
template <int W>
Mask<W> split(Float<W> share, Float<W>& u) {
    const Float<W> one(1.0f), below(0.99999994f);
    const Mask<W> first = u < share;
    u = min(kanuka::select(first, u / max(share, Float<W>(1e-6f)),
                           (u - share) / max(one - share, Float<W>(1e-6f))),
            below);
    return first;
}

// Evaluation and sampling of a reflection whose Fresnel term is `fresnel(in, cosine)`.
template <int W, class Fresnel>
struct ReflectionLobe {
    using V = Vec3<Float<W>>;

    [[gnu::noinline]] static LobeValue<W> eval(const LobeInputs<W>& in, const V& wo, const V& wi) {
        return in.stretched ? eval_with(stretched_of(in), in, to_axis(in, wo), to_axis(in, wi))
                            : eval_with(ggx_of(in), in, wo, wi);
    }
    [[gnu::noinline]] static LobeSample<W> sample(const LobeInputs<W>& in, const V& wo, Float<W> u0,
                                                  Float<W> u1) {
        V wi;
        const Mask<W> spreads = in.has_walks ? split(in.spread, u1) : Mask<W>(false);
        if (in.stretched) {
            const V w = to_axis(in, wo);
            wi = from_axis(in, reflect(w, sample_facet(stretched_of(in), in, w, u0, u1)));
        } else {
            wi = reflect(wo, sample_facet(ggx_of(in), in, wo, u0, u1));
        }
        if (in.has_walks)
            wi = kanuka::select(spreads, sample_cosine(u0, u1), wi);
        LobeSample<W> s = sample_of(wi);
        s.valid = wi.z > Float<W>(0.0f);
        s.delta = in.alpha < Float<W>(SmoothAlpha);
        if (any(s.delta))
            s.value = {Fresnel::value(in, wo.z), Spectrum<W>(Float<W>(1.0f))};
        else
            s.value = no_value<W>();
        return s;
    }

  private:
    template <class Facets>
    static LobeValue<W> eval_with(const Facets& facets, const LobeInputs<W>& in, const V& wo, const V& wi) {
        const FacetTerms<W> t = facet_reflection(facets, in, wo, wi);
        LobeValue<W> v{Fresnel::value(in, t.cos_m) * t.f, Spectrum<W>(t.pdf)};
        if (in.compensated && Fresnel::Compensated) {
            const Spectrum<W> more = compensation(in, wi);
            v.f *= in.has_walks ? select(in.walks, Spectrum<W>(Float<W>(1.0f)), more) : more;
        }
        if (in.has_walks) {
            v.f += walk_between_mirrors(microsurface_of(in), wo, wi, in.walks,
                                        [&](Float<W> cosine) { return Fresnel::value(in, cosine); });
            const Float<W> cosine = max(wi.z, Float<W>(0.0f)) * Float<W>(InvPi);
            v.pdf = v.pdf * (Float<W>(1.0f) - in.spread) + Spectrum<W>(in.spread * cosine);
        }
        return v;
    }
};

// ---- metals by colour

// Also of Retro, and of Metal once prepared.
struct Conductor {
    static constexpr LobeId Id = LobeId::MicrofacetConductorBrdf;
    static constexpr int Face = color_of(Id, "reflectance"), Edge = color_of(Id, "edgeReflectance"),
                         Tint = color_of(Id, "edgeTint"), Roughness = number_of(Id, "roughness");
    static_assert(Face == color_of(LobeId::RetroBrdf, "reflectance") &&
                  Edge == color_of(LobeId::RetroBrdf, "edgeReflectance") &&
                  Roughness == number_of(LobeId::RetroBrdf, "roughness"));
};

// Schlick's curve from the face's reflectance to the edge's, less the dip of metals.
template <int W>
struct ColoredFresnel {
    static constexpr bool Compensated = true;

    static Spectrum<W> value(const LobeInputs<W>& in, Float<W> cosine) {
        const Float<W> w = schlick_weight(cosine);
        Spectrum<W> r = in.color[Conductor::Face] * (Float<W>(1.0f) - w) + in.color[Conductor::Edge] * w;
        if (in.has(input_of(Conductor::Id, "edgeTint"))) {
            const Float<W> d = dip_weight(cosine);
            for (int i = 0; i < Wavelengths; i++)
                r[i] = max(r[i] - in.dip[i] * d, Float<W>(0.0f));
        }
        return r;
    }
};

// c and s of lobe_tables.h. F: the mean of Fresnel's term over directions.
template <int W>
void prepare_gain(LobeInputs<W>& in, const Vec3<Float<W>>& wo, const Spectrum<W>& F) {
    const Float<W> one(1.0f);
    const Float<W> E = in.stretched ? in.cell.mean() : ggx_mean_albedo(in.alpha);
    for (int i = 0; i < Wavelengths; i++)
        in.gain[i] = F[i] * E / (one - F[i] * (one - E));
    in.balance = balance_of(in, in.stretched ? to_axis(in, wo) : wo);
}

template <int W>
void prepare_conductor(LobeInputs<W>& in, const Vec3<Float<W>>& wo) {
    using C = Conductor;
    prepare_facets<C::Id>(in, in.number[C::Roughness]);
    in.dip = Spectrum<W>(Float<W>(0.0f));
    if (in.has(input_of(C::Id, "edgeTint"))) { // at 82 degrees, where the dip is deepest (Kutz et al. 2021)
        const Float<W> w = schlick_weight(Float<W>(DipCosine)), one(1.0f);
        for (int i = 0; i < Wavelengths; i++)
            in.dip[i] =
                (in.color[C::Face][i] * (one - w) + in.color[C::Edge][i] * w) * (one - in.color[C::Tint][i]);
    }
    if (in.compensated) { // Schlick's weight has the mean 1/21, the dip DipScale / 126
        Spectrum<W> F;
        for (int i = 0; i < Wavelengths; i++)
            F[i] = in.color[C::Face][i] +
                   (in.color[C::Edge][i] - in.color[C::Face][i]) * Float<W>(1 / 21.0f) -
                   in.dip[i] * Float<W>(DipScale / 126);
        prepare_gain(in, wo, F);
    }
    prepare_walks<C::Id>(in, wo, 1.0f);
}

// What is scattered once by Fresnel's mean over visible normals: a black face still has its bright edges;
// what meets several facets comes on top.
template <int W>
Spectrum<W> albedo_of_conductor(const LobeInputs<W>& in, Float<W> cos_o) {
    const Float<W> alpha = in.balance_alpha, one(1.0f);
    const Float<W> whole = ggx_albedo(cos_o, alpha), edge = schlick_albedo(cos_o, alpha);
    Spectrum<W> a = in.color[Conductor::Face] * (whole - edge) + in.color[Conductor::Edge] * edge;
    const Float<W> dip = dip_albedo(cos_o, alpha);
    const Float<W> more = one / max(whole, Float<W>(1e-3f)) - one;
    for (int i = 0; i < Wavelengths; i++) {
        a[i] = max(a[i] - in.dip[i] * dip, Float<W>(0.0f));
        if (in.compensated)
            a[i] = kanuka::select(in.rough, a[i] * fma(in.gain[i], more, one), a[i]);
        a[i] = min(a[i], one); // whether or not a lane beside it is rough
    }
    return a;
}

template <LobeId Lobe, int W>
void prepare_film(LobeInputs<W>& in) {
    in.has_film = in.has(input_of(Lobe, "filmThickness"));
    if (in.has_film) {
        in.film = max(in.number[number_of(Lobe, "filmThickness")], Float<W>(0.0f));
        in.film_index = max(in.number[number_of(Lobe, "filmIor")], Float<W>(1.0f));
    }
}

// ---- metals by complex index

template <int W>
struct MetalFresnel {
    static constexpr bool Compensated = true;

    static Spectrum<W> value(const LobeInputs<W>& in, Float<W> cosine) {
        Spectrum<W> r;
        for (int i = 0; i < Wavelengths; i++)
            r[i] = in.has_film ? film_reflectance(cosine, in.film_index, in.film / in.wavelength(i),
                                                  in.eta[i], in.k[i])
                               : film_reflectance(cosine, Float<W>(1.0f), Float<W>(0.0f), in.eta[i], in.k[i]);
        return r;
    }
};

// The mean over directions, 2 int F c dc, by Gauss's rule of four cosines for that weight: within 0.0006
// bare, 0.006 under 600 nm of film.
template <int W>
Spectrum<W> mean_fresnel_of_metal(const LobeInputs<W>& in) {
    constexpr float Cosine[] = {0.139759864f, 0.416409568f, 0.723156986f, 0.942895804f};
    constexpr float Weight[] = {0.0623619419f, 0.259695095f, 0.406929136f, 0.271013827f};
    Spectrum<W> F(Float<W>(0.0f));
    for (size_t k = 0; k < std::size(Cosine); k++)
        F += MetalFresnel<W>::value(in, Float<W>(Cosine[k])) * Float<W>(Weight[k]);
    return F;
}

// For albedos over visible normals Schlick's curve and a dip stand in, right head-on and at 82 degrees: face,
// edge and dip, as for metals by colour. They take the places of eta and extinction, which are kept as eta
// and k.
template <int W>
void prepare_metal(LobeInputs<W>& in, const Vec3<Float<W>>& wo) {
    constexpr LobeId Id = LobeId::MetalBrdf;
    constexpr int Eta = color_of(Id, "eta"), Extinction = color_of(Id, "extinction");
    const Float<W> one(1.0f), zero(0.0f);
    const Float<W> which = in.number[number_of(Id, "metal")];
    const Int<W> row = max(min(to_int(which + Float<W>(0.5f)), Int<W>(LobeTables::Metals)), Int<W>(0));
    const Mask<W> named = row > Int<W>(0);
    for (int i = 0; i < Wavelengths; i++) {
        in.eta[i] = in.color[Eta][i], in.k[i] = in.color[Extinction][i];
        if (any(named)) {
            const Knot<W> at(in.l[i], LobeTables::MetalKnots);
            const Int<W> p = max(row - Int<W>(1), Int<W>(0)) * Int<W>(LobeTables::MetalKnots) + at.i;
            const auto read = [&](const float* t) {
                const Float<W> a = gather(t, p), b = gather(t, p + Int<W>(1));
                return fma(at.f, b - a, a);
            };
            in.eta[i] = kanuka::select(named, read(lobe_tables().metal_n), in.eta[i]);
            in.k[i] = kanuka::select(named, read(lobe_tables().metal_k), in.k[i]);
        }
        in.eta[i] = max(in.eta[i], Float<W>(0.01f));
        in.k[i] = max(in.k[i], zero);
    }
    prepare_facets<Id>(in, in.number[number_of(Id, "roughness")]);
    prepare_film<Id>(in);
    in.color[Conductor::Face] = MetalFresnel<W>::value(in, one);
    in.color[Conductor::Edge] = Spectrum<W>(one);
    const Spectrum<W> at82 = MetalFresnel<W>::value(in, Float<W>(DipCosine));
    const Float<W> w = schlick_weight(Float<W>(DipCosine));
    for (int i = 0; i < Wavelengths; i++)
        in.dip[i] = fma(one - w, in.color[Conductor::Face][i], w) - at82[i];
    if (in.compensated)
        prepare_gain(in, wo, mean_fresnel_of_metal(in));
}

// ---- dielectrics that only reflect

// Not compensated: what an upper layer does not reflect is its base's.
template <int W>
struct DielectricFresnel {
    static constexpr bool Compensated = false;
    static constexpr int Reflectance = color_of(LobeId::MicrofacetDielectricBrdf, "reflectance");

    static Spectrum<W> value(const LobeInputs<W>& in, Float<W> cosine) {
        if (in.has_film) {
            Spectrum<W> r;
            for (int i = 0; i < Wavelengths; i++)
                r[i] = in.color[Reflectance][i] * film_reflectance(cosine, in.film_index,
                                                                   in.film / in.wavelength(i), in.eta[0],
                                                                   Float<W>(0.0f));
            return r;
        }
        Float<W> cos_t;
        return in.color[Reflectance] * fresnel_dielectric(cosine, in.eta[0], cos_t);
    }
};

template <int W>
void prepare_dielectric_reflection(LobeInputs<W>& in) {
    constexpr LobeId Id = LobeId::MicrofacetDielectricBrdf;
    in.eta = Spectrum<W>(max(in.number[number_of(Id, "ior")], Float<W>(1.0001f)));
    prepare_facets<Id>(in, in.number[number_of(Id, "roughness")]);
    prepare_film<Id>(in);
}

template <int W>
Spectrum<W> albedo_of_dielectric_reflection(const LobeInputs<W>& in, Float<W> cos_o) {
    const Float<W> alpha = in.balance_alpha;
    const Float<W> plain = dielectric_albedo(cos_o, alpha, in.eta[0]);
    if (!in.has_film)
        return in.color[DielectricFresnel<W>::Reflectance] * plain;
    // As much more than without the film as a smooth surface reflects.
    Float<W> cos_t;
    const Float<W> soft = softened(cos_o, alpha);
    const Float<W> ratio = plain / max(fresnel_dielectric(soft, in.eta[0], cos_t), Float<W>(1e-6f));
    return DielectricFresnel<W>::value(in, soft) * min(ratio, Float<W>(1.0f));
}

} // namespace kanuka::bsdf
