#include "transport/scene_data.h"

#include <algorithm>

#include "scene/schema/parameter.h"
#include "transport/lights_setup.h"
#include "transport/media_setup.h"
#include "transport/roulette_pilot.h"

namespace kanuka::transport {

namespace {

void fill_geometry(SceneData& data, const SceneInputs& in) {
    GeometryView& view = data.view.geometry;
    static const store::ShapeRecord no_shape{};
    view.shapes =
        reinterpret_cast<const int32_t*>(in.store->shapes().empty() ? &no_shape : in.store->shapes().data());
    view.emitters = in.store->emitters().data();
    view.links = in.store->links().data();
    view.ray_query = RayQuery(in.bvh);
    view.instanced = in.instanced;
    view.variations = in.variations.empty() ? nullptr : in.variations.data();
    view.moving = in.moving || !in.camera.motion.empty();
    view.fades = in.fades;
    for (size_t i = 0; i < in.store->programs().size(); i++)
        data.materials.emplace_back(in.store->programs()[i], in.store->words(int(i)));
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

// Lights that no expression tells apart are of one class.
class LightClasses {
  public:
    explicit LightClasses(const std::vector<std::string>& expressions) {
        for (const std::string& text : expressions)
            for (std::string& name : names_in_path_expression(text))
                m_wanted.push_back(std::move(name));
        std::ranges::sort(m_wanted);
        m_wanted.erase(std::unique(m_wanted.begin(), m_wanted.end()), m_wanted.end());
    }
    uint8_t of(std::span<const LightLabel> lights) {
        LightNames names = names_of(lights);
        const size_t at =
            size_t(std::find(m_classes.begin() + 1, m_classes.end(), names) - m_classes.begin());
        if (at == m_classes.size())
            m_classes.push_back(std::move(names));
        return uint8_t(at);
    }
    const std::vector<LightNames>& all() const { return m_classes; }

  private:
    // By which expressions mean all of some lights.
    LightNames names_of(std::span<const LightLabel> lights) const {
        LightNames names;
        for (const std::string& name : m_wanted)
            if (!lights.empty() && std::ranges::all_of(lights, [&](const LightLabel& light) {
                    return light.name == name || scene::is_word_of(name, light.group);
                }))
                names.push_back(name);
        return names;
    }

    std::vector<std::string> m_wanted;
    std::vector<LightNames> m_classes{{}, {}}; // what shines of itself; lights without a name
};

// Of each emitter of the store. Area lights are lights; all else that emits shines of itself, and is 0.
std::vector<int32_t> area_lights_of_emitters(const store::Store& store) {
    std::vector<int32_t> of_emitter(store.emitters().size(), 0);
    for (int s = 0; s < int(store.shapes().size()); s++) {
        const store::ShapeRecord& shape = store.shapes()[size_t(s)];
        if (shape.emitter >= 0)
            std::fill_n(of_emitter.begin() + shape.emitter, store::emitter_count(shape),
                        std::max(store.links_of(s).area_light, 0));
    }
    return of_emitter;
}

std::vector<uint8_t> classes_of_emitters(const SceneInputs& in, LightClasses& classes) {
    std::vector<uint8_t> of_light{0}, of_emitter;
    for (const AreaLight& light : in.area_lights)
        of_light.push_back(classes.of(std::span(&light.label, 1)));
    for (const int32_t light : area_lights_of_emitters(*in.store))
        of_emitter.push_back(of_light[size_t(light)]);
    return of_emitter;
}

// Constant environments are one light to transport, and so are pictures: the first's multipliers are all
// theirs.
LobeMultipliers multipliers_of_environment(const SceneInputs& in, bool picture, Journal& journal) {
    const LobeMultipliers* first = nullptr;
    for (const scene::Light& light : in.lights) {
        if (light.kind != scene::Light::Kind::Environment ||
            picture != (!light.texture.empty() || light.table != nullptr))
            continue;
        if (first && *first != light.lobes)
            journal.warning(light.where, "environments that differ in \"diffuse\" or \"specular\" are shown "
                                         "as the first of them says");
        else if (!first)
            first = &light.lobes;
    }
    return first ? *first : LobeMultipliers();
}

void fill_multipliers(SceneData& data, const SceneInputs& in, Journal& journal) {
    const auto has_none = [](const auto& light) { return light.lobes.none(); };
    if (std::ranges::all_of(in.lights, has_none) && std::ranges::all_of(in.area_lights, has_none))
        return;
    auto all = std::make_unique<LightMultipliers>();
    all->of_light.assign(size_t(-LightId::Least), {});
    all->of_light[LightId::Constant - LightId::Least] = multipliers_of_environment(in, false, journal);
    all->of_light[LightId::Picture - LightId::Least] = multipliers_of_environment(in, true, journal);
    for (const AnalyticLight& light : data.view.lights.analytic)
        all->of_light.push_back(in.lights[size_t(light.source)].lobes);
    all->of_area_light.emplace_back();
    for (const AreaLight& light : in.area_lights)
        all->of_area_light.push_back(light.lobes);
    all->area_light = area_lights_of_emitters(*in.store);
    data.multipliers = std::move(all);
    data.view.lights.multipliers = data.multipliers.get();
}

void fill_expressions(SceneData& data, const SceneInputs& in) {
    if (in.expressions.empty())
        return;
    LightClasses classes(in.expressions);
    auto all = std::make_unique<PathExpressions>();
    std::vector<LightLabel> ambient, constant, picture;
    for (const scene::Light& light : in.lights)
        if (light.kind == scene::Light::Kind::Ambient)
            ambient.push_back({light.name, light.group});
        else if (light.kind == scene::Light::Kind::Environment)
            (light.texture.empty() && !light.table ? constant : picture).push_back({light.name, light.group});
    picture.resize(std::min(picture.size(), size_t(1)));
    static_assert(LightId::Least == LightId::Unnamed && LightId::Ambient == LightId::Unnamed + 1 &&
                  LightId::Constant == LightId::Ambient + 1 && LightId::Picture == LightId::Constant + 1 &&
                  LightId::Surface == LightId::Picture + 1);
    all->class_of_light = {1, classes.of(ambient), classes.of(constant), classes.of(picture), 0};
    for (const AnalyticLight& light : data.view.lights.analytic) {
        const scene::Light& source = in.lights[size_t(light.source)];
        const LightLabel label{source.name, source.group};
        all->class_of_light.push_back(classes.of(std::span(&label, 1)));
    }
    all->class_of_emitter = classes_of_emitters(in, classes);
    for (const std::string& text : in.expressions)
        all->automata.push_back(compile_path_expression(text, classes.all()));
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
    // What is learned will seldom say otherwise where nothing but the sky shines.
    view.settings.first_pairs = RoulettePilot::is_wanted(view.settings) && view.lights.choices == 0;
    fill_expressions(*this, in);
    fill_multipliers(*this, in, journal);
    spectra = palette.tables(); // those of lights are there now
    view.spectra.tables = spectra;
}

} // namespace kanuka::transport
