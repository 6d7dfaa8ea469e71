#include "render/lighting.h"

#include <algorithm>

#include "render/air.h"
#include "render/light_pictures.h"
#include "render/pixel_filter.h"
#include "scene/digest.h"
#include "scene/shutter.h"
#include "shade/lights.h"

namespace kanuka::render {

void Lighting::build() {
    gather_lights();
    transport::SceneInputs& in = m_inputs;
    const ColorSetup& color = m_world.color();
    in.palette = color.palette.get();
    in.sensor = &color.sensor;
    load_environment(in, color.palette->space(), m_job.journal);
    load_tables(in, color.palette->space(), m_job.journal);
    in.render_from_world = m_world.camera().render_from_world;
    in.camera = m_world.camera().view;
    in.camera.motion = m_world.camera().motion;
    if (const auto fault = scene::fault_of_opening(m_job.options.shutter_opening))
        m_job.journal.warning(m_job.where(), "the shutter's opening is not used: " + *fault);
    else
        m_shutter_quantiles = scene::shutter_quantiles(m_job.options.shutter_opening);
    in.camera.shutter_quantiles = m_shutter_quantiles;
    place_filter();
    in.integrator = m_job.integrator;
    in.clamp_direct = m_job.options.clamp_direct;
    in.clamp_indirect = m_job.options.clamp_indirect;
    in.max_depth = m_job.options.max_depth;
    in.volume_depth = m_job.options.volume_depth;
    in.light_samples = m_job.options.light_samples;
    in.interreflection = !m_world.classic();
    in.seed = m_job.options.seed;
    refresh();
    m_world.shading().check_air(m_world.bvh().bounds());
}

Digest Lighting::key() const {
    const transport::LatLong& map = m_inputs.map;
    Digester of;
    of(m_inputs.lights, map.width, map.height, map.rgb);
    for (const transport::AreaLight& light : m_inputs.area_lights) {
        of(light.lobes.diffuse, light.lobes.specular);
        if (!m_inputs.expressions.empty()) // which alone know their names
            of(light.label.name, light.label.group);
    }
    return of.digest();
}

void Lighting::gather_lights() {
    shade::ShadingSystem& shading = m_world.shading();
    std::vector<scene::Light>& lights = m_inputs.lights;
    lights = m_job.scene.lights;
    for (scene::Light& l : lights)
        shading.find_files(l);
    std::vector<scene::ShaderRef> light_shaders = m_job.scene.light_shaders;
    for (scene::ShaderRef& ref : light_shaders)
        if (!m_world.classic() && !ref.shadows)
            ref.shadows = true;
    for (scene::Light& l : shading.lights(light_shaders, m_world.bounds()))
        lights.push_back(std::move(l));
    const ColorSetup& color = m_world.color();
    for (scene::Light& l : lights)
        shade::resolve_light_color(l, *color.palette, color.folders, m_job.journal);
    m_world.linking().apply(lights);
}

void Lighting::place_filter() {
    m_filter = make_filter(m_job.options, m_job.where(), m_job.journal);
    const film::Filter::Cells& cells = m_filter->cells();
    transport::FilterView& filter = m_inputs.camera.filter;
    filter.cells = {cells.nx,
                    cells.ny,
                    cells.rows.data(),
                    cells.cells.data(),
                    cells.weight.data(),
                    {cells.width[0], cells.width[1]}};
    filter.x = m_filter->table_x();
    filter.y = m_filter->table_y();
    if (m_filter->has_weights()) {
        filter.signs_x = m_filter->weight_x();
        filter.signs_y = m_filter->weight_y();
    }
}

void Lighting::refresh() {
    place_lamps();
    const Geometry& geometry = m_world.geometry();
    m_inputs.aov_is_color = m_job.aovs.is_color();
    m_inputs.expressions = m_job.aovs.expressions();
    m_inputs.area_lights = m_world.linking().area_lights();
    m_inputs.store = &geometry.store;
    m_inputs.bvh = &m_world.bvh();
    m_inputs.groups = geometry.groups;
    m_inputs.instanced = geometry.instanced;
    m_inputs.variations = geometry.variations;
    m_inputs.moving = geometry.moving;
    m_inputs.fades = geometry.fades;
    m_data = transport::SceneData(m_inputs, m_job.journal);
    m_data.view.settings.footprints = m_footprints;
    if (m_world.shading().has_air() && !m_data.view.media.airs.empty())
        m_air = make_air(m_world.shading(), m_world.bvh(), m_linked_lamps, m_data.view, m_inputs.lights);
    m_data.view.media.air = m_air.get();
    m_job.stats->bytes.textures = m_world.shading().texture_bytes();
    m_job.stats->count.textures_made = m_world.shading().textures_made();
}

// Lights that shaders are told of, for what is in their way.
void Lighting::place_lamps() {
    m_air.reset();
    m_inputs.point_lights.clear();
    const auto lit = [](const grid::LayeringProgram& p) { return !p.lit_by.empty(); };
    if (!m_world.shading().has_air() && std::ranges::none_of(m_world.geometry().store.programs(), lit))
        return;
    const std::vector<shade::Lamp> lamps = m_world.shading().lamps();
    std::vector<scene::Light> lights;
    for (const shade::Lamp& lamp : lamps)
        lights.push_back(lamp.light);
    m_world.linking().apply(lights);
    const Transform& render_from_world = m_world.camera().render_from_world;
    for (size_t i = 0; i < lamps.size(); i++)
        m_inputs.point_lights.push_back({lamps[i].far ? render_from_world.vector(lamps[i].place)
                                                      : render_from_world.point(lamps[i].place),
                                         lamps[i].far, lights[i].passes});
    m_linked_lamps = std::move(lights);
}

} // namespace kanuka::render
