// mnk_init and mnk_interior: the calls that build a material.
#include "sl/ops/host_calls.h"

namespace kanuka::sl::ops {

static Vec3f value(const Runner& r, const Arguments& a, int k) {
    const float* const* p = a.at(k);
    const bool triple = r.stage.instrs[size_t(a.site.args[size_t(k)])].ty == ir::Ty::Triple;
    return triple ? Vec3f(p[0][0], p[1][0], p[2][0]) : Vec3f(p[0][0], 0, 0);
}

static void add_node(Runner& r, const Arguments& a, MaterialBuild::Node node) {
    for (const MaterialBuild::Node& other : r.build->nodes)
        if (other.name == node.name) {
            r.services.report(Severity::Error, r.location(a.site.loc),
                              "the material already has a \"" + node.name + "\"; it is left as it is");
            return;
        }
    node.loc = a.site.loc;
    r.build->nodes.push_back(std::move(node));
}

// An interior has one phase function: what is added or set last. Setting the same keeps what else was given.
static void set_phase(Runner& r, const Arguments& a, grid::Interior& interior) {
    const auto lobe = grid::LobeId(a.site.imm);
    if (a.site.kind == ir::CallKind::AddPhaseFunction || lobe != interior.phase)
        interior.phase_inputs = grid::Interior::defaults(lobe);
    interior.phase = lobe;
    for (size_t k = 1; k < a.site.args.size(); k++) {
        const int input = grid::find_input(grid::lobe(lobe), a.site.names[k]);
        const grid::LobeInput& declared = grid::lobe(lobe).inputs[size_t(input)];
        const Vec3f given = value(r, a, int(k));
        const float x = declared.type == grid::InputType::Color ? (given.x + given.y + given.z) / 3 : given.x;
        const float kept = x >= declared.low ? std::min(x, declared.high) : declared.low; // NaN: the lowest
        if (kept != x)
            r.services.report(Severity::Warning, r.location(a.site.loc),
                              std::string(grid::lobe(lobe).name) + ": " + std::string(declared.name) +
                                  " is " + std::to_string(x) + "; it is kept within " +
                                  std::to_string(declared.low) + " and " + std::to_string(declared.high));
        interior.phase_inputs[size_t(input)] = kept;
    }
}

void build_call(Runner& r, const Arguments& a) {
    using ir::CallKind;
    if (!r.build)
        return;
    MaterialBuild& m = *r.build;
    switch (a.site.kind) {
    case CallKind::CreateBoundary:
        m.has_boundary = true;
        break;
    case CallKind::CreateInterior: {
        m.has_interior = true;
        const std::string kind = a.text(1);
        if (kind != "homogeneous")
            r.services.report(Severity::Error, r.location(a.site.loc),
                              "interiors of kind \"" + kind +
                                  "\" are not known; it is taken as \"homogeneous\"");
        if (a.site.args.size() > 2)
            m.interior.ior = a.at(2)[0][0];
        break;
    }
    case CallKind::AddLobe: {
        MaterialBuild::Node n;
        n.name = a.text(0);
        n.lobe = grid::LobeId(a.site.imm);
        for (size_t k = 1; k < a.site.args.size(); k++) {
            n.given.push_back(grid::find_input(grid::lobe(n.lobe), a.site.names[k]));
            n.values.push_back(value(r, a, int(k)));
        }
        add_node(r, a, std::move(n));
        break;
    }
    case CallKind::AddLayer: {
        MaterialBuild::Node n;
        n.name = a.text(1);
        n.upper = a.text(3);
        n.lower = a.text(4);
        const std::string op = a.text(2);
        if (op == "mix")
            n.op = grid::LayerOp::Mix;
        else if (op == "over")
            n.op = grid::LayerOp::Over;
        else if (op == "coat")
            n.op = grid::LayerOp::Coat;
        else if (op == "thick")
            n.op = grid::LayerOp::Thick;
        else if (op == "add")
            n.op = grid::LayerOp::Add;
        else {
            r.services.report(Severity::Error, r.location(a.site.loc),
                              "there is no layer \"" + op + "\"; there are mix, over, coat, thick and add");
            break;
        }
        add_node(r, a, std::move(n));
        break;
    }
    case CallKind::AddPhaseFunction:
    case CallKind::SetPhaseFunction:
        set_phase(r, a, m.interior);
        break;
    case CallKind::SetAbsorption:
        m.interior.absorption = value(r, a, 0);
        break;
    case CallKind::SetScattering:
        m.interior.scattering = value(r, a, 0);
        break;
    case CallKind::SetPriority:
        m.interior.priority = a.at(0)[0][0];
        break;
    default:
        break;
    }
}

} // namespace kanuka::sl::ops
