// The one declaration of every lobe: name, inputs, types, ranges, units, docs, storage. The shading
// language's types, the vertex record, the transport code and the manual all derive from it, and so do the
// names that code has for inputs: an order that changes here changes nothing elsewhere.
#pragma once

#include <iterator>
#include <limits>

#include "grid/lobe_schema.h"

namespace kanuka::grid {

namespace schema {

inline constexpr float Inf = std::numeric_limits<float>::infinity();
using enum InputType;

inline constexpr std::string_view AlphaDoc =
    "perceptual roughness; the width of microfacets' slopes is its square "
    "(Burley 2012), 0 is a smooth surface";
inline constexpr std::string_view RoughnessDoc = "0 is Lambertian";
inline constexpr std::string_view ReflectanceDoc = "fraction of light reflected";
inline constexpr std::string_view NormalDoc = "Fresnel reflectance at normal incidence";
inline constexpr std::string_view GrazingDoc =
    "Fresnel reflectance at grazing incidence (Schlick); equal to reflectance for a constant reflectance";

// Inputs that many lobes have.
constexpr LobeInput color_input(std::string_view name, float fallback, std::string_view doc) {
    return {name, Color, Vec3f(fallback, fallback, fallback), 0, 1, "1", Storage::Color, doc};
}
constexpr LobeInput body_color(std::string_view name, float fallback, std::string_view doc) {
    LobeInput input = color_input(name, fallback, doc);
    input.body = true;
    return input;
}
constexpr LobeInput float_input(std::string_view name, float fallback, float low, float high,
                                std::string_view unit, std::string_view doc) {
    return {name, Float, Vec3f(fallback, 0, 0), low, high, unit, Storage::Half, doc};
}
inline constexpr LobeInput Walks = float_input(
    "walks", 0, 0, 1, "1",
    "1: light between facets, GGX's, follows random walks (Heitz et al. 2016), with some noise and "
    "not below films; 0: it is shaped as what one facet scatters");
inline constexpr LobeInput Anisotropy = float_input(
    "anisotropy", 0, 0, 1, "1", "of slopes: 0 the same all round, 1 next to none along the grooves");
inline constexpr LobeInput Rotation =
    float_input("rotation", 0, 0, 1, "turns",
                "of the grooves, from the direction of dPdu; half a turn is none, and "
                "between vertices the shorter way is taken");
inline constexpr LobeInput Tail =
    float_input("tail", 0.5f, 0, 0.6f, "1",
                "how far slopes spread: 0 Beckmann, 0.5 GGX, between and beyond Student's t with 1 / tail");
inline constexpr LobeInput FilmThickness = float_input(
    "filmThickness", 0, 0, 5000, "nm", "of a clear film on the surface, which interferes; 0 is none");
inline constexpr LobeInput FilmIor =
    float_input("filmIor", 1.33f, 1, 4, "1", "index of refraction of the film");

// Of lobes that reflect alone: those that transmit, too, have the surface between their two sides.
inline constexpr LobeInput OwnNormal{"normal",
                                     Normal,
                                     Vec3f(0, 0, 0),
                                     -Inf,
                                     Inf,
                                     "",
                                     Storage::Unit,
                                     "that the lobe stands on, in current space, on either side; its length "
                                     "does not count, and 0 is the surface's"};

inline constexpr LobeInput lambert_brdf[] = {
    body_color("diffuseReflectance", 1, ReflectanceDoc),
    OwnNormal,
};
inline constexpr LobeInput lambert_btdf[] = {
    body_color("diffuseTransmittance", 1, "fraction of light let through"),
};
inline constexpr LobeInput oren_nayar[] = {
    body_color("diffuseReflectance", 1, "fraction of light that a facet reflects"),
    float_input("roughness", 0.5f, 0, 1, "1", RoughnessDoc),
    OwnNormal,
};
inline constexpr LobeInput burley[] = {
    body_color("diffuseReflectance", 1, ReflectanceDoc),
    float_input("roughness", 0.5f, 0, 1, "1",
                "0 is darker, 1 brighter along the surface and towards the light"),
    OwnNormal,
};
inline constexpr LobeInput sheen[] = {
    body_color("reflectance", 1, "of the fibres"),
    float_input("roughness", 0.3f, 0, 1, "1", "how far the fibres lean; the least is 0.05"),
    OwnNormal,
};
inline constexpr LobeInput conductor[] = {
    body_color("reflectance", 1, NormalDoc),
    color_input("edgeReflectance", 1, GrazingDoc),
    float_input("roughness", 0.2f, 0, 1, "1", AlphaDoc),
    color_input("edgeTint", 1,
                "factor of the reflectance at 82 degrees, where real metals lie below Schlick's curve"),
    Anisotropy,
    Rotation,
    Tail,
    Walks,
    OwnNormal,
};
inline constexpr std::string_view MetalNames[] = {"", "Ag", "Al", "Au", "Cr", "Cu", "Fe", "Ni", "Pt", "Ti"};
inline constexpr LobeInput metal[] = {
    {"metal", Float, Vec3f(0, 0, 0), 0, 9, "1", Storage::Half,
     "measured spectra of a metal, by its symbol: \"Au\"; 0, or \"\", takes eta and extinction; between "
     "vertices it is the nearest one's",
     MetalNames},
    {"eta", Color, Vec3f(1.5f, 1.5f, 1.5f), 0, 20, "1", Storage::Amount,
     "index of refraction n, against vacuum"},
    {"extinction", Color, Vec3f(4, 4, 4), 0, 20, "1", Storage::Amount, "extinction coefficient k"},
    float_input("roughness", 0.2f, 0, 1, "1", AlphaDoc),
    Anisotropy,
    Rotation,
    Tail,
    FilmThickness,
    FilmIor,
    OwnNormal,
};
inline constexpr LobeInput retro[] = {
    body_color("reflectance", 1, NormalDoc),
    color_input("edgeReflectance", 1, GrazingDoc),
    float_input("roughness", 0.3f, 0, 1, "1", AlphaDoc),
    OwnNormal,
};
inline constexpr LobeInput dielectric_brdf[] = {
    color_input("reflectance", 1, "tint of the reflection"),
    float_input("ior", 1.5f, 1, 4, "1", "index of refraction against the outside"),
    float_input("roughness", 0.1f, 0, 1, "1", AlphaDoc),
    Anisotropy,
    Rotation,
    Tail,
    FilmThickness,
    FilmIor,
    color_input("transmittance", 1,
                "of the layer, for light that crosses it once, straight: as the upper layer of a coat, what "
                "lies below is seen through it, down and up, along refracted ways"),
    float_input("thickness", 1, 0, 1000, "mm", "of the layer, for its absorption"),
    {"absorption", Color, Vec3f(0, 0, 0), 0, Inf, "1/mm", Storage::Amount,
     "of light on its way through the layer, besides transmittance"},
    OwnNormal,
};
inline constexpr LobeInput dielectric_bsdf[] = {
    color_input(
        "roughness", 0,
        "perceptual roughness, its mean is used; the width of microfacets' slopes is its square, 0 is "
        "a smooth interface"),
    color_input("reflectance", 1, "tint of the reflection"),
    body_color("transmittance", 1, "tint of the transmission"),
    float_input("ior", 1.5f, 1, 4, "1", "index of refraction at 587.6 nm"),
    float_input("abbe", 0, 0, 200, "1", "Abbe number V_d, 20 disperses strongly; 0 = no dispersion"),
    Anisotropy,
    Rotation,
    Tail,
    FilmThickness,
    FilmIor,
    Walks,
};
inline constexpr LobeInput thin_walled[] = {
    color_input("reflectance", 1, "tint of the reflection"),
    body_color("transmittance", 1, "tint of the transmission"),
    float_input("ior", 1.5f, 1, 4, "1", "index of refraction of the sheet"),
    float_input("roughness", 0, 0, 1, "1", AlphaDoc),
    float_input("thickness", 0, 0, 5000, "nm",
                "of a sheet so thin that its two sides interfere: a soap film; 0 = they do not"),
};
inline constexpr LobeInput grating[] = {
    color_input("reflectance", 1, "of all orders together"),
    float_input(
        "roughness", 0.15f, 0, 1, "1",
        "blurs the orders; a third of its square is their width, in sines of angles, and at least 0.003"),
    float_input("period", 1600, 100, 60000, "nm", "from groove to groove; a compact disc has 1600"),
    float_input("depth", 120, 0, 5000, "nm",
                "of the grooves; a quarter of a wavelength leaves nothing of the mirror's direction"),
    Rotation,
    OwnNormal,
};
inline constexpr LobeInput phong[] = {
    color_input("reflectance", 1, "fraction of light reflected, head-on"),
    float_input("exponent", 20, 0, 10000, "1", "of the cosine with the mirror direction"),
    OwnNormal,
};
inline constexpr LobeInput blinn[] = {
    color_input("reflectance", 1, "fraction of light reflected, at most"),
    float_input("exponent", 80, 0, 10000, "1", "of the cosine with the half vector"),
    OwnNormal,
};
inline constexpr std::string_view HighlightNames[] = {"half", "mirror"};
inline constexpr LobeInput highlight[] = {
    {"height", Color, Vec3f(1, 1, 1), 0, Inf, "1", Storage::Amount,
     "of the highlight: what is reflected there of a light that makes a white matte surface show 1; held to "
     "what reflects all light"},
    float_input("exponent", 80, 0, 10000, "1", "of the cosine"),
    {"about", Float, Vec3f(0, 0, 0), 0, 1, "", Storage::Half,
     "what direction the cosine is with: half, that between light and view; mirror, that of the view",
     HighlightNames},
    OwnNormal,
};
inline constexpr LobeInput emission[] = {
    {"radiance", Color, Vec3f(1, 1, 1), 0, Inf, "W/(sr m^2), D65 = (1, 1, 1)", Storage::Amount,
     "radiance, the same in all directions, on the outside"},
};
inline constexpr LobeInput cone_emission[] = {
    {"radiance", Color, Vec3f(1, 1, 1), 0, Inf, "W/(sr m^2), D65 = (1, 1, 1)", Storage::Amount,
     "radiance within the cone, on the outside"},
    float_input("angle", 45, 1, 90, "degrees", "from the normal to the cone's edge, where nothing is left"),
    float_input("softness", 0.2f, 0, 1, "1",
                "of the edge: the part of the angle over which light fades; 0 is a sharp edge"),
};
inline constexpr LobeInput profile_emission[] = {
    {"radiance", Color, Vec3f(1, 1, 1), 0, Inf, "W/(sr m^2), D65 = (1, 1, 1)", Storage::Amount,
     "radiance along the normal, on the outside"},
    float_input("exponent", 1, 0, 1000, "1",
                "of the cosine to the normal that radiance goes with: 0 is diffuse, more is narrower"),
};
inline constexpr LobeInput henyey_greenstein[] = {
    {"meanCosine", Color, Vec3f(0, 0, 0), -1, 1, "1", Storage::Color,
     "anisotropy g, its mean is used: forwards above 0, 0 is isotropic; beyond 0.9995 either way it is that"},
};
inline constexpr LobeInput double_henyey_greenstein[] = {
    float_input("meanCosine", 0.8f, -1, 1, "1", "g of the first part, within 0.9995"),
    float_input("otherMeanCosine", -0.3f, -1, 1, "1", "g of the second part, within 0.9995"),
    float_input("share", 0.2f, 0, 1, "1", "of the second part"),
};
inline constexpr LobeInput draine[] = {
    float_input("meanCosine", 0.5f, 0.05f, 1, "1",
                "g of the factor that is Henyey and Greenstein's, within 0.9995"),
    float_input("alpha", 1, 0, 1000, "1", "of the factor 1 + alpha cos^2"),
};
inline constexpr LobeInput mie[] = {
    float_input("diameter", 10, 5, 50, "um", "of the droplets"),
};

inline constexpr LobeInput rayleigh_phase[] = {
    float_input(
        "angstromExponent", 0, 0, 8, "1",
        "scattering goes with (550 nm / wavelength) to this power, and what SetScattering says is that "
        "at 550 nm: 4 for air (Rayleigh 1871); 0 leaves it to SetScattering's colour"),
};
constexpr LobeInput aim(std::string_view name, float fallback, std::string_view doc) {
    return {name, Float, Vec3f(fallback, 0, 0), -Inf, Inf, "", Storage::Full, doc};
}
inline constexpr LobeInput aimed[] = {
    color_input("part", 1, "of the light that comes from there"),
    aim("x", 0, "of the direction, in current space; its length does not count"),
    aim("y", 0, "likewise"),
    aim("z", 1, "likewise"),
};
inline constexpr LobeDecl table[] = {
    {LobeId::LambertBrdf, "LambertBrdf", LobeKind::Reflection, lambert_brdf,
     "Lambertian reflection on both sides", true, true},
    {LobeId::LambertBtdf, "LambertBtdf", LobeKind::Transmission, lambert_btdf, "Lambertian transmission",
     true, true},
    {LobeId::OrenNayarBrdf, "OrenNayarBrdf", LobeKind::Reflection, oren_nayar,
     "rough diffuse reflection that loses no energy: EON (Portsmouth, Kutz and Hill 2025)", true, true},
    {LobeId::BurleyBrdf, "BurleyBrdf", LobeKind::Reflection, burley,
     "Burley's diffuse reflection (2012), normalised"},
    {LobeId::SheenBrdf, "SheenBrdf", LobeKind::Reflection, sheen,
     "cloth: light along upright fibres (Estevez and Kulla 2017)"},
    {LobeId::MicrofacetConductorBrdf, "MicrofacetConductorBrdf", LobeKind::Reflection, conductor,
     "microfacets with a coloured Fresnel term: metals, and glossy reflection of a given colour", true, true},
    {LobeId::MetalBrdf, "MetalBrdf", LobeKind::Reflection, metal,
     "microfacets of metal by its complex index of refraction, bare or under a thin film"},
    {LobeId::RetroBrdf, "RetroBrdf", LobeKind::Reflection, retro,
     "back to where light comes from: reflective foil and paint", true, true},
    {LobeId::MicrofacetDielectricBrdf, "MicrofacetDielectricBrdf", LobeKind::Reflection, dielectric_brdf,
     "microfacets with dielectric Fresnel, reflection alone: the upper layer of a coat"},
    {LobeId::MicrosurfaceDielectricBsdfRgb_v1, "MicrosurfaceDielectricBsdfRgb_v1",
     LobeKind::ReflectionTransmission, dielectric_bsdf,
     "rough or smooth dielectric interface: glass, water; disperses with a finite Abbe number", true, true},
    {LobeId::ThinWalledDielectricBsdf, "ThinWalledDielectricBsdf", LobeKind::ReflectionTransmission,
     thin_walled, "a thin sheet: window panes, leaves of plastic, soap films; light goes on as it came", true,
     true},
    {LobeId::GratingBrdf, "GratingBrdf", LobeKind::Reflection, grating,
     "a mirror with fine grooves, which sends every wavelength its own way: discs, foils, beetles"},
    {LobeId::PhongBrdf, "PhongBrdf", LobeKind::Reflection, phong,
     "Phong's highlight, physically scaled (Lafortune and Willems 1994)"},
    {LobeId::BlinnBrdf, "BlinnBrdf", LobeKind::Reflection, blinn,
     "Blinn's highlight, physically scaled (Ashikhmin and Shirley 2000)"},
    {LobeId::HighlightBrdf, "HighlightBrdf", LobeKind::Reflection, highlight,
     "the highlight of RISpec's specular() and phong(): a power of a cosine alone, as high from everywhere",
     false},
    {LobeId::AimedBsdf, "AimedBsdf", LobeKind::ReflectionTransmission, aimed,
     "light from one direction that the shader says, whoever looks: lenses, periscopes", false},
    {LobeId::DiffuseEmission, "DiffuseEmission", LobeKind::Emission, emission, "diffuse emitter"},
    {LobeId::ConeEmission, "ConeEmission", LobeKind::Emission, cone_emission,
     "emitter that shines within a cone about its normal, with a soft edge"},
    {LobeId::ProfileEmission, "ProfileEmission", LobeKind::Emission, profile_emission,
     "emitter whose radiance is a power of the cosine to its normal"},
    {LobeId::HenyeyGreensteinPfrgb, "HenyeyGreensteinPfrgb", LobeKind::Phase, henyey_greenstein,
     "Henyey and Greenstein's phase function (1941)"},
    {LobeId::DoubleHenyeyGreensteinPfrgb, "DoubleHenyeyGreensteinPfrgb", LobeKind::Phase,
     double_henyey_greenstein, "two of Henyey and Greenstein's: forwards and backwards, as skin and clouds"},
    {LobeId::RayleighPfrgb, "RayleighPfrgb", LobeKind::Phase, rayleigh_phase,
     "Rayleigh's phase function: particles much smaller than the wavelength, as in air and thin milk"},
    {LobeId::DrainePfrgb, "DrainePfrgb", LobeKind::Phase, draine,
     "Draine's phase function (2003): between Rayleigh's and Henyey and Greenstein's"},
    {LobeId::MiePfrgb, "MiePfrgb", LobeKind::Phase, mie,
     "water droplets, as in fog and clouds, by their size: Mie's theory fitted (Jendersie and d'Eon 2023)"},
};

consteval bool is_in_order() {
    for (size_t i = 0; i < std::size(table); i++)
        if (table[i].id != LobeId(i))
            return false;
    return std::size(table) == size_t(LobeId::Count);
}
static_assert(is_in_order());

} // namespace schema

// ---- inputs by name, while compiling: names that a lobe does not have do not compile

// The number of an input among all of its lobe.
consteval int input_of(LobeId lobe, std::string_view name) {
    const std::span<const LobeInput> inputs = schema::table[int(lobe)].inputs;
    for (size_t i = 0; i < inputs.size(); i++)
        if (inputs[i].name == name)
            return int(i);
    throw "the lobe has no input of this name";
}

consteval int among(LobeId lobe, std::string_view name, InputType type) {
    const std::span<const LobeInput> inputs = schema::table[int(lobe)].inputs;
    const size_t place = size_t(input_of(lobe, name));
    if (inputs[place].type != type)
        throw "the input is of the other type";
    int before = 0;
    for (size_t i = 0; i < place; i++)
        before += inputs[i].type == type ? 1 : 0;
    return before;
}
// Its number among the lobe's colours, or floats: lanes keep them apart.
consteval int color_of(LobeId lobe, std::string_view name) {
    return among(lobe, name, InputType::Color);
}
consteval int number_of(LobeId lobe, std::string_view name) {
    return among(lobe, name, InputType::Float);
}

// What all emission lobes have.
inline constexpr int EmissionRadiance = input_of(LobeId::DiffuseEmission, "radiance");
static_assert(EmissionRadiance == input_of(LobeId::ConeEmission, "radiance") &&
              EmissionRadiance == input_of(LobeId::ProfileEmission, "radiance"));

// The most inputs of a type that a lobe has, and of all.
consteval int most_inputs(bool (*counts)(const LobeInput&)) {
    int most = 0;
    for (const LobeDecl& lobe : schema::table) {
        int n = 0;
        for (const LobeInput& input : lobe.inputs)
            n += counts(input) ? 1 : 0;
        most = n > most ? n : most;
    }
    return most;
}
inline constexpr int MostColors = most_inputs([](const LobeInput& i) { return i.type == InputType::Color; }),
                     MostNumbers = most_inputs([](const LobeInput& i) { return i.type == InputType::Float; }),
                     MostInputs = most_inputs([](const LobeInput&) { return true; });

} // namespace kanuka::grid
