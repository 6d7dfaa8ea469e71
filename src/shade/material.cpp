#include "shade/material.h"

#include "shade/opacity.h"

namespace kanuka::shade {

int add_emission(grid::LayeringProgram& program) {
    const grid::LobeInput& radiance = grid::lobe(grid::LobeId::DiffuseEmission).inputs[0];
    program.slots.push_back(
        {radiance.type, radiance.storage, radiance.low, radiance.high, true, "arealight.radiance"});
    const int slot = int(program.slots.size()) - 1;
    const int surface = int(program.nodes.size()) - 1; // -1 where the surface has no lobes at all
    grid::LayerNode emission;
    emission.lobe = grid::LobeId::DiffuseEmission;
    emission.name = "arealight";
    emission.inputs = {slot};
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

MaterialImpl::MaterialImpl(std::shared_ptr<const MaterialCore> core, Own own, Textures& textures,
                           Journal& journal, uint64_t hash)
    : m_core(std::move(core)), m_own(std::move(own)), m_textures(textures), m_journal(journal), m_hash(hash),
      m_eye(m_own.spaces.eye()) {}

bool MaterialImpl::displaces() const {
    return m_core->displacement || m_core->surface->displaces();
}

bool MaterialImpl::uniform() const {
    // Presence of a varying Os may be added here, to a surface that is uniform itself.
    if (m_core->presence_slot >= 0 && m_own.varying_color_or_opacity)
        return false;
    return m_core->surface->uniform_material(m_own.varying_color_or_opacity);
}

sl::GridGlobals MaterialImpl::globals(const grid::Grid& grid) const {
    sl::GridGlobals g;
    g.Cs = m_own.color;
    g.Os = m_own.opacity;
    g.E = m_eye;
    // Boundary vertices may have been moved along their edge to meet a neighbour; the middle row and column
    // have not.
    const int row = grid.nv / 2 * (grid.nu + 1), column = grid.nu / 2, pitch = grid.nu + 1;
    if (grid.nu > 0)
        g.du = (grid.u[size_t(row + grid.nu)] - grid.u[size_t(row)]) / float(grid.nu);
    if (grid.nv > 0)
        g.dv = (grid.v[size_t(column + grid.nv * pitch)] - grid.v[size_t(column)]) / float(grid.nv);
    return g;
}

void MaterialImpl::displace(grid::Grid& grid) const {
    // A displacement shader comes first; a class surface then displaces what it left.
    const sl::GridGlobals g = globals(grid);
    if (m_core->displacement) {
        Spaces spaces = m_own.spaces;
        spaces.current_from_shader = m_own.displacement_from_shader;
        MaterialServices services(spaces, m_own.facts, m_textures, m_journal, m_own.displacement_where);
        m_core->displacement->displace(grid, g, services);
    }
    if (m_core->surface->displaces()) {
        MaterialServices services(m_own.spaces, m_own.facts, m_textures, m_journal, m_own.surface_where);
        m_core->surface->displace(grid, g, services);
    }
}

void MaterialImpl::shade(grid::Grid& grid, grid::VertexInputs& out) const {
    MaterialServices services(m_own.spaces, m_own.facts, m_textures, m_journal, m_own.surface_where);
    m_core->surface->shade(grid, globals(grid), services, out);
    out.slots.resize(m_core->program.slots.size());
    if (m_core->emission_slot >= 0) {
        grid::SlotValues& radiance = out.slots[size_t(m_core->emission_slot)];
        radiance.uniform = true;
        radiance.value = m_core->emission;
    }
    if (m_core->presence_slot >= 0)
        fill_presence(grid, m_own.opacity, out.slots[size_t(m_core->presence_slot)]);
}

} // namespace kanuka::shade
