#include "render/emitters.h"

#include <cstring>

#include "color/photometry.h"

namespace kanuka::render {

void spread_flux(const scene::ShaderRef& light, store::Page& page) {
    const auto unit = color::find_unit(light.parameters.get_string("unit", ""));
    if (!unit || *unit == color::Unit::None)
        return;
    const double area = std::max(double(store::emitting_area(page)), 1e-12);
    // The shading system made lumen of watt; what is left is geometry.
    const auto as = *unit == color::Unit::Watt ? color::Unit::Lumen : *unit;
    store::scale_emission(page, float(*color::photometric(1, as, {color::LightShape::Area, 0, area}, 0)));
}

static uint32_t emitter_at(const store::PageHeader& h, uint32_t e) {
    return h.emitters_at + e * uint32_t(sizeof(store::Emitter) / 4);
}

template <class Asked> // asked(emitter)
static void leave_emitters(store::Page& page, Asked asked) {
    const store::PageHeader& h = page.header();
    for (uint32_t e = 0; e < h.emitters; e++) {
        uint32_t* at = page.words.data() + emitter_at(h, e);
        store::Emitter emitter;
        std::memcpy(&emitter, at, sizeof emitter);
        if (asked(emitter))
            continue;
        emitter.power = 0;
        std::memcpy(at, &emitter, sizeof emitter);
    }
}

void ask_no_emitters(store::Page& page) {
    leave_emitters(page, [](const store::Emitter&) { return false; });
}

void ask_uncut_emitters(store::Page& page, std::span<const bvh::Scene::Plane> clips, bool of_solid,
                        bool at_rest) {
    if (!of_solid && clips.empty())
        return;
    leave_emitters(page, [&](const store::Emitter& emitter) {
        bool kept = !of_solid && at_rest;
        for (const bvh::Scene::Plane& plane : clips)
            for (const Vec3f& p : {emitter.p0, emitter.p0 + emitter.e1, emitter.p0 + emitter.e2})
                kept &= dot(p - plane.point, plane.normal) <= 0;
        return kept;
    });
}

bool shines_without_area(const store::Page& page) {
    const store::PageHeader& h = page.header();
    bool shines = false;
    for (uint32_t e = 0; e < h.emitters; e++) {
        store::Emitter emitter;
        std::memcpy(&emitter, page.words.data() + emitter_at(h, e), sizeof emitter);
        if (emitter.area > 0)
            return false;
        shines |= emitter.scale > 0;
    }
    return shines;
}

} // namespace kanuka::render
