#include "grid/lobe_schema.h"

namespace kanuka::grid {

namespace {

constexpr float Inf = std::numeric_limits<float>::infinity();
using enum InputType;

constexpr std::string_view AlphaDoc =
    "perceptual roughness; the GGX width is its square (Burley 2012), 0 is a smooth surface";

const LobeInput lambert_brdf[] = {
    {"diffuseReflectance", Color, Vec3f(1, 1, 1), 0, 1, "1", Storage::Rgb11, "fraction of light reflected"},
};
const LobeInput lambert_btdf[] = {
    {"diffuseTransmittance", Color, Vec3f(1, 1, 1), 0, 1, "1", Storage::Rgb11,
     "fraction of light let through"},
};
const LobeInput conductor[] = {
    {"reflectance", Color, Vec3f(1, 1, 1), 0, 1, "1", Storage::Rgb11,
     "Fresnel reflectance at normal incidence"},
    {"edgeReflectance", Color, Vec3f(1, 1, 1), 0, 1, "1", Storage::Rgb11,
     "Fresnel reflectance at grazing incidence (Schlick); equal to reflectance for a constant reflectance"},
    {"roughness", Float, Vec3f(0.2f, 0, 0), 0, 1, "1", Storage::Half, AlphaDoc},
};
const LobeInput dielectric_brdf[] = {
    {"reflectance", Color, Vec3f(1, 1, 1), 0, 1, "1", Storage::Rgb11, "tint of the reflection"},
    {"ior", Float, Vec3f(1.5f, 0, 0), 1, 4, "1", Storage::Half, "index of refraction against the outside"},
    {"roughness", Float, Vec3f(0.1f, 0, 0), 0, 1, "1", Storage::Half, AlphaDoc},
};
const LobeInput dielectric_bsdf[] = {
    {"roughness", Color, Vec3f(0, 0, 0), 0, 1, "1", Storage::Rgb11,
     "perceptual roughness, its mean is used; the GGX width is its square, 0 is a smooth interface"},
    {"reflectance", Color, Vec3f(1, 1, 1), 0, 1, "1", Storage::Rgb11, "tint of the reflection"},
    {"transmittance", Color, Vec3f(1, 1, 1), 0, 1, "1", Storage::Rgb11, "tint of the transmission"},
    {"ior", Float, Vec3f(1.5f, 0, 0), 1, 4, "1", Storage::Half, "index of refraction at 587.6 nm"},
    {"abbe", Float, Vec3f(0, 0, 0), 0, 200, "1", Storage::Half,
     "Abbe number V_d, 20 disperses strongly; 0 = no dispersion"},
};
const LobeInput emission[] = {
    {"radiance", Color, Vec3f(1, 1, 1), 0, Inf, "W/(sr m^2), D65 = (1, 1, 1)", Storage::Rgb9e5,
     "radiance, the same in all directions, on the outside"},
};
const LobeInput henyey_greenstein[] = {
    {"meanCosine", Color, Vec3f(0, 0, 0), -1, 1, "1", Storage::Rgb11, "anisotropy g, its mean is used"},
};

const LobeDecl table[] = {
    {LobeId::LambertBrdf, "LambertBrdf", LobeKind::Reflection, lambert_brdf,
     "Lambertian reflection on both sides"},
    {LobeId::LambertBtdf, "LambertBtdf", LobeKind::Transmission, lambert_btdf, "Lambertian transmission"},
    {LobeId::MicrofacetConductorBrdf, "MicrofacetConductorBrdf", LobeKind::Reflection, conductor,
     "GGX microfacets with a coloured Fresnel term: metals, and glossy reflection of a given colour"},
    {LobeId::MicrofacetDielectricBrdf, "MicrofacetDielectricBrdf", LobeKind::Reflection, dielectric_brdf,
     "GGX microfacets with dielectric Fresnel, reflection alone: the upper layer of a coat"},
    {LobeId::MicrosurfaceDielectricBsdfRgb_v1, "MicrosurfaceDielectricBsdfRgb_v1",
     LobeKind::ReflectionTransmission, dielectric_bsdf,
     "rough or smooth dielectric interface: glass, water; disperses with a finite Abbe number"},
    {LobeId::DiffuseEmission, "DiffuseEmission", LobeKind::Emission, emission, "diffuse emitter"},
    {LobeId::HenyeyGreensteinPfrgb, "HenyeyGreensteinPfrgb", LobeKind::Phase, henyey_greenstein,
     "Henyey and Greenstein's phase function (1941)"},
};
static_assert(std::size(table) == size_t(LobeId::Count));

} // namespace

std::span<const LobeDecl> lobe_table() {
    return table;
}

const LobeDecl& lobe(LobeId id) {
    return table[int(id)];
}

const LobeDecl* find_lobe(std::string_view name) {
    for (const LobeDecl& d : table)
        if (d.name == name)
            return &d;
    return nullptr;
}

int find_input(const LobeDecl& lobe, std::string_view name) {
    for (size_t i = 0; i < lobe.inputs.size(); i++)
        if (lobe.inputs[i].name == name)
            return int(i);
    return -1;
}

} // namespace kanuka::grid
