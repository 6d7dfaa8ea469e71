#include "shade/material.h"

#include <algorithm>

#include "grid/lobe_table.h"
#include "shade/area_light.h"
#include "shade/opacity.h"

namespace kanuka::shade {

int add_emission(grid::LayeringProgram& program) {
    const grid::LobeInput& radiance =
        grid::lobe(grid::LobeId::DiffuseEmission).inputs[grid::EmissionRadiance];
    program.slots.push_back(
        {radiance.type, radiance.storage, radiance.low, radiance.high, true, "arealight.radiance"});
    const int slot = int(program.slots.size()) - 1;
    const int surface = int(program.nodes.size()) - 1; // -1 where the surface has no lobes at all
    grid::LayerNode emission;
    emission.lobe = grid::LobeId::DiffuseEmission;
    emission.name = "arealight";
    emission.inputs.assign(grid::lobe(emission.lobe).inputs.size(), -1);
    emission.inputs[grid::EmissionRadiance] = slot;
    program.nodes.push_back(emission);
    if (surface >= 0) {
        grid::LayerNode add;
        add.op = grid::LayerOp::Add;
        add.name = "arealight.add";
        add.upper = surface + 1;
        add.lower = surface;
        program.nodes.push_back(add);
    }
    return slot;
}

void add_lit_by(grid::LayeringProgram& program, const std::vector<bool>& lights) {
    const grid::LobeInput& radiance =
        grid::lobe(grid::LobeId::DiffuseEmission).inputs[grid::EmissionRadiance];
    for (size_t i = 0; i < lights.size(); i++)
        if (lights[i]) {
            program.lit_by.push_back({int(i), int(program.slots.size())});
            program.slots.push_back({radiance.type, radiance.storage, radiance.low, radiance.high, false,
                                     "lit by " + std::to_string(i)});
        }
}

void add_aovs(grid::LayeringProgram& program, const sl::Instance& surface,
              const std::vector<std::string>& wanted) {
    const std::span<const sl::Parameter> parameters = surface.shader().parameters();
    for (const std::string& name : surface.aovs()) {
        const auto found = std::find(wanted.begin(), wanted.end(), name);
        const auto parameter = std::find_if(parameters.begin(), parameters.end(),
                                            [&](const sl::Parameter& p) { return p.name == name; });
        if (found == wanted.end() || parameter == parameters.end())
            continue;
        add_aov(program, int(found - wanted.begin()), name,
                parameter->type == sl::Type::Color ? scene::Type::Color : scene::Type::Float,
                sl::components(parameter->type));
    }
}

// One slot a component, of values that come with their components together.
static void fill_aovs(const grid::LayeringProgram& program, const std::vector<grid::SlotValues>& values,
                      grid::VertexInputs& out) {
    for (size_t a = 0; a < values.size() && a < program.aovs.size(); a++)
        for (int c = 0; c < program.aovs[a].components; c++) {
            grid::SlotValues& slot = out.slots[size_t(program.aovs[a].slots[size_t(c)])];
            slot.uniform = values[a].uniform;
            slot.value = Vec3f(values[a].value[c], 0, 0);
            slot.data.clear();
            const ptrdiff_t stride = out.stride;
            if (!slot.uniform)
                slot.data.assign(values[a].data.begin() + c * stride,
                                 values[a].data.begin() + (c + 1) * stride);
        }
}

MaterialImpl::MaterialImpl(std::shared_ptr<const MaterialCore> core, Own own, Textures& textures,
                           Journal& journal, uint64_t hash)
    : m_core(std::move(core)), m_own(std::move(own)), m_textures(textures), m_journal(journal), m_hash(hash),
      m_eye(m_own.spaces.eye()) {}

Digest MaterialImpl::Own::digest_of(const SpacesRead& read) const {
    Digester d;
    Spaces of_shader = spaces;
    for (const Transform* t :
         {&spaces.current_from_shader, &displacement_from_shader, &area_light_from_shader}) {
        of_shader.current_from_shader = *t;
        d(of_shader.digest_of(read));
    }
    return d.digest();
}

Digest MaterialImpl::digest_of(const SpacesRead& read) const {
    Digester d;
    d(m_own.digest_of(read));
    for (const std::string& name : read.files)
        d(name, m_textures.identity(name));
    return d.digest();
}

SpacesRead MaterialImpl::reads_spaces() const {
    SpacesRead read = m_core->read;
    read.eye |= reads_displacing().eye || reads_shading().eye;
    return read;
}

bool MaterialImpl::displaces() const {
    return m_core->displacement || m_core->surface->displaces();
}

bool MaterialImpl::emission_varies() const {
    return m_core->light_varies || m_core->surface->emission_varies(m_own.varying_color_or_opacity);
}

bool MaterialImpl::uniform() const {
    if (m_core->light_varies || std::ranges::any_of(m_own.primvar_aovs, &PrimvarAov::varying))
        return false;
    // Presence of a varying Os may be added here, to a surface that is uniform itself.
    if (m_core->presence_slot >= 0 && m_own.varying_color_or_opacity)
        return false;
    return m_core->surface->uniform_material(m_own.varying_color_or_opacity);
}

// A displacement shader moves what a class displaces then.
grid::Reads MaterialImpl::reads_displacing() const {
    const grid::Reads none, surface = m_core->surface->reads_displacing();
    const grid::Reads shader = m_core->displacement ? m_core->displacement->reads_displacing() : none;
    return both(shader, surface, shader.rings + surface.rings);
}

grid::Reads MaterialImpl::reads_shading() const {
    grid::Reads all = m_core->surface->reads_shading();
    if (m_core->area_light) {
        const grid::Reads r = m_core->area_light->reads_shading();
        all = both(all, r, std::max(all.rings, r.rings));
    }
    return all;
}

sl::GridGlobals MaterialImpl::globals(const grid::Grid& grid) const {
    sl::GridGlobals g;
    g.Cs = m_own.color;
    g.Os = m_own.opacity;
    g.E = m_eye;
    if (const grid::Stencils* s = grid.stencils.get(); s && s->own > 0) {
        double du = 0, dv = 0;
        for (size_t i = 0; i < size_t(s->own); i++)
            du += double(s->step_u[i]), dv += double(s->step_v[i]);
        g.du = float(du / s->own), g.dv = float(dv / s->own);
        return g;
    }
    if (grid.nv == 0) // vertices of a mesh: no neighbours are beside them
        return g;
    // Boundary vertices may have been moved along their edge to meet a neighbour; the middle row and column
    // have not.
    const int row = grid.nv / 2 * (grid.nu + 1), column = grid.nu / 2, pitch = grid.nu + 1;
    if (grid.nu > 0)
        g.du = (grid.u[size_t(row + grid.nu)] - grid.u[size_t(row)]) / float(grid.nu);
    if (grid.nv > 0)
        g.dv = (grid.v[size_t(column + grid.nv * pitch)] - grid.v[size_t(column)]) / float(grid.nv);
    return g;
}

static void note(const MaterialServices& services, SpacesLog* log) {
    if (log)
        log->add(services.read());
}

void MaterialImpl::displace(grid::Grid& grid, SpacesLog* log) const {
    // A displacement shader comes first; a class surface then displaces what it left.
    const sl::GridGlobals g = globals(grid);
    if (m_core->displacement) {
        Spaces spaces = m_own.spaces;
        spaces.current_from_shader = m_own.displacement_from_shader;
        MaterialServices services(spaces, m_own.facts, m_textures, m_journal, m_own.displacement_where);
        m_core->displacement->displace(grid, g, services);
        note(services, log);
    }
    if (m_core->surface->displaces()) {
        MaterialServices services(m_own.spaces, m_own.facts, m_textures, m_journal, m_own.surface_where);
        m_core->surface->displace(grid, g, services);
        note(services, log);
    }
}

// What one light more makes the surface shine with, light by light: in front of each shadows are traced.
void MaterialImpl::shade_by_lights(grid::Grid& grid, const sl::GridGlobals& globals,
                                   MaterialServices& services, grid::VertexInputs& out) const {
    const int slot = m_core->program.emission()->inputs[grid::EmissionRadiance];
    const auto at = [&](const grid::SlotValues& v, size_t c, size_t i) {
        return v.uniform ? v.value[int(c)] : v.data[c * size_t(grid.stride) + i];
    };
    for (const grid::LitBy& one : m_core->program.lit_by) {
        std::vector<bool> wanted = m_core->wanted_lights;
        wanted[size_t(one.light)] = true;
        services.want_lights(&wanted);
        grid::Grid again = grid; // shading may turn normals
        grid::VertexInputs lit;
        m_core->surface->shade(again, globals, services, lit);
        const grid::SlotValues &with = lit.slots[size_t(slot)], &without = out.slots[size_t(slot)];
        grid::SlotValues& more = out.slots[size_t(one.slot)];
        more.uniform = with.uniform && without.uniform;
        for (int c = 0; c < 3; c++)
            more.value[c] = std::max(with.value[c] - without.value[c], 0.0f);
        if (more.uniform)
            continue;
        more.data.assign(3 * size_t(grid.stride), 0.0f);
        for (size_t c = 0; c < 3; c++)
            for (size_t i = 0; i < size_t(grid.vertices()); i++)
                more.data[c * size_t(grid.stride) + i] = std::max(at(with, c, i) - at(without, c, i), 0.0f);
    }
    services.want_lights(nullptr);
}

void MaterialImpl::shade(grid::Grid& grid, grid::VertexInputs& out, SpacesLog* log) const {
    MaterialServices services(m_own.spaces, m_own.facts, m_textures, m_journal, m_own.surface_where,
                              m_core->ranges.get());
    const sl::GridGlobals g = globals(grid);
    if (!m_core->program.lit_by.empty())
        services.want_lights(&m_core->wanted_lights);
    if (m_core->surface_aovs == 0) {
        m_core->surface->shade(grid, g, services, out);
        out.slots.resize(m_core->program.slots.size());
    } else {
        std::vector<grid::SlotValues> values;
        m_core->surface->shade_with_aovs(grid, g, services, out, values);
        out.slots.resize(m_core->program.slots.size());
        fill_aovs(m_core->program, values, out);
    }
    for (size_t k = m_core->surface_aovs; k < m_core->program.aovs.size(); k++)
        for (const PrimvarAov& aov : m_own.primvar_aovs)
            if (aov.index == m_core->program.aovs[k].index)
                fill_primvar_aov(aov, m_core->program.aovs[k], grid, m_own.spaces.current_from_object, out);
    if (!m_core->program.lit_by.empty())
        shade_by_lights(grid, g, services, out);
    if (m_core->emission_slot >= 0) {
        grid::SlotValues& radiance = out.slots[size_t(m_core->emission_slot)];
        radiance.uniform = true;
        radiance.value = m_core->emission;
        if (m_core->light_varies) {
            Spaces spaces = m_own.spaces;
            spaces.current_from_shader = m_own.area_light_from_shader;
            MaterialServices of_light(spaces, m_own.facts, m_textures, m_journal, m_own.area_light_where);
            radiance.uniform = false;
            radiance.data = run_area_light(*m_core->area_light, grid, g, of_light).Cl;
            note(of_light, log);
        }
    }
    if (m_core->presence_slot >= 0)
        fill_presence(grid, m_own.opacity, out.slots[size_t(m_core->presence_slot)]);
    note(services, log);
}

} // namespace kanuka::shade
