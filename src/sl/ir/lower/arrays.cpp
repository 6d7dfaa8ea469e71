#include "sl/ir/lower/arrays.h"

#include <algorithm>
#include <deque>

#include "sl/ir/lower/assignments.h"
#include "sl/ir/lower/coshaders.h"
#include "sl/ir/lower/variables.h"

namespace kanuka::sl::ir {

using namespace ast;

void ArrayLowerer::end_stage() {
    Stage& s = m_b.stage();
    for (const Push& p : m_pushes)
        s.faults[size_t(p.fault)].second =
            "array \"" + s.vars[size_t(p.var)].name + "\" is full: it has room for " +
            std::to_string(s.vars[size_t(p.var)].array) +
            " values; reserve(array, n) before the loop makes more, as does the compiler's option for it";
}

// push(), pop() and their kin. Room is made when the stage is compiled: for what the calls are seen to ask,
// and for ResizableRoom elements where loops hide that.
Ref ArrayLowerer::array_op(const Expr* e, ops::Special what) {
    using ops::Special;
    const Expr* array = e->args[0];
    const Loc at = e->loc;
    if (array->type.base == Base::Struct && array->var && !array->var->fields.empty())
        return struct_array_op(e, what);
    if (what == Special::ArrayLength && array->type.array && array->kind == ExprKind::Call)
        return m_b.constant(float(coshaders().shader_list(array).size()));
    if (!array->type.array || !array->var) {
        if (!array->type.array)
            m_diagnostics.error(array->loc,
                                e->shadeop->name + "() needs an array, found " + array->type.str());
        return zero(Ty::Float);
    }
    const Binding b = bind(array->var);
    if (b.kind != Binding::Variable)
        return zero(Ty::Float);
    if (what == Special::ArrayLength)
        return length(b, at);
    if (what == Special::ArrayCapacity)
        return m_b.constant(float(room(b)));
    if (b.length < 0) {
        m_diagnostics.error(array->loc,
                            "\"" + std::string(array->var->name) +
                                "\" has a fixed size; declare it without one: " + array->type.str());
        return zero(Ty::Float);
    }
    ast::Type element = array->type;
    element.array = false;
    element.size = 0;
    if (what == Special::Pop)
        return pop(b, ty(element), at);
    if (what == Special::Push)
        push(b, e->args[1], element, at);
    else
        resize(b, e->args[1], what == Special::Resize, at);
    return zero(Ty::Float);
}

// An array of structs is an array for each member.
Ref ArrayLowerer::struct_array_op(const Expr* e, ops::Special what) {
    const std::vector<VarDecl*>& fields = e->args[0]->var->fields;
    const bool pushes = what == ops::Special::Push, pops = what == ops::Special::Pop;
    if (pops)
        m_diagnostics.error(e->loc, "pop() of structs: take the last element, then resize the array");
    std::deque<VarDecl> values; // what push() puts at the end, member by member
    std::vector<VarDecl*> parts;
    for (size_t k = 0; pushes && k < fields.size(); k++) {
        VarDecl& part = values.emplace_back(*fields[k]);
        part.type.array = part.resizable = false;
        part.kind = VarDecl::Local;
        variables().declare(&part);
        parts.push_back(&part);
    }
    if (pushes)
        assignments().assign_struct(parts, e->args[1], e->loc);
    Ref r = zero(Ty::Float);
    for (size_t k = 0; !pops && k < fields.size(); k++) {
        Expr names[2] = {{ExprKind::Name, e->loc}, {ExprKind::Name, e->loc}};
        names[0].var = fields[k];
        names[0].type = fields[k]->type;
        Expr call = *e;
        call.args[0] = &names[0];
        if (pushes) {
            names[1].var = parts[k];
            names[1].type = parts[k]->type;
            call.args[1] = &names[1];
        }
        r = array_op(&call, what);
    }
    for (const VarDecl* part : parts)
        m_state.bindings.erase(part);
    return r;
}

int ArrayLowerer::room(const Binding& array) {
    return m_b.stage().vars[size_t(array.var)].array;
}

Ref ArrayLowerer::length(const Binding& array, Loc at) {
    return array.length >= 0 ? m_b.load(array.length, at) : m_b.constant(float(room(array)));
}

void ArrayLowerer::push(const Binding& array, const Expr* what, const ast::Type& element, Loc at) {
    const int trips = m_state.loops.known == m_state.loops.depth ? m_state.loops.trips : 0;
    variables().need_room(array.var, trips > 0 ? room(array) + trips
                                               : std::max(m_context.options.array_room, room(array) + 1));
    const Ref value = expr_as(what, element), i = length(array, at);
    const Ref r = m_b.emit(Op::StoreElement, Ty::Void, {i, value}, at, array.var);
    m_pushes.push_back({array.var, fault(at, {})});
    m_b.stage().instrs[r].floats = {float(m_pushes.back().fault)};
    m_b.store(array.length, m_b.emit(Op::Add, Ty::Float, {i, m_b.constant(1.0f)}, at), at);
}

Ref ArrayLowerer::pop(const Binding& array, Ty element, Loc at) {
    const Ref less = m_b.emit(Op::Sub, Ty::Float, {length(array, at), m_b.constant(1.0f)}, at);
    const Ref i = m_b.emit(Op::Max, Ty::Float, {less, m_b.constant(0.0f)}, at);
    m_b.store(array.length, i, at);
    return m_b.emit(Op::LoadElement, element, {i}, at, array.var);
}

// Makes room, and sets the length.
void ArrayLowerer::resize(const Binding& array, const Expr* length, bool set, Loc at) {
    const Ref wanted = expr_as(length, {Base::Float});
    variables().need_room(array.var, m_b.is_const(wanted)
                                         ? int(std::clamp(m_b.at(wanted).floats[0], 1.0f, 65536.0f))
                                         : ResizableRoom);
    if (!set)
        return;
    const Ref some = m_b.emit(Op::Max, Ty::Float, {wanted, m_b.constant(0.0f)}, at);
    m_b.store(array.length, m_b.emit(Op::Min, Ty::Float, {some, m_b.constant(float(room(array)))}, at), at);
}

} // namespace kanuka::sl::ir
