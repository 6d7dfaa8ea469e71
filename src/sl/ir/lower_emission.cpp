// Light shaders: what they send to a point Ps, and from where. illuminate and solar say the form of the
// light; a light with neither shines from everywhere.
#include "sl/ir/lower.h"

namespace kanuka::sl::ir {

using namespace ast;

// Rows of the matrix from shader to current space: 3 is the light's own place, 2 the axis along which it
// looks.
Ref Lower::shader_frame(int row, Loc at) {
    return in_prologue([&] {
        CallSite site{CallKind::SpaceMatrix, at};
        site.args = {m_b.text("shader"), m_b.text("current")};
        const Ref m = m_b.call(std::move(site), Ty::Matrix);
        std::vector<Ref> parts;
        for (int c = 0; c < 3; c++)
            parts.push_back(m_b.emit(Op::Extract, Ty::Float, {m}, at, 4 * row + c));
        return m_b.emit(Op::Make, Ty::Triple, std::move(parts), at);
    });
}

void Lower::light_stage() {
    Stage& stage = m_program.light;
    begin_stage(stage, Role::Light, "light");
    const Loc at = m_shader.loc;
    static constexpr Ty types[] = {Ty::Triple, Ty::Float, Ty::Triple, Ty::Triple, Ty::Float};
    static constexpr const char* names[] = {"Cl", "form", "from", "axis", "angle"};
    m_emission[0] = bind(m_sema.global("Cl")).var;
    for (int k = 1; k < int(Emission::Count); k++) {
        m_emission[k] = m_b.var(names[k], types[k], at);
        m_b.declare(m_emission[k]);
        m_b.store(m_emission[k], zero(types[k]), at);
    }
    statement(m_shader.body);
    for (int k = 0; k < int(Emission::Count); k++)
        stage.outputs.push_back({Output::Emitted, m_emission[k], k});
    end_stage();
}

// Volume and imager shaders take a colour and an opacity and hand them on changed. They come in as Cs and Os.
void Lower::filter_stage() {
    Stage& stage = m_program.filter;
    begin_stage(stage, Role::Filter, "filter");
    const int vars[] = {bind(m_sema.global("Ci")).var, bind(m_sema.global("Oi")).var,
                        bind(m_sema.global("alpha")).var};
    statement(m_shader.body);
    for (int k = 0; k < 3; k++)
        stage.outputs.push_back({Output::Filtered, vars[k], k});
    end_stage();
}

// illuminate([category,] from [, axis, angle]) body, solar([category,] [axis, angle]) body: L leads to the
// point that is lit; outside of the cone there is no light.
void Lower::emission(const Stmt* s) {
    const bool solar = s->kind == StmtKind::Solar;
    if (m_role != Role::Light) {
        m_diagnostics.warning(s->loc,
                              "illuminate and solar belong into light shaders: here their bodies do not run");
        return;
    }
    std::vector<const Expr*> args;
    for (const Expr* a : s->args)
        if (!a->type.is(Base::String)) // categories: every light lights everything
            args.push_back(a);
    if ((solar && args.size() != 0 && args.size() != 2) || (!solar && args.size() != 1 && args.size() != 3)) {
        m_diagnostics.error(s->loc,
                            solar ? "solar takes nothing, or an axis and an angle: solar (axis, angle) { … }"
                                  : "illuminate takes a position, and perhaps an axis and an angle: "
                                    "illuminate (from, axis, angle) { … }");
        return;
    }
    const auto set = [&](Emission what, Ref value) { m_b.store(m_emission[int(what)], value, s->loc); };
    const Ref Ps = global(m_sema.global("Ps"), s->loc);
    const Ref from = solar ? shader_frame(3, s->loc) : expr_as(args[0], {Base::Point});
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
        if (solar) {
            L = axis;
        } else if (!m_program.area_light) { // in front of which is its axis
            const auto length = [&](Ref v) {
                return m_b.emit(Op::Sqrt, Ty::Float, {m_b.emit(Op::Dot, Ty::Float, {v, v}, s->loc)}, s->loc);
            };
            const Ref cosine = m_b.emit(Op::Math1, Ty::Float, {angle}, s->loc, int(Fn::Cos));
            const Ref size = m_b.emit(Op::Mul, Ty::Float, {length(L), length(axis)}, s->loc);
            inside = m_b.emit(Op::Ge, Ty::Bool,
                              {m_b.emit(Op::Dot, Ty::Float, {L, axis}, s->loc),
                               m_b.emit(Op::Mul, Ty::Float, {cosine, size}, s->loc)},
                              s->loc);
        }
    } else {
        set(Emission::Axis, m_b.triple(0));
        set(Emission::Angle, m_b.constant(0.0f));
    }
    m_b.store(bind(m_sema.global("L")).var, L, s->loc);
    const auto dark = [&] { set(Emission::Color, m_b.triple(0)); };
    if (m_b.is_const(inside)) {
        statement(s->body);
        return;
    }
    Item i{Item::If};
    i.ref = inside;
    i.loc = s->loc;
    i.body = in_block([&] { statement(s->body); });
    i.orelse = in_block(dark);
    m_b.item(i);
}

} // namespace kanuka::sl::ir
