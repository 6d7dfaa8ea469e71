// Shading networks of other renderers, as far as they have a counterpart here: the
// Bxdfs, Patterns and Integrators that RenderMan has had since its version 19. A table says what each
// becomes.

#include <algorithm>
#include <cmath>

#include "ingest/rib/handlers.h"
#include "ingest/rib/ris.h"
#include "scene/layers.h"

namespace kanuka::ingest::handlers {

using ris::Mapping;
using ris::names;
using ris::ours;
using ris::set;
using scene::ShaderRef;
using scene::Type;
using scene::Value;
using scene::ValueList;

namespace {

constexpr Mapping Bxdfs[] = {
    {"PxrDisney", "principled",
     "baseColor metallic roughness specular clearcoat:coat emitColor:emission presence subsurface"},
    {"PxrDisneyBsdf", "principled",
     "baseColor metallic roughness ior clearcoat:coat emitColor:emission presence"},
    {"PxrDiffuse", "principled", "diffuseColor:baseColor presence"},
    {"PxrSurface", "principled",
     "diffuseColor:baseColor specularRoughness:roughness presence clearcoatRoughness:coatRoughness"},
    {"PxrLayerSurface", "principled",
     "diffuseColor:baseColor specularRoughness:roughness presence clearcoatRoughness:coatRoughness"},
    {"PxrConstant", "emitter", "emitColor:radiance"},
    {"PxrBlack", "principled", ""},
    {"PxrGlass", "glass", "ior roughness transmissionColor:transmittance reflectionColor:reflectance"},
    {"PxrLMDiffuse", "principled", "frontColor:baseColor presence"},
    {"PxrLMPlastic", "principled", "diffuseColor:baseColor roughness specularRoughness:roughness presence"},
    {"PxrLMMetal", "principled", "roughness presence"},
    {"PxrLMGlass", "glass", "refractionIndex:ior roughness"},
    {"LamaDiffuse", "principled", "color:baseColor"},
    {"LamaConductor", "conductor", "reflectivity:reflectance edgeColor:edgeReflectance roughness"},
    {"LamaDielectric", "glass",
     "IOR:ior roughness reflectionTint:reflectance transmissionTint:transmittance"},
    {"LamaEmission", "emitter", "color:radiance"},
    {"LamaSurface", "principled", ""},
    {"PxrVolume", "cloud", "anisotropy:meanCosine"},
};

constexpr std::string_view SurfaceParameters =
    "diffuseGain specularFaceColor specularEdgeColor specularModelType specularFresnelMode specularIor "
    "clearcoatFaceColor clearcoatEdgeColor glowGain glowColor refractionGain refractionColor "
    "glassRoughness glassIor emission eta sheen specularTint diffuseColor densityFloat densityColor "
    "densityFloatPrimVar maxDensity";

float largest(Rgb c) {
    return std::max({c.x, c.y, c.z});
}

// ---- Bxdf -------------------------------------------------------------------------------------------

// The gains, Fresnel colours and lobes of PxrSurface in the terms of `principled`.
std::string surface_of_lobes(const ValueList& theirs, ValueList& to) {
    const float diffuse = theirs.get_float("diffuseGain", 1);
    const Rgb face = theirs.get_color("specularFaceColor", Rgb(0));
    const Rgb edge = theirs.get_color("specularEdgeColor", Rgb(0));
    const bool physical = theirs.get_int("specularFresnelMode", 0) == 1;
    const Rgb base = to.get_color("baseColor", Rgb(0.18f));
    if (theirs.get_float("refractionGain", 0) > 0.5f) {
        const float ior = theirs.get_float("glassIor", 1.5f);
        const float roughness = theirs.get_float("glassRoughness", 0.1f);
        const Rgb tint = theirs.get_color("refractionColor", Rgb(1));
        to.values.clear();
        set(to, "ior", ior);
        set(to, "roughness", roughness);
        set(to, "transmittance", tint);
        return "glass";
    }
    if (diffuse <= 0 && largest(face) > 0.2f) { // metal: no light from below
        set(to, "baseColor", face);
        set(to, "metallic", 1.0f);
    } else {
        if (const Value* v = to.find("baseColor"); !v || v->type != Type::String)
            set(to, "baseColor", base * diffuse);
        if (physical)
            set(to, "specular", largest(edge) > 0 ? 1.0f : 0.0f);
        else
            set(to, "specular", largest(face) > 0 ? 1.0f : largest(edge) > 0 ? 0.5f : 0.0f);
        if (physical)
            set(to, "ior", theirs.get_color("specularIor", Rgb(1.5f)).x);
        else if (const float f = largest(face); f > 0 && f < 0.9f) // Schlick's F0 as an index of refraction
            set(to, "ior", (1 + std::sqrt(f)) / (1 - std::sqrt(f)));
    }
    const Rgb coat = theirs.get_color("clearcoatFaceColor", theirs.get_color("clearcoatEdgeColor", Rgb(0)));
    if (largest(coat) > 0)
        set(to, "coat", 1.0f);
    if (const float glow = theirs.get_float("glowGain", 0); glow > 0)
        set(to, "emission", theirs.get_color("glowColor", Rgb(1)) * glow);
    return "principled";
}

} // namespace

void pattern(Context& c, Call& call) {
    const std::string handle = call.text(1);
    c.patterns[handle] = c.shader(call, 0);
}

// "handle:output", if there is such a Pattern.
struct Reference {
    std::string handle, output;
};
static std::optional<Reference> reference(const Context& c, const Value& v) {
    if (v.type != Type::String || v.strings.size() != 1)
        return std::nullopt;
    const std::string& text = v.strings[0];
    const size_t colon = text.rfind(':');
    if (colon == std::string::npos || colon + 1 == text.size() || !c.patterns.contains(text.substr(0, colon)))
        return std::nullopt;
    return Reference{text.substr(0, colon), text.substr(colon + 1)};
}

// Makes a Pattern, and those that feed it, layers of a surface. What they are is a shader of that name.
static void add_pattern(Context& c, const std::string& handle, ShaderRef& surface) {
    const std::vector<std::string> known = scene::layers(surface);
    if (std::find(known.begin(), known.end(), handle) != known.end())
        return;
    ShaderRef layer = c.patterns[handle];
    layer.handle = handle;
    scene::add_layer(surface, layer); // known from here on: circles end
    ValueList own;
    for (Value& v : layer.parameters.values) {
        const std::optional<Reference> r = reference(c, v);
        if (!r) {
            own.set(std::move(v));
            continue;
        }
        add_pattern(c, r->handle, surface);
        own.set(scene::texts(":" + v.name, {r->handle, r->output}, v.where));
    }
    layer.parameters = std::move(own);
    scene::add_layer(surface, std::move(layer)); // after those that feed it
}

// A parameter that a Pattern feeds: a picture on the base colour is that of the surface, others are layers.
static void take_reference(Context& c, const Call& call, const Value& v, std::string_view our_name,
                           ShaderRef& surface) {
    const std::optional<Reference> r = reference(c, v);
    if (!r) {
        const std::string text = v.strings.empty() ? "" : v.strings[0];
        c.reports.once(Severity::Warning, "pattern " + text, v.where,
                       std::string(call.spec->name) + " \"" + call.text(0) + "\": \"" + v.name +
                           "\" is fed by \"" + text +
                           "\", which is no output of a Pattern before it; the default was used. It is "
                           "written \"handle:output\"");
        return;
    }
    const ShaderRef& pattern = c.patterns[r->handle];
    if (pattern.name == "PxrTexture" && our_name == "baseColor" && r->output == "resultRGB") {
        set(surface.parameters, "baseColor", Rgb(1));
        set(surface.parameters, "texturename", pattern.parameters.get_string("filename", ""));
        return;
    }
    add_pattern(c, r->handle, surface);
    scene::connect(surface, std::string(our_name), r->handle, r->output, v.where);
}

// What volumes turn aside and take away a metre, of their density and albedo.
static void take_volume(const ValueList& theirs, ValueList& to) {
    const Rgb density = theirs.get_color("densityColor", Rgb(1)) * theirs.get_float("densityFloat", 1),
              albedo = theirs.get_color("diffuseColor", Rgb(0.5f));
    set(to, "scattering", density * albedo);
    set(to, "absorption", density * (Rgb(1) - albedo));
}

void bxdf(Context& c, Call& call) {
    c.traces_light = true;
    static constexpr Mapping fallback{"", "principled",
                                      "baseColor diffuseColor:baseColor color:baseColor roughness presence"};
    if (call.text(0) == "PxrLightEmission") // its light is the area light's
        return;
    const Mapping* mapping = ris::find(Bxdfs, call.text(0));
    if (!mapping) {
        mapping = &fallback;
        c.reports.once(Severity::Warning, "Bxdf " + call.text(0), call.where,
                       "Bxdf \"" + call.text(0) +
                           "\" is not known; a plain surface of its colour and roughness stands in. Write "
                           "Surface with a shader of your own");
    }
    ShaderRef layered;
    ValueList& to = layered.parameters;
    for (const Value& v : call.params.values) {
        const std::string_view name = ours(mapping->parameters, v.name);
        if (name.empty())
            continue;
        if (v.type == Type::String) {
            take_reference(c, call, v, name, layered);
            continue;
        }
        Value renamed = v;
        renamed.name = name;
        to.set(std::move(renamed));
    }
    const std::string_view theirs = mapping->theirs;
    std::string shader(mapping->ours);
    if (theirs == "PxrSurface" || theirs == "PxrLayerSurface")
        shader = surface_of_lobes(call.params, to);
    else if (theirs == "PxrDiffuse" || theirs == "PxrLMDiffuse" || theirs == "LamaDiffuse")
        set(to, "specular", 0.0f);
    else if (theirs == "PxrBlack")
        set(to, "specular", 0.0f), set(to, "baseColor", Rgb(0));
    else if (theirs == "PxrLMMetal")
        set(to, "metallic", 1.0f), set(to, "baseColor", call.params.get_color("specularColor", Rgb(0.9f)));
    else if (theirs == "PxrVolume")
        take_volume(call.params, to), c.attributes.edit("density_primvar").density_primvar =
                                          call.params.get_string("densityFloatPrimVar", "density");
    if (theirs == "PxrDisney") // Burley's specular 0.5 is an index of refraction of 1.5
        set(to, "specular", std::min(1.0f, 2 * call.params.get_float("specular", 0.5f)));
    std::erase_if(to.values, [](const Value& v) { return v.name == "subsurface"; });
    ris::report_rest(c, call, *mapping, SurfaceParameters);
    if (shader == "principled" && largest(to.get_color("emission", Rgb(0))) < 0)
        set(to, "emission", Rgb(0));
    ShaderRef ref = c.shader(call, 0);
    ref.name = shader;
    ref.parameters = std::move(to);
    ref.coshaders = std::move(layered.coshaders);
    c.attributes.edit(FieldSurface).surface = std::move(ref);
}

// ---- Displace ---------------------------------------------------------------------------------------

// A displacement shader of that name. Its texts may be those of the shader, too: only what names a Pattern,
// or looks like it where a number belongs, is a connection.
void displace(Context& c, Call& call) {
    static constexpr std::string_view Numbers = "enabled dispAmount dispScalar dispVector modelDispVector";
    if (call.text(0).empty() || call.text(0) == "null") {
        put_displacement(c, std::nullopt);
        return;
    }
    const bool shipped = call.text(0) == "PxrDisplace";
    ShaderRef layered;
    ValueList own;
    for (const Value& v : call.params.values) {
        if (reference(c, v) || (shipped && v.type == Type::String && names(Numbers, v.name)))
            take_reference(c, call, v, v.name, layered);
        else if (!shipped || names(Numbers, v.name))
            own.set(v);
        else if (!v.name.starts_with("__"))
            c.reports.once(Severity::Info, "parameters of PxrDisplace", v.where,
                           "Displace \"PxrDisplace\" has no \"" + v.name + "\" here; there are " +
                               std::string(Numbers));
    }
    for (Value& v : layered.parameters.values) // connections
        own.set(std::move(v));
    ShaderRef ref = c.shader(call, 0);
    ref.parameters = std::move(own);
    ref.coshaders = std::move(layered.coshaders);
    put_displacement(c, std::move(ref));
}

// ---- the rest ---------------------------------------------------------------------------------------

void integrator(Context& c, Call& call) {
    c.traces_light = true;
    const std::string& name = call.text(0);
    if (name == "PxrPathTracer" || name == "PxrVCM" || name == "PxrUnified")
        c.options.options.max_depth =
            std::clamp(call.params.get_int("maxPathLength", c.options.options.max_depth), 1, 1000);
    else if (name == "PxrDirectLighting")
        c.options.options.max_depth = 1;
    else if (name == "PxrOcclusion")
        c.options.options.integrator = "ao";
    else if (name == "PxrVisualizer" || name == "PxrDebugShadingContext" || name == "PxrValidateBxdf")
        c.options.options.integrator = "facing";
    else if (name == "PxrDefault")
        return;
    else
        c.reports.once(Severity::Warning, "Integrator " + name, call.where,
                       "Integrator \"" + name +
                           "\" has no counterpart: paths are traced. Choose another by Option \"kanuka\" "
                           "\"string integrator\"");
}

// A colour behind everything is an imager; the others grade the picture.
void display_filter(Context& c, Call& call) {
    if (call.text(0) != "PxrBackgroundDisplayFilter" && call.text(0) != "PxrBackgroundSampleFilter") {
        c.reports.once(Severity::Warning, "DisplayFilter", call.where,
                       std::string(call.spec->name) + " \"" + call.text(0) +
                           "\" is not supported and was left out: grade the picture afterwards");
        return;
    }
    ShaderRef imager;
    imager.name = "background";
    imager.where = call.where;
    set(imager.parameters, "bgcolor", call.params.get_color("backgroundColor", Rgb(0)));
    c.options.options.imager = std::move(imager);
}

} // namespace kanuka::ingest::handlers
