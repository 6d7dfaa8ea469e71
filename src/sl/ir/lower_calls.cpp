#include <algorithm>
#include <cmath>
#include <cstdio>

#include "sl/ir/lower.h"

namespace kanuka::sl::ir {

using namespace ast;

Ref Lower::call(const Expr* e) {
    if (e->function) {
        std::vector<const Expr*> args(e->args.begin(), e->args.end());
        return inline_function(e->function, args, e->loc);
    }
    return e->shadeop ? shadeop(e) : zero(ty(e->type));
}

// ---- functions
// ------------------------------------------------------------------------------------------------------

// A function whose only return is its last statement needs no jump.
bool Lower::returns_early(const FunctionDecl* f) {
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
void Lower::bind_formal(const VarDecl* formal, const Expr* a, Bindings& bindings,
                        std::vector<std::pair<const Expr*, int>>& copies) {
    Binding b;
    if (formal->type.base == Base::Struct) {
        const bool named = a->kind == ExprKind::Name && a->var;
        if (!named) { // a result or a constructor: into variables of its own
            for (VarDecl* f : formal->fields)
                declare(f);
            assign_struct(formal->fields, a, a->loc);
            return;
        }
        for (size_t i = 0; i < formal->fields.size() && i < a->var->fields.size(); i++) {
            Expr name{ExprKind::Name, a->loc};
            name.var = a->var->fields[i];
            name.type = name.var->type;
            bind_formal(formal->fields[i], &name, bindings, copies);
        }
        return;
    }
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
            assign_array(b, a, formal->type, a->loc);
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

Ref Lower::inline_function(FunctionDecl* f, const std::vector<const Expr*>& args, Loc at) {
    Bindings bindings;
    std::vector<std::pair<const Expr*, int>> copies;
    for (size_t i = 0; i < f->formals.size(); i++)
        bind_formal(f->formals[i], args[i], bindings, copies);
    const Ref result = inline_placed(f, std::move(bindings), at);
    for (const auto& [target, var] : copies)
        assign_to(target, m_b.load(var, at), at);
    return result;
}

// s->f (…): the members that the function sees are those of s.
Ref Lower::struct_call(const Expr* e) {
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
    std::vector<std::pair<const Expr*, int>> copies;
    for (size_t i = 0; i < e->function->formals.size(); i++)
        bind_formal(e->function->formals[i], e->args[i + 1], bindings, copies);
    const Ref result = inline_placed(e->function, std::move(bindings), e->loc);
    for (const auto& [target, var] : copies)
        assign_to(target, m_b.load(var, e->loc), e->loc);
    return result;
}

Ref Lower::inline_with(FunctionDecl* f, std::vector<Binding> values, Loc at) {
    Bindings bindings;
    for (size_t i = 0; i < f->formals.size(); i++)
        bindings.emplace_back(f->formals[i], std::move(values[i]));
    return inline_placed(f, std::move(bindings), at);
}

Ref Lower::inline_values(FunctionDecl* f, const std::vector<Ref>& args, Loc at) {
    std::vector<Binding> values(f->formals.size());
    for (size_t i = 0; i < values.size(); i++) {
        values[i].kind = Binding::Value;
        values[i].value = args[i];
    }
    return inline_with(f, std::move(values), at);
}

Ref Lower::inline_placed(FunctionDecl* f, Bindings bindings, Loc at) {
    // What a shadeop's own source does is said to be at its call.
    const bool outermost = !m_b.place() && m_diagnostics.sources().name(f->loc.file).starts_with("<");
    if (outermost)
        m_b.set_place(&at);
    const Ref result = inline_body(f, std::move(bindings), at);
    if (outermost)
        m_b.set_place(nullptr);
    return result;
}

Ref Lower::inline_body(FunctionDecl* f, Bindings bindings, Loc at) {
    for (const FunctionDecl* active : m_active)
        if (active == f) {
            m_diagnostics.error(at, "function \"" + std::string(f->name) +
                                        "\" calls itself; RSL has no recursion");
            return zero(ty(f->result));
        }
    if (m_active.size() > 200 || m_overflow)
        return zero(ty(f->result));
    for (auto& [formal, binding] : bindings)
        m_bind[formal] = std::move(binding);
    if (f->result_fields)
        for (const VarDecl* field : f->result_fields->fields)
            declare(field);
    m_active.push_back(f);
    m_active_units.push_back(m_self);
    std::vector<LoopTargets> loops;
    loops.swap(m_loops);
    Ref result = ir::None;
    const Ty result_ty = ty(f->result);
    if (returns_early(f)) {
        const int var = result_ty == Ty::Void ? -1 : m_b.var(std::string(f->name), result_ty, at);
        if (var >= 0) {
            m_b.declare(var);
            m_b.store(var, zero(result_ty), at);
        }
        const int target = m_b.stage().targets++;
        m_returns.push_back({target, var});
        Item scope{Item::Scope};
        scope.target = target;
        scope.loc = at;
        scope.body = in_block([&] { statement(f->body); });
        m_b.item(scope);
        m_returns.pop_back();
        if (var >= 0)
            result = load_tagged(var, at);
    } else {
        m_returns.push_back({-1, -1});
        for (const Stmt* s : f->body->block) {
            if (s->kind != StmtKind::Return)
                statement(s);
            else if (s->expr && f->result_fields)
                assign_struct(f->result_fields->fields, s->expr, s->loc);
            else if (s->expr)
                result = expr_as(s->expr, f->result);
        }
        m_returns.pop_back();
    }
    loops.swap(m_loops);
    m_active.pop_back();
    m_active_units.pop_back();
    return result == ir::None ? zero(result_ty == Ty::Void ? Ty::Float : result_ty) : result;
}

// ---- shadeops
// -------------------------------------------------------------------------------------------------------

Ref Lower::shadeop(const Expr* e) {
    if (m_role == Role::Shade)
        if (const Ref r = light_shadeop(e); r != ir::None)
            return r;
    const ops::Signature& s = e->shadeop->signatures[size_t(e->signature)];
    switch (s.impl) {
    case ops::Impl::Primitive:
        return primitive(e, s);
    case ops::Impl::Noise:
        return noise(e, s);
    case ops::Impl::Closure:
        return closure(e, s);
    case ops::Impl::Special:
        return special(e, s);
    case ops::Impl::Source: {
        FunctionDecl* f = m_sema.source(*e->shadeop, e->signature);
        if (!f)
            return zero(ty(e->type));
        std::vector<const Expr*> args(e->args.begin(), e->args.end());
        args.resize(f->formals.size());
        return inline_function(f, args, e->loc);
    }
    }
    return zero(ty(e->type));
}

Ref Lower::primitive(const Expr* e, const ops::Signature& s) {
    std::vector<Ref> args;
    for (size_t i = 0; i < e->args.size(); i++)
        args.push_back(expr_as(e->args[i], s.args[std::min(i, s.args.size() - 1)].type));
    const Ty t = ty(s.result);
    // min and max of more than two
    while (args.size() > s.args.size()) {
        const Ref two = m_b.emit(s.op, t, {args[0], args[1]}, e->loc, s.imm);
        args.erase(args.begin());
        args[0] = two;
    }
    const size_t before = m_b.stage().instrs.size();
    const Ref r = m_b.emit(s.op, t, std::move(args), e->loc, s.imm);
    return size_t(r) == before ? told_math(r, e->loc) : r;
}

// pow() and log() are 0 where they have no value. That is told, as a division by zero is, unless it cannot
// be.
Ref Lower::told_math(Ref r, Loc at) {
    Instr& i = m_b.stage().instrs[size_t(r)];
    const bool pow = i.op == Op::Math2 && Fn(i.imm) == Fn::Pow;
    const bool log = i.op == Op::Math1 && Fn(i.imm) == Fn::Log;
    if (!pow && !log)
        return r;
    const auto all = [&](Ref a, auto&& good) {
        const Instr& c = m_b.at(a);
        return c.op == Op::Const && std::all_of(c.floats.begin(), c.floats.end(), good);
    };
    const Op op = m_b.at(i.args[0]).op;
    const bool safe = pow ? op == Op::Abs || op == Op::Sqrt ||
                                all(i.args[0], [](float x) { return x >= 0; }) ||
                                all(i.args[1], [](float y) { return y == std::trunc(y); })
                          : all(i.args[0], [](float x) { return x > 0; });
    if (!safe)
        m_b.stage().instrs[size_t(r)].floats = {
            float(fault(at, pow ? "pow() of a negative number to a power that is not whole: 0"
                                : "log() of a number that is not positive: 0"))};
    return r;
}

// Calls are counted, so that each has a number of its own, in loops, too.
Ref Lower::random(const Expr* e, const ops::Signature& s) {
    const Loc at = e->loc;
    if (m_random < 0) {
        m_random = m_b.var("random", Ty::Float, at);
        m_b.stage().vars[size_t(m_random)].counts = true;
        in_prologue([&] {
            m_b.declare(m_random);
            const float first = float(int(m_role)) * 2097152.0f; // stages differ: 2^21 calls each
            m_b.store(m_random, m_b.constant(first), at);
        });
    }
    const Ref call = m_b.emit(Op::Add, Ty::Float, {m_b.load(m_random, at), m_b.constant(1.0f)}, at);
    m_b.store(m_random, call, at);
    return source_call("__random", {call}, at, ty(s.result));
}

Ref Lower::noise(const Expr* e, const ops::Signature& s) {
    std::vector<Ref> parts;
    for (size_t i = 0; i < s.args.size(); i++) {
        const Ref a = expr_as(e->args[i], s.args[i].type);
        if (m_b.at(a).ty == Ty::Float)
            parts.push_back(a);
        else
            for (int c = 0; c < 3; c++)
                parts.push_back(m_b.emit(Op::Extract, Ty::Float, {a}, e->loc, c));
    }
    const ops::NoiseKind kind = ops::NoiseKind(s.imm);
    const bool periodic = kind == ops::NoiseKind::PeriodicNoise;
    const int dimensions = int(parts.size()) / (periodic ? 2 : 1);
    const Ty t = ty(s.result);
    return m_b.emit(Op::Noise, t, std::move(parts), e->loc, ops::find_noise(kind, dimensions, comps(t)));
}

Ref Lower::closure(const Expr* e, const ops::Signature& s) {
    std::vector<Ref> args;
    for (size_t i = 0; i < s.args.size(); i++)
        if (!s.args[i].type.is(Base::String))
            args.push_back(expr_as(e->args[i], s.args[i].type));
    if (!m_lit) {
        const std::string what = e->shadeop->name + "() is not known here: light comes after shading";
        if (m_program.kind == ShaderKind::Class)
            m_diagnostics.error(e->loc, what + "; use a lobe");
        else
            m_diagnostics.warning(e->loc, what + "; it is black");
        return zero(Ty::Triple);
    }
    Closure kind = Closure(s.imm);
    m_program.interreflection |= kind == Closure::Indirect;
    if (kind == Closure::Mirror && args.size() == 2)
        args.erase(args.begin()); // trace(P, R)
    if (kind == Closure::Mirror && tag(args[0]) == Tag::Refracted)
        kind = Closure::Refraction;
    if (kind == Closure::Specular)
        args[2] = blinn_exponent(args[2], e->loc);
    if (kind == Closure::Diffuse && !args.empty() &&
        (tag(args[0]) == Tag::Behind || tag(args[0]) == Tag::Negated))
        return diffuse(args[0], e->loc);
    return m_b.emit(Op::Closure, Ty::Triple, std::move(args), e->loc, int(kind));
}

Ref Lower::component(const Expr* e, const ops::Signature& s) {
    const bool matrix = e->args[0]->type.is(Base::Matrix);
    const bool set = s.special == ops::Special::SetComponent;
    const Ref whole = expr(e->args[0]);
    const Ty t = m_b.at(whole).ty;
    const int n = comps(t);
    Ref index = expr_as(e->args[1], {Base::Float});
    if (matrix) {
        const Ref column = expr_as(e->args[2], {Base::Float});
        index =
            m_b.emit(Op::Add, Ty::Float,
                     {m_b.emit(Op::Mul, Ty::Float,
                               {m_b.emit(Op::Floor, Ty::Float, {index}, e->loc), m_b.constant(4.0f)}, e->loc),
                      column},
                     e->loc);
    }
    if (m_b.is_const(index)) {
        const float f = std::floor(m_b.at(index).floats[0]);
        if (!(f >= 0 && f < float(n))) {
            char number[32]; // it may be any
            std::snprintf(number, sizeof number, "%.9g", double(f));
            m_diagnostics.error(e->args[1]->loc, std::string("component ") + number + " of a " +
                                                     e->args[0]->type.str() + " does not exist");
            return zero(Ty::Float);
        }
    }
    if (!set)
        return component_of(whole, index, e->loc);
    const Ref value = expr_as(e->args[matrix ? 3 : 2], {Base::Float});
    assign_to(e->args[0], with_component(whole, index, value, e->loc), e->loc);
    return zero(Ty::Float);
}

// Is `index` element i?
static Ref is_element(Builder& b, Ref index, int i, Loc at) {
    if (b.is_const(index))
        return b.boolean(int(b.at(index).floats[0]) == i);
    const Ref low = b.emit(Op::Ge, Ty::Bool, {index, b.constant(float(i))}, at);
    const Ref high = b.emit(Op::Lt, Ty::Bool, {index, b.constant(float(i + 1))}, at);
    return b.emit(Op::And, Ty::Bool, {low, high}, at);
}

Ref Lower::component_of(Ref whole, Ref index, Loc at) {
    const int n = comps(m_b.at(whole).ty);
    const auto part = [&](int i) { return m_b.emit(Op::Extract, Ty::Float, {whole}, at, i); };
    if (m_b.is_const(index)) {
        const float f = m_b.at(index).floats[0];
        return part(f > 0 ? int(std::min(f, float(n - 1))) : 0);
    }
    Ref r = part(0);
    for (int i = 1; i < n; i++)
        r = m_b.emit(Op::Select, Ty::Float, {is_element(m_b, index, i, at), part(i), r}, at);
    return r;
}

Ref Lower::with_component(Ref whole, Ref index, Ref value, Loc at) {
    const Ty t = m_b.at(whole).ty;
    std::vector<Ref> parts;
    for (int i = 0; i < comps(t); i++) {
        const Ref old = m_b.emit(Op::Extract, Ty::Float, {whole}, at, i);
        parts.push_back(m_b.emit(Op::Select, Ty::Float, {is_element(m_b, index, i, at), value, old}, at));
    }
    return m_b.emit(Op::Make, t, std::move(parts), at);
}

// The matrix between two spaces. Found once, when the stage begins, where the names are constants or
// parameters.
Ref Lower::space(const Expr* e) {
    const Ref from = expr(e->args[0]), to = expr(e->args[1]);
    const auto key = [&](Ref r) {
        const Instr& i = m_b.at(r);
        return i.op == Op::Text    ? "\"" + i.text
               : i.op == Op::Param ? "param" + std::to_string(i.imm)
                                   : std::string();
    };
    const std::string k1 = key(from), k2 = key(to);
    const bool leaves = !k1.empty() && !k2.empty();
    if (leaves && k1 == k2)
        return convert(m_b.constant(1.0f), {Base::Float}, {Base::Matrix}, e->loc);
    if (leaves)
        if (const auto it = m_spaces.find(k1 + "|" + k2); it != m_spaces.end())
            return it->second;
    CallSite site{CallKind::SpaceMatrix, e->loc};
    site.args = {from, to};
    if (!leaves)
        return m_b.call(std::move(site), Ty::Matrix);
    const Ref r = in_prologue([&] { return m_b.call(std::move(site), Ty::Matrix); });
    m_spaces[k1 + "|" + k2] = r;
    return r;
}

Ref Lower::host(CallKind kind, const Expr* e, const ops::Signature& s) {
    CallSite site{kind, e->loc};
    for (size_t i = 0; i < e->args.size(); i++) {
        const Expr* a = e->args[i];
        Ref r = a->type.array || a->type.handle() || a->type.base == Base::Lobe ? zero(Ty::Float) : expr(a);
        if (m_b.at(r).ty == Ty::Bool)
            r = m_b.emit(Op::ToFloat, Ty::Float, {r}, e->loc);
        site.args.push_back(r);
    }
    return m_b.call(std::move(site), ty(s.result) == Ty::Void ? Ty::Void : ty(s.result));
}

// texture("name"[channel], s, t, "blur", 0.1, …) and its forms without coordinates or with those of four
// corners.
Ref Lower::texture(const Expr* e, const ops::Signature& s) {
    const bool environment = s.special == ops::Special::Environment;
    CallSite site{environment ? CallKind::Environment : CallKind::Texture, e->loc};
    const Expr* file = e->args[0];
    Ref channel = m_b.constant(0.0f);
    if (file->kind == ExprKind::Index && file->type.is(Base::String) && !file->args[0]->type.array) {
        channel = expr_as(file->args[1], {Base::Float});
        file = file->args[0];
    }
    site.names = {"file", "channel"};
    site.args = {expr(file), channel};
    const std::vector<Ref> where = texture_coordinates(e, environment);
    if (environment) {
        // A refracted direction sees the scene through a lobe, as trace() does; pictures.cpp knows of
        // mirrors.
        if (m_lit && !where.empty() && tag(where[0]) == Tag::Refracted && ty(s.result) == Ty::Triple)
            return m_b.emit(Op::Closure, Ty::Triple, {where[0]}, e->loc, int(Closure::Refraction));
        site.names.emplace_back("direction");
        site.args.push_back(where.empty() ? zero(Ty::Triple) : where[0]);
    } else {
        place_texture(site, where);
    }
    texture_options(site, e);
    site.imm = comps(ty(s.result));
    return m_b.call(std::move(site), ty(s.result));
}

// The values between the file's name and the first option.
std::vector<Ref> Lower::texture_coordinates(const Expr* e, bool environment) {
    std::vector<Ref> where;
    for (size_t i = 1; i < e->args.size() && e->args[i]->kind != ExprKind::String; i++) {
        const Expr* a = e->args[i];
        if (a->type.base != Base::Struct) {
            where.push_back(expr(a));
            continue;
        }
        // A filter region: coordinates, and a direction.
        for (size_t k = environment ? 2 : 0;
             a->var && k < (environment ? 3u : 2u) && k < a->var->fields.size(); k++) {
            Expr field{ExprKind::Name, a->loc};
            field.var = a->var->fields[k];
            field.type = field.var->type;
            where.push_back(expr(&field));
        }
    }
    return where;
}

void Lower::place_texture(CallSite& site, const std::vector<Ref>& where) {
    const auto add = [&](const char* name, size_t k, const char* fallback) {
        site.names.emplace_back(name);
        site.args.push_back(k < where.size() && m_b.at(where[k]).ty == Ty::Float
                                ? where[k]
                                : global(m_sema.global(fallback), site.loc));
    };
    if (where.size() == 8) {
        static constexpr const char* Corners[] = {"s1", "t1", "s2", "t2", "s3", "t3", "s4", "t4"};
        for (size_t k = 0; k < 8; k++)
            add(Corners[k], k, "s");
        return;
    }
    if (where.size() != 0 && where.size() != 2)
        m_diagnostics.error(site.loc,
                            "texture() takes no coordinates, (s, t), or those of four corners; found " +
                                std::to_string(where.size()) + " values");
    add("s", 0, "s");
    add("t", 1, "t");
}

// "blur", 0.1, …
void Lower::texture_options(CallSite& site, const Expr* e) {
    size_t i = 1;
    while (i < e->args.size() && e->args[i]->kind != ExprKind::String)
        i++;
    for (; i + 1 < e->args.size(); i += 2) {
        const Expr* n = e->args[i];
        if (n->kind != ExprKind::String) {
            m_diagnostics.error(n->loc, "expected the name of a texture parameter as a string");
            break;
        }
        static constexpr std::string_view Known[] = {
            "blur",  "sblur", "tblur",  "width", "swidth",  "twidth", "fill",   "wrap",
            "swrap", "twrap", "filter", "lerp",  "samples", "bias",   "interp", "alpha"};
        const bool known = std::ranges::find(Known, n->text) != std::end(Known);
        if (!known)
            m_diagnostics.warning(n->loc, "texture parameter \"" + std::string(n->text) +
                                              "\" is not known and ignored");
        const Ref value = expr(e->args[i + 1]);
        if (known) {
            site.names.emplace_back(n->text);
            site.args.push_back(value);
        }
    }
}

// What shadername() and its like call a kind.
static const char* message_name(ShaderKind kind) {
    static constexpr const char* Names[] = {"surface",     "surface",    "displacement",
                                            "lightsource", "atmosphere", "imager"};
    return Names[int(kind)];
}

Ref Lower::special(const Expr* e, const ops::Signature& s) {
    using ops::Special;
    switch (s.special) {
    case Special::Absent:
        return absent(e, s);
    case Special::Host:
        return host(CallKind(s.imm), e, s);
    case Special::Query:
        return query(e, s);
    case Special::Spline:
        return spline(e, s);
    case Special::Component:
    case Special::SetComponent:
        return component(e, s);
    case Special::Determinant:
        return determinant(expr(e->args[0]), e->loc);
    case Special::Space:
        return space(e);
    case Special::Difference:
        return difference(e, s);
    case Special::CalculateNormal:
        return calculate_normal(e, s);
    case Special::Random:
        return random(e, s);
    case Special::ShaderName:
        return shader_name(e);
    case Special::Texture:
    case Special::Environment:
        return texture(e, s);
    case Special::PointCloud:
        m_diagnostics.warning(e->loc,
                              e->shadeop->name + "() is not here: there are no point clouds; it gives 0");
        return zero(Ty::Float);
    case Special::Emit:
        m_diagnostics.warning(e->loc, "emit() is not here: add to Ci, or use an area light");
        return absent(e, s);
    case Special::RayInfo:
        return ray_info(e);
    case Special::ArrayLength:
    case Special::ArrayCapacity:
    case Special::Push:
    case Special::Pop:
    case Special::Resize:
    case Special::Reserve:
        return array_op(e, s.special);
    case Special::GetShader:
        return get_shader(e);
    case Special::GetShaders: // as the value of an array alone: shader_list()
    case Special::GetLights:
        return absent(e, s);
    case Special::GetVariable:
    case Special::HasMethod:
        return ask_shader(e, s);
    case Special::Create:
    case Special::AddLayer:
    case Special::AddNode:
    case Special::SetLobe:
    case Special::SetLayer:
    case Special::SetPresence:
    case Special::SetInterior:
        material(e, s);
        return zero(Ty::Float);
    }
    return zero(Ty::Float);
}

// Messages of other shaders and the like: none of them is there.
Ref Lower::absent(const Expr* e, const ops::Signature& s) {
    for (const Expr* a : e->args)
        if (a->type.base != Base::Struct && !a->type.array && !a->type.handle())
            expr(a);
    const Ty t = ty(s.result);
    return zero(t == Ty::Void ? Ty::Float : t);
}

// To the next vertex.
Ref Lower::difference(const Expr* e, const ops::Signature& s) {
    const Ref x = expr_as(e->args[0], s.args[0].type);
    CallSite site{CallKind(s.imm), e->loc};
    site.args = {x};
    if (const Instr& i = m_b.at(x); i.op == Op::Input)
        site.imm = 1 + i.imm;
    return m_b.call(std::move(site), m_b.at(x).ty);
}

Ref Lower::calculate_normal(const Expr* e, const ops::Signature& s) {
    const Ref P = expr_as(e->args[0], s.args[0].type);
    CallSite site{CallKind::CalculateNormal, e->loc};
    site.args = {P, input(Input::N)};
    return m_b.call(std::move(site), m_b.at(P).ty);
}

Ref Lower::shader_name(const Expr* e) {
    const bool own =
        e->args.empty() || constant_text(e->args[0], "the kind of a shader") == message_name(m_program.kind);
    const std::string_view name =
        m_self < 0 ? std::string_view(m_program.name) : m_linked->units[size_t(m_self)].shader->name;
    return m_b.text(own ? std::string(name) : std::string());
}

} // namespace kanuka::sl::ir
