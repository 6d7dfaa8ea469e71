#include "shade/lights.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "color/photometry.h"
#include "shade/search.h"

namespace kanuka::shade {

namespace {

constexpr float Degrees = 180 * InvPi;

// Name, type and meaning of every light parameter stand once, here; docs/shade.md has the same table for
// readers.
struct LightShader {
    std::string_view name;
    scene::Light::Kind kind;
    std::vector<std::string_view> parameters;
};

const std::vector<LightShader>& light_shaders() {
    using enum scene::Light::Kind;
    static const std::vector<LightShader> table = {
        {"ambientlight", Ambient, {"intensity", "lightcolor", "spectrum", "unit"}},
        {"distantlight", Distant, {"intensity", "lightcolor", "spectrum", "unit", "from", "to", "angle"}},
        {"pointlight", Point, {"intensity", "lightcolor", "spectrum", "unit", "from", "radius"}},
        {"spotlight",
         Spot,
         {"intensity", "lightcolor", "spectrum", "unit", "from", "to", "coneangle", "conedeltaangle",
          "beamdistribution", "radius"}},
        {"environmentlight",
         Environment,
         {"intensity", "lightcolor", "spectrum", "unit", "texture", "mapname", "visible"}},
    };
    return table;
}

// Light shaders of other renderers that are a standard one with a shadow map. Shadows are traced here, so
// what they say of the map is taken without a word and does nothing.
constexpr std::pair<std::string_view, std::string_view> ShadowLights[] = {
    {"shadowdistant", "distantlight"}, {"shadowpoint", "pointlight"}, {"shadowspot", "spotlight"}};
constexpr std::string_view ShadowMapParameters[] = {"shadowname", "sfpx", "sfnx", "sfpy",  "sfny",   "sfpz",
                                                    "sfnz",       "blur", "bias", "width", "samples"};

constexpr std::string_view AreaParameters[] = {"intensity", "lightcolor", "spectrum", "unit"};

std::string joined(std::span<const std::string_view> names) {
    std::string all;
    for (std::string_view n : names)
        all += (all.empty() ? "" : ", ") + std::string(n);
    return all;
}

bool contains(std::span<const std::string_view> names, std::string_view name) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

void check_parameters(const scene::ShaderRef& ref, std::span<const std::string_view> known,
                      std::span<const std::string_view> silent, Journal& journal) {
    for (const scene::Value& v : ref.parameters.values)
        if (!contains(known, v.name) && !contains(silent, v.name))
            journal.warning(v.where.line > 0 ? v.where : ref.where, "light shader \"" + ref.name +
                                                                        "\" has no parameter \"" + v.name +
                                                                        "\"; it has " + joined(known));
}

Vec3f point_of(const scene::ShaderRef& ref, std::string_view name, Vec3f fallback) {
    const scene::Value* v = ref.parameters.find(name);
    if (!v || v->floats.size() < 3)
        return fallback;
    return {v->floats[0], v->floats[1], v->floats[2]};
}

void place(scene::Light& light, const scene::ShaderRef& ref) {
    const Transform& m = ref.world_from_shader;
    const Vec3f from = point_of(ref, "from", {0, 0, 0}), to = point_of(ref, "to", {0, 0, 1});
    light.world_from_light = aimed(m.point(from), m.point(to));
}

void take_texture(scene::Light& light, const scene::ShaderRef& ref, const Textures& textures,
                  Journal& journal) {
    const std::string name = ref.parameters.get_string("texture", ref.parameters.get_string("mapname", ""));
    if (name.empty())
        return;
    light.texture = textures.find(name);
    if (light.texture.empty())
        journal.error(ref.where,
                      "environment picture \"" + name + "\" is not found; searched in " +
                          join_folders(textures.folders()) +
                          ". Add its folder: Option \"searchpath\" \"texture\" [\"FOLDER\"]. A constant "
                          "environment stands in for it");
}

std::string_view standard_name(std::string_view name) {
    for (const auto& [theirs, ours] : ShadowLights)
        if (name == theirs)
            return ours;
    return name;
}

const LightShader* find_light(std::string_view name) {
    for (const LightShader& s : light_shaders())
        if (s.name == standard_name(name))
            return &s;
    return nullptr;
}

} // namespace

Transform aimed(const Vec3f& from, const Vec3f& to) {
    Vec3f z = to - from;
    z = length(z) > 0 ? normalize(z) : Vec3f(0, 0, 1);
    const Vec3f x = normalize(cross(std::abs(z.x) < 0.9f ? Vec3f(1, 0, 0) : Vec3f(0, 1, 0), z));
    const Vec3f y = cross(z, x);
    Transform t;
    t.m[0] = {x.x, y.x, z.x, from.x};
    t.m[1] = {x.y, y.y, z.y, from.y};
    t.m[2] = {x.z, y.z, z.z, from.z};
    return t;
}

bool is_standard_light(std::string_view name) {
    return find_light(name) != nullptr;
}

void report_unknown_light(const scene::ShaderRef& ref, const std::string& searched, Journal& journal) {
    std::vector<std::string_view> names;
    for (const LightShader& s : light_shaders())
        names.push_back(s.name);
    journal.error(ref.where, "light shader \"" + ref.name + "\" is not found (" + ref.name + ".slo or " +
                                 ref.name + ".sl), searched in " + searched +
                                 "; the light is left out. Built in are " + joined(names) +
                                 ", and AreaLightSource \"arealight\"");
}

Rgb light_amount(const scene::ShaderRef& ref) {
    return ref.parameters.get_color("lightcolor", Rgb(1)) * ref.parameters.get_float("intensity", 1);
}

namespace {

// The unit by name; none = reported.
color::Unit unit_of(const std::string& name, const Location& where, Journal& journal) {
    const auto unit = color::find_unit(name);
    if (!unit)
        journal.error(where,
                      "a light's unit is \"" + name +
                          "\"; there are lumen, candela, lux, nit and watt. The amount is taken as it is");
    return unit.value_or(color::Unit::None);
}

// The light's spectrum; white where there is none, or it cannot be had.
color::Table spectrum_of(const std::string& name, const color::Palette& palette,
                         std::span<const std::string> folders, const Location& where, Journal& journal) {
    if (name.empty())
        return palette.white();
    try {
        return color::resolve_light(name, folders);
    } catch (const Error& e) {
        journal.error(where,
                      std::string("the spectrum of a light: ") + e.what() + ". White stands in for it");
        return palette.white();
    }
}

// Steradians that a spot fills at full intensity: its falloff over the cone.
double spot_solid_angle(const scene::Light& light) {
    const double outer = std::cos(double(light.cone_angle) / Degrees),
                 inner = std::cos(std::max(0.0, double(light.cone_angle - light.cone_delta_angle)) / Degrees);
    double sum = 0;
    constexpr int N = 4096;
    for (int i = 0; i < N; i++) {
        const double c = outer + (1 - outer) * (i + 0.5) / N;
        const double t = std::clamp((c - outer) / std::max(inner - outer, 1e-6), 0.0, 1.0);
        sum += t * t * (3 - 2 * t) * std::pow(std::max(c, 0.0), int(light.beam_distribution));
    }
    return std::max(sum * 2 * double(Pi) * (1 - outer) / N, 1e-9);
}

} // namespace

Rgb area_light_amount(const scene::ShaderRef& ref, color::Palette* palette,
                      std::span<const std::string> folders, Journal& journal) {
    const std::string spectrum = ref.parameters.get_string("spectrum", ""),
                      unit = ref.parameters.get_string("unit", "");
    Rgb amount = light_amount(ref);
    if (!palette || (spectrum.empty() && unit.empty()))
        return amount;
    const color::Table power = spectrum_of(spectrum, *palette, folders, ref.where, journal);
    const Rgb filter = ref.parameters.get_color("lightcolor", Rgb(1));
    amount = palette->add_light(power, filter) * ref.parameters.get_float("intensity", 1);
    if (unit_of(unit, ref.where, journal) == color::Unit::Watt)
        amount *= float(color::luminous_efficacy(power));
    return amount;
}

void resolve_light_color(scene::Light& light, color::Palette& palette, std::span<const std::string> folders,
                         Journal& journal) {
    using Kind = scene::Light::Kind;
    if (light.spectrum.empty() && light.unit.empty())
        return;
    const color::Table power = spectrum_of(light.spectrum, palette, folders, light.where, journal);
    if (!light.spectrum.empty())
        light.amount = palette.add_light(power, light.amount);
    const color::Unit unit = unit_of(light.unit, light.where, journal);
    if (unit == color::Unit::None)
        return;
    color::LightMeasure measure{color::LightShape::Point};
    if (light.kind == Kind::Spot)
        measure.solid_angle = spot_solid_angle(light);
    else if (light.kind == Kind::Distant)
        measure.shape = color::LightShape::Distant;
    else if (light.kind != Kind::Point)
        measure.shape = color::LightShape::Environment;
    if (const auto factor = color::photometric(1, unit, measure, color::luminous_efficacy(power)))
        light.amount *= float(*factor);
    else
        journal.error(light.where,
                      "the unit \"" + light.unit +
                          "\" does not measure such a light: points and spots take lumen, candela and watt, "
                          "distant lights lux and watt, environments nit, lux and watt. The amount is taken "
                          "as it is");
}

std::optional<scene::Light> make_light(const scene::ShaderRef& ref, const Textures& textures,
                                       Journal& journal) {
    const LightShader* shader = find_light(ref.name);
    if (!shader)
        return std::nullopt;
    std::span<const std::string_view> silent;
    if (shader->name != ref.name)
        silent = ShadowMapParameters;
    check_parameters(ref, shader->parameters, silent, journal);

    scene::Light light;
    light.kind = shader->kind;
    light.name = ref.handle;
    light.where = ref.where;
    light.amount = light_amount(ref);
    light.spectrum = ref.parameters.get_string("spectrum", "");
    light.unit = ref.parameters.get_string("unit", "");
    const float classic = light.unit.empty() ? Pi : 1; // an amount with a unit is what it says
    // RISpec's light shaders hand Cl to a surface whose diffuse() multiplies it by the cosine alone. A white
    // Lambertian surface reflects radiance E / pi, so Cl stands for an irradiance of pi Cl.
    switch (light.kind) {
    case scene::Light::Kind::Distant:
        place(light, ref);
        light.amount *= classic;
        light.angle = std::clamp(ref.parameters.get_float("angle", 0), 0.0f, 180.0f);
        break;
    case scene::Light::Kind::Point:
    case scene::Light::Kind::Spot:
        place(light, ref);
        light.amount *= classic; // Cl = intensity / r^2, so the radiant intensity is pi times `intensity`
        light.radius = std::max(0.0f, ref.parameters.get_float("radius", 0));
        light.cone_angle = ref.parameters.get_float("coneangle", 30 / Degrees) * Degrees;
        light.cone_delta_angle = ref.parameters.get_float("conedeltaangle", 5 / Degrees) * Degrees;
        light.beam_distribution = ref.parameters.get_float("beamdistribution", 2);
        break;
    case scene::Light::Kind::Environment:
        light.world_from_light = ref.world_from_shader;
        light.visible_camera = ref.parameters.get_float("visible", 1) != 0;
        take_texture(light, ref, textures, journal);
        break;
    case scene::Light::Kind::Ambient:
        light.visible_camera = false;
        break;
    }
    return light;
}

void check_area_light(const scene::ShaderRef& ref, Journal& journal) {
    if (ref.name != "arealight")
        journal.warning(ref.where,
                        "unknown area light shader \"" + ref.name +
                            "\"; it shines as \"arealight\" does: radiance intensity times lightcolor");
    check_parameters(ref, AreaParameters, {}, journal);
}

} // namespace kanuka::shade
