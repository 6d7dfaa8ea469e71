#include <cmath>

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

static bool has_return(const Stmt* s) {
    if (!s)
        return false;
    if (s->kind == StmtKind::Return)
        return true;
    for (const Stmt* b : s->block)
        if (has_return(b))
            return true;
    return has_return(s->body) || has_return(s->orelse);
}

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

Ref Lower::inline_function(FunctionDecl* f, const std::vector<const Expr*>& args, Loc at) {
    std::vector<Binding> bindings;
    std::vector<std::pair<const Expr*, int>>
        copies; // outputs that are not plain variables: written back after
    for (size_t i = 0; i < f->formals.size(); i++) {
        const VarDecl* formal = f->formals[i];
        const Expr* a = args[i];
        Binding b;
        if (formal->type.handle()) {
            b.kind = Binding::Handle;
        } else if (formal->type.base == Base::Lobe || formal->type.array) {
            if (a->var)
                b = bind(a->var);
        } else if (formal->output && a->kind == ExprKind::Name && a->var &&
                   bind(a->var).kind == Binding::Variable) {
            b = bind(a->var);
        } else if (formal->output) {
            b.kind = Binding::Variable;
            const Ref value = expr_as(a, formal->type);
            b.var = m_b.var(std::string(formal->name), ty(formal->type), formal->loc);
            m_b.declare(b.var);
            m_b.store(b.var, value, a->loc);
            copies.emplace_back(a, b.var);
        } else {
            b.kind = Binding::Value;
            b.value = expr_as(a, formal->type);
        }
        bindings.push_back(std::move(b));
    }
    const Ref result = inline_with(f, std::move(bindings), at);
    for (const auto& [target, var] : copies)
        assign_to(target, m_b.load(var, at), at);
    return result;
}

Ref Lower::inline_with(FunctionDecl* f, std::vector<Binding> bindings, Loc at) {
    // What a shadeop's own source does is said to be at its call.
    const bool outermost = !m_b.place() && m_diagnostics.sources().name(f->loc.file).starts_with("<");
    if (outermost)
        m_b.set_place(&at);
    const Ref result = inline_body(f, std::move(bindings), at);
    if (outermost)
        m_b.set_place(nullptr);
    return result;
}

Ref Lower::inline_body(FunctionDecl* f, std::vector<Binding> bindings, Loc at) {
    for (const FunctionDecl* active : m_active)
        if (active == f) {
            m_diagnostics.error(at, "function \"" + std::string(f->name) +
                                        "\" calls itself; RSL has no recursion");
            return zero(ty(f->result));
        }
    if (m_active.size() > 200 || m_overflow)
        return zero(ty(f->result));
    for (size_t i = 0; i < f->formals.size(); i++)
        m_bind[f->formals[i]] = std::move(bindings[i]);
    m_active.push_back(f);
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
            result = m_b.load(var, at);
    } else {
        m_returns.push_back({-1, -1});
        for (const Stmt* s : f->body->block) {
            if (s->kind == StmtKind::Return) {
                if (s->expr)
                    result = expr_as(s->expr, f->result);
            } else {
                statement(s);
            }
        }
        m_returns.pop_back();
    }
    loops.swap(m_loops);
    m_active.pop_back();
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
    return m_b.emit(s.op, t, std::move(args), e->loc, s.imm);
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
    if (kind == Closure::Mirror && args.size() == 2)
        args.erase(args.begin()); // trace(P, R)
    if (kind == Closure::Mirror && tag(args[0]) == Tag::Refracted)
        kind = Closure::Refraction;
    return m_b.emit(Op::Closure, Ty::Triple, std::move(args), e->loc, int(kind));
}

Ref Lower::component(const Expr* e) {
    const bool matrix = e->args[0]->type.is(Base::Matrix);
    const bool set = e->shadeop->name == "setcomp";
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
    const auto part = [&](int i) { return m_b.emit(Op::Extract, Ty::Float, {whole}, e->loc, i); };
    const auto at = [&](int i) { // is `index` element i?
        const Ref low = m_b.emit(Op::Ge, Ty::Bool, {index, m_b.constant(float(i))}, e->loc);
        const Ref high = m_b.emit(Op::Lt, Ty::Bool, {index, m_b.constant(float(i + 1))}, e->loc);
        return m_b.emit(Op::And, Ty::Bool, {low, high}, e->loc);
    };
    if (m_b.is_const(index)) {
        const float f = std::floor(m_b.at(index).floats[0]);
        if (!(f >= 0 && f < float(n))) {
            m_diagnostics.error(e->args[1]->loc, "component " + std::to_string(int(f)) + " of a " +
                                                     e->args[0]->type.str() + " does not exist");
            return zero(Ty::Float);
        }
    }
    if (!set) {
        if (m_b.is_const(index))
            return part(int(m_b.at(index).floats[0]));
        Ref r = part(0);
        for (int i = 1; i < n; i++)
            r = m_b.emit(Op::Select, Ty::Float, {at(i), part(i), r}, e->loc);
        return r;
    }
    const Ref value = expr_as(e->args[matrix ? 3 : 2], {Base::Float});
    std::vector<Ref> parts;
    for (int i = 0; i < n; i++) {
        const Ref old = part(i);
        parts.push_back(m_b.emit(
            Op::Select, Ty::Float,
            {m_b.is_const(index) ? m_b.boolean(int(m_b.at(index).floats[0]) == i) : at(i), value, old},
            e->loc));
    }
    const Ref made = m_b.emit(Op::Make, t, std::move(parts), e->loc);
    assign_to(e->args[0], made, e->loc);
    return zero(Ty::Float);
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
    CallSite site{CallKind::SpaceMatrix, m_active.empty() ? e->loc : e->loc};
    site.args = {from, to};
    Block* const here = m_b.block();
    if (leaves)
        m_b.set_block(m_prologue);
    const Ref r = m_b.call(std::move(site), Ty::Matrix);
    m_b.set_block(here);
    if (leaves)
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
    const bool environment = e->shadeop->name == "environment";
    CallSite site{environment ? CallKind::Environment : CallKind::Texture, e->loc};
    const auto add = [&](const char* name, Ref r) {
        site.names.emplace_back(name);
        site.args.push_back(r);
    };
    const Expr* file = e->args[0];
    Ref channel = m_b.constant(0.0f);
    if (file->kind == ExprKind::Index && file->type.is(Base::String) && !file->args[0]->type.array) {
        channel = expr_as(file->args[1], {Base::Float});
        file = file->args[0];
    }
    add("file", expr(file));
    add("channel", channel);
    size_t i = 1;
    std::vector<Ref> positional;
    while (i < e->args.size() && e->args[i]->kind != ExprKind::String)
        positional.push_back(expr(e->args[i++]));
    const auto coordinate = [&](size_t k, const char* fallback) {
        if (k < positional.size() && m_b.at(positional[k]).ty == Ty::Float)
            return positional[k];
        return global(m_sema.global(fallback), e->loc);
    };
    if (environment) {
        // A refracted direction sees the scene through a lobe, as trace() does; closures.cpp knows of
        // mirrors.
        if (m_lit && !positional.empty() && tag(positional[0]) == Tag::Refracted &&
            ty(s.result) == Ty::Triple)
            return m_b.emit(Op::Closure, Ty::Triple, {positional[0]}, e->loc, int(Closure::Refraction));
        add("direction", positional.empty() ? zero(Ty::Triple) : positional[0]);
    } else if (positional.size() == 8) {
        static constexpr const char* Names[] = {"s1", "t1", "s2", "t2", "s3", "t3", "s4", "t4"};
        for (size_t k = 0; k < 8; k++)
            add(Names[k], coordinate(k, "s"));
    } else {
        if (positional.size() != 0 && positional.size() != 2)
            m_diagnostics.error(e->loc,
                                "texture() takes no coordinates, (s, t), or those of four corners; found " +
                                    std::to_string(positional.size()) + " values");
        add("s", coordinate(0, "s"));
        add("t", coordinate(1, "t"));
    }
    for (; i + 1 < e->args.size(); i += 2) {
        const Expr* n = e->args[i];
        if (n->kind != ExprKind::String) {
            m_diagnostics.error(n->loc, "expected the name of a texture parameter as a string");
            break;
        }
        static constexpr std::string_view Known[] = {
            "blur",  "sblur", "tblur",  "width", "swidth",  "twidth", "fill",   "wrap",
            "swrap", "twrap", "filter", "lerp",  "samples", "bias",   "interp", "alpha"};
        bool known = false;
        for (std::string_view k : Known)
            known = known || k == n->text;
        if (!known)
            m_diagnostics.warning(n->loc, "texture parameter \"" + std::string(n->text) +
                                              "\" is not known and ignored");
        const Ref value = expr(e->args[i + 1]);
        if (known) {
            site.names.emplace_back(n->text);
            site.args.push_back(value);
        }
    }
    site.imm = comps(ty(s.result));
    if (environment) // a mirror lobe if the direction depends on the view: closures.cpp decides
        site.names[2] = "direction";
    return m_b.call(std::move(site), ty(s.result));
}

Ref Lower::special(const Expr* e, const ops::Signature& s) {
    const std::string& n = e->shadeop->name;
    bool known = true;
    if (const Ref r = material(e, s, known); known)
        return r;
    if (n == "spline")
        return spline(e, s);
    if (n == "comp" || n == "setcomp")
        return component(e);
    if (n == "__space")
        return space(e);
    if (n == "__dx" || n == "__dy" || n == "calculatenormal") {
        const Ref x = expr_as(e->args[0], s.args[0].type);
        CallSite site{n == "__dx"   ? CallKind::Dx
                      : n == "__dy" ? CallKind::Dy
                                    : CallKind::CalculateNormal,
                      e->loc};
        site.args = {x};
        if (n == "calculatenormal")
            site.args.push_back(input(Input::N));
        return m_b.call(std::move(site), m_b.at(x).ty);
    }
    if (n == "texture" || n == "environment")
        return texture(e, s);
    if (n == "determinant")
        return determinant(expr(e->args[0]), e->loc);
    if (n == "arraylength") {
        const Expr* a = e->args[0];
        if (!a->type.array || !a->var)
            return m_b.constant(0.0f);
        return m_b.constant(float(m_b.stage().vars[bind(a->var).var].array));
    }
    if (n == "shadername")
        return m_b.text(m_program.name);
    if (n == "format")
        return host(CallKind::Format, e, s);
    if (n == "concat")
        return host(CallKind::Concat, e, s);
    if (n == "match")
        return host(CallKind::Match, e, s);
    if (n == "printf")
        return host(CallKind::Printf, e, s);
    if (n == "__report")
        return host(CallKind::Report, e, s);
    if (const Ref r = light_query(e, known = true); known)
        return r;
    // attribute, option, rendererinfo, textureinfo, shadow: nothing is known of what they ask
    return zero(ty(s.result));
}

Ref Lower::spline(const Expr* e, const ops::Signature& s) {
    const Loc at = e->loc;
    size_t k = 0;
    const ops::SplineBasis* basis = ops::find_basis("catmull-rom");
    if (s.args[0].type.is(Base::String)) {
        const std::string name = constant_text(e->args[0], "a spline's basis");
        basis = ops::find_basis(name);
        if (!basis) {
            m_diagnostics.error(e->args[0]->loc,
                                "unknown basis \"" + name +
                                    "\"; there are bezier, bspline, catmull-rom, hermite, linear");
            basis = ops::find_basis("catmull-rom");
        }
        k = 1;
    }
    const ast::Type element = s.result;
    const Ty t = ty(element);
    const Ref x = expr_as(e->args[k++], {Base::Float});
    int var = -1;
    if (k < e->args.size() && e->args[k]->type.array) {
        if (!e->args[k]->var)
            return zero(t);
        var = bind(e->args[k]->var).var;
    } else {
        std::vector<Ref> values;
        for (; k < e->args.size(); k++) {
            if (conversion_cost(e->args[k]->type, element) < 0) {
                m_diagnostics.error(e->args[k]->loc, "found " + e->args[k]->type.str() + ", expected " +
                                                         element.str() + " for a value of the spline");
                return zero(t);
            }
            values.push_back(expr_as(e->args[k], element));
        }
        var = m_b.var("spline", t, at, std::max<int>(1, int(values.size())));
        m_b.declare(var);
        for (size_t i = 0; i < values.size(); i++)
            m_b.emit(Op::StoreElement, Ty::Void, {m_b.constant(float(i)), values[i]}, at, var);
    }
    const int n = m_b.stage().vars[var].array;
    if (n < 4) {
        m_diagnostics.error(at, "a spline needs at least 4 values, found " + std::to_string(n));
        return zero(t);
    }
    // Segment and parameter within it.
    const int segments = (n - 4) / basis->step + 1;
    const auto f = [&](float v) { return m_b.constant(v); };
    const auto op = [&](Op o, Ref a, Ref b) { return m_b.emit(o, m_b.at(a).ty, {a, b}, at); };
    const Ref scaled = op(Op::Mul, op(Op::Min, op(Op::Max, x, f(0)), f(1)), f(float(segments)));
    const Ref segment = op(Op::Min, m_b.emit(Op::Floor, Ty::Float, {scaled}, at), f(float(segments - 1)));
    const Ref u = op(Op::Sub, scaled, segment);
    const Ref first = op(Op::Mul, segment, f(float(basis->step)));
    Ref sum = ir::None;
    for (int c = 0; c < 4; c++) {
        Ref w = f(basis->m[0][c]);
        for (int d = 1; d < 4; d++)
            w = op(Op::Add, op(Op::Mul, w, u), f(basis->m[d][c]));
        const Ref value = m_b.emit(Op::LoadElement, t, {op(Op::Add, first, f(float(c)))}, at, var);
        const Ref term = op(Op::Mul, value, t == Ty::Triple ? m_b.splat(w, at) : w);
        sum = sum == ir::None ? term : op(Op::Add, sum, term);
    }
    return sum;
}

} // namespace kanuka::sl::ir
