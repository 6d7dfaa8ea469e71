#include "sl/ir/lower/assignments.h"

#include <algorithm>
#include <deque>

#include "sl/ir/lower/coshaders.h"
#include "sl/ir/lower/expressions.h"
#include "sl/ir/lower/materials.h"
#include "sl/ir/lower/matrix.h"
#include "sl/ir/lower/variables.h"

namespace kanuka::sl::ir {

using namespace ast;

void AssignmentLowerer::assign_array(const Binding& to, const Expr* value, const ast::Type& type, Loc at) {
    const int var = to.var;
    if (var < 0)
        return;
    ast::Type element = type;
    element.array = false;
    const auto length = [&](Ref n) {
        if (to.length >= 0)
            m_b.store(to.length, n, at);
    };
    const auto put = [&](int i, Ref r) {
        m_b.emit(Op::StoreElement, Ty::Void, {m_b.constant(float(i)), r}, at, var);
    };
    if (value->kind == ExprKind::List) {
        const int given = int(value->args.size());
        if (to.length >= 0)
            variables().need_room(var, given);
        const int n = to.length >= 0 ? given : m_b.stage().vars[var].array;
        for (int i = 0; i < n; i++)
            put(i, i < given ? expr_as(value->args[size_t(i)], element) : zero(ty(element)));
        length(m_b.constant(float(given)));
    } else if (value->type.array) {
        if (!value->var) { // a list of co-shaders, or the empty array of a shadeop
            const std::vector<std::string> handles = coshaders().shader_list(value);
            if (value->kind != ExprKind::Call)
                expr(value);
            if (to.length >= 0)
                variables().need_room(var, int(handles.size()));
            const int n = std::min(m_b.stage().vars[var].array, int(handles.size()));
            for (int i = 0; i < n; i++)
                put(i, m_b.text(handles[size_t(i)]));
            return length(m_b.constant(float(n)));
        }
        const Binding from = bind(value->var);
        if (from.var < 0)
            return;
        const int available = m_b.stage().vars[from.var].array;
        if (to.length >= 0)
            variables().need_room(var, available);
        for (int i = 0; i < std::min(m_b.stage().vars[var].array, available); i++) {
            const Ref r = m_b.emit(Op::LoadElement, ty(element), {m_b.constant(float(i))}, at, from.var);
            put(i, r);
        }
        length(from.length >= 0 ? m_b.load(from.length, at) : m_b.constant(float(available)));
    } else {
        const Ref r = expr_as(value, element);
        const int n = m_b.stage().vars[var].array;
        for (int i = 0; i < n; i++)
            put(i, r);
    }
}

void AssignmentLowerer::copy_fields(const std::vector<VarDecl*>& to, const std::vector<VarDecl*>& from,
                                    Loc at) {
    for (size_t i = 0; i < to.size() && i < from.size(); i++) {
        if (!to[i]->fields.empty()) {
            copy_fields(to[i]->fields, from[i]->fields, at);
            continue;
        }
        Expr name{ExprKind::Name, at};
        name.var = from[i];
        name.type = from[i]->type;
        const Binding target = bind(to[i]);
        if (to[i]->type.array)
            assign_array(target, &name, to[i]->type, at);
        else if (target.kind == Binding::Variable)
            store_tagged(target.var, expr(&name), at);
    }
}

// All values are computed before the first is assigned: they may read what is assigned.
void AssignmentLowerer::construct_struct(const std::vector<VarDecl*>& fields, const Expr* value, Loc at) {
    const auto given = [&](size_t i) -> const Expr* {
        return i < value->args.size() && value->args[i] ? value->args[i] : fields[i]->init;
    };
    std::vector<Ref> values(fields.size(), ir::None);
    for (size_t i = 0; i < fields.size() && i < value->args.size(); i++)
        if (const Expr* a = given(i); a && fields[i]->fields.empty() && !fields[i]->type.array)
            values[i] = expr_as(a, fields[i]->type);
    for (size_t i = 0; i < fields.size(); i++) {
        const Expr* a = given(i);
        const Binding target = bind(fields[i]);
        if (!fields[i]->fields.empty()) {
            if (a)
                assign_struct(fields[i]->fields, a, at);
        } else if (fields[i]->type.array) {
            if (a)
                assign_array(target, a, fields[i]->type, at);
        } else if (target.kind == Binding::Variable) {
            store_tagged(target.var, values[i] != ir::None ? values[i] : zero(ty(fields[i]->type)), at);
        }
    }
}

// The members of a struct take the value of an expression: another struct, a constructor, a function's
// result.
void AssignmentLowerer::assign_struct(const std::vector<VarDecl*>& fields, const Expr* value, Loc at) {
    if (value->kind == ExprKind::Construct) {
        construct_struct(fields, value, at);
    } else if (value->kind == ExprKind::Name && value->var) {
        copy_fields(fields, value->var->fields, at);
    } else if (value->kind == ExprKind::Index && value->args[0]->var) { // an element of an array of structs
        const std::vector<VarDecl*>& from = value->args[0]->var->fields;
        const Ref i = expr_as(value->args[1], {Base::Float});
        for (size_t k = 0; k < fields.size() && k < from.size(); k++) {
            const Binding source = bind(from[k]), target = bind(fields[k]);
            if (source.kind != Binding::Variable || target.kind != Binding::Variable)
                continue;
            m_b.store(target.var, m_b.emit(Op::LoadElement, ty(fields[k]->type), {i}, at, source.var), at);
        }
    } else if (value->kind == ExprKind::Call && value->function) {
        expr(value);
        if (value->function->result_fields)
            copy_fields(fields, value->function->result_fields->fields, at);
    } else if (value->kind == ExprKind::Method && !value->function) {
        coshaders().coshader(value, &fields);
    } else if (value->kind == ExprKind::Assign) {
        expr(value);
        if (value->args[0]->var)
            copy_fields(fields, value->args[0]->var->fields, at);
    } else {
        m_diagnostics.error(value->loc,
                            "expected a struct's variable, its constructor or a function's result");
    }
}

void AssignmentLowerer::assign_to(const Expr* target, Ref value, Loc at) {
    if (target->kind == ExprKind::Index && !target->args[0]->type.array) {
        // A component of what may itself be an element of an array.
        const Expr* whole = target->args[0];
        const bool matrix = whole->type.is(Base::Matrix) && whole->kind == ExprKind::Index;
        if (!matrix && !whole->type.triple()) {
            m_diagnostics.error(target->loc, "cannot assign to this part of a " + whole->type.str());
            return;
        }
        if (matrix)
            whole = whole->args[0];
        const Ref i =
            matrix ? expressions().element_of_matrix(target) : expr_as(target->args[1], {Base::Float});
        return assign_to(whole, with_component(m_b, expr(whole), i, value, at), at);
    }
    const bool element = target->kind == ExprKind::Index;
    const Expr* base = element ? target->args[0] : target;
    if (!base->var)
        return;
    const Ref i = element ? expr_as(target->args[1], {Base::Float}) : ir::None;
    const Binding& b = bind(base->var);
    if (b.kind != Binding::Variable)
        return;
    const int var = b.var;
    if (!element)
        return store_tagged(var, value, at);
    const Ref r = m_b.emit(Op::StoreElement, Ty::Void, {i, value}, at, var);
    m_b.stage().instrs[r].floats = {float(
        fault(target->args[1]->loc, "index outside of array \"" + std::string(base->var->name) + "\""))};
}

// array[i] = a struct
void AssignmentLowerer::assign_struct_element(const Expr* target, const Expr* from, Loc at) {
    const std::vector<VarDecl*>& arrays = target->args[0]->var->fields;
    std::deque<VarDecl> temporaries; // one of the element's type for each member
    std::vector<VarDecl*> fields;
    for (const VarDecl* a : arrays) {
        VarDecl& t = temporaries.emplace_back(*a);
        t.type.array = false;
        t.resizable = false;
        t.kind = VarDecl::Local;
        variables().declare(&t);
        fields.push_back(&t);
    }
    assign_struct(fields, from, at);
    const Ref i = expr_as(target->args[1], {Base::Float});
    for (size_t k = 0; k < arrays.size(); k++) {
        const Binding array = bind(arrays[k]);
        if (array.kind == Binding::Variable)
            m_b.emit(Op::StoreElement, Ty::Void, {i, m_b.load(bind(fields[k]).var, at)}, at, array.var);
    }
    for (const VarDecl* t : fields)
        m_state.bindings.erase(t);
}

Ref AssignmentLowerer::assign(const Expr* e) {
    const Expr *target = e->args[0], *from = e->args[1];
    if (target->type.handle()) {
        expr(from);
        return ir::None;
    }
    if (target->type.base == Base::Lobe) {
        if (target->var)
            materials().bind_lobe(target->var, from);
        return ir::None;
    }
    if (target->type.base == Base::Struct && !target->type.array) {
        if (target->kind == ExprKind::Index && target->args[0]->var)
            assign_struct_element(target, from, e->loc);
        else if (target->var)
            assign_struct(target->var->fields, from, e->loc);
        return zero(Ty::Float);
    }
    if (target->type.array) {
        if (target->var)
            assign_array(Binding(bind(target->var)), from, target->type, e->loc);
        return zero(Ty::Float);
    }
    Ref value;
    if (e->op == BinOp::None) {
        value = expr_as(from, target->type);
    } else {
        const Ref old = expr(target);
        const Ref change = expr(from);
        ast::Type result = target->type;
        if (e->op == BinOp::Dot)
            result = {Base::Float};
        value = expressions().convert(
            expressions().arithmetic(e->op, old, target->type, change, from->type, result, e->loc),
            target->type, e->loc);
    }
    assign_to(target, value, e->loc);
    return value;
}

} // namespace kanuka::sl::ir
