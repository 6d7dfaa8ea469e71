#include "ingest/rib/dialects/attributes.h"

#include <cmath>

namespace kanuka::ingest::dialects {

namespace {

// Which only BMRT was told: its "arealight" is another.
constexpr std::string_view BmrtLight = "light:nsamples";

constexpr std::string_view Bmrt = "render:casts_shadows", Prman = "visibility:transmission",
                           Delight = "shade:transmissionhitmode";

// BMRT's casts_shadows, and the ways in which PRMan and 3Delight have said the same. Each of them may take
// shadows away; none gives back what another took.
bool casts_shadows(const scene::ValueList& user) {
    if (user.get_string(Bmrt, "") == "none" || user.get_string(Prman, "") == "transparent" ||
        user.get_string(Delight, "") == "transparent")
        return false;
    const scene::Value* v = user.find(Prman);
    return !v || v->type == scene::Type::String || user.get_int(Prman, 1) != 0;
}

} // namespace

void attribute(AttributeState& to, std::string_view name) {
    if (name == BmrtLight && !to.shared->area_light_by_intensity)
        to.edit("area_light_by_intensity").area_light_by_intensity = true;
    if (name == Bmrt || name == Prman || name == Delight) {
        const bool casts = casts_shadows(to.shared->user);
        if (casts != to.shared->casts_shadows)
            to.edit("casts_shadows").casts_shadows = casts;
    }
}

void adapt(const scene::AttributeParameter& row, scene::Setting& value) {
    if (row.kind == scene::Kind::Text && row.count == 0) {
        std::vector<std::string> words;
        for (const std::string& text : value.texts)
            for (size_t at = 0; (at = text.find_first_not_of(" \t\n,", at)) != std::string::npos;) {
                const size_t end = std::min(text.find_first_of(" \t\n,", at), text.size());
                words.push_back(text.substr(at, end - at));
                at = end;
            }
        value.texts = std::move(words);
    }
    if (row.range.least == 0 && !row.range.above)
        for (double& x : value.numbers)
            x = std::isfinite(x) ? std::abs(x) : 0;
}

} // namespace kanuka::ingest::dialects
