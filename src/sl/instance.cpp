#include <algorithm>
#include <cstring>
#include <deque>

#include "sl/shader.h"

namespace kanuka::sl {

InstanceImpl::InstanceImpl(std::shared_ptr<const ShaderImpl> shader, std::span<const Argument> arguments,
                           Services& services)
    : m_shader(std::move(shader)) {
    const ir::Program& p = m_shader->program();
    bind(arguments, services);
    const Build& b = m_shader->build({});
    if (b.defaults && !p.defaults.outputs.empty())
        run_once(b.defaults, services, nullptr);
    // What the defaults computed gives way to what was given.
    bind(arguments, services);
    for (const ir::Output& o : p.displace.outputs)
        if (o.kind == ir::Output::Carried)
            m_variant.params[size_t(o.index)] = true;
    m_members.assign(size_t(p.member_floats) + 1, 0.0f);
    m_member_texts.assign(size_t(p.member_strings) + 1, "");
    ops::MaterialBuild build;
    for (const auto& [name, lobe] : p.fixed_lobes) {
        ops::MaterialBuild::Node n;
        n.name = name;
        n.lobe = lobe;
        build.nodes.push_back(std::move(n));
    }
    if (b.init)
        run_once(b.init, services, &build);
    if (b.interior && build.has_interior)
        run_once(b.interior, services, &build);
    build_material(build, services);
    settle_presence(services);
}

// ---- running once: defaults, init, interior
// -----------------------------------------------------------------------------

void InstanceImpl::run_once(const BuiltStage& built, Services& services, ops::MaterialBuild* build) {
    const ir::Program& p = m_shader->program();
    ops::Runner runner{p, built.stage, services, 1, 1, build, {}, {}};
    std::vector<float> uniforms(size_t(built.plan.uniforms) + 16, 0.0f),
        scratch(size_t(built.plan.arrays + 1) * 16, 0.0f);
    std::vector<const char*> texts(size_t(built.plan.texts) + 1, "");
    std::vector<float> inputs(size_t(ir::Input::Count) * 3, 0.0f);
    std::vector<const float*> input_pointers(size_t(ir::Input::Count) * 3, scratch.data());
    std::vector<const float*> varying(size_t(p.floats) + 1, nullptr);
    std::vector<std::vector<float>> results(built.stage.outputs.size(), std::vector<float>(32, 0.0f));
    std::vector<float*> outputs(built.stage.outputs.size() * 16 + 1, nullptr);
    for (size_t k = 0; k < results.size(); k++)
        for (size_t c = 0; c < 16; c++)
            outputs[k * 16 + c] = results[k].data() + c;
    Frame f{};
    f.count = 1;
    f.stride = 16;
    f.uniforms = uniforms.data();
    f.texts = texts.data();
    f.scratch = scratch.data();
    f.inputs = input_pointers.data();
    f.uniform_inputs = inputs.data();
    f.params = m_params.data();
    f.param_texts = m_param_texts.data();
    f.varying_params = varying.data();
    f.members = m_members.data();
    f.member_texts = m_member_texts.data();
    f.channels = m_channels.data();
    f.outputs = outputs.data();
    f.host = &runner;
    call(built, f, runner);
    runner.report_faults();
    for (size_t k = 0; k < built.stage.outputs.size(); k++) {
        const ir::Output& o = built.stage.outputs[k];
        const bool member = o.kind == ir::Output::Member;
        const ir::Place& place = (member ? p.members : p.places)[size_t(o.index)];
        if (place.text) {
            const char* s;
            std::memcpy(static_cast<void*>(&s), results[k].data(), sizeof s);
            (member ? m_member_texts : m_param_texts)[size_t(place.offset)] =
                m_texts.emplace_back(s ? s : "").c_str();
        } else {
            const int n = ir::comps(built.stage.vars[size_t(o.var)].ty);
            std::copy_n(results[k].begin(), n,
                        (member ? m_members : m_params).begin() + place.offset + o.element * n);
        }
    }
}

// What a loop that does not end costs is bounded on every grid alike, so that pictures do not depend on which
// comes first; the first is told at once.
void InstanceImpl::call(const BuiltStage& built, Frame& frame, ops::Runner& runner) const {
    std::atomic<bool>& endless = m_shader->endless();
    frame.budget = ir::LoopBudget;
    frame.patience = ir::LoopPatience;
    built.run(&frame);
    if (frame.budget < 0 && !endless.exchange(true)) {
        runner.report_faults();
        runner.faults.clear();
    }
}

// ---- running over grids
// -----------------------------------------------------------------------------------------------------

// Homogeneous points serve as points.
static bool feeds(const grid::Channel& c, const ir::Place& place) {
    return c.components == place.count || (c.components == 4 && place.count == 3);
}
static grid::Channel divided_by_w(const grid::Channel& c) {
    grid::Channel point{c.name, 3, c.stride, std::vector<float>(size_t(c.stride) * 3 + 32)};
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < c.stride; i++) {
            const float w = c.component(3)[i];
            point.component(k)[i] = w != 0 ? c.component(k)[i] / w : c.component(k)[i];
        }
    return point;
}

ir::Variant InstanceImpl::variant_for(const grid::Grid& grid) const {
    ir::Variant v = m_variant;
    v.Cs = v.Os = false;
    for (const grid::Channel& c : grid.primvars) {
        v.Cs = v.Cs || (c.name == "Cs" && c.components == 3);
        v.Os = v.Os || (c.name == "Os" && c.components == 3);
        v.E = v.E || (c.name == "E" && c.components == 3 && m_shader->kind() == ShaderKind::Volume);
    }
    const ir::Program& p = m_shader->program();
    for (size_t i = 0; i < v.params.size(); i++) {
        bool found = false;
        for (const grid::Channel& c : grid.primvars)
            found = found || (c.name == m_primvars[i] && feeds(c, p.places[i]));
        v.params[i] = v.params[i] && found;
    }
    return v;
}

// What a stage reads of a grid: a pointer for each component that varies, a value for each that does not.
struct InstanceImpl::GridInputs {
    std::vector<float> uniform;
    std::vector<const float*> varying, parameters;
    std::deque<grid::Channel> divided; // points that were homogeneous
};

InstanceImpl::GridInputs InstanceImpl::inputs_of(const grid::Grid& grid, const GridGlobals& globals,
                                                 const ir::Variant& variant) const {
    const ir::Program& p = m_shader->program();
    GridInputs in;
    in.uniform.assign(size_t(ir::Input::Count) * 3, 0.0f);
    in.varying.assign(size_t(ir::Input::Count) * 3, nullptr);
    in.parameters.assign(size_t(p.floats) + 1, nullptr);
    const auto triple = [&](ir::Input i, const float* base, int64_t s) {
        for (int c = 0; c < 3; c++)
            in.varying[size_t(i) * 3 + size_t(c)] = base + c * s;
    };
    const auto uniform = [&](ir::Input i, const Vec3f& v) {
        for (int c = 0; c < 3; c++)
            in.uniform[size_t(i) * 3 + size_t(c)] = v[c];
    };
    using enum ir::Input;
    triple(P, grid.P.data(), grid.stride);
    triple(N, (grid.facets ? grid.Ng : grid.N).data(), grid.stride);
    triple(Ng, grid.Ng.data(), grid.stride);
    triple(dPdu, grid.dPdu.data(), grid.stride);
    triple(dPdv, grid.dPdv.data(), grid.stride);
    in.varying[size_t(u) * 3] = grid.u.data();
    in.varying[size_t(v) * 3] = grid.v.data();
    in.varying[size_t(s) * 3] = grid.s.data();
    in.varying[size_t(t) * 3] = grid.t.data();
    uniform(Cs, globals.Cs);
    uniform(Os, globals.Os);
    uniform(E, globals.E);
    uniform(time, Vec3f(globals.time));
    uniform(du, Vec3f(globals.du));
    uniform(dv, Vec3f(globals.dv));
    for (const grid::Channel& c : grid.primvars) {
        if (c.name == "Cs" && variant.Cs)
            triple(Cs, c.component(0), c.stride);
        if (c.name == "Os" && variant.Os)
            triple(Os, c.component(0), c.stride);
        if (c.name == "E" && variant.E)
            triple(E, c.component(0), c.stride);
        for (size_t i = 0; i < variant.params.size(); i++)
            if (variant.params[i] && c.name == m_primvars[i] && feeds(c, p.places[i])) {
                const bool divide = c.components != p.places[i].count;
                const grid::Channel& from = divide ? in.divided.emplace_back(divided_by_w(c)) : c;
                for (int k = 0; k < from.components; k++)
                    in.parameters[size_t(p.places[i].offset + k)] = from.component(k);
            }
    }
    return in;
}

void InstanceImpl::run(const BuiltStage& built, const ir::Variant& variant, grid::Grid& grid,
                       const GridGlobals& globals, Services& services,
                       const std::vector<float*>& outputs) const {
    const ir::Program& p = m_shader->program();
    const int vertices = grid.vertices();
    // Where neighbours do not count (a mesh, and no patch of one) any number of vertices is a grid: blocks
    // keep the scratch memory in the cache.
    constexpr int BlockSize = 2048;
    const bool mesh = grid.nv == 0, blocks = mesh && !grid.stencils;
    const int block = blocks ? std::min(vertices, BlockSize) : vertices;
    const int64_t stride = (block + 31) / 16 * 16;
    ops::Runner runner{p,       built.stage, services, mesh ? block : grid.nu + 1, mesh ? 1 : grid.nv + 1,
                       nullptr, {},          {},       grid.stencils.get()};
    const std::unique_ptr<float[]> scratch(new float[size_t(built.plan.arrays) * size_t(stride) + 16]);
    std::vector<float> uniforms(size_t(built.plan.uniforms) + 16, 0.0f);
    std::vector<const char*> texts(size_t(built.plan.texts) + 1, "");

    GridInputs in = inputs_of(grid, globals, variant);
    std::vector<float*> out = outputs;

    Frame f{};
    f.stride = stride;
    f.uniforms = uniforms.data();
    f.texts = texts.data();
    f.scratch = scratch.get();
    f.inputs = in.varying.data();
    f.uniform_inputs = in.uniform.data();
    f.params = m_params.data();
    f.param_texts = m_param_texts.data();
    f.varying_params = in.parameters.data();
    f.members = m_members.data();
    f.member_texts = m_member_texts.data();
    f.channels = m_channels.data();
    f.outputs = out.data();
    f.host = &runner;
    for (int begin = 0; begin < vertices; begin += block) {
        f.count = std::min(block, vertices - begin);
        if (blocks)
            runner.columns = f.count;
        call(built, f, runner);
        // On to the next block: everything that has a value a vertex.
        for (const float*& x : in.varying)
            x = x ? x + f.count : nullptr;
        for (const float*& x : in.parameters)
            x = x ? x + f.count : nullptr;
        for (size_t k = 0; k < out.size(); k++)
            if (out[k] && built.stage.vars[size_t(built.stage.outputs[k / 16].var)].varying)
                out[k] += f.count;
    }
    runner.report_faults();
}

void InstanceImpl::shade(grid::Grid& grid, const GridGlobals& globals, Services& services,
                         grid::VertexInputs& out) const {
    shade(grid, globals, services, out, nullptr);
}

grid::Reads InstanceImpl::reads_shading() const {
    const ir::Program& p = m_shader->program();
    const grid::Reads light =
        both(p.light.reads, p.filter.reads, std::max(p.light.reads.rings, p.filter.reads.rings));
    return both(p.shade.reads, light, std::max(p.shade.reads.rings, light.rings));
}

std::vector<std::string> InstanceImpl::aovs() const {
    std::vector<std::string> names;
    for (const ir::Output& o : m_shader->program().shade.outputs)
        if (o.kind == ir::Output::Aov)
            names.push_back(m_shader->program().parameters[size_t(o.index)].name);
    return names;
}

void InstanceImpl::shade_with_aovs(grid::Grid& grid, const GridGlobals& globals, Services& services,
                                   grid::VertexInputs& out, std::vector<grid::SlotValues>& aovs) const {
    shade(grid, globals, services, out, &aovs);
}

void InstanceImpl::shade(grid::Grid& grid, const GridGlobals& globals, Services& services,
                         grid::VertexInputs& out, std::vector<grid::SlotValues>* aovs) const {
    if (aovs)
        aovs->clear();
    out.stride = grid.stride;
    out.slots.assign(m_layering.slots.size(), {});
    for (size_t s = 0; s < m_sources.size(); s++) {
        out.slots[s].uniform = true;
        out.slots[s].value = m_sources[s].value;
    }
    if (!m_shader->program().shade.root)
        return keep_in_range(out, 0, 0, services);
    carry_members(grid, globals, services);
    const ir::Variant variant = variant_for(grid);
    const BuiltStage& built = m_shader->build(variant).shade;
    const ir::Stage& stage = built.stage;
    std::vector<float> unused(size_t(grid.stride) + 32, 0.0f), normals;
    std::vector<float*> outputs(stage.outputs.size() * 16, unused.data());
    std::vector<std::array<float, 16>> values(stage.outputs.size());
    for (size_t k = 0; k < stage.outputs.size(); k++) {
        const ir::Output& o = stage.outputs[k];
        if (o.kind == ir::Output::Normal) {
            normals = grid.facets ? grid.Ng : grid.N;
            normals.resize(size_t(grid.stride) * 3 + 32);
            for (size_t c = 0; c < 3; c++)
                outputs[k * 16 + c] = normals.data() + c * size_t(grid.stride);
        } else if (o.var >= 0 && !stage.vars[size_t(o.var)].varying) {
            for (size_t c = 0; c < 16; c++)
                outputs[k * 16 + c] = &values[k][c];
        }
    }
    for (size_t s = 0; s < m_sources.size(); s++) {
        const int k = m_sources[s].output;
        if (k < 0 || !stage.vars[size_t(stage.outputs[size_t(k)].var)].varying)
            continue;
        const size_t n = size_t(grid::components_of(m_layering.slots[s].type));
        out.slots[s].uniform = false;
        out.slots[s].data.resize(n * size_t(grid.stride) + 32);
        for (size_t c = 0; c < n; c++)
            outputs[size_t(k) * 16 + c] = out.slots[s].data.data() + c * size_t(grid.stride);
    }
    std::vector<std::pair<size_t, size_t>> wanted; // output, its components
    for (size_t k = 0; aovs && k < stage.outputs.size(); k++)
        if (stage.outputs[k].kind == ir::Output::Aov)
            wanted.emplace_back(k, size_t(ir::comps(stage.vars[size_t(stage.outputs[k].var)].ty)));
    if (aovs)
        aovs->resize(wanted.size());
    for (size_t a = 0; a < wanted.size(); a++) {
        const auto [k, n] = wanted[a];
        grid::SlotValues& values_of = (*aovs)[a];
        values_of.uniform = !stage.vars[size_t(stage.outputs[k].var)].varying;
        if (values_of.uniform)
            continue;
        values_of.data.resize(n * size_t(grid.stride) + 32);
        for (size_t c = 0; c < n; c++)
            outputs[k * 16 + c] = values_of.data.data() + c * size_t(grid.stride);
    }
    run(built, variant, grid, globals, services, outputs);
    for (size_t a = 0; a < wanted.size(); a++) {
        const auto [k, n] = wanted[a];
        grid::SlotValues& values_of = (*aovs)[a];
        if (values_of.uniform)
            values_of.value = Vec3f(values[k][0], values[k][1], values[k][2]);
        else
            values_of.data.resize(n * size_t(grid.stride));
    }
    for (size_t s = 0; s < m_sources.size(); s++) {
        const int k = m_sources[s].output;
        if (!out.slots[s].uniform)
            out.slots[s].data.resize(size_t(grid::components_of(m_layering.slots[s].type)) *
                                     size_t(grid.stride));
        else if (k >= 0)
            out.slots[s].value = Vec3f(values[size_t(k)][0], values[size_t(k)][1], values[size_t(k)][2]);
    }
    keep_in_range(out, size_t(grid.vertices()), size_t(grid.stencils ? grid.stencils->own : grid.vertices()),
                  services);
    if (!normals.empty()) {
        normals.resize(size_t(grid.stride) * 3);
        grid.N.swap(normals);
        grid.facets = false;
    }
}

} // namespace kanuka::sl
