// Running the displacement stage: what it moves, and what it leaves for the surface.
#include <algorithm>

#include "sl/shader.h"

namespace kanuka::sl {

void InstanceImpl::displace(grid::Grid& grid, const GridGlobals& globals, Services& services) const {
    if (!displaces())
        return;
    const ir::Variant variant = variant_for(grid);
    const BuiltStage& built = m_shader->build(variant).displace;
    // Results go beside the grid: the stage reads its neighbours' old positions to the end.
    std::vector<std::vector<float>> moved(built.stage.outputs.size());
    std::vector<float*> outputs(built.stage.outputs.size() * 16, nullptr);
    const ir::Program& p = m_shader->program();
    const auto components_of = [&](const ir::Output& o) {
        return o.kind == ir::Output::Carried ? size_t(p.places[size_t(o.index)].count) : size_t(3);
    };
    for (size_t k = 0; k < moved.size(); k++) {
        const ir::Output& o = built.stage.outputs[k];
        if (o.var < 0)
            continue;
        if (o.kind != ir::Output::Carried)
            moved[k] = o.kind == ir::Output::Position ? grid.P : grid.N;
        moved[k].resize(size_t(grid.stride) * components_of(o) + 32);
        for (size_t c = 0; c < components_of(o); c++)
            outputs[k * 16 + c] = moved[k].data() + c * size_t(grid.stride);
    }
    run(built, variant, grid, globals, services, outputs);
    for (size_t k = 0; k < moved.size(); k++) {
        const ir::Output& o = built.stage.outputs[k];
        if (o.var < 0)
            continue;
        const size_t components = components_of(o), stride = size_t(grid.stride);
        moved[k].resize(stride * components);
        if (o.kind != ir::Output::Carried) {
            (o.kind == ir::Output::Position ? grid.P : grid.N).swap(moved[k]);
            continue;
        }
        if (!built.stage.vars[size_t(o.var)].varying)
            for (size_t c = 0; c < components; c++)
                std::fill_n(moved[k].begin() + ptrdiff_t(c * stride), stride, moved[k][c * stride]);
        const std::string& name = p.parameters[size_t(o.index)].name;
        std::erase_if(grid.primvars, [&](const grid::Channel& c) { return c.name == name; });
        grid.primvars.push_back({name, int(components), grid.stride, std::move(moved[k])});
    }
}

// A grid that was not displaced has no members to take over: displacement runs for them, on a copy.
void InstanceImpl::carry_members(grid::Grid& grid, const GridGlobals& globals, Services& services) const {
    const ir::Program& p = m_shader->program();
    const auto has = [&](const ir::Output& o) {
        return o.kind != ir::Output::Carried ||
               std::ranges::any_of(grid.primvars, [&](const grid::Channel& c) {
                   return c.name == p.parameters[size_t(o.index)].name;
               });
    };
    if (std::ranges::all_of(p.displace.outputs, has))
        return;
    grid::Grid copy = grid;
    displace(copy, globals, services);
    grid.primvars = std::move(copy.primvars);
}

} // namespace kanuka::sl
