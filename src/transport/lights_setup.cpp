#include "transport/lights_setup.h"

#include <algorithm>
#include <cmath>

namespace kanuka::transport {

using Kind = scene::Light::Kind;

void uplift_amount(const Rgb& rgb, const color::Palette& palette, float out[4]) {
    const float m = std::max({rgb.x, rgb.y, rgb.z, 0.0f});
    const auto c = palette.emission(m > 0 ? rgb : Rgb(0), 2 * m);
    std::copy(c.begin(), c.end(), out);
}

bool usable(const Rgb& c) {
    return std::isfinite(c.x + c.y + c.z) && std::max({c.x, c.y, c.z}) > 0;
}

namespace {

bool finite(const Transform& t) {
    for (const auto& row : t.m)
        for (double x : row)
            if (!std::isfinite(x))
                return false;
    return true;
}

// Lights of one kind that add up.
struct Sum {
    Rgb all{0, 0, 0};
    std::vector<Rgb> parts;
    int32_t sets = 0;

    void add(const scene::Light& light) {
        all += light.amount;
        parts.push_back(light.amount);
        sets |= light.lit_sets;
    }
    void uplift(color::Palette& palette, float c[4]) const {
        uplift_amount(all, palette, c);
        if (parts.size() > 1)
            if (const auto sum = palette.sum(parts))
                std::copy(sum->begin(), sum->end(), c);
    }
};

// Several constant environments add up; one picture is kept.
void add_picture(SceneData& data, const SceneInputs& in, const scene::Light& light, Journal& journal) {
    if (!(std::abs(light.world_from_light.determinant3()) > 1e-30))
        journal.warning(light.where, "an environment's transformation is flat: its picture is left out");
    else if (data.view.lights.map.width > 0)
        journal.warning(light.where, "a second environment picture is not used; one scene has one");
    else if (in.map.width > 0)
        fill_map(data, in.map, light, in.render_from_world);
}

// Environments and analytic lights.
void sort_lights(SceneData& data, const SceneInputs& in, color::Palette& palette, Journal& journal) {
    LightsView& view = data.view.lights;
    Sum constant, ambient;
    AnalyticFiller analytic(data, in, palette, journal);
    for (const scene::Light& light : in.lights) {
        const bool environment = light.kind == Kind::Environment;
        if (!std::isfinite(light.amount.x + light.amount.y + light.amount.z) ||
            !finite(light.world_from_light)) {
            journal.warning(light.where, "a light whose amount or place is not a number is left out");
            continue;
        }
        if (light.kind == Kind::Portal) {
            analytic.add(light);
            continue;
        }
        if (!usable(light.amount))
            continue;
        view.linked |= light.lit_sets != -1;
        view.shadow_linked |= light.passes != 0;
        view.shadowless |= !light.shadows;
        if (light.kind == Kind::Ambient) {
            ambient.add(light);
        } else if (environment && light.texture.empty() && !light.table) {
            constant.add(light);
            view.constant.visible_camera |= light.visible_camera;
        } else if (environment) {
            add_picture(data, in, light, journal);
        } else {
            analytic.add(light);
        }
    }
    view.ambient.present = usable(ambient.all);
    view.ambient.sets = ambient.sets;
    ambient.uplift(palette, view.ambient.c);
    view.constant.present = usable(constant.all);
    view.constant.sets = constant.sets;
    constant.uplift(palette, view.constant.c);
    analytic.finish();
}

// Numbers the choices among lights; see LightsView.
void number_choices(LightsView& view) {
    view.choices = view.emitter_choice >= 0 ? 1 : 0;
    view.map_choice = view.map.cells.rows > 0 || !view.portals.empty() ? view.choices++ : -1;
    view.first_light_choice = view.choices;
    view.choices += view.by_choice;
    const bool far = view.map_choice >= 0 || view.distant > 0,
               near = view.emitter_choice >= 0 || view.by_choice > view.distant;
    view.samples = far && near && view.choices <= LightsView::FewChoices ? 2 : 1;
    if (view.map_choice < 0)
        return;
    // Pi times the mean over the sphere of what is sampled.
    view.map_choice_sets = view.map.sets;
    if (view.portals.empty()) {
        view.map_irradiance = 0.25f / view.map.density;
        return;
    }
    view.map_irradiance = Pi * (view.map.mean + (view.constant.present ? 0.5f * view.constant.c[3] : 0.0f));
    view.map_choice_sets =
        (view.map.width > 0 ? view.map.sets : 0) | (view.constant.present ? view.constant.sets : 0);
}

void take_portals(SceneData& data, const SceneInputs& in, Journal& journal) {
    LightsView& view = data.view.lights;
    if (data.lights.portals.empty())
        return;
    if (view.constant.present || view.map.width > 0)
        view.portals = data.lights.portals;
    else
        journal.warning(std::ranges::find(in.lights, Kind::Portal, &scene::Light::kind)->where,
                        "nothing comes through a portal where the scene has no environment");
}

} // namespace

void fill_lights(SceneData& data, const SceneInputs& in, color::Palette& palette, Journal& journal) {
    LightsView& view = data.view.lights;
    data.lights.point_lights = in.point_lights;
    view.point_lights = data.lights.point_lights;
    for (const PointLight& light : in.point_lights)
        view.shadow_linked |= light.passes != 0;
    for (const store::Links& links : in.store->links())
        view.linked |= links.lit_sets != 1 || links.shone_sets != -1;
    sort_lights(data, in, palette, journal);
    take_portals(data, in, journal);
    fill_emitters(data, in);
    number_choices(view);
    for (int k = 0; data.view.media.has_fog && k < view.by_choice; k++)
        if (view.analytic[size_t(k)].shape == AnalyticLight::Delta &&
            data.lights.fog_lamps.size() < LightsView::MostFogLamps)
            data.lights.fog_lamps.push_back(k);
    view.fog_lamps = data.lights.fog_lamps;
}

} // namespace kanuka::transport
