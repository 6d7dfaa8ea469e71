#include "sl/ir/lower/emission.h"

#include "sl/ir/lower/statements.h"
#include "sl/ir/lower/variables.h"

namespace kanuka::sl::ir {

using namespace ast;

void EmissionLowerer::begin() {
    const Loc at = m_context.shader.loc;
    static constexpr Ty types[] = {Ty::Triple, Ty::Float, Ty::Triple, Ty::Triple, Ty::Float};
    static constexpr const char* names[] = {"Cl", "form", "from", "axis", "angle"};
    m_vars[0] = bind(m_sema.global("Cl")).var;
    for (int k = 1; k < int(Emission::Count); k++) {
        m_vars[k] = m_b.var(names[k], types[k], at);
        m_b.declare(m_vars[k]);
        m_b.store(m_vars[k], zero(types[k]), at);
    }
}

void EmissionLowerer::outputs(Stage& stage) {
    for (int k = 0; k < int(Emission::Count); k++)
        stage.outputs.push_back({Output::Emitted, m_vars[k], k});
}

// illuminate([category,] from [, axis, angle]) body, solar([category,] [axis, angle]) body: L leads to the
// point that is lit; outside of the cone there is no light.
void EmissionLowerer::emission(const Stmt* s) {
    const bool solar = s->kind == StmtKind::Solar;
    if (m_state.role != Role::Light) {
        m_diagnostics.warning(s->loc,
                              "illuminate and solar belong into light shaders: here their bodies do not run");
        return;
    }
    std::vector<const Expr*> args;
    for (const Expr* a : s->args)
        if (!a->type.is(Base::String)) // categories: every light lights everything
            args.push_back(a);
    if (!fits(s, args.size()))
        return;
    const auto set = [&](Emission what, Ref value) { m_b.store(m_vars[int(what)], value, s->loc); };
    const Ref Ps = variables().global("Ps", s->loc);
    const Ref from = solar ? variables().shader_frame(3, s->loc) : expr_as(args[0], {Base::Point});
    Ref L = m_b.emit(Op::Sub, Ty::Triple, {Ps, from}, s->loc);
    const bool cone = args.size() >= 2;
    set(Emission::Form, m_b.constant(float(!solar ? sl::Emission::Illuminate
                                           : cone ? sl::Emission::Solar
                                                  : sl::Emission::Sky)));
    set(Emission::From, from);
    Ref inside = m_b.boolean(true);
    if (cone) {
        const Ref axis = expr_as(args[args.size() - 2], {Base::Vector});
        const Ref angle = expr_as(args[args.size() - 1], {Base::Float});
        set(Emission::Axis, axis);
        set(Emission::Angle, angle);
        if (solar)
            L = axis;
        else if (!m_program.area_light) // in front of which is its axis
            inside = in_cone(L, axis, angle, s->loc);
    } else {
        set(Emission::Axis, m_b.triple(0));
        set(Emission::Angle, m_b.constant(0.0f));
    }
    m_b.store(bind(m_sema.global("L")).var, L, s->loc);
    if (m_b.is_const(inside)) {
        statements().statement(s->body);
        return;
    }
    Item i{Item::If};
    i.ref = inside;
    i.loc = s->loc;
    i.body = in_block([&] { statements().statement(s->body); });
    i.orelse = in_block([&] { set(Emission::Color, m_b.triple(0)); });
    m_b.item(i);
}

bool EmissionLowerer::fits(const Stmt* s, size_t args) {
    const bool solar = s->kind == StmtKind::Solar;
    if (solar ? args == 0 || args == 2 : args == 1 || args == 3)
        return true;
    m_diagnostics.error(s->loc,
                        solar ? "solar takes nothing, or an axis and an angle: solar (axis, angle) { … }"
                              : "illuminate takes a position, and perhaps an axis and an angle: "
                                "illuminate (from, axis, angle) { … }");
    return false;
}

// L . axis >= cos(angle) |L| |axis|
Ref EmissionLowerer::in_cone(Ref L, Ref axis, Ref angle, Loc at) {
    const auto length = [&](Ref v) {
        return m_b.emit(Op::Sqrt, Ty::Float, {m_b.emit(Op::Dot, Ty::Float, {v, v}, at)}, at);
    };
    const Ref cosine = m_b.emit(Op::Math1, Ty::Float, {angle}, at, int(Fn::Cos));
    const Ref size = m_b.emit(Op::Mul, Ty::Float, {length(L), length(axis)}, at);
    return m_b.emit(
        Op::Ge, Ty::Bool,
        {m_b.emit(Op::Dot, Ty::Float, {L, axis}, at), m_b.emit(Op::Mul, Ty::Float, {cosine, size}, at)}, at);
}

} // namespace kanuka::sl::ir
