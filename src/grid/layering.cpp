#include "grid/layering.h"

#include <algorithm>
#include <utility>

namespace kanuka::grid {

std::array<float, Interior::MaxPhaseInputs> Interior::defaults(LobeId phase) {
    std::array<float, MaxPhaseInputs> values{};
    const auto inputs = lobe(phase).inputs;
    for (size_t i = 0; i < inputs.size(); i++)
        values[i] = inputs[i].fallback.x; // colours have greys for defaults
    return values;
}

const LayerNode* LayeringProgram::emission() const {
    for (const LayerNode& n : nodes)
        if (n.op == LayerOp::Lobe && lobe(n.lobe).kind == LobeKind::Emission)
            return &n;
    return nullptr;
}

bool LayeringProgram::emits() const {
    return emission() != nullptr;
}

bool LayeringProgram::emits_along_normals() const {
    const LayerNode* node = emission();
    return node && (node->lobe == LobeId::ConeEmission || node->lobe == LobeId::ProfileEmission);
}

bool LayeringProgram::emission_depends_on(const std::function<bool(int slot)>& property) const {
    const auto has = [&](int slot) { return slot >= 0 && property(slot); };
    // Of each node, does it hold emission, and does that depend? Children come before their parents.
    std::vector<std::pair<bool, bool>> found;
    for (const LayerNode& n : nodes) {
        auto& [emits, depends] = found.emplace_back(false, false);
        if (n.op == LayerOp::Lobe) {
            emits = lobe(n.lobe).kind == LobeKind::Emission;
            depends = emits && std::any_of(n.inputs.begin(), n.inputs.end(), has);
        }
        for (const int child : {n.upper, n.lower})
            if (n.op != LayerOp::Lobe && child >= 0)
                emits |= found[size_t(child)].first, depends |= found[size_t(child)].second;
        depends |= emits && has(n.weight);
    }
    return std::any_of(found.begin(), found.end(), [](const auto& node) { return node.second; });
}

bool LayeringProgram::lets_through() const {
    return presence >= 0 || interior || std::ranges::any_of(nodes, [](const LayerNode& n) {
               const LobeKind kind = n.op == LayerOp::Lobe ? lobe(n.lobe).kind : LobeKind::Reflection;
               return kind == LobeKind::Transmission || kind == LobeKind::ReflectionTransmission;
           });
}

bool LayeringProgram::is_layer() const {
    const bool refracts = std::ranges::any_of(nodes, [](const LayerNode& n) {
        return n.op == LayerOp::Lobe && n.lobe == LobeId::MicrosurfaceDielectricBsdfRgb_v1;
    });
    return lets_through() && !refracts && !interior;
}

bool LayeringProgram::needs_tangent() const {
    for (const LayerNode& n : nodes) {
        if (n.op != LayerOp::Lobe || find_input(lobe(n.lobe), "rotation") < 0)
            continue;
        const int anisotropy = find_input(lobe(n.lobe), "anisotropy"); // round lobes have no direction
        if (anisotropy < 0 || (size_t(anisotropy) < n.inputs.size() && n.inputs[size_t(anisotropy)] >= 0))
            return true;
    }
    return false;
}

std::string LayeringProgram::key() const {
    std::string k = "v" + std::to_string(LayeringVersion);
    for (const LayerNode& n : nodes) {
        k += ";" + std::to_string(int(n.op)) + "," + std::to_string(int(n.lobe)) + "," +
             std::to_string(n.upper) + "," + std::to_string(n.lower) + "," + std::to_string(n.weight);
        for (int s : n.inputs)
            k += ":" + std::to_string(s);
    }
    for (const Slot& s : slots)
        k += "|" + std::to_string(int(s.type)) + std::to_string(int(s.storage)) +
             std::to_string(int(s.between));
    k += "|a" + std::to_string(air);
    for (int c : opacity)
        k += "," + std::to_string(c);
    for (const Aov& a : aovs) {
        k += "|o" + std::to_string(a.index) + (a.color ? "c" : "");
        for (int c = 0; c < a.components; c++)
            k += "," + std::to_string(a.slots[size_t(c)]);
    }
    for (const LitBy& l : lit_by)
        k += "|l" + std::to_string(l.light) + "," + std::to_string(l.slot);
    k += "|e" + std::to_string(emission_cosine) + (shines_both ? "b" : "");
    k += "|p" + std::to_string(presence) + "i" + std::to_string(interior.has_value()) + "m" +
         std::to_string(ambient);
    if (variants > 1)
        k += "v" + std::to_string(variants);
    return k;
}

} // namespace kanuka::grid
