#include "shade/lights.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "color/photometry.h"
#include "shade/search.h"
#include "shade/sky.h"

namespace kanuka::shade {

namespace {

constexpr float Degrees = 180 * InvPi;

// Of light shaders that look into a shadow map. Shadows are traced here, so what they say of the map is taken
// without a word and does nothing.
constexpr std::string_view ShadowMapParameters[] = {"shadowname", "sfpx", "sfnx", "sfpy",  "sfny",   "sfpz",
                                                    "sfnz",       "blur", "bias", "width", "samples"};
constexpr std::span<const std::string_view> ShadowMapFaces = std::span(ShadowMapParameters).subspan(1, 6);

constexpr std::string_view AreaParameters[] = {"intensity", "lightcolor", "spectrum", "unit",
                                               "diffuse",   "specular",   "group",    "__group"};

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

std::string find_file(const char* what, const std::string& name, const char* instead, const Location& where,
                      const Textures& textures, Journal& journal) {
    if (name.empty())
        return {};
    std::string file = textures.find(name);
    if (file.empty())
        journal.error(where, std::string(what) + " \"" + name + "\" is not found; " +
                                 searched_in(textures.folders(), "texture", where) + ". " + instead);
    return file;
}

} // namespace

Transform frame_of(const Vec3f& origin, const Vec3f& direction, const Vec3f& up, const Vec3f& other) {
    const Vec3f z = length(direction) > 0 ? normalize(direction) : Vec3f(0, 0, 1);
    const Vec3f x = normalize(cross(std::abs(dot(up, z)) < 0.9999f ? up : other, z)), y = cross(z, x);
    Transform t;
    for (int i = 0; i < 3; i++)
        t.m[size_t(i)] = {x[i], y[i], z[i], origin[i]};
    return t;
}

Transform aimed(const Vec3f& from, const Vec3f& to) {
    return frame_of(from, to - from, {1, 0, 0}, {0, 1, 0});
}

bool is_standard_light(std::string_view name) {
    return scene::find_light_shader(name) != nullptr;
}

std::optional<scene::Light> make_stand_in(const scene::ShaderRef& ref, const std::string& searched,
                                          const Textures& textures, Journal& journal) {
    if (ref.stand_in && ref.stand_in->name.empty()) {
        journal.report(Severity::Info, ref.where,
                       "light shader \"" + ref.name +
                           "\" is not found and nothing stands in for it: indirect light is traced");
        return std::nullopt;
    }
    // Where nobody knows what it was like: without a falloff its intensity fits any size of scene.
    const std::string instead = ref.stand_in ? ref.stand_in->name : "distantlight";
    std::vector<std::string_view> names;
    for (const scene::LightKind& kind : scene::light_kinds())
        names.push_back(kind.shader);
    journal.error(ref.where, "light shader \"" + ref.name + "\" is not found (" + ref.name + ".slo or " +
                                 ref.name + ".sl), searched in " + searched + "; \"" + instead +
                                 "\" with what parameters they share stands in for it. Built in are " +
                                 joined(names) + ", and AreaLightSource \"arealight\"");
    scene::ShaderRef standard = ref;
    standard.name = instead;
    if (ref.stand_in) {
        standard.parameters = ref.stand_in->parameters;
    } else {
        const auto known = scene::find_light_shader(instead)->shader_parameters();
        std::erase_if(standard.parameters.values,
                      [&](const scene::Value& v) { return !contains(known, v.name); });
    }
    std::optional<scene::Light> light = make_light(standard, textures, journal);
    if (light)
        light->shadows = casts_shadows(ref, nullptr);
    return light;
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

// Of a light's surface, in the scene's units: scaled as the renderer scales it.
double area_of(const scene::Light& light) {
    double scale[3];
    for (size_t c = 0; c < 3; c++)
        scale[c] = std::hypot(light.world_from_light.m[0][c], light.world_from_light.m[1][c],
                              light.world_from_light.m[2][c]);
    const double r = double(light.radius) * scale[0];
    switch (light.kind) {
    case scene::Light::Kind::Quad:
        return double(light.width) * scale[0] * double(light.height) * scale[1];
    case scene::Light::Kind::Disk:
        return double(Pi) * r * r;
    case scene::Light::Kind::Cylinder:
        return 2 * double(Pi) * r * double(light.height) * scale[2];
    default:
        return 4 * double(Pi) * r * r;
    }
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
    else if (light.kind == Kind::Environment || light.kind == Kind::Ambient)
        measure.shape = color::LightShape::Environment;
    else if (light.kind != Kind::Point)
        measure.shape = color::LightShape::Area, measure.area = std::max(area_of(light), 1e-12);
    if (const auto factor = color::photometric(1, unit, measure, color::luminous_efficacy(power)))
        light.amount *= float(*factor);
    else
        journal.error(
            light.where,
            "the unit \"" + light.unit +
                "\" does not measure such a light: points and spots take lumen, candela and watt, "
                "distant lights lux and watt, environments nit, lux and watt, lights with an area all. "
                "The amount is taken as it is");
}

bool is_classic_light(const scene::ShaderRef& ref) {
    constexpr std::string_view Classic[] = {"ambientlight", "distantlight", "pointlight", "spotlight"};
    const scene::LightKind* standard = scene::find_light_shader(ref.name);
    return standard && contains(Classic, standard->shader) && !(ref.parameters.get_float("angle", 0) > 0) &&
           !(ref.parameters.get_float("radius", 0) > 0);
}

// RISpec's lights cast shadows only where they are asked to, by shadow maps; so do PRMan's, BMRT's,
// 3Delight's and Aqsis'. Here a map is a wish to have them: they are traced.
bool casts_shadows(const scene::ShaderRef& ref, const sl::Shader* shader) {
    if (ref.shadows)
        return *ref.shadows;
    const auto is_map = [](const std::string& name) {
        return name.find("shadow") != std::string::npos || contains(ShadowMapFaces, name);
    };
    for (const scene::Value& v : ref.parameters.values)
        if (v.type == scene::Type::String && is_map(v.name) && !v.strings.empty() && !v.strings[0].empty())
            return true;
    if (shader)
        for (const sl::Parameter& p : shader->parameters())
            if (p.type == sl::Type::String && is_map(p.name) && !p.strings.empty() && !p.strings[0].empty() &&
                !ref.parameters.find(p.name))
                return true;
    return scene::find_light_shader(ref.name) && !is_classic_light(ref);
}

// RISpec's spotlight compares cosines: beyond pi its cone grows narrower again, and a scene that gives 40
// degrees where 40 radians are meant has one of cos(40), as wide as acos(cos(40)).
static void take_cone(scene::Light& light, const scene::ShaderRef& ref) {
    const float angle = ref.parameters.get_float("coneangle", light.cone_angle / Degrees),
                delta = ref.parameters.get_float("conedeltaangle", light.cone_delta_angle / Degrees);
    light.cone_angle = angle * Degrees;
    light.cone_delta_angle = delta * Degrees;
    if (!(angle > Pi) || !std::isfinite(angle) || !std::isfinite(delta))
        return;
    const double outer = std::cos(double(angle)),
                 inner = std::max(outer, std::cos(double(angle) - double(delta)));
    light.cone_angle = float(std::acos(outer)) * Degrees;
    light.cone_delta_angle = float(std::acos(outer) - std::acos(inner)) * Degrees;
}

// What a light shader's parameters say. What cannot be is reported and stays as it was.
static void take_parameters(scene::LightSettings& settings, const scene::LightKind& kind,
                            const scene::ShaderRef& ref, Journal& journal) {
    // What is made of several parameters, or counts otherwise in RIB: below.
    constexpr std::string_view Apart[] = {"amount", "cone_angle", "cone_delta_angle", "decay", "sun"};
    for (const scene::LightParameter& row : scene::light_parameters()) {
        if (!row.is_of(kind) || contains(Apart, row.name))
            continue;
        for (const std::string_view name : scene::words_of(row.rib)) {
            const scene::Value* v = ref.parameters.find(name);
            if (!v)
                continue;
            if (const auto fault = row.set(settings, scene::setting_of(*v)))
                journal.error(v->where.line > 0 ? v->where : ref.where,
                              "light shader \"" + ref.name + "\": \"" + std::string(name) + "\"" +
                                  fault->substr(std::string_view(row.name).size()) + "; it stays as it was");
            break;
        }
    }
    settings.light.amount = light_amount(ref);
    if (kind.kind == scene::Light::Kind::Spot)
        take_cone(settings.light, ref);
    const float decay = ref.parameters.get_float("decay", 2);
    settings.decay = std::isfinite(decay) ? int(std::lround(std::clamp(decay, 0.0f, 4.0f))) : 2;
}

scene::Light finished_light(const scene::LightKind& kind, const scene::LightSettings& settings,
                            const Vec3f& sun) {
    using Kind = scene::Light::Kind;
    scene::Light light = settings.light;
    if (kind.daylight && kind.kind == Kind::Environment)
        light.table = preetham_sky(sun, settings.turbidity);
    else if (kind.daylight)
        light.amount = light.amount * preetham_sun(sun, settings.turbidity);
    // A falloff that physics has not, as Maya's and 3Delight's lights can have: a table of one texel says so.
    // Such a light has no extent, for the power would not hold near it.
    if (settings.decay != 2 && (kind.kind == Kind::Point || kind.kind == Kind::Spot)) {
        auto table = std::make_shared<scene::LightTable>();
        table->angle = 1.01f * Pi;
        table->falloff = settings.decay;
        table->rgb = {1, 1, 1};
        light.table = std::move(table);
        light.radius = 0;
    }
    return light;
}

std::optional<scene::Light> make_light(const scene::ShaderRef& ref, const Textures& textures,
                                       Journal& journal) {
    const scene::LightKind* kind = scene::find_light_shader(ref.name);
    if (!kind)
        return std::nullopt;
    std::span<const std::string_view> silent;
    if (kind->shader != ref.name)
        silent = ShadowMapParameters;
    check_parameters(ref, kind->shader_parameters(), silent, journal);

    scene::LightSettings settings = kind->defaults();
    take_parameters(settings, *kind, ref, journal);
    scene::Light& given = settings.light;
    given.name = ref.handle;
    given.where = ref.where;
    given.shadows = casts_shadows(ref, nullptr);
    const Transform& m = ref.world_from_shader;
    const Vec3f sun = point_of(ref, "sundirection", {0.3f, 0.2f, 0.6f}); // the zenith is +z
    if (kind->is_placed_by_points()) {
        const Vec3f from = point_of(ref, "from", {0, 0, 0}), to = point_of(ref, "to", {0, 0, 1});
        given.world_from_light = aimed(m.point(from), m.point(to));
        if (given.unit.empty())
            given.amount *= IrradianceOfCl; // Cl = intensity, or intensity / r^2
    } else if (kind->daylight && kind->kind == scene::Light::Kind::Distant) {
        given.world_from_light = aimed(m.point({0, 0, 0}), m.point(-sun));
    } else if (kind->kind != scene::Light::Kind::Ambient) {
        given.world_from_light = m;
    }
    scene::Light light = finished_light(*kind, settings, sun);
    find_light_files(light, textures, journal);
    return light;
}

void find_light_files(scene::Light& light, const Textures& textures, Journal& journal) {
    if (light.kind == scene::Light::Kind::Environment)
        light.texture = find_file("environment picture", light.texture,
                                  "A constant environment stands in for it", light.where, textures, journal);
    else
        light.texture = find_file("light picture", light.texture, "The light is the same all over",
                                  light.where, textures, journal);
    light.profile = find_file("photometric profile", light.profile, "The light shines without it",
                              light.where, textures, journal);
}

void check_area_light(const scene::ShaderRef& ref, Journal& journal) {
    if (ref.name != "arealight")
        journal.warning(ref.where,
                        "unknown area light shader \"" + ref.name +
                            "\"; it shines as \"arealight\" does: radiance intensity times lightcolor");
    else if (ref.parameters.get_float("intensity", 1) > 1000 && !ref.parameters.find("unit"))
        journal.warning(
            ref.where,
            "\"arealight\" shines with a radiance of intensity times lightcolor, which is far beyond "
            "white here. BMRT's light of that name has light fall off by the square of the distance: its "
            "radiance is pi times the intensity, over the area");
    check_parameters(ref, AreaParameters, {}, journal);
}

} // namespace kanuka::shade
