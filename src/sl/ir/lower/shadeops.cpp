#include "sl/ir/lower/shadeops.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "sl/ir/lower/arrays.h"
#include "sl/ir/lower/assignments.h"
#include "sl/ir/lower/coshaders.h"
#include "sl/ir/lower/expressions.h"
#include "sl/ir/lower/functions.h"
#include "sl/ir/lower/materials.h"
#include "sl/ir/lower/matrix.h"
#include "sl/ir/lower/optics.h"
#include "sl/ir/lower/queries.h"
#include "sl/ir/lower/splines.h"
#include "sl/ir/lower/textures.h"
#include "sl/ops/noise.h"

namespace kanuka::sl::ir {

using namespace ast;

void ShadeopLowerer::begin_stage() {
    m_spaces.clear();
    m_random = -1;
}

Ref ShadeopLowerer::shadeop(const Expr* e) {
    if (m_state.role == Role::Shade)
        if (const Ref r = optics().shadeop(e); r != ir::None)
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
        return functions().inline_function(f, args, e->loc);
    }
    }
    return zero(ty(e->type));
}

Ref ShadeopLowerer::special(const Expr* e, const ops::Signature& s) {
    using ops::Special;
    switch (s.special) {
    case Special::Absent:
        return absent(e, s);
    case Special::Host:
        return host(CallKind(s.imm), e, s);
    case Special::Query:
        return queries().query(e, s);
    case Special::Spline:
        return splines().spline(e, s);
    case Special::Component:
    case Special::SetComponent:
        return component(e, s);
    case Special::Determinant:
        return determinant(m_b, expr_as(e->args[0], s.args[0].type), e->loc);
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
        return textures().texture(e, s);
    case Special::PointCloud:
        m_diagnostics.warning(e->loc,
                              e->shadeop->name + "() is not here: there are no point clouds; it gives 0");
        return zero(Ty::Float);
    case Special::Emit:
        m_diagnostics.warning(e->loc, "emit() is not here: add to Ci, or use an area light");
        return absent(e, s);
    case Special::RayInfo:
        return queries().ray_info(e);
    case Special::ArrayLength:
    case Special::ArrayCapacity:
    case Special::Push:
    case Special::Pop:
    case Special::Resize:
    case Special::Reserve:
        return arrays().array_op(e, s.special);
    case Special::GetShader:
        return coshaders().get_shader(e);
    case Special::GetShaders: // as the value of an array alone: shader_list()
    case Special::GetLights:
        return absent(e, s);
    case Special::GetVariable:
    case Special::HasMethod:
        return coshaders().ask_shader(e, s);
    case Special::Create:
    case Special::AddLayer:
    case Special::AddNode:
    case Special::SetLobe:
    case Special::SetLayer:
    case Special::SetPresence:
    case Special::SetInterior:
        materials().material(e, s);
        return zero(Ty::Float);
    }
    return zero(Ty::Float);
}

// Messages of other shaders and the like: none of them is there.
Ref ShadeopLowerer::absent(const Expr* e, const ops::Signature& s) {
    for (const Expr* a : e->args)
        if (a->type.base != Base::Struct && !a->type.array && !a->type.handle())
            expr(a);
    const Ty t = ty(s.result);
    return zero(t == Ty::Void ? Ty::Float : t);
}

Ref ShadeopLowerer::primitive(const Expr* e, const ops::Signature& s) {
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

Ref ShadeopLowerer::told_math(Ref r, Loc at) {
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

Ref ShadeopLowerer::noise(const Expr* e, const ops::Signature& s) {
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

Ref ShadeopLowerer::closure(const Expr* e, const ops::Signature& s) {
    std::vector<Ref> args;
    for (size_t i = 0; i < s.args.size(); i++)
        if (!s.args[i].type.is(Base::String))
            args.push_back(expr_as(e->args[i], s.args[i].type));
    if (!m_state.lit) {
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
        args[2] = optics().blinn_exponent(args[2], e->loc);
    if (kind == Closure::Diffuse && !args.empty() &&
        (tag(args[0]) == Tag::Behind || tag(args[0]) == Tag::Negated))
        return optics().diffuse(args[0], e->loc);
    return m_b.emit(Op::Closure, Ty::Triple, std::move(args), e->loc, int(kind));
}

Ref ShadeopLowerer::component(const Expr* e, const ops::Signature& s) {
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
        return component_of(m_b, whole, index, e->loc);
    const Ref value = expr_as(e->args[matrix ? 3 : 2], {Base::Float});
    assignments().assign_to(e->args[0], with_component(m_b, whole, index, value, e->loc), e->loc);
    return zero(Ty::Float);
}

// The matrix between two spaces. Found once, when the stage begins, where the names are constants or
// parameters.
Ref ShadeopLowerer::space(const Expr* e) {
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
        return expressions().convert(m_b.constant(1.0f), {Base::Matrix}, e->loc);
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

Ref ShadeopLowerer::host(CallKind kind, const Expr* e, const ops::Signature& s) {
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

// To the next vertex.
Ref ShadeopLowerer::difference(const Expr* e, const ops::Signature& s) {
    const Ref x = expr_as(e->args[0], s.args[0].type);
    CallSite site{CallKind(s.imm), e->loc};
    site.args = {x};
    if (const Instr& i = m_b.at(x); i.op == Op::Input)
        site.imm = 1 + i.imm;
    return m_b.call(std::move(site), m_b.at(x).ty);
}

Ref ShadeopLowerer::calculate_normal(const Expr* e, const ops::Signature& s) {
    const Ref P = expr_as(e->args[0], s.args[0].type);
    CallSite site{CallKind::CalculateNormal, e->loc};
    site.args = {P, input(Input::N)};
    return m_b.call(std::move(site), m_b.at(P).ty);
}

// Calls are counted, so that each has a number of its own, in loops, too.
Ref ShadeopLowerer::random(const Expr* e, const ops::Signature& s) {
    const Loc at = e->loc;
    if (m_random < 0) {
        m_random = m_b.var("random", Ty::Float, at);
        m_b.stage().vars[size_t(m_random)].counts = true;
        in_prologue([&] {
            m_b.declare(m_random);
            const float first = float(int(m_state.role)) * 2097152.0f; // stages differ: 2^21 calls each
            m_b.store(m_random, m_b.constant(first), at);
        });
    }
    const Ref call = m_b.emit(Op::Add, Ty::Float, {m_b.load(m_random, at), m_b.constant(1.0f)}, at);
    m_b.store(m_random, call, at);
    return functions().source_call("__random", {call}, at, ty(s.result));
}

// What shadername() and its like call a kind.
static const char* message_name(ShaderKind kind) {
    static constexpr const char* Names[] = {"surface",     "surface",    "displacement",
                                            "lightsource", "atmosphere", "imager"};
    return Names[int(kind)];
}

Ref ShadeopLowerer::shader_name(const Expr* e) {
    const bool own = e->args.empty() || materials().constant_text(e->args[0], "the kind of a shader") ==
                                            message_name(m_program.kind);
    const std::string_view name = m_state.self < 0
                                      ? std::string_view(m_program.name)
                                      : m_context.linked->units[size_t(m_state.self)].shader->name;
    return m_b.text(own ? std::string(name) : std::string());
}

} // namespace kanuka::sl::ir
