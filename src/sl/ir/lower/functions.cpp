#include "sl/ir/lower/functions.h"

#include <algorithm>

#include "sl/ir/lower/assignments.h"
#include "sl/ir/lower/shadeops.h"
#include "sl/ir/lower/statements.h"
#include "sl/ir/lower/variables.h"

namespace kanuka::sl::ir {

using namespace ast;

Ref FunctionLowerer::call(const Expr* e) {
    if (e->function) {
        std::vector<const Expr*> args(e->args.begin(), e->args.end());
        return inline_function(e->function, args, e->loc);
    }
    return e->shadeop ? shadeops().shadeop(e) : zero(ty(e->type));
}

// A function whose only return is its last statement needs no jump.
bool FunctionLowerer::returns_early(const FunctionDecl* f) {
    const auto [it, fresh] = m_early.try_emplace(f, false);
    if (fresh) {
        const std::vector<Stmt*>& body = f->body->block;
        for (size_t i = 0; i < body.size(); i++)
            if (has_return(body[i]) && !(i + 1 == body.size() && body[i]->kind == StmtKind::Return))
                it->second = true;
    }
    return it->second;
}

// What a formal stands for: the caller's variable where it is an output or an array, else a value. What is
// neither (an output that is no plain variable) is copied, and back after the call.
void FunctionLowerer::bind_formal(const VarDecl* formal, const Expr* a, Bindings& bindings, Copies& copies) {
    if (formal->type.base == Base::Struct)
        return bind_struct(formal, a, bindings, copies);
    Binding b;
    if (formal->type.handle()) {
        b.kind = Binding::Handle;
    } else if (formal->type.base == Base::Lobe || formal->type.array) {
        if (a->var) {
            b = bind(a->var);
        } else if (formal->type.array) { // a list or an empty array
            b.kind = Binding::Variable;
            b.var = m_b.var(std::string(formal->name), ty(formal->type), formal->loc,
                            std::max(1, int(a->kind == ExprKind::List ? a->args.size() : 0)));
            m_b.declare(b.var);
            if (a->kind != ExprKind::List) {
                b.length = m_b.var(std::string(formal->name) + ".length", Ty::Float, formal->loc);
                m_b.declare(b.length);
            }
            assignments().assign_array(b, a, formal->type, a->loc);
        }
    } else if (formal->output && a->kind == ExprKind::Name && a->var &&
               bind(a->var).kind == Binding::Variable) {
        b = bind(a->var);
    } else if (formal->output || formal->assigned) {
        b.kind = Binding::Variable;
        const Ref value = expr_as(a, formal->type);
        b.var = m_b.var(std::string(formal->name), ty(formal->type), formal->loc);
        m_b.declare(b.var);
        store_tagged(b.var, value, a->loc);
        if (formal->output)
            copies.emplace_back(a, b.var);
    } else {
        b.kind = Binding::Value;
        b.value = expr_as(a, formal->type);
    }
    bindings.emplace_back(formal, std::move(b));
}

void FunctionLowerer::bind_struct(const VarDecl* formal, const Expr* a, Bindings& bindings, Copies& copies) {
    const bool named = a->kind == ExprKind::Name && a->var;
    if (!named) { // a result or a constructor: into variables of its own
        for (VarDecl* f : formal->fields)
            variables().declare(f);
        assignments().assign_struct(formal->fields, a, a->loc);
        return;
    }
    for (size_t i = 0; i < formal->fields.size() && i < a->var->fields.size(); i++) {
        Expr name{ExprKind::Name, a->loc};
        name.var = a->var->fields[i];
        name.type = name.var->type;
        bind_formal(formal->fields[i], &name, bindings, copies);
    }
}

Ref FunctionLowerer::inline_function(FunctionDecl* f, const std::vector<const Expr*>& args, Loc at) {
    Bindings bindings;
    Copies copies;
    for (size_t i = 0; i < f->formals.size(); i++)
        bind_formal(f->formals[i], args[i], bindings, copies);
    return inline_bound(f, std::move(bindings), copies, at);
}

Ref FunctionLowerer::inline_bound(FunctionDecl* f, Bindings bindings, const Copies& copies, Loc at) {
    const Ref result = inline_placed(f, std::move(bindings), at);
    for (const auto& [target, var] : copies)
        assignments().assign_to(target, m_b.load(var, at), at);
    return result;
}

// s->f (…): the members that the function sees are those of s.
Ref FunctionLowerer::struct_call(const Expr* e) {
    Bindings bindings;
    const auto members = [&](auto& again, const std::vector<VarDecl*>& seen,
                             const std::vector<VarDecl*>& own) -> void {
        for (size_t i = 0; i < seen.size() && i < own.size(); i++)
            if (own[i]->fields.empty())
                bindings.emplace_back(seen[i], bind(own[i]));
            else
                again(again, seen[i]->fields, own[i]->fields);
    };
    members(members, e->var->type.record->members, e->var->fields);
    Copies copies;
    for (size_t i = 0; i < e->function->formals.size(); i++)
        bind_formal(e->function->formals[i], e->args[i + 1], bindings, copies);
    return inline_bound(e->function, std::move(bindings), copies, e->loc);
}

Ref FunctionLowerer::inline_with(FunctionDecl* f, std::vector<Binding> values, Loc at) {
    Bindings bindings;
    for (size_t i = 0; i < f->formals.size(); i++)
        bindings.emplace_back(f->formals[i], std::move(values[i]));
    return inline_placed(f, std::move(bindings), at);
}

Ref FunctionLowerer::inline_values(FunctionDecl* f, const std::vector<Ref>& args, Loc at) {
    std::vector<Binding> values(f->formals.size());
    for (size_t i = 0; i < values.size(); i++) {
        values[i].kind = Binding::Value;
        values[i].value = args[i];
    }
    return inline_with(f, std::move(values), at);
}

Ref FunctionLowerer::source_call(const char* shadeop, std::vector<Ref> args, Loc at, Ty result) {
    const ops::Shadeop* op = ops::find_shadeop(shadeop);
    for (size_t k = 0; op && k < op->signatures.size(); k++) {
        const ops::Signature& s = op->signatures[k];
        bool fits = s.impl == ops::Impl::Source && s.args.size() == args.size() && ty(s.result) == result;
        for (size_t i = 0; fits && i < args.size(); i++)
            fits = ty(s.args[i].type) == m_b.at(args[i]).ty;
        FunctionDecl* f = fits ? m_sema.source(*op, int(k)) : nullptr;
        if (!f)
            continue;
        return inline_values(f, args, at);
    }
    return zero(result);
}

// A stage method: its formals are the stage's own outputs and handles.
void FunctionLowerer::run_method(FunctionDecl* f) {
    std::vector<Binding> bindings;
    for (const VarDecl* v : f->formals) {
        Binding b;
        b.kind = Binding::Handle;
        const char* global_name = v->type.is(Base::Point)    ? "P"
                                  : v->type.is(Base::Normal) ? "N"
                                  : v->type.is(Base::Color)
                                      ? (bindings.empty() && f->name != "opacity" ? "Ci" : "Oi")
                                      : nullptr;
        if (global_name)
            b = bind(m_sema.global(global_name));
        bindings.push_back(std::move(b));
    }
    inline_with(f, std::move(bindings), f->loc);
}

Ref FunctionLowerer::inline_placed(FunctionDecl* f, Bindings bindings, Loc at) {
    // What a shadeop's own source does is said to be at its call.
    const bool outermost = !m_b.place() && m_diagnostics.sources().name(f->loc.file).starts_with("<");
    if (outermost)
        m_b.set_place(&at);
    const Ref result = inline_body(f, std::move(bindings), at);
    if (outermost)
        m_b.set_place(nullptr);
    return result;
}

Ref FunctionLowerer::inline_body(FunctionDecl* f, Bindings bindings, Loc at) {
    const auto runs = [&](const ActiveFunction& a) { return a.function == f; };
    if (std::ranges::any_of(m_state.active, runs)) {
        m_diagnostics.error(at,
                            "function \"" + std::string(f->name) + "\" calls itself; RSL has no recursion");
        return zero(ty(f->result));
    }
    if (m_state.active.size() > 200 || m_context.overflow)
        return zero(ty(f->result));
    for (auto& [formal, binding] : bindings)
        m_state.bindings[formal] = std::move(binding);
    if (f->result_fields)
        for (const VarDecl* field : f->result_fields->fields)
            variables().declare(field);
    m_state.active.push_back({f, m_state.self});
    std::vector<LoopTargets> loops;
    loops.swap(m_state.loops.targets);
    const Ty t = ty(f->result);
    const Ref result = returns_early(f) ? scoped_body(f, t, at) : plain_body(f);
    loops.swap(m_state.loops.targets);
    m_state.active.pop_back();
    return result == ir::None ? zero(t == Ty::Void ? Ty::Float : t) : result;
}

// Its returns jump to its end.
Ref FunctionLowerer::scoped_body(FunctionDecl* f, Ty result, Loc at) {
    const int var = result == Ty::Void ? -1 : m_b.var(std::string(f->name), result, at);
    if (var >= 0) {
        m_b.declare(var);
        m_b.store(var, zero(result), at);
    }
    const int target = m_b.stage().targets++;
    m_state.returns.push_back({target, var});
    Item scope{Item::Scope};
    scope.target = target;
    scope.loc = at;
    scope.body = in_block([&] { statements().statement(f->body); });
    m_b.item(scope);
    m_state.returns.pop_back();
    return var >= 0 ? load_tagged(var, at) : ir::None;
}

Ref FunctionLowerer::plain_body(FunctionDecl* f) {
    Ref result = ir::None;
    m_state.returns.push_back({-1, -1});
    for (const Stmt* s : f->body->block) {
        if (s->kind != StmtKind::Return)
            statements().statement(s);
        else if (s->expr && f->result_fields)
            assignments().assign_struct(f->result_fields->fields, s->expr, s->loc);
        else if (s->expr)
            result = expr_as(s->expr, f->result);
    }
    m_state.returns.pop_back();
    return result;
}

} // namespace kanuka::sl::ir
