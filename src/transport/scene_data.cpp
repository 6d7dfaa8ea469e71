#include "transport/scene_data.h"

#include <algorithm>

#include "scene/schema/parameter.h"
#include "transport/lights_setup.h"
#include "transport/media_setup.h"

namespace kanuka::transport {

namespace {

void fill_geometry(SceneData& data, const SceneInputs& in) {
    GeometryView& view = data.view.geometry;
    static const store::ShapeRecord no_shape{};
    view.words = in.store->words();
    view.floats = in.store->floats();
    view.shapes =
        reinterpret_cast<const int32_t*>(in.store->shapes().empty() ? &no_shape : in.store->shapes().data());
    view.emitters = in.store->emitters().data();
    view.links = in.store->links().data();
    view.ray_query = RayQuery(in.bvh);
    view.instanced = in.instanced;
    view.moving = in.moving || !in.camera.motion.empty();
    for (const auto& program : in.store->programs())
        data.materials.emplace_back(program);
    view.materials = data.materials;
    for (const store::ShapeRecord& s : in.store->shapes())
        view.tinted |= (s.flags & store::ShapeRecord::Tinted) != 0;
    for (const store::Links& links : in.store->links()) {
        view.holds_out |= (links.seen & store::Links::HeldOut) != 0;
        view.hides |= (links.seen & store::Links::Unseen) != 0;
        view.backdrops |= (links.seen & store::Links::Backdrop) != 0;
        view.fades |= links.fades();
    }
}

void fill_spectra(SceneData& data, const SceneInputs& in, color::Palette& palette) {
    SpectraView& view = data.view.spectra;
    color::Sensor observer;
    if (!in.sensor)
        observer = color::make_sensor(color::Observer::Cie1931, palette.white(), color::Space::Rec709);
    const color::Sensor& sensor = in.sensor ? *in.sensor : observer;
    const color::UpliftTable& uplift = palette.uplift_table();
    view.uplift = {uplift.coefficients.data(), uplift.resolution, uplift.z_factor, uplift.z_offset};
    data.wavelengths = std::make_unique<const WavelengthTable>(make_wavelengths(sensor, palette.white()));
    const WavelengthTable& table = *data.wavelengths;
    view.wavelengths = table.quantile;
    view.sensor = {table.sensor[0], std::size(table.sensor) * std::size(table.sensor[0])};
    view.white = table.lookup_white;
    for (size_t i = 0; i < 9; i++)
        view.sensor_matrix[i] = sensor.output_from_sensor[i / 3][i % 3];
}

void fill_settings(SceneData& data, const SceneInputs& in) {
    SettingsView& view = data.view.settings;
    view.integrator = in.integrator;
    view.seed = in.seed;
    view.clamp_direct = in.clamp_direct > 0 ? in.clamp_direct : Unclamped;
    view.clamp_indirect = in.clamp_indirect > 0 ? in.clamp_indirect : Unclamped;
    view.max_depth = in.max_depth;
    view.light_samples = std::max(in.light_samples, 1);
    view.interreflection = in.interreflection;
    for (const bsdf::MaterialCode& m : data.materials)
        view.keeps_ratios |= m.dispersive;
    data.aov_is_color.assign(in.aov_is_color.begin(), in.aov_is_color.end());
    view.aov_is_color = data.aov_is_color;
}

// By which of `wanted` expressions mean all of some lights.
LightNames names_of(std::span<const scene::Light* const> lights, const std::vector<std::string>& wanted) {
    LightNames names;
    for (const std::string& name : wanted)
        if (!lights.empty() && std::ranges::all_of(lights, [&](const scene::Light* light) {
                return light->name == name || scene::is_word_of(name, light->group);
            }))
            names.push_back(name);
    return names;
}

// Lights that no expression tells apart are of one class.
void fill_expressions(SceneData& data, const SceneInputs& in) {
    if (in.expressions.empty())
        return;
    std::vector<std::string> wanted;
    for (const std::string& text : in.expressions)
        for (std::string& name : names_in_path_expression(text))
            wanted.push_back(std::move(name));
    std::ranges::sort(wanted);
    wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
    std::vector<LightNames> classes{{}, {}}; // what shines of itself; lights without a name
    const auto class_of = [&](std::span<const scene::Light* const> lights) {
        LightNames names = names_of(lights, wanted);
        const size_t at = size_t(std::find(classes.begin() + 1, classes.end(), names) - classes.begin());
        if (at == classes.size())
            classes.push_back(std::move(names));
        return uint8_t(at);
    };
    auto all = std::make_unique<PathExpressions>();
    std::vector<const scene::Light*> ambient, constant, picture;
    for (const scene::Light& light : in.lights)
        if (light.kind == scene::Light::Kind::Ambient)
            ambient.push_back(&light);
        else if (light.kind == scene::Light::Kind::Environment)
            (light.texture.empty() && !light.table ? constant : picture).push_back(&light);
    picture.resize(std::min(picture.size(), size_t(1)));
    static_assert(LightId::Least == LightId::Unnamed && LightId::Ambient == LightId::Unnamed + 1 &&
                  LightId::Constant == LightId::Ambient + 1 && LightId::Picture == LightId::Constant + 1 &&
                  LightId::Surface == LightId::Picture + 1);
    all->class_of_light = {1, class_of(ambient), class_of(constant), class_of(picture), 0};
    for (const AnalyticLight& light : data.view.lights.analytic) {
        const scene::Light* const one[] = {&in.lights[size_t(light.source)]};
        all->class_of_light.push_back(class_of(one));
    }
    for (const std::string& text : in.expressions)
        all->automata.push_back(compile_path_expression(text, classes));
    all->first_channel = int(data.aov_is_color.size()) - 3 * int(in.expressions.size());
    data.expressions = std::move(all);
    data.view.settings.expressions = data.expressions.get();
}

} // namespace

SceneData::SceneData(const SceneInputs& in, Journal& journal) {
    color::Palette rec709;
    color::Palette& palette = in.palette ? *in.palette : rec709;
    fill_geometry(*this, in);
    fill_spectra(*this, in, palette);
    view.camera = in.camera;
    fill_settings(*this, in);
    fill_media(*this, *in.store, in.volume_depth, journal);
    fill_lights(*this, in, palette, journal);
    fill_expressions(*this, in);
    spectra = palette.tables(); // those of lights are there now
    view.spectra.tables = spectra;
}

} // namespace kanuka::transport
