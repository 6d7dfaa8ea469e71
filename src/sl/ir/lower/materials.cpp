#include "sl/ir/lower/materials.h"

#include <algorithm>

#include "sl/ir/lower/shadeops.h"

namespace kanuka::sl::ir {

using namespace ast;

void MaterialLowerer::material(const Expr* e, const ops::Signature& s) {
    using ops::Special;
    const auto in = [&](Role role, const char* stage) { return only_in(role, e, stage); };
    switch (s.special) {
    case Special::Create:
        if (in(Role::Init, "mnk_init"))
            shadeops().host(CallKind(s.imm), e, s);
        return;
    case Special::AddLayer:
        if (in(Role::Init, "mnk_init")) {
            shadeops().host(CallKind::AddLayer, e, s);
            note_added(m_b.stage().calls.back());
        }
        return;
    case Special::AddNode:
        if (CallKind(s.imm) == CallKind::SetPhaseFunction ? in(Role::Interior, "mnk_interior")
                                                          : in(Role::Init, "mnk_init"))
            add_node(e, CallKind(s.imm));
        return;
    case Special::SetLobe:
        if (in(Role::Shade, "mnk_prelighting"))
            set_lobe(e);
        return;
    case Special::SetLayer:
        if (in(Role::Shade, "mnk_prelighting"))
            set_layer(e);
        return;
    case Special::SetPresence:
        if (in(Role::Shade, "mnk_prelighting"))
            set_presence(e);
        return;
    case Special::SetInterior:
        if (in(Role::Interior, "mnk_interior"))
            set_interior(e, CallKind(s.imm));
        return;
    default:
        return;
    }
}

std::string MaterialLowerer::constant_text(const Expr* e, const char* what) {
    const Ref r = expr(e);
    if (m_b.at(r).op == Op::Text)
        return m_b.at(r).text;
    m_diagnostics.error(e->loc, std::string(what) + " must be a string constant");
    return {};
}

bool MaterialLowerer::only_in(Role role, const Expr* e, const char* stage) {
    if (m_state.role == role)
        return true;
    m_diagnostics.error(e->loc, e->shadeop->name + "() belongs into " + stage);
    return false;
}

int MaterialLowerer::channel(const std::string& node, int input, grid::LobeId lobe, Ty ty, bool presence,
                             Loc at) {
    const std::string key = node + '\0' + std::to_string(input) + (presence ? "p" : "");
    const auto [it, fresh] = m_channels.try_emplace(key, int(m_program.channels.size()));
    if (fresh)
        m_program.channels.push_back(
            {node, input, lobe, presence, false, ty,
             !presence && !m_added.lobes.contains(node) && !m_added.layers.contains(node)});
    const int index = it->second;
    if (!m_channel_vars.count(index)) {
        const int var = m_b.var(presence ? "presence" : node, ty, at);
        in_prologue([&] {
            m_b.declare(var);
            m_b.store(var, m_b.leaf(Op::Channel, ty, index), at);
        });
        m_channel_vars[index] = var;
    }
    return index;
}

void MaterialLowerer::set_channel(const std::string& node, int input, grid::LobeId lobe, Ty ty, Ref value,
                                  Loc at) {
    const int index = channel(node, input, lobe, ty, false, at);
    m_b.store(m_channel_vars[index], value, at);
}

void MaterialLowerer::channel_outputs(Stage& stage) {
    for (const auto& [channel, var] : std::map<int, int>(m_channel_vars.begin(), m_channel_vars.end()))
        stage.outputs.push_back({Output::Slot, var, channel});
}

// A lobe's variable is a variable for each input that a constructor names.
void MaterialLowerer::bind_lobe(const VarDecl* v, const Expr* init) {
    const grid::LobeDecl& lobe = grid::lobe(v->type.lobe);
    Binding& b = m_state.bindings[v];
    if (b.kind != Binding::Lobe || b.inputs.empty()) {
        b.kind = Binding::Lobe;
        b.inputs.assign(lobe.inputs.size(), -1);
        b.given.assign(lobe.inputs.size(), false);
    }
    if (!init)
        return;
    const LobeValue value = lobe_value(init);
    Binding& bound = m_state.bindings[v];
    for (size_t i = 0; i < value.inputs.size() && i < bound.inputs.size(); i++) {
        const grid::LobeInput& in = lobe.inputs[i];
        const Ty t = in.type == grid::InputType::Float ? Ty::Float : Ty::Triple;
        Ref r = value.inputs[i];
        if (r == ir::None && bound.inputs[i] < 0)
            continue;
        if (r == ir::None) // assigned again without this input: its default
            r = t == Ty::Triple ? m_b.constant({in.fallback.x, in.fallback.y, in.fallback.z}, t)
                                : m_b.constant(in.fallback.x);
        if (bound.inputs[i] < 0) {
            bound.inputs[i] = m_b.var(std::string(v->name) + "." + std::string(in.name), t, v->loc);
            m_b.declare(bound.inputs[i]);
            bound.given[i] = true;
        }
        m_b.store(bound.inputs[i], r, init->loc);
    }
}

MaterialLowerer::LobeValue MaterialLowerer::lobe_value(const Expr* e) {
    LobeValue value{e->type.lobe, {}};
    const grid::LobeDecl& lobe = grid::lobe(e->type.lobe);
    value.inputs.assign(lobe.inputs.size(), ir::None);
    if (e->kind == ExprKind::Construct) {
        for (size_t i = 0; i + 1 < e->args.size(); i += 2) {
            const int input = grid::find_input(lobe, e->args[i]->text);
            if (input >= 0)
                value.inputs[size_t(input)] =
                    expr_as(e->args[i + 1], {base_of(lobe.inputs[size_t(input)].type)});
        }
    } else if (e->kind == ExprKind::Name && e->var) {
        const Binding& b = bind(e->var);
        for (size_t i = 0; i < b.inputs.size(); i++)
            if (b.inputs[i] >= 0)
                value.inputs[i] = m_b.load(b.inputs[i], e->loc);
    } else {
        m_diagnostics.error(e->loc, "expected a lobe's constructor or a variable that holds a lobe");
    }
    return value;
}

void MaterialLowerer::note_added(const CallSite& site) {
    const bool lobe = site.kind == CallKind::AddLobe;
    const Instr& name = m_b.at(site.args[lobe ? 0 : 1]);
    if (name.op != Op::Text)
        m_added.open = true;
    else if (lobe)
        m_added.lobes[name.text].insert(grid::LobeId(site.imm));
    else
        m_added.layers.insert(name.text);
    if (!lobe)
        m_added.joins.push_back(site);
}

// "; did you mean ..., or what there is.
std::string MaterialLowerer::known_nodes(const std::string& name) const {
    std::vector<std::string_view> names;
    for (const auto& [lobe, types] : m_added.lobes)
        names.push_back(lobe);
    names.insert(names.end(), m_added.layers.begin(), m_added.layers.end());
    if (const std::string near = closest(name, names); !near.empty())
        return "; did you mean \"" + near + "\"?";
    std::string have;
    for (const std::string_view n : names)
        have += (have.empty() ? "\"" : ", \"") + std::string(n) + "\"";
    return have.empty() ? "; it adds none" : "; it adds " + have;
}

bool MaterialLowerer::is_added(const std::string& name, Loc at, std::optional<grid::LobeId> lobe) {
    const auto found = m_added.lobes.find(name);
    const bool layer = m_added.layers.contains(name);
    if (found == m_added.lobes.end() && !layer) {
        if (m_added.open)
            return true;
        m_diagnostics.error(at, "mnk_init adds no lobe or layer \"" + name + "\"" + known_nodes(name));
        return false;
    }
    if (!lobe || m_added.open || (found != m_added.lobes.end() && found->second.contains(*lobe)))
        return true;
    m_diagnostics.error(at, "\"" + name + "\" is set to a " + std::string(grid::lobe(*lobe).name) +
                                ", but mnk_init adds it as a " +
                                (layer ? "layer: SetLayer sets its weight"
                                       : std::string(grid::lobe(*found->second.begin()).name)));
    return false;
}

void MaterialLowerer::check_layers() {
    static constexpr std::string_view Kinds[] = {"mix", "over", "coat", "thick", "add"};
    for (const CallSite& site : m_added.joins) {
        const Instr& kind = m_b.at(site.args[2]);
        if (kind.op == Op::Text && std::ranges::find(Kinds, kind.text) == std::end(Kinds))
            m_diagnostics.error(site.loc, "there is no layer \"" + kind.text +
                                              "\"; there are mix, over, coat, thick and add");
        for (const size_t part : {3, 4})
            if (const Instr& name = m_b.at(site.args[part]); name.op == Op::Text)
                is_added(name.text, site.loc, {});
    }
}

// AddLobe, AddPhaseFunction, SetPhaseFunction: a name, and a lobe's inputs.
void MaterialLowerer::add_node(const Expr* e, CallKind kind) {
    const bool phase = kind != CallKind::AddLobe;
    const LobeValue value = lobe_value(e->args[2]);
    const grid::LobeDecl& lobe = grid::lobe(value.lobe);
    if ((lobe.kind == grid::LobeKind::Phase) != phase) {
        m_diagnostics.error(e->args[2]->loc,
                            std::string(lobe.name) + (phase ? " is not a phase function"
                                                            : " is a phase function: use AddPhaseFunction"));
        return;
    }
    CallSite site{kind, e->loc};
    site.imm = int(value.lobe);
    site.args = {expr(e->args[1])};
    site.names = {"name"};
    for (size_t i = 0; i < value.inputs.size(); i++)
        if (value.inputs[i] != ir::None) {
            site.args.push_back(value.inputs[i]);
            site.names.emplace_back(lobe.inputs[i].name);
        }
    m_b.call(std::move(site), Ty::Void);
    if (!phase)
        note_added(m_b.stage().calls.back());
}

void MaterialLowerer::set_lobe(const Expr* e) {
    const std::string node = constant_text(e->args[1], "the name of a lobe");
    const Ref weight = expr_as(e->args[2], {Base::Float});
    const LobeValue value = lobe_value(e->args[3]);
    if (grid::lobe(value.lobe).kind == grid::LobeKind::Phase) {
        m_diagnostics.error(e->args[3]->loc,
                            std::string(grid::lobe(value.lobe).name) +
                                " is a phase function: it belongs into the interior (AddPhaseFunction)");
        return;
    }
    if (!is_added(node, e->args[1]->loc, value.lobe))
        return;
    // A weight that is one for ever needs no place; any other store would meet it in this channel.
    const std::string key = node + '\0' + "-1";
    if (!m_b.is_const(weight, 1) || m_channels.count(key))
        set_channel(node, -1, value.lobe, Ty::Float, weight, e->args[2]->loc);
    for (size_t i = 0; i < value.inputs.size(); i++)
        if (value.inputs[i] != ir::None)
            set_channel(node, int(i), value.lobe, m_b.at(value.inputs[i]).ty, value.inputs[i], e->loc);
}

void MaterialLowerer::set_layer(const Expr* e) {
    const std::string name = constant_text(e->args[1], "the name of a layer");
    const Ref weight = expr_as(e->args[2], {Base::Float});
    if (is_added(name, e->args[1]->loc, {}))
        set_channel(name, -1, grid::LobeId::LambertBrdf, Ty::Float, weight, e->loc);
}

void MaterialLowerer::set_presence(const Expr* e) {
    const Ref value = expr_as(e->args[1], {Base::Float});
    const int index = channel("", -1, grid::LobeId::LambertBrdf, Ty::Float, true, e->loc);
    m_b.store(m_channel_vars[index], value, e->loc);
}

void MaterialLowerer::set_interior(const Expr* e, CallKind kind) {
    CallSite site{kind, e->loc};
    site.args = {expr_as(e->args[1], {kind == CallKind::SetPriority ? Base::Float : Base::Color})};
    m_b.call(std::move(site), Ty::Void);
}

} // namespace kanuka::sl::ir
