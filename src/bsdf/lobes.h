// Any lobe of grid/lobe_table.h: evaluation, sampling, density, albedo. `id` is the same for all lanes: hits
// are grouped by layering program. All but Lambert's are functions of their own, so that what calls them
// stays small.
#pragma once

#include "bsdf/lobes_classic.h"
#include "bsdf/lobes_diffuse.h"
#include "bsdf/lobes_interface.h"
#include "bsdf/lobes_special.h"

namespace kanuka::bsdf {

// Fills in what is derived from a lobe's inputs, once a hit. `outside`: wo is on the outside of the surface.
// l: normalised wavelengths, which must outlive the inputs.
template <int W>
[[gnu::noinline]] void prepare_lobe(LobeId id, LobeInputs<W>& in, const Vec3<Float<W>>& wo, Mask<W> outside,
                                    const Float<W> l[Wavelengths], const Float<W>* outer = nullptr) {
    in.l = l;
    in.outer = outer;
    in.stretched = in.has_film = in.dispersive = in.compensated = in.has_walks = in.has_spread = false;
    switch (id) {
    case LobeId::OrenNayarBrdf:
        return OrenNayarLobe<W>::prepare(in, wo);
    case LobeId::MicrofacetConductorBrdf:
        return prepare_conductor(in, wo);
    case LobeId::RetroBrdf: { // as a conductor without stretch or tint
        in.given = 0;
        return prepare_conductor(in, wo);
    }
    case LobeId::MetalBrdf:
        return prepare_metal(in, wo);
    case LobeId::MicrofacetDielectricBrdf:
        return prepare_dielectric_reflection(in);
    case LobeId::MicrosurfaceDielectricBsdfRgb_v1:
        return prepare_interface(in, wo, outside);
    case LobeId::ThinWalledDielectricBsdf:
        return ThinWallLobe<W>::prepare(in, wo);
    case LobeId::GratingBrdf:
        return GratingLobe<W>::prepare(in);
    case LobeId::HighlightBrdf:
        return HighlightLobe<W>::prepare(in);
    default:
        return;
    }
}

// Light that a mirror of its own sends back: reflection as seen from the mirrored side.
template <int W>
Vec3<Float<W>> mirrored(const Vec3<Float<W>>& wo) {
    return {-wo.x, -wo.y, wo.z};
}

template <int W>
LobeValue<W> eval_lobe(LobeId id, const LobeInputs<W>& in, const Vec3<Float<W>>& wo,
                       const Vec3<Float<W>>& wi) {
    switch (id) {
    case LobeId::LambertBrdf:
        return LambertLobe<W>::eval(in, wi, false);
    case LobeId::LambertBtdf:
        return LambertLobe<W>::eval(in, wi, true);
    case LobeId::OrenNayarBrdf:
        return OrenNayarLobe<W>::eval(in, wo, wi);
    case LobeId::BurleyBrdf:
        return BurleyLobe<W>::eval(in, wo, wi);
    case LobeId::SheenBrdf:
        return SheenLobe<W>::eval(in, wo, wi);
    case LobeId::MicrofacetConductorBrdf:
        return ReflectionLobe<W, ColoredFresnel<W>>::eval(in, wo, wi);
    case LobeId::RetroBrdf:
        return ReflectionLobe<W, ColoredFresnel<W>>::eval(in, mirrored(wo), wi);
    case LobeId::MetalBrdf:
        return ReflectionLobe<W, MetalFresnel<W>>::eval(in, wo, wi);
    case LobeId::MicrofacetDielectricBrdf:
        return ReflectionLobe<W, DielectricFresnel<W>>::eval(in, wo, wi);
    case LobeId::MicrosurfaceDielectricBsdfRgb_v1:
        return InterfaceLobe<W>::eval(in, wo, wi);
    case LobeId::ThinWalledDielectricBsdf:
        return ThinWallLobe<W>::eval(in, wo, wi);
    case LobeId::GratingBrdf:
        return GratingLobe<W>::eval(in, wo, wi);
    case LobeId::PhongBrdf:
        return PhongLobe<W>::eval(in, wo, wi);
    case LobeId::BlinnBrdf:
        return BlinnLobe<W>::eval(in, wo, wi);
    case LobeId::HighlightBrdf:
        return HighlightLobe<W>::eval(in, wo, wi);
    default:
        return no_value<W>();
    }
}

template <int W>
LobeSample<W> sample_lobe(LobeId id, const LobeInputs<W>& in, const Vec3<Float<W>>& wo, Float<W> u_choice,
                          Float<W> u0, Float<W> u1) {
    switch (id) {
    case LobeId::LambertBrdf:
    case LobeId::BurleyBrdf:
        return LambertLobe<W>::sample(u0, u1, false);
    case LobeId::LambertBtdf:
        return LambertLobe<W>::sample(u0, u1, true);
    case LobeId::OrenNayarBrdf:
        return OrenNayarLobe<W>::sample(in, wo, u_choice, u0, u1);
    case LobeId::SheenBrdf:
        return SheenLobe<W>::sample(u0, u1);
    case LobeId::MicrofacetConductorBrdf:
        return ReflectionLobe<W, ColoredFresnel<W>>::sample(in, wo, u0, u1);
    case LobeId::RetroBrdf:
        return ReflectionLobe<W, ColoredFresnel<W>>::sample(in, mirrored(wo), u0, u1);
    case LobeId::MetalBrdf:
        return ReflectionLobe<W, MetalFresnel<W>>::sample(in, wo, u0, u1);
    case LobeId::MicrofacetDielectricBrdf:
        return ReflectionLobe<W, DielectricFresnel<W>>::sample(in, wo, u0, u1);
    case LobeId::MicrosurfaceDielectricBsdfRgb_v1:
        return InterfaceLobe<W>::sample(in, wo, u_choice, u0, u1);
    case LobeId::ThinWalledDielectricBsdf:
        return ThinWallLobe<W>::sample(in, wo, u_choice, u0, u1);
    case LobeId::GratingBrdf:
        return GratingLobe<W>::sample(in, wo, u_choice, u0, u1);
    case LobeId::PhongBrdf:
        return PhongLobe<W>::sample(in, wo, u0, u1);
    case LobeId::BlinnBrdf:
        return BlinnLobe<W>::sample(in, wo, u0, u1);
    case LobeId::HighlightBrdf:
        return HighlightLobe<W>::sample(in, wo, u0, u1);
    case LobeId::AimedBsdf: // where to, those know who know its place
    {
        LobeSample<W> s = sample_of(Vec3<Float<W>>(Float<W>(0.0f), Float<W>(0.0f), Float<W>(1.0f)));
        s.delta = Mask<W>(true);
        s.value = {in.color[color_of(LobeId::AimedBsdf, "part")], Spectrum<W>(Float<W>(1.0f))};
        return s;
    }
    default: {
        LobeSample<W> s = sample_of(Vec3<Float<W>>(Float<W>(0.0f), Float<W>(0.0f), Float<W>(1.0f)));
        s.valid = Mask<W>(false);
        return s;
    }
    }
}

// Fraction of light from wo that the lobe scatters: what a coat keeps from its base, and how lobes share
// samples.
template <int W>
Spectrum<W> albedo_of_lobe(LobeId id, const LobeInputs<W>& in, const Vec3<Float<W>>& wo) {
    switch (id) {
    case LobeId::LambertBrdf:
    case LobeId::LambertBtdf:
        return in.color[LambertLobe<W>::Part];
    case LobeId::AimedBsdf:
        return in.color[color_of(LobeId::AimedBsdf, "part")];
    case LobeId::OrenNayarBrdf:
        return OrenNayarLobe<W>::albedo(in);
    case LobeId::BurleyBrdf:
        return BurleyLobe<W>::albedo(in, wo.z);
    case LobeId::SheenBrdf:
        return SheenLobe<W>::albedo(in, wo.z);
    case LobeId::MicrofacetConductorBrdf:
    case LobeId::RetroBrdf:
    case LobeId::MetalBrdf:
        return albedo_of_conductor(in, wo.z);
    case LobeId::MicrofacetDielectricBrdf:
        return albedo_of_dielectric_reflection(in, wo.z);
    case LobeId::MicrosurfaceDielectricBsdfRgb_v1:
        return albedo_of_interface(in, wo.z);
    case LobeId::ThinWalledDielectricBsdf:
        return ThinWallLobe<W>::albedo(in, wo.z);
    case LobeId::GratingBrdf:
        return GratingLobe<W>::albedo(in, wo);
    case LobeId::PhongBrdf:
        return PhongLobe<W>::albedo(in, wo.z);
    case LobeId::BlinnBrdf:
        return BlinnLobe<W>::albedo(in, wo.z);
    case LobeId::HighlightBrdf:
        return HighlightLobe<W>::albedo(in, wo.z);
    default:
        return Spectrum<W>(Float<W>(0.0f));
    }
}

} // namespace kanuka::bsdf
