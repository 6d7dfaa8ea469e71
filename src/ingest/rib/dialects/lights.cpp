#include "ingest/rib/dialects/lights.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "scene/schema/lights.h"

namespace kanuka::ingest::dialects {

namespace {

// The first row that fits counts. Empty: what such a light would bring is found by tracing.
constexpr std::pair<std::string_view, std::string_view> LightNames[] = {
    {"caustic", ""},
    {"indirect", ""},
    {"photon", ""},
    {"portal", "portallight"},
    {"ambient", "ambientlight"},
    {"env", "environmentlight"},
    {"dome", "environmentlight"},
    {"sky", "environmentlight"},
    {"occl", "environmentlight"},
    {"hemi", "environmentlight"},
    {"distant", "distantlight"},
    {"directional", "distantlight"},
    {"sun", "distantlight"},
    {"spot", "spotlight"},
    {"point", "pointlight"},
    {"nofall", "distantlight"},
    {"arealight", "quadlight"},
};

std::string in_lower_case(std::string name) {
    for (char& c : name)
        c = char(std::tolower(static_cast<unsigned char>(c)));
    return name;
}

// A light that says nothing of its kind is taken for a distant one: without a falloff its intensity is known
// to fit any size of scene.
std::string_view likely_shader(const scene::ShaderRef& light) {
    const std::string name = in_lower_case(light.name.substr(light.name.find_last_of('/') + 1));
    for (const auto& [part, standard] : LightNames)
        if (name.find(part) != std::string::npos)
            return standard;
    return light.parameters.find("coneangle") ? "spotlight" : "distantlight";
}

void set_number(scene::ValueList& parameters, const char* name, float number) {
    scene::Value v;
    v.name = name;
    v.floats = std::vector<float>{number};
    parameters.set(std::move(v));
}

// The power of the distance that their light falls off with, where the shader's name or a parameter says.
// Exporters (Maya's, Liquid's) call it decay; BMRT's and Larry Gritz' uberlight falloff.
std::optional<int> falloff_of(const scene::ShaderRef& light) {
    if (in_lower_case(light.name).find("nofall") != std::string::npos)
        return 0;
    for (const char* parameter : {"decay", "decayRate", "decayrate", "falloff"})
        if (const scene::Value* v = light.parameters.find(parameter); v && v->type == scene::Type::Float) {
            const float power = light.parameters.get_float(parameter, 2);
            if (std::isfinite(power))
                return int(std::lround(std::clamp(power, 0.0f, 4.0f)));
        }
    return std::nullopt;
}

// Liquid's and Maya's cone ends beyond its angle, and they have another name for the distribution.
void take_cone(scene::ValueList& to, const scene::ValueList& theirs) {
    if (const scene::Value* soft = theirs.find("penumbraangle"); soft && !soft->floats.empty()) {
        constexpr float Default = 30 * Pi / 180;
        const float edge = soft->floats[0], angle = theirs.get_float("coneangle", Default);
        set_number(to, "coneangle", angle + std::max(edge, 0.0f));
        set_number(to, "conedeltaangle", std::max(std::abs(edge), 1e-4f));
    }
    if (theirs.find("dropoff"))
        set_number(to, "beamdistribution", std::max(theirs.get_float("dropoff", 0), 0.0f));
}

} // namespace

std::shared_ptr<const scene::ShaderRef::StandIn> stand_in_for_light(const scene::ShaderRef& light) {
    using Kind = scene::Light::Kind;
    if (scene::find_light_shader(light.name))
        return nullptr;
    const std::string_view name = likely_shader(light);
    if (name.empty())
        return std::make_shared<const scene::ShaderRef::StandIn>();
    const scene::LightKind& standard = *scene::find_light_shader(name);
    scene::ShaderRef::StandIn result{std::string(name), light.parameters};
    const std::vector<std::string_view> known = standard.shader_parameters();
    std::erase_if(result.parameters.values, [&](const scene::Value& v) {
        return std::ranges::find(known, v.name) == known.end() || v.name == "texture" ||
               v.name == "mapname"; // pictures that theirs may well not shine
    });
    if (standard.kind == Kind::Environment) // light shaders are seen by surfaces alone
        set_number(result.parameters, "visible", 0);
    const std::optional<int> falloff = falloff_of(light);
    if (falloff && (standard.kind == Kind::Point || standard.kind == Kind::Spot)) {
        set_number(result.parameters, "decay", float(*falloff));
        if (standard.kind == Kind::Spot)
            take_cone(result.parameters, light.parameters);
    }
    return std::make_shared<const scene::ShaderRef::StandIn>(std::move(result));
}

} // namespace kanuka::ingest::dialects
