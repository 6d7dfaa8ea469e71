// The layering program of an instance: which lobes, how they lie, and where their inputs come from.
#include <algorithm>
#include <cmath>
#include <utility>

#include "sl/shader.h"

namespace kanuka::sl {

using grid::LayerOp;

static grid::Slot make_slot(const grid::LobeInput& in, const std::string& node) {
    grid::Slot s;
    s.type = in.type;
    s.storage = in.storage;
    s.low = in.low;
    s.high = in.high;
    s.name = node + "." + std::string(in.name);
    s.between = in.between();
    return s;
}

// A slot, and the output of the shade stage that fills it; channel -1 = it keeps the value.
int InstanceImpl::add_slot(grid::Slot slot, int channel, Vec3f value) {
    const std::vector<ir::Output>& outputs = m_shader->program().shade.outputs;
    m_layering.slots.push_back(std::move(slot));
    SlotSource source;
    source.value = value;
    for (size_t k = 0; k < outputs.size(); k++)
        if (outputs[k].kind == ir::Output::Slot && outputs[k].index == channel && channel >= 0)
            source.output = int(k);
    m_sources.push_back(source);
    return int(m_layering.slots.size()) - 1;
}

Location InstanceImpl::place_of(const ops::MaterialBuild::Node& n) const {
    const ir::Program& p = m_shader->program();
    return {n.loc.file < p.files.size() ? p.files[n.loc.file] : p.name, int(n.loc.line), int(n.loc.column)};
}

// A layer's children are there, and of a kind that it takes.
void InstanceImpl::check_layer(const ops::MaterialBuild::Node& n, const grid::LayerNode& node,
                               Services& services) const {
    for (const auto& [child, given] : {std::pair{node.upper, &n.upper}, std::pair{node.lower, &n.lower}})
        if (child < 0)
            services.report(Severity::Error, place_of(n),
                            "layer \"" + n.name + "\" names \"" + *given +
                                "\", which is no lobe or layer of this material that is still free");
    if (node.upper < 0 || node.lower < 0)
        return;
    const grid::LayerNode& upper = m_layering.nodes[size_t(node.upper)];
    if (n.op == LayerOp::Thick &&
        (upper.op != LayerOp::Lobe || upper.lobe != grid::LobeId::MicrofacetDielectricBrdf))
        services.report(Severity::Warning, place_of(n),
                        "layer \"" + n.name + "\" is thick, but its upper, \"" + n.upper +
                            "\", is no MicrofacetDielectricBrdf: it bends no light, as \"coat\"");
}

// All emission of a material is of one lobe.
void InstanceImpl::check_emission(const ops::MaterialBuild::Node& n, Services& services) const {
    const grid::LayerNode* first = m_layering.emission();
    if (first && first->lobe != n.lobe && grid::lobe(n.lobe).kind == grid::LobeKind::Emission)
        services.report(Severity::Warning, place_of(n),
                        "\"" + n.name + "\" is a " + std::string(grid::lobe(n.lobe).name) + " beside the " +
                            std::string(grid::lobe(first->lobe).name) + " \"" + first->name +
                            "\": a surface shines in one shape, that of the first");
}

// The channels that the shader sets of a node: its weight first, then its inputs; -1 = never set.
std::vector<int> InstanceImpl::channels_of(const ops::MaterialBuild::Node& n, Services& services) const {
    const ir::Program& p = m_shader->program();
    const grid::LobeDecl& lobe = grid::lobe(n.lobe);
    std::vector<int> channels(lobe.inputs.size() + 1, -1);
    for (size_t c = 0; c < p.channels.size(); c++) {
        const ir::Channel& channel = p.channels[c];
        if (channel.node != n.name || channel.presence || channel.ambient || channel.opacity >= 0)
            continue;
        if (channel.input >= 0 && (n.op != LayerOp::Lobe || channel.lobe != n.lobe)) {
            services.report(Severity::Error, place_of(n),
                            "SetLobe gives \"" + n.name + "\" a " +
                                std::string(grid::lobe(channel.lobe).name) + ", AddLobe made it a " +
                                (n.op == LayerOp::Lobe ? std::string(lobe.name) : "layer"));
            continue;
        }
        channels[size_t(channel.input + 1)] = int(c);
    }
    return channels;
}

int InstanceImpl::node_of(const ops::MaterialBuild& build, const std::string& name, std::vector<int>& made,
                          int depth, Services& services) {
    const auto found =
        std::find_if(build.nodes.begin(), build.nodes.end(), [&](const auto& n) { return n.name == name; });
    if (found == build.nodes.end() || depth > 64)
        return -1;
    const size_t index = size_t(found - build.nodes.begin());
    if (made[index] >= 0)
        return -1; // a node has one parent
    const ops::MaterialBuild::Node& n = *found;
    grid::LayerNode node;
    node.op = n.op;
    node.lobe = n.lobe;
    node.name = n.name;
    made[index] = 0;
    if (n.op != LayerOp::Lobe) {
        node.upper = node_of(build, n.upper, made, depth + 1, services);
        node.lower = node_of(build, n.lower, made, depth + 1, services);
        check_layer(n, node, services);
        if (node.upper < 0 || node.lower < 0)
            return std::max(node.upper, node.lower);
    } else {
        check_emission(n, services);
    }
    // Slots: the weight, then the inputs that the shader sets or that differ from their default.
    const grid::LobeDecl& lobe = grid::lobe(n.lobe);
    const std::vector<int> channels = channels_of(n, services);
    if (channels[0] >= 0) {
        grid::Slot weight;
        weight.name = n.name + ".weight";
        if (n.op == LayerOp::Lobe && lobe.kind == grid::LobeKind::Emission)
            weight.high = std::numeric_limits<float>::infinity();
        m_channels[size_t(channels[0]) * 3] = 1;
        node.weight = add_slot(std::move(weight), channels[0], Vec3f(1, 0, 0));
    }
    if (n.op == LayerOp::Lobe) {
        node.inputs.assign(lobe.inputs.size(), -1);
        for (size_t i = 0; i < lobe.inputs.size(); i++) {
            const auto given = std::find(n.given.begin(), n.given.end(), int(i));
            const Vec3f value =
                given != n.given.end() ? n.values[size_t(given - n.given.begin())] : lobe.inputs[i].fallback;
            const int channel = channels[i + 1];
            if (channel >= 0)
                for (int c = 0; c < 3; c++)
                    m_channels[size_t(channel) * 3 + size_t(c)] = value[c];
            if (channel >= 0 || given != n.given.end())
                node.inputs[i] = add_slot(make_slot(lobe.inputs[i], n.name), channel, value);
        }
    }
    m_layering.nodes.push_back(std::move(node));
    made[index] = 1;
    return int(m_layering.nodes.size()) - 1;
}

// Amounts that cannot be are none, with a warning.
static grid::Interior clean(grid::Interior in, Services& services) {
    bool bad = false;
    const auto keep = [&](float& x, float low, float otherwise) {
        if (std::isfinite(x) && x >= low)
            return;
        bad = true;
        x = otherwise;
    };
    keep(in.ior, 0.1f, 1);
    keep(in.priority, -1e6f, 0);
    for (int c = 0; c < 3; c++)
        keep(in.absorption[c], 0, 0), keep(in.scattering[c], 0, 0);
    if (bad)
        services.report(
            Severity::Warning, {},
            "an interior's index of refraction, absorption, scattering or priority is negative or "
            "not a number; it is taken as nothing");
    return in;
}

// Nodes that the shader sets, but that its init never made.
void InstanceImpl::warn_unmade(const ops::MaterialBuild& build, Services& services) const {
    const ir::Program& p = m_shader->program();
    for (size_t c = 0; c < p.channels.size(); c++) {
        const ir::Channel& channel = p.channels[c];
        const auto named = [&](const auto& n) { return n.name == channel.node; };
        if (!channel.unsure || std::ranges::any_of(build.nodes, named) ||
            std::any_of(p.channels.begin(), p.channels.begin() + ptrdiff_t(c),
                        [&](const ir::Channel& other) { return other.node == channel.node; }))
            continue;
        std::string have;
        for (const auto& n : build.nodes)
            have += (have.empty() ? "\"" : ", \"") + n.name + "\"";
        services.report(Severity::Warning, {p.name},
                        "mnk_prelighting sets \"" + channel.node + "\", but mnk_init added " +
                            (have.empty() ? "nothing" : "only " + have) + ": it does nothing");
    }
}

// Makes all nodes, and gives those that no layer names. Layers are made from the top, lobes in the order of
// their AddLobe.
std::vector<int> InstanceImpl::make_roots(const ops::MaterialBuild& build, Services& services) {
    std::vector<int> made(build.nodes.size(), -1), roots;
    for (const auto& n : build.nodes) {
        bool inner = false;
        for (const auto& layer : build.nodes)
            inner = inner || (layer.op != LayerOp::Lobe && (layer.upper == n.name || layer.lower == n.name) &&
                              &layer != &n);
        if (inner)
            continue;
        const int root = node_of(build, n.name, made, 0, services);
        if (root >= 0)
            roots.push_back(root);
    }
    return roots;
}

// Slots of the surface, and of no lobe: presence, opacity, ambient.
void InstanceImpl::add_surface_slots() {
    const ir::Program& p = m_shader->program();
    for (size_t c = 0; c < p.channels.size(); c++) {
        const bool ambient = p.channels[c].ambient;
        const int opacity = p.channels[c].opacity;
        if ((!p.channels[c].presence && !ambient && opacity < 0) ||
            (opacity >= 0 && !colors_opacity(p.channels[c])))
            continue;
        grid::Slot slot;
        slot.name = ambient ? "ambient" : opacity >= 0 ? "opacity" : "presence";
        if (ambient)
            slot.type = grid::InputType::Color, slot.storage = grid::Storage::Amount, slot.high = 65504;
        else
            m_channels[c * 3] = 1;
        int& index = ambient        ? m_layering.ambient
                     : opacity >= 0 ? m_layering.opacity[size_t(opacity)]
                                    : m_layering.presence;
        index = add_slot(std::move(slot), int(c), Vec3f(ambient ? 0.0f : 1.0f, 0, 0));
    }
}

// What has one value on all grids, whether these have colours or not.
void InstanceImpl::find_uniform() {
    const ir::Program& p = m_shader->program();
    ir::Variant colors = m_variant;
    colors.Cs = colors.Os = true;
    const std::vector<bool> always = m_shader->uniform_outputs(colors),
                            plain = m_shader->uniform_outputs(m_variant);
    m_uniform = m_uniform_plain = true;
    for (size_t s = 0; s < m_sources.size(); s++) {
        const int k = m_sources[s].output;
        m_layering.slots[s].uniform = k < 0 || always[size_t(k)];
        m_uniform = m_uniform && m_layering.slots[s].uniform;
        m_uniform_plain = m_uniform_plain && (k < 0 || plain[size_t(k)]);
    }
    const auto varies = [&](const std::vector<bool>& uniform) {
        return m_layering.emission_depends_on([&](int slot) {
            const int k = m_sources[size_t(slot)].output;
            return k >= 0 && !uniform[size_t(k)];
        });
    };
    m_emission_varies = varies(always);
    m_emission_varies_plain = varies(plain);
    for (size_t k = 0; k < p.shade.outputs.size(); k++) {
        const ir::Output& o = p.shade.outputs[k];
        if (o.kind == ir::Output::Normal)
            m_uniform = m_uniform_plain = false; // bump: every vertex has its normal
        if (o.kind == ir::Output::Aov) {         // shown, as slots are
            m_uniform = m_uniform && always[k];
            m_uniform_plain = m_uniform_plain && plain[k];
        }
    }
}

void InstanceImpl::build_material(const ops::MaterialBuild& build, Services& services) {
    const ir::Program& p = m_shader->program();
    m_channels.assign(p.channels.size() * 3 + 3, 0.0f);
    warn_unmade(build, services);
    const std::vector<int> roots = make_roots(build, services);
    add_surface_slots();
    // Several roots lie side by side under implicit Add nodes.
    int top = roots.empty() ? -1 : roots[0];
    for (size_t i = 1; i < roots.size(); i++) {
        grid::LayerNode add;
        add.op = LayerOp::Add;
        add.upper = top;
        add.lower = roots[i];
        m_layering.nodes.push_back(std::move(add));
        top = int(m_layering.nodes.size()) - 1;
    }
    if (build.has_interior)
        m_layering.interior = clean(build.interior, services);
    m_layering.shines_both = !p.fixed_lobes.empty();
    find_uniform();
}

// Where Oi is as grey as Os, and that is known to be grey, presence says it all.
bool InstanceImpl::colors_opacity(const ir::Channel& channel) const {
    const bool grey =
        m_opacity && !m_variant.Os && m_opacity->x == m_opacity->y && m_opacity->y == m_opacity->z;
    return !(channel.as_os && grey);
}

// Says nothing: for a point that no picture shows.
class Silent final : public Services {
  public:
    explicit Silent(Services& services) : m_services(services) {}
    void texture(const TextureRequest& q) override { m_services.texture(q); }
    void environment(const TextureRequest& q, const float* x, const float* y, const float* z) override {
        m_services.environment(q, x, y, z);
    }
    bool transform(const char* from, const char* to, float matrix[16]) override {
        return m_services.transform(from, to, matrix);
    }
    bool query(const Query& q) override { return m_services.query(q); }
    void report(Severity, const Location&, const std::string&) override {}

  private:
    Services& m_services;
};

// A surface that the arguments make opaque has no presence to test at every hit.
void InstanceImpl::settle_presence(Services& services) {
    const int slot = m_layering.presence;
    if (slot < 0 || !m_opacity || m_variant.Os || !m_shader->program().shade.root)
        return;
    const int output = m_sources[size_t(slot)].output;
    if (output < 0 || !m_shader->uniform_outputs(m_variant)[size_t(output)])
        return;
    grid::Grid point; // of a plane that the eye is in front of
    point.allocate(0, 0);
    point.u[0] = point.v[0] = point.s[0] = point.t[0] = 0.5f;
    point.dPdu[0] = point.dPdv[point.stride] = 1;
    point.N[2 * point.stride] = point.Ng[2 * point.stride] = 1;
    GridGlobals globals;
    globals.Os = *m_opacity;
    globals.E = Vec3f(0, 0, 1);
    grid::VertexInputs values;
    Silent silent(services);
    shade(point, globals, silent, values);
    if (values.slots[size_t(slot)].uniform && values.slots[size_t(slot)].value.x >= 1) {
        const auto drop = [&](int& which) {
            const int gone = std::exchange(which, -1);
            if (gone < 0)
                return;
            m_layering.slots.erase(m_layering.slots.begin() + gone);
            m_sources.erase(m_sources.begin() + gone);
            for (int* other : {&m_layering.presence, &m_layering.ambient, &m_layering.opacity[0],
                               &m_layering.opacity[1], &m_layering.opacity[2]}) // slots of lobes come before
                *other -= *other > gone;
        };
        drop(m_layering.presence);
        for (int& component : m_layering.opacity)
            drop(component);
    }
}

} // namespace kanuka::sl
