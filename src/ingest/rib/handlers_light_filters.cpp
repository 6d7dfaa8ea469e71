// LightFilter of RIS: what multiplies a light's colour is done, of the others is said what would do.

#include <cmath>

#include "ingest/rib/context.h"
#include "ingest/rib/handlers.h"

namespace kanuka::ingest::handlers {

using scene::Value;

namespace {

struct Mend {
    std::string_view filter, mend;
};
constexpr Mend Mends[] = {
    {"PxrBarnLightFilter",
     "a spotlight (coneangle, conedeltaangle) is bounded, and so is light behind a hole in a "
     "polygon"},
    {"PxrRodLightFilter",
     "put a polygon where it is dark, with Attribute \"visibility\" \"integer camera\" 0"},
    {"PxrBlockerLightFilter",
     "put a polygon where it is dark, with Attribute \"visibility\" \"integer camera\" 0"},
    {"PxrGoboLightFilter", "a PxrRectLight's lightColorMap, or a light shader with texture(), has a picture"},
    {"PxrCookieLightFilter",
     "a PxrRectLight's lightColorMap, or a light shader with texture(), has a picture"},
    {"PxrRampLightFilter", "a light shader of its own varies with distance and direction"},
    {"PxrCombinerLightFilter", "enable the filters that it combines one by one"},
};

} // namespace

void light_filter(Context& c, Call& call) {
    const std::string &name = call.text(0), &handle = call.text(1);
    if (name != "PxrIntMultLightFilter") {
        std::string_view mend = "write a light shader that filters";
        for (const Mend& m : Mends)
            if (m.filter == name)
                mend = m.mend;
        c.reports.once(Severity::Warning, "LightFilter " + name, call.where,
                       "LightFilter \"" + name +
                           "\" has no counterpart, its lights shine without it: " + std::string(mend));
        c.light_filters[handle] = std::nullopt;
        return;
    }
    const scene::ValueList& p = call.params;
    const double gain = double(p.get_float("intensity", 1)) * std::exp2(double(p.get_float("exposure", 0)));
    c.light_filters[handle] = p.get_color("tint", Rgb(1)) * float(std::isfinite(gain) ? gain : 1);
    std::string rest;
    for (const Value& v : p.values)
        if (v.name != "intensity" && v.name != "exposure" && v.name != "tint" && !v.name.starts_with("__") &&
            !(v.name == "saturation" && p.get_float("saturation", 1) == 1) && v.name != "combineMode")
            rest += (rest.empty() ? "" : ", ") + v.name;
    if (!rest.empty())
        c.reports.once(Severity::Info, "parameters of " + name, call.where,
                       "LightFilter \"" + name +
                           "\" is a factor of intensity, exposure and tint; there is no "
                           "counterpart of " +
                           rest);
}

void enable_light_filter(Context& c, Call& call) {
    const std::string light = call.handle(0), filter = call.handle(1);
    const auto known = c.light_filters.find(filter);
    if (known == c.light_filters.end()) {
        c.reports.error("unknown light filter", call.where,
                        "EnableLightFilter: there is no LightFilter \"" + filter + "\" before it");
        return;
    }
    if (!known->second) // reported
        return;
    const bool on = call.i(2) != 0;
    const auto& area = c.attributes.shared->area_light;
    if (area && area->handle == light) { // what follows shines by it
        if (on)
            scale_color(c.attributes.edit(FieldAreaLight).area_light->parameters, "lightcolor",
                        *known->second);
        else
            c.reports.once(Severity::Warning, "filter of an area light", call.where,
                           "EnableLightFilter turns no filter of area lights off; AttributeEnd does");
        return;
    }
    if (!c.lights.filter(light, filter, *known->second, on))
        c.reports.error(
            "filter of an unknown light", call.where,
            "EnableLightFilter \"" + light +
                "\": no light in force has this handle; declare it by Light or LightSource first");
}

} // namespace kanuka::ingest::handlers
