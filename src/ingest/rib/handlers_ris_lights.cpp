// Light, and area lights of RenderMan 19 and 20.
#include <algorithm>
#include <cmath>

#include "ingest/rib/handlers.h"
#include "ingest/rib/ris.h"
#include "scene/schema/lights.h"

namespace kanuka::ingest::handlers {

using ris::set;
using scene::ShaderRef;
using scene::Value;
using scene::ValueList;

namespace {

constexpr ris::Mapping RisLights[] = {
    {"PxrRectLight", "quadlight", "lightColorMap:texture"},
    {"PxrDiskLight", "disklight", ""},
    {"PxrSphereLight", "spherelight", ""},
    {"PxrCylinderLight", "cylinderlight", ""},
    {"PxrDistantLight", "distantlight", "angleExtent:angle"},
    {"PxrDomeLight", "environmentlight", "lightColorMap:texture"},
    {"PxrPortalLight", "portallight", ""},
    {"PxrMeshLight", "arealight", ""},
};

// AreaLightSource of RenderMan 19 and 20, whose shape is a primitive or a Geometry that follows.
constexpr std::string_view ShapedLights[] = {"PxrAreaLight",   "PxrStdAreaLight", "PxrStdEnvMapLight",
                                             "PxrEnvMapLight", "PxrEnvDayLight",  "PxrStdEnvDayLight"};

// What all lights have, and what is taken account of below.
constexpr std::string_view LightParameters =
    "intensity exposure lightColor areaNormalize primaryVisibility lightGroup lightColorGamma diffuse "
    "specular "
    "traceLightPaths enableShadows fixedSampleCount importanceMultiplier";

} // namespace

// Their area lights have an edge or a diameter of one and are scaled by the transformation, as ours are.
static double area_of(const Context& c, std::string_view light) {
    const Vec3f o = c.ctm.point({0, 0, 0});
    const double x = length(c.ctm.point({1, 0, 0}) - o), y = length(c.ctm.point({0, 1, 0}) - o),
                 z = length(c.ctm.point({0, 0, 1}) - o);
    constexpr double Quarter = 0.78539816339744831;
    if (light == "PxrRectLight")
        return x * y;
    if (light == "PxrDiskLight")
        return Quarter * x * y;
    if (light == "PxrSphereLight")
        return 4 * Quarter * std::pow(x * y * z, 2.0 / 3);
    if (light == "PxrCylinderLight")
        return 4 * Quarter * x * std::sqrt(y * z);
    return 1;
}

static void take_area_light(ShaderRef& light) {
    const ValueList theirs = std::move(light.parameters);
    light.parameters = {};
    const double intensity =
        double(theirs.get_float("intensity", 1)) * std::exp2(double(theirs.get_float("exposure", 0)));
    set(light.parameters, "intensity", float(std::isfinite(intensity) ? intensity : 0));
    set(light.parameters, "lightcolor", theirs.get_color("lightColor", theirs.get_color("envTint", Rgb(1))));
    if (const std::string map = theirs.get_string("rman__EnvMap", ""); !map.empty())
        set(light.parameters, "texture", map);
    if (const float seen = theirs.get_float("rman__LightPrimaryVisibility", 1); seen == 0)
        set(light.parameters, "visible", seen);
    light.name = "arealight";
}

void shaped_light(ShaderRef& light) {
    if (std::find(std::begin(ShapedLights), std::end(ShapedLights), light.name) != std::end(ShapedLights))
        take_area_light(light);
}

// Geometry "envsphere" and the shapes of lights: with an area light in force, the light itself.
bool light_geometry(Context& c, const Call& call) {
    static constexpr std::pair<std::string_view, std::string_view> Shapes[] = {
        {"envsphere", "environmentlight"},
        {"rectlight", "quadlight"},
        {"disklight", "disklight"},
        {"spherelight", "spherelight"},
        {"cylinderlight", "cylinderlight"}};
    for (const auto& [shape, name] : Shapes)
        if (call.text(0) == shape) {
            if (!c.attributes.shared->area_light)
                return true; // what a light that is off would look like
            ShaderRef light = *c.attributes.shared->area_light;
            if (light.name != "arealight")
                take_area_light(light);
            light.name = name;
            light.world_from_shader = c.ctm;
            if (name != "environmentlight")
                std::erase_if(light.parameters.values, [](const Value& v) { return v.name == "texture"; });
            c.traces_light = true;
            c.add_light(std::move(light));
            return true;
        }
    return false;
}

void ris_light(Context& c, Call& call) {
    const ris::Mapping* mapping = ris::find(RisLights, call.text(0));
    if (!mapping) {
        c.reports.once(Severity::Warning, "Light " + call.text(0), call.where,
                       "Light \"" + call.text(0) +
                           "\" has no counterpart and was left out; use PxrRectLight, PxrDiskLight, "
                           "PxrSphereLight, PxrCylinderLight, PxrDistantLight, PxrDomeLight, PxrPortalLight, "
                           "PxrMeshLight or a LightSource");
        return;
    }
    const ValueList& theirs = call.params;
    ValueList to;
    double intensity =
        double(theirs.get_float("intensity", 1)) * std::exp2(double(theirs.get_float("exposure", 0)));
    if (theirs.get_int("areaNormalize", 0) != 0)
        intensity /= std::max(area_of(c, mapping->theirs), 1e-30);
    set(to, "intensity", float(std::isfinite(intensity) ? intensity : 0));
    set(to, "lightcolor", theirs.get_color("lightColor", Rgb(1)));
    for (const Value& v : theirs.values)
        if (const std::string_view name = ris::ours(mapping->parameters, v.name); !name.empty()) {
            Value renamed = v;
            renamed.name = name;
            to.set(std::move(renamed));
        }
    if (mapping->ours != "arealight")
        set(to, "visible",
            float(theirs.get_int("primaryVisibility", 1) != 0 && c.attributes.shared->visible_camera));
    if (const std::string group = theirs.get_string("lightGroup", ""); !group.empty())
        set(to, "group", group);
    for (const char* lobes : {"diffuse", "specular"})
        if (const float factor = theirs.get_float(lobes, 1); factor != 1)
            set(to, lobes, factor);
    ris::report_rest(c, call, *mapping, LightParameters);
    // Portals have no light of their own.
    if (const scene::LightKind* kind = scene::find_light_shader(mapping->ours)) {
        const std::vector<std::string_view> known = kind->shader_parameters();
        std::erase_if(to.values,
                      [&](const Value& v) { return std::ranges::find(known, v.name) == known.end(); });
    }
    const std::string handle = call.text(1);
    ShaderRef light = c.shader(call, 0);
    light.name = mapping->ours;
    light.handle = handle;
    light.parameters = std::move(to);
    if (mapping->theirs == "PxrCylinderLight") { // theirs lies along x, ours along z
        Transform turn;
        turn.m[0] = {0, 0, 1, 0};
        turn.m[1] = {0, 1, 0, 0};
        turn.m[2] = {-1, 0, 0, 0};
        light.world_from_shader = light.world_from_shader * turn;
    }
    if (mapping->theirs == "PxrDomeLight") // for a right-handed space, RISpec's sky for a left-handed one
        light.world_from_shader = light.world_from_shader * Transform::scale(1, -1, 1);
    if (mapping->theirs == "PxrMeshLight") { // what follows shines
        c.lights.declare_area(handle);
        c.attributes.edit(FieldAreaLight).area_light = std::move(light);
        return;
    }
    c.traces_light = true;
    c.add_light(std::move(light));
}

} // namespace kanuka::ingest::handlers
