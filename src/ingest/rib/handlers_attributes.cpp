// Attributes: what holds for the primitives that follow.

#include <cmath>

#include "ingest/rib/context.h"
#include "ingest/rib/dialects/attributes.h"
#include "ingest/rib/handlers.h"
#include "ingest/rib/view_bound.h"
#include "scene/edit_checks.h"

namespace kanuka::ingest::handlers {

using scene::ShaderRef;
using scene::Value;

// ---- colour -----------------------------------------------------------------------------------------

static bool color_of(Context& c, const Call& call, Rgb& rgb) {
    const auto& v = call.args[0].floats;
    const auto& samples = c.options.rgb_from_samples;
    const size_t n = samples.empty() ? 3 : samples.size() / 3;
    if (v.size() != n) {
        c.reports.error("colour components", call.where,
                        std::string(call.spec->name) + ": expected " + std::to_string(n) +
                            " numbers, found " + std::to_string(v.size()) + "; it stays as it was");
        return false;
    }
    if (!c.finite(call, 1))
        return false;
    rgb = Rgb(0.0f);
    for (size_t i = 0; i < n; i++)
        for (int k = 0; k < 3; k++)
            rgb[k] += v[i] * (samples.empty() ? float(int(i) == k) : samples[i * 3 + size_t(k)]);
    return true;
}

void color(Context& c, Call& call) {
    Rgb rgb;
    if (!c.attributes.shared->color_spectrum.empty()) // a plain colour takes its place
        c.attributes.edit("color_spectrum").color_spectrum.clear();
    if (color_of(c, call, rgb) && !(c.attributes.shared->color == rgb && (c.attributes.set & FieldColor)))
        c.attributes.edit(FieldColor).color = rgb;
}

void opacity(Context& c, Call& call) {
    Rgb rgb;
    if (color_of(c, call, rgb) && !(c.attributes.shared->opacity == rgb && (c.attributes.set & FieldOpacity)))
        c.attributes.edit(FieldOpacity).opacity = rgb;
}

void texture_coordinates(Context& c, Call& call) {
    if (!c.finite(call, 1))
        return;
    auto& to = c.attributes.edit(FieldTextureCoordinates).texture_coordinates;
    std::copy_n(call.args[0].floats.begin(), 8, to.begin());
}

// ---- shaders ----------------------------------------------------------------------------------------

// BMRT's Attribute "light" "shadows".
static std::optional<bool> wanted_shadows(const Context& c) {
    const std::string one = c.attributes.shared->user.get_string("light:shadows", "");
    return one == "on" ? std::optional(true) : one == "off" ? std::optional(false) : std::nullopt;
}

void light_source(Context& c, Call& call) {
    if (c.scope() == InObject) {
        c.reports.error("light in object", call.where,
                        "LightSource inside ObjectBegin … ObjectEnd was left out: lights cannot be "
                        "instanced; move it out");
        return;
    }
    const std::string handle = call.handle(1);
    ShaderRef light = c.shader(call, 0);
    light.handle = handle;
    light.coshaders = c.attributes.shared->coshaders;
    light.shadows = wanted_shadows(c);
    c.lights.declare(std::move(light), c.attributes);
}

void area_light_source(Context& c, Call& call) {
    const std::string handle = call.handle(1);
    const std::string& name = call.text(0);
    c.lights.declare_area(handle);
    c.traces_light = true;
    if (name.empty() || name == "null") {
        c.attributes.edit(FieldAreaLight).area_light.reset(); // ends an area light
        return;
    }
    ShaderRef light = c.shader(call, 0);
    light.handle = handle;
    shaped_light(light);
    c.attributes.edit(FieldAreaLight).area_light = std::move(light);
}

void illuminate(Context& c, Call& call) {
    c.lights.illuminate(call.handle(0), call.i(1) != 0, c.attributes, c.reports, call.where);
}

// A co-shader. Of one handle the last counts.
void coshader(Context& c, Call& call) {
    ShaderRef ref = c.shader(call, 0);
    ref.handle = call.text(1);
    if (ref.handle.empty()) {
        c.reports.error("co-shader without a handle", call.where,
                        "Shader \"" + ref.name + "\" was left out: nothing can call it without a handle");
        return;
    }
    std::vector<ShaderRef>& all = c.attributes.edit(FieldCoShaders).coshaders;
    std::erase_if(all, [&](const ShaderRef& known) { return known.handle == ref.handle; });
    all.push_back(std::move(ref));
}

void surface(Context& c, Call& call) {
    c.attributes.edit(FieldSurface).surface = c.shader(call, 0);
}

void displacement(Context& c, Call& call) {
    if (call.text(0).empty() || call.text(0) == "null")
        put_displacement(c, std::nullopt);
    else
        put_displacement(c, c.shader(call, 0));
}

static void not_run(Context& c, const Call& call) {
    c.reports.once(Severity::Warning, call.spec->name, call.where,
                   std::string(call.spec->name) + " \"" + call.text(0) + "\" is kept with the scene, but " +
                       std::string(call.spec->note));
}

void interior(Context& c, Call& call) {
    not_run(c, call);
    c.attributes.edit(FieldInterior).interior = c.shader(call, 0);
}

void exterior(Context& c, Call& call) {
    not_run(c, call);
    c.attributes.edit(FieldExterior).exterior = c.shader(call, 0);
}

void atmosphere(Context& c, Call& call) {
    auto& a = c.attributes.edit(FieldAtmosphere);
    if (call.text(0).empty() || call.text(0) == "null")
        a.atmosphere.reset();
    else
        a.atmosphere = c.shader(call, 0);
}

// ---- numbers and switches ---------------------------------------------------------------------------

void shading_rate(Context& c, Call& call) {
    if (!c.finite(call, 1))
        return;
    if (!(call.f(0) > 0)) {
        c.reports.error("ShadingRate", call.where,
                        "ShadingRate must be more than 0 pixels; it stays as it was");
        return;
    }
    if (c.attributes.shared->shading_rate != call.f(0) || !(c.attributes.set & FieldShadingRate))
        c.attributes.edit(FieldShadingRate).shading_rate = call.f(0);
}

void matte(Context& c, Call& call) {
    c.attributes.edit(FieldMatte).matte = call.i(0) != 0;
}

void sides(Context& c, Call& call) {
    if (call.i(0) != 1 && call.i(0) != 2) {
        c.reports.error("Sides", call.where,
                        "Sides " + std::to_string(call.i(0)) + ": it must be 1 or 2; it stays as it was");
        return;
    }
    c.attributes.edit(FieldSides).sides = call.i(0);
}

// reverse_orientation = the outside is not where the handedness of the primitive's own space puts it. "lh"
// and "rh" name a handedness outright: they are compared with that of the space current now, as seen from the
// (left-handed) camera.
void orientation(Context& c, Call& call) {
    const std::string& o = call.text(0);
    bool reverse;
    if (o == "outside" || o == "inside") {
        reverse = o == "inside";
    } else if (o == "lh" || o == "rh") {
        reverse = c.left_handed() != (o == "lh");
    } else {
        c.reports.error("Orientation", call.where,
                        "Orientation \"" + o +
                            "\": it must be outside, inside, lh or rh; it stays as it was");
        return;
    }
    c.attributes.edit(FieldOrientation).reverse_orientation = reverse;
}

void reverse_orientation(Context& c, Call&) {
    auto& a = c.attributes.edit(FieldToggleOrientation);
    a.reverse_orientation = !a.reverse_orientation;
}

// ---- level of detail --------------------------------------------------------------------------------

void detail(Context& c, Call& call) {
    const auto& v = call.args[0].floats;
    if (!c.finite(call, 1))
        return;
    Bounds3f b;
    b.extend(Vec3f(v[0], v[2], v[4]));
    b.extend(Vec3f(v[1], v[3], v[5]));
    c.attributes.detail_bound = b;
    c.attributes.detail_transform = c.camera_from_current();
}

// Of the paths' numbers from 0 to 1 those between two meet what follows; 0 and 1: all do.
static void set_level(Context& c, float from, float to) {
    const scene::Attributes& now = *c.attributes.shared;
    if (now.level_from == from && now.level_to == to)
        return;
    scene::Attributes& a = c.attributes.edit("level");
    a.level_from = from, a.level_to = to;
}

// A representation fades in from minvisible to lowertransition, and out from uppertransition to maxvisible.
// Neighbours share their transitions: there a path meets one of them or the other, never both or none.
void detail_range(Context& c, Call& call) {
    const auto& v = call.args[0].floats;
    if (!(v[0] <= v[1] && v[1] <= v[2] && v[2] <= v[3])) {
        c.reports.error("DetailRange", call.where,
                        "DetailRange was left out: its four numbers must not fall");
        return;
    }
    c.attributes.detail_visible = true;
    if (!c.attributes.detail_bound)
        return set_level(c, 0, 1);
    const double size = view_bound(c, *c.attributes.detail_bound, c.attributes.detail_transform).area;
    const bool ends = v[3] < 1e37f;
    c.attributes.detail_visible = size >= double(v[0]) && !(ends && size >= double(v[3]));
    const auto share = [&](float from, float to) { return float((size - from) / (double(to) - from)); };
    set_level(c, ends && size > double(v[2]) && size < double(v[3]) ? share(v[2], v[3]) : 0,
              size < double(v[1]) && size >= double(v[0]) ? share(v[0], v[1]) : 1);
}

// ---- Attribute --------------------------------------------------------------------------------------

// What scene/schema/attributes.cpp declares.
static void declared_attribute(Context& c, const std::string& category, const Value& v,
                               const scene::AttributeParameter& row) {
    scene::Setting value = scene::setting_of(v);
    dialects::adapt(row, value);
    if (row.takes(value))
        row.put(c.attributes.edit(bit_of(row)), value);
    else
        c.reports.error("Attribute " + category, v.where,
                        "Attribute \"" + category + "\": \"" + v.name + "\" must be " + row.expected() +
                            "; it stays as it was");
}

// Of what instances differ by: objects.h.
static scene::Fault fault_of_difference(const Value& v) {
    std::vector<float> given(v.floats.begin(), v.floats.end());
    given.insert(given.end(), v.ints.begin(), v.ints.end());
    scene::Variation variation;
    if (v.name == "variant")
        variation.variant = std::move(given);
    else if (v.name == "tint")
        variation.tint = std::move(given);
    else if (v.name == "roughness")
        variation.roughness = std::move(given);
    else
        return std::nullopt;
    if (variation.empty())
        return v.name + ": expected numbers";
    return scene::fault_of(variation, 1);
}

static scene::Fault fault_of_primvar(const Value& v) {
    scene::Variation variation;
    variation.primvars.set(instance_primvar(v));
    return scene::fault_of(variation, 1);
}

void attribute(Context& c, Call& call) {
    const std::string& category = call.text(0);
    for (Value& v : call.params.values) {
        const std::string name = category + ":" + v.name;
        if (const scene::AttributeParameter* row = scene::find_rib_attribute(name)) {
            declared_attribute(c, category, v, *row);
        } else if (category == "kanuka") {
            c.reports.error("Attribute kanuka", v.where,
                            "Attribute \"kanuka\": there is no \"" + v.name + "\"; there are " +
                                scene::rib_names_of(scene::attribute_parameters(), category));
        } else if (const scene::Fault fault = category == "instance"           ? fault_of_difference(v)
                                              : category == "instance:primvar" ? fault_of_primvar(v)
                                                                               : std::nullopt) {
            c.reports.error("Attribute " + category, v.where,
                            "Attribute \"" + category + "\": " + *fault + "; it stays as it was");
        } else {
            v.name = name;
            c.attributes.edit(FieldUser).user.set(std::move(v));
            dialects::attribute(c.attributes, name);
        }
    }
}

} // namespace kanuka::ingest::handlers
