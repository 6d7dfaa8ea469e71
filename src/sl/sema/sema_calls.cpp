#include <algorithm>

#include "sl/sema/sema.h"

namespace kanuka::sl {

using namespace ast;

// An expression that is assigned to. Parameters and globals that a shader may not change become copies of its
// own: much published code changes them.
void Sema::written(Expr* e, const std::string& by) {
    while (e->kind == ExprKind::Index)
        e = e->args[0];
    if (e->kind != ExprKind::Name) {
        m_diagnostics.warning(e->loc, "this is " + by + ", but is no variable: the value goes nowhere");
        return;
    }
    VarDecl* v = e->var;
    if (!v)
        return;
    const bool first = !v->assigned;
    v->written = v->assigned = true;
    for (VarDecl* f : v->fields)
        f->assigned = true;
    const std::string name = "\"" + std::string(v->name) + "\"";
    if (first && v->kind == VarDecl::Global && v->name == "P" && m_shader->kind == ShaderKind::Surface)
        m_diagnostics.warning(e->loc,
                              "P is " + by +
                                  " in a surface shader: what it computes with changes, as for a bump by "
                                  "calculatenormal(P); only a displacement shader moves the surface");
    if (first && v->kind == VarDecl::Parameter && !v->output)
        m_diagnostics.warning(e->loc, name + " is a parameter and is " + by +
                                          ": a copy of it changes; declare it output to hand it out");
    else if (v->kind == VarDecl::Global && v->global >= 0 &&
             (ops::globals()[size_t(v->global)].name == "PI" ||
              ops::globals()[size_t(v->global)].name == "null" ||
              ops::globals()[size_t(v->global)].name == "ncomps"))
        m_diagnostics.error(e->loc, name + " cannot be changed by a shader, but is " + by);
}

std::vector<FunctionDecl*> Sema::find_functions(std::string_view name) {
    // Inner functions come first: among equals the first is taken.
    std::vector<FunctionDecl*> all;
    for (Scope* s = m_scope; s; s = s->parent)
        if (const auto it = s->functions.find(name); it != s->functions.end())
            all.insert(all.end(), it->second.begin(), it->second.end());
    return all;
}

ast::Type Sema::call(Expr* e, const ast::Type* expected) {
    const std::vector<FunctionDecl*> functions = find_functions(e->text);
    const ops::Shadeop* op = ops::find_shadeop(e->text);
    if (!functions.empty()) {
        const bool single = functions.size() == 1 && !op;
        for (size_t i = 0; i < e->args.size(); i++) {
            const bool known = functions.size() == 1 && i < functions[0]->formals.size();
            // An output argument is not read: no warning that it has no value yet.
            bool output = false;
            for (const FunctionDecl* f : functions)
                output = output || (i < f->formals.size() && f->formals[i]->output);
            if (output && e->args[i]->kind == ExprKind::Name && find(e->args[i]->text))
                find(e->args[i]->text)->written = true;
            expr(e->args[i], known ? &functions[0]->formals[i]->type : nullptr);
            if (e->args[i]->type.base == Base::Error && e->args[i]->kind != ExprKind::Name)
                return {};
        }
        FunctionDecl* f = choose(e, functions, expected);
        if (f || single || !op)
            return f ? f->result : no_function(e, functions);
        // A function of the shader's own with other arguments: the shadeop of that name is meant.
        return call_shadeop(e, *op, expected);
    }
    if (op)
        return call_shadeop(e, *op, expected);
    std::vector<std::string_view> names;
    for (Scope* s = m_scope; s; s = s->parent)
        for (const auto& [n, f] : s->functions)
            names.push_back(n);
    for (const ops::Shadeop& op : ops::shadeops())
        if (!op.name.starts_with("__"))
            names.push_back(op.name);
    std::sort(names.begin(), names.end());
    const std::string near = closest(e->text, names);
    if (m_plugins) {
        for (Expr* a : e->args)
            expr(a);
        m_diagnostics.warning(e->loc, "\"" + std::string(e->text) + "\" is not known here: it gives 0");
        e->args.clear();
        return expected && expected->base != Base::Error ? *expected : ast::Type{Base::Float};
    }
    m_diagnostics.error(e->loc, "there is no function \"" + std::string(e->text) + "\"" +
                                    (near.empty() ? "" : "; did you mean \"" + near + "\"?"));
    for (Expr* a : e->args)
        expr(a);
    return {};
}

static int result_cost(const ast::Type& result, const ast::Type* expected) {
    if (!expected || expected->base == Base::Error)
        return 0;
    const int c = conversion_cost(result, *expected);
    return c < 0 ? 50 : c;
}

// The function that takes these arguments, null = none.
FunctionDecl* Sema::choose(Expr* e, const std::vector<FunctionDecl*>& candidates, const ast::Type* expected) {
    FunctionDecl* best = nullptr;
    int best_cost = 1 << 20;
    for (FunctionDecl* f : candidates) {
        if (f->formals.size() != e->args.size())
            continue;
        int cost = result_cost(f->result, expected);
        bool fits = true;
        for (size_t i = 0; i < e->args.size() && fits; i++) {
            const ast::Type &from = e->args[i]->type, &to = f->formals[i]->type;
            const int c = conversion_cost(from, to);
            // What comes back must fit too.
            fits = c >= 0 && (!f->formals[i]->output || conversion_cost(to, from) >= 0);
            cost += c * 4;
        }
        if (fits && cost < best_cost) {
            best = f;
            best_cost = cost;
        }
    }
    if (!best)
        return nullptr;
    e->function = best;
    best->called = true;
    for (size_t i = 0; i < e->args.size(); i++)
        if (best->formals[i]->output)
            written(e->args[i], "an output of \"" + std::string(best->name) + "\"");
    check_function(best);
    return best;
}

ast::Type Sema::no_function(Expr* e, const std::vector<FunctionDecl*>& candidates) {
    std::string found, have;
    for (const Expr* a : e->args)
        found += (found.empty() ? "" : ", ") + a->type.str();
    for (const FunctionDecl* f : candidates) {
        have += "\n  " + f->result.str() + " " + std::string(f->name) + "(";
        for (size_t i = 0; i < f->formals.size(); i++)
            have += (i ? ", " : "") + f->formals[i]->type.str();
        have += ")";
    }
    m_diagnostics.error(e->loc, "function \"" + std::string(e->text) + "\" does not take (" + found +
                                    "); there is" + have);
    return {};
}

// Gives arguments their types; false if one has none.
bool Sema::check_arguments(Expr* e, const ops::Shadeop& op, const ast::Type* expected) {
    // Arguments of one-signature shadeops have their type from it; the others stand for themselves.
    const bool single = op.signatures.size() == 1;
    bool broken = false;
    // Textures beside a colour, or where one is wanted, are colours: mix (Cs, texture (name), 0.5).
    static const ast::Type color{Base::Color};
    std::vector<size_t> order; // those that know their type first
    for (const bool open : {false, true})
        for (size_t i = 0; i < e->args.size(); i++)
            if (open == (!single && op.category != "Textures" && asks_texture(e->args[i])))
                order.push_back(i);
    const auto wants_color = [&](size_t i) {
        bool beside = expected && expected->is(Base::Color), takes = false;
        for (const Expr* a : e->args)
            beside = beside || a->type.is(Base::Color);
        for (const ops::Signature& s : op.signatures)
            takes = takes || (i < s.args.size() && s.args[i].type.is(Base::Color));
        return beside && takes;
    };
    for (const size_t i : order) {
        const bool known = single && i < op.signatures[0].args.size();
        // An output argument is not read: no warning that it has no value yet.
        bool output = false;
        for (const ops::Signature& s : op.signatures)
            output = output || (i < s.args.size() ? s.args[i].output
                                                  : s.variadic && !s.args.empty() && s.args.back().output);
        Expr* a = e->args[i];
        if (output && a->kind == ExprKind::Name && find(a->text))
            find(a->text)->written = true;
        const bool open = !single && op.category != "Textures" && asks_texture(a);
        expr(a, known ? &op.signatures[0].args[i].type : open && wants_color(i) ? &color : nullptr);
        broken = broken || a->type.base == Base::Error;
    }
    return !broken;
}

// What the conversions of the arguments cost for one signature, negative = it does not take them.
static int arguments_cost(const Expr* e, const ops::Signature& s) {
    int cost = 0;
    for (size_t i = 0; i < s.args.size(); i++) {
        const ast::Type& from = e->args[i]->type;
        const ast::Type& to = s.args[i].type;
        int c = conversion_cost(from, to);
        if (to.base == Base::Lobe)
            c = from.base == Base::Lobe ? 0 : -1;
        else if (to.base == Base::Void)
            c = 0;
        else if (s.args[i].output && from.base != to.base && !(from.spatial() && to.spatial()))
            c = -1;
        if (c < 0)
            return -1;
        cost += c * 4;
    }
    // min and max: further arguments are of the same type.
    if (s.impl == ops::Impl::Primitive)
        for (size_t i = s.args.size(); i < e->args.size(); i++) {
            const int c = conversion_cost(e->args[i]->type, s.args.back().type);
            if (c < 0)
                return -1;
            cost += c * 4;
        }
    return cost;
}

// The signature that takes the arguments at the least cost, -1 = none.
static int choose_signature(const Expr* e, const ops::Shadeop& op, const ast::Type* expected) {
    int best = -1, best_cost = 1 << 20;
    for (size_t k = 0; k < op.signatures.size(); k++) {
        const ops::Signature& s = op.signatures[k];
        if (e->args.size() < s.args.size() || (e->args.size() > s.args.size() && !s.variadic))
            continue;
        const int arguments = arguments_cost(e, s);
        const int cost = result_cost(s.result, expected) + (s.variadic ? 1 : 0) + arguments;
        if (arguments >= 0 && cost < best_cost) {
            best = int(k);
            best_cost = cost;
        }
    }
    return best;
}

void Sema::no_signature(const Expr* e, const ops::Shadeop& op) {
    std::string found, have;
    for (const Expr* a : e->args)
        found += (found.empty() ? "" : ", ") + a->type.str();
    for (const ops::Signature& s : op.signatures) {
        have += "\n  " + s.result.str() + " " + op.name + "(";
        for (size_t i = 0; i < s.args.size(); i++)
            have += std::string(i ? ", " : "") + (s.args[i].output ? "output " : "") +
                    (s.args[i].type.base == Base::Lobe ? "lobe" : s.args[i].type.str()) + " " +
                    s.args[i].name;
        have += s.variadic ? ", …)" : ")";
    }
    m_diagnostics.error(e->loc, "shadeop \"" + op.name + "\" does not take (" + found + "); there is" + have);
}

ast::Type Sema::call_shadeop(Expr* e, const ops::Shadeop& op, const ast::Type* expected) {
    if (!check_arguments(e, op, expected))
        return {};
    const int best = choose_signature(e, op, expected);
    if (best < 0) {
        no_signature(e, op);
        return {};
    }
    e->shadeop = &op;
    e->signature = best;
    const ops::Signature& s = op.signatures[best];
    if (s.special == ops::Special::GetShader || s.special == ops::Special::GetShaders)
        note_use(CoShaderUse::Any);
    else if (s.special == ops::Special::GetVariable || s.special == ops::Special::HasMethod)
        note_use(CoShaderUse::Connected);
    for (size_t i = 0; i < s.args.size(); i++)
        if (s.args[i].output)
            written(e->args[i], "an output of " + op.name + "()");
    if (s.impl == ops::Impl::Source && !source(op, best))
        return {};
    if (s.special == ops::Special::Pop && e->args[0]->type.array) { // of what the array has
        ast::Type element = e->args[0]->type;
        element.array = false;
        element.size = 0;
        return element;
    }
    return s.result;
}

// Ray (P, R): values of the members in their order, or by name: Ray ("origin", P).
ast::Type Sema::construct_struct(Expr* e) {
    const ast::Type type = e->type;
    const std::vector<VarDecl*>& members = type.record->members;
    std::vector<Expr*> values(members.size(), nullptr);
    const auto by_name = [&](const Expr* a) -> int {
        for (size_t k = 0; a->kind == ExprKind::String && k < members.size(); k++)
            if (members[k]->name == a->text)
                return int(k);
        return -1;
    };
    const bool named = e->args.size() > 1 && by_name(e->args[0]) >= 0 && e->args.size() % 2 == 0;
    for (size_t i = 0; i < e->args.size(); i++) {
        const int k = named ? by_name(e->args[i]) : int(i);
        if (k < 0 || size_t(k) >= members.size()) {
            m_diagnostics.error(e->args[i]->loc, named ? "the struct has no member of this name"
                                                       : "struct \"" + std::string(type.record->name) +
                                                             "\" has " + std::to_string(members.size()) +
                                                             " members");
            break;
        }
        i += named;
        const ast::Type& to = members[size_t(k)]->type;
        expr(e->args[i], &to);
        if (!to.array)
            want(e->args[i], to, "member \"" + std::string(members[size_t(k)]->name) + "\"");
        values[size_t(k)] = e->args[i];
    }
    e->args = std::move(values); // null = the member's own default
    return type;
}

// A string that stands for one of the values 0, 1, … of an input: the number takes its place.
void Sema::choose(Expr* e, std::span<const std::string_view> choices, std::string_view input) {
    std::string have;
    for (size_t k = 0; k < choices.size(); k++) {
        if (choices[k] == e->text) {
            e->kind = ExprKind::Number;
            e->number = float(k);
            e->type = {Base::Float};
            return;
        }
        have += (k ? ", \"" : "\"") + std::string(choices[k]) + "\"";
    }
    m_diagnostics.error(e->loc, "input \"" + std::string(input) + "\" has no choice \"" +
                                    std::string(e->text) + "\"; it has " + have);
    e->type = {Base::Float};
}

// LambertBrdf("diffuseReflectance", color (1, 0, 0)): names and values of inputs.
ast::Type Sema::construct(Expr* e) {
    if (e->type.base == Base::Struct)
        return construct_struct(e);
    const grid::LobeDecl& lobe = grid::lobe(e->type.lobe);
    const ast::Type type = e->type;
    for (size_t i = 0; i < e->args.size(); i += 2) {
        Expr* name = e->args[i];
        if (name->kind != ExprKind::String) {
            m_diagnostics.error(name->loc, "expected the name of an input as a string constant");
            return type;
        }
        name->type = {Base::String};
        if (i + 1 >= e->args.size()) {
            m_diagnostics.error(name->loc, "input \"" + std::string(name->text) + "\" has no value");
            return type;
        }
        const int input = grid::find_input(lobe, name->text);
        if (input < 0) {
            std::string have;
            std::vector<std::string_view> names;
            for (const grid::LobeInput& in : lobe.inputs) {
                have += (have.empty() ? "" : ", ") + std::string(in.name);
                names.push_back(in.name);
            }
            m_diagnostics.error(name->loc, std::string(lobe.name) + " has no input \"" +
                                               std::string(name->text) + "\"; it has " + have);
            expr(e->args[i + 1]);
            continue;
        }
        const std::span<const std::string_view> choices = lobe.inputs[input].names;
        if (!choices.empty() && e->args[i + 1]->kind == ExprKind::String) {
            choose(e->args[i + 1], choices, name->text);
            continue;
        }
        const ast::Type want_type{base_of(lobe.inputs[input].type)};
        expr(e->args[i + 1], &want_type);
        want(e->args[i + 1], want_type, "input \"" + std::string(name->text) + "\"");
    }
    return type;
}

} // namespace kanuka::sl
