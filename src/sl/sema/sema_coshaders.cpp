// What is asked of co-shaders: s->x, s->f (…). Where the shader is compiled with co-shaders, types are
// theirs; else they follow from what is wanted.
#include <algorithm>

#include "sl/sema/linked.h"
#include "sl/sema/sema.h"

namespace kanuka::sl {

using namespace ast;

bool Linked::in_category(size_t unit, std::string_view category) const {
    std::string_view all = units[unit].given->category;
    while (!all.empty()) {
        const size_t comma = std::min(all.find(','), all.size());
        std::string_view one = all.substr(0, comma);
        all.remove_prefix(std::min(comma + 1, all.size()));
        while (!one.empty() && one.front() == ' ')
            one.remove_prefix(1);
        while (!one.empty() && one.back() == ' ')
            one.remove_suffix(1);
        if (one == category)
            return true;
    }
    return false;
}

// Positional arguments, then, for formals that have a default value, names and values.
static std::vector<Expr*> arrange(const FunctionDecl& f, const std::vector<Expr*>& args) {
    const size_t n = f.formals.size();
    size_t needed = 0;
    while (needed < n && !f.formals[needed]->init)
        needed++;
    const bool named = args.size() > needed && args[needed]->kind == ExprKind::String &&
                       std::any_of(f.formals.begin() + std::ptrdiff_t(needed), f.formals.end(),
                                   [&](const VarDecl* v) { return v->name == args[needed]->text; });
    if (args.size() == n && !named)
        return args;
    if (args.size() < needed)
        return {};
    std::vector<Expr*> all(args.begin(), args.begin() + std::ptrdiff_t(needed));
    for (size_t i = needed; i < n; i++)
        all.push_back(f.formals[i]->init);
    size_t i = needed;
    for (; i + 1 < args.size() && args[i]->kind == ExprKind::String; i += 2) {
        size_t k = needed;
        while (k < n && f.formals[k]->name != args[i]->text)
            k++;
        if (k == n)
            return {};
        all[k] = args[i + 1];
    }
    if (i == args.size())
        return all;
    // Or all by their places, the last left out.
    if (args.size() > n)
        return {};
    std::copy(args.begin(), args.end(), all.begin());
    return all;
}

ast::Type Sema::coshader(Expr* e, const ast::Type* expected) {
    note_use(CoShaderUse::Connected);
    const bool wanted = expected && expected->base != Base::Error && expected->base != Base::Bool;
    const ast::Type unknown = wanted ? *expected : ast::Type{Base::Float};
    const std::vector<Expr*> given(e->args.begin() + 1, e->args.end());
    if (!m_linked) {
        for (Expr* a : given) { // what may be an output is not read
            if (a->kind == ExprKind::Name && find(a->text))
                find(a->text)->written = true;
            expr(a);
        }
        return unknown;
    }
    const size_t count = m_linked->units.size();
    if (!e->called) {
        for (size_t u = 0; u < count; u++)
            if (VarDecl* v = m_linked->variable(u, e->text)) {
                v->read = true;
                return v->type;
            }
        return unknown;
    }
    // 1. Arguments have their types from the only method of that name, or stand for themselves.
    std::vector<FunctionDecl*> named;
    for (const Linked::Unit& unit : m_linked->units)
        for (FunctionDecl* f : unit.shader->functions)
            if (f->is_public && f->name == e->text)
                named.push_back(f);
    for (size_t i = 0; i < given.size(); i++) {
        const ast::Type* as = nullptr;
        for (const FunctionDecl* f : named)
            if (i < f->formals.size()) {
                as = as && !(*as == f->formals[i]->type) ? nullptr : &f->formals[i]->type;
                if (f->formals[i]->output && given[i]->kind == ExprKind::Name && find(given[i]->text))
                    find(given[i]->text)->written = true;
            }
        expr(given[i], as);
    }
    // 2. Each co-shader has its own.
    std::vector<Linked::Target> targets(count);
    const FunctionDecl* first = nullptr;
    for (size_t u = 0; u < count; u++) {
        int best = 1 << 20;
        for (FunctionDecl* f : m_linked->units[u].shader->functions) {
            if (!f->is_public || f->name != e->text)
                continue;
            std::vector<Expr*> args = arrange(*f, given);
            bool fits = args.size() == f->formals.size();
            int cost = 0;
            for (size_t i = 0; i < args.size() && fits; i++) {
                if (args[i] == f->formals[i]->init)
                    continue;
                const int c = conversion_cost(args[i]->type, f->formals[i]->type);
                fits = c >= 0;
                cost += c;
            }
            if (fits && cost < best) {
                best = cost;
                targets[u] = {f, std::move(args)};
            }
        }
        FunctionDecl* f = targets[u].function;
        if (!f)
            continue;
        f->called = true;
        first = first ? first : f;
        for (size_t i = 0; i < f->formals.size(); i++)
            if (f->formals[i]->output && targets[u].args[i] != f->formals[i]->init)
                written(targets[u].args[i], "an output of \"" + std::string(f->name) + "\"");
    }
    m_linked->calls[e] = std::move(targets);
    if (!first && !named.empty()) {
        std::string found;
        for (const Expr* a : given)
            found += (found.empty() ? "" : ", ") + a->type.str();
        m_diagnostics.warning(e->loc, "no co-shader's method \"" + std::string(e->text) + "\" takes (" +
                                          found + "): the call does nothing");
    }
    return first ? first->result : unknown;
}

} // namespace kanuka::sl
