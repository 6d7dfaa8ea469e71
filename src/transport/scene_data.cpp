#include "transport/scene_data.h"

#include <algorithm>

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
    spectra = palette.tables(); // those of lights are there now
    view.spectra.tables = spectra;
}

} // namespace kanuka::transport
