#include "sl/ir/lower/queries.h"

#include <algorithm>

#include "sl/ir/lower/assignments.h"
#include "sl/ir/lower/expressions.h"
#include "sl/ir/lower/variables.h"

namespace kanuka::sl::ir {

using namespace ast;

// attribute ("name", variable) and its kin: 1 and the variable's value if the host knows, else 0.
Ref QueryLowerer::query(const Expr* e, const ops::Signature& s) {
    const Query::Kind kind = Query::Kind(s.imm);
    const bool texture = kind == Query::Texture;
    const size_t names = texture ? 2 : 1;
    std::vector<Ref> args;
    for (size_t i = 0; i < names; i++)
        args.push_back(expr(e->args[i]));
    const Expr* target = e->args.size() > names ? e->args[names] : nullptr;
    const bool array = target && target->type.array;
    ast::Type element = target ? target->type : ast::Type{Base::Float};
    element.array = false;
    const Ty t = array && ty(element) == Ty::Float ? Ty::Matrix : ty(element);
    // What is asked for decides what fits: a string is no answer where a number is wanted.
    const auto ask = [&](CallKind call, Ty result) {
        CallSite site{call, e->loc};
        site.args = args;
        site.imm = int(kind) * 4 + (t == Ty::String ? 0 : t == Ty::Float ? 1 : t == Ty::Triple ? 2 : 3);
        return m_b.call(std::move(site), result);
    };
    const Ref found = ask(CallKind::Found, Ty::Float);
    if (!target || t == Ty::Void)
        return found;
    const Ref value = ask(CallKind::Query, t);
    const Ref known = expressions().truth(found);
    if (array) {
        if (target->var && ty(element) == Ty::Float)
            answer_array(bind(target->var), known, value, e->loc);
        return found;
    }
    const Ref old = expr(target);
    if (m_b.at(old).ty == t)
        assignments().assign_to(target, m_b.emit(Op::Select, t, {known, value, old}, e->loc), e->loc);
    return found;
}

// The first sixteen elements, where the host knows.
void QueryLowerer::answer_array(const Binding& b, Ref known, Ref value, Loc at) {
    if (b.kind != Binding::Variable)
        return;
    for (int i = 0; i < std::min(m_b.stage().vars[size_t(b.var)].array, 16); i++) {
        const Ref old = m_b.emit(Op::LoadElement, Ty::Float, {m_b.constant(float(i))}, at, b.var);
        const Ref part = m_b.emit(Op::Extract, Ty::Float, {value}, at, i);
        const Ref now = m_b.emit(Op::Select, Ty::Float, {known, part, old}, at);
        m_b.emit(Op::StoreElement, Ty::Void, {m_b.constant(float(i)), now}, at, b.var);
    }
}

// rayinfo (name, variable). A surface is shaded for whatever ray may come: as if for one from the camera.
Ref QueryLowerer::ray_info(const Expr* e) {
    const std::string what = e->args[0]->kind == ExprKind::String ? std::string(e->args[0]->text) : "";
    const Expr* target = e->args[1];
    const Ty t = target->var ? ty(target->type) : Ty::Void;
    Ref value = ir::None;
    if (what == "type" && t == Ty::String)
        value = m_b.text("camera");
    else if (what == "direction" && t == Ty::Triple)
        value = variables().global("I", e->loc);
    else if (what == "origin" && t == Ty::Triple && m_state.role == Role::Shade)
        value = variables().global("E", e->loc);
    else if (t == Ty::Float && (what.ends_with("depth") || what == "shadeopacity" || what == "ismedium"))
        value = zero(t);
    if (value == ir::None || target->type.array ||
        (t == Ty::Triple && m_b.stage().vars[size_t(bind(target->var).var)].must_be_uniform))
        return zero(Ty::Float);
    assignments().assign_to(target, value, e->loc);
    return m_b.constant(1.0f);
}

} // namespace kanuka::sl::ir
