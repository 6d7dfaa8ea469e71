// Running light, volume and imager shaders, whose results are colours and not materials.
#include "sl/shader.h"

namespace kanuka::sl {

// Runs a stage whose outputs are numbers and triples; all of them come back as three arrays, one value a
// vertex.
std::vector<std::vector<float>> InstanceImpl::run_whole(const BuiltStage& built, const ir::Variant& variant,
                                                        grid::Grid& points, const GridGlobals& globals,
                                                        Services& services) const {
    const ir::Stage& stage = built.stage;
    const size_t stride = size_t(points.stride), count = size_t(points.vertices());
    std::vector<std::vector<float>> values(stage.outputs.size());
    std::vector<float*> outputs(stage.outputs.size() * 16, nullptr);
    for (size_t k = 0; k < stage.outputs.size(); k++) {
        values[k].assign(3 * stride + 32, 0.0f);
        for (size_t c = 0; c < 16; c++)
            outputs[k * 16 + c] = values[k].data() + std::min(c, size_t(2)) * stride;
    }
    run(built, variant, points, globals, services, outputs);
    for (size_t k = 0; k < stage.outputs.size(); k++) {
        const int var = stage.outputs[k].var;
        if (var < 0 || stage.vars[size_t(var)].varying)
            continue;
        for (size_t c = 0; c < 3; c++)
            std::fill_n(values[k].begin() + ptrdiff_t(c * stride), count, values[k][c * stride]);
    }
    return values;
}

Emission InstanceImpl::emit(grid::Grid& points, const GridGlobals& globals, Services& services) const {
    Emission result;
    const size_t stride = size_t(points.stride);
    if (!m_shader->program().light.root) {
        result.Cl.assign(3 * stride, 0.0f);
        return result;
    }
    const ir::Variant variant = variant_for(points);
    const BuiltStage& built = m_shader->build(variant).light;
    std::vector<std::vector<float>> values = run_whole(built, variant, points, globals, services);
    // All but Cl belong to the light: the first vertex speaks for them.
    const auto first = [&](ir::Emission what) -> const std::vector<float>& { return values[size_t(what)]; };
    const auto triple = [&](ir::Emission what) {
        return Vec3f(first(what)[0], first(what)[stride], first(what)[2 * stride]);
    };
    result.form = Emission::Form(int(first(ir::Emission::Form)[0]));
    result.from = triple(ir::Emission::From);
    result.axis = triple(ir::Emission::Axis);
    result.angle = first(ir::Emission::Angle)[0];
    const ir::Stage& stage = built.stage;
    const int Cl = stage.outputs[size_t(ir::Emission::Color)].var;
    result.uniform = Cl >= 0 && !stage.vars[size_t(Cl)].varying;
    result.Cl = std::move(values[size_t(ir::Emission::Color)]);
    return result;
}

Filtered InstanceImpl::filter(grid::Grid& points, const GridGlobals& globals, Services& services) const {
    if (!m_shader->program().filter.root) {
        const std::vector<float> nothing(3 * size_t(points.stride), 0.0f);
        return {nothing, nothing, nothing};
    }
    const ir::Variant variant = variant_for(points);
    const BuiltStage& built = m_shader->build(variant).filter;
    std::vector<std::vector<float>> values = run_whole(built, variant, points, globals, services);
    return {std::move(values[0]), std::move(values[1]), std::move(values[2])};
}

} // namespace kanuka::sl
