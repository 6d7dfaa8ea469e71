#include "sl/ir/lower/optics.h"

#include <cmath>
#include <utility>

#include "sl/ir/lower/assignments.h"
#include "sl/ir/lower/directions.h"
#include "sl/ir/lower/functions.h"
#include "sl/ir/lower/light_loops.h"
#include "sl/ir/lower/shadeops.h"
#include "sl/ir/lower/ward.h"

namespace kanuka::sl::ir {

using namespace ast;

Ref OpticsLowerer::shadeop(const Expr* e) {
    using ops::Optics;
    const bool in_loop = m_state.light.depth > 0;
    switch (e->shadeop->optics) {
    case Optics::None:
        return ir::None;
    case Optics::Fresnel:
        return fresnel(e);
    case Optics::Occlusion:
        note_occlusion(e->loc);
        return ir::None;
    case Optics::Normalize:
        return normalize(e);
    case Optics::Length:
        return in_loop ? length(e) : ir::None;
    case Optics::FaceForward:
        return face_forward(e);
    case Optics::TransformVector:
        return m_state.lit ? transform_vector(e) : ir::None;
    case Optics::Reflect:
        return reflect(e, Tag::Mirrored);
    case Optics::Refract:
        return reflect(e, Tag::Refracted);
    case Optics::SpecularBrdf:
        return specular_brdf(e);
    case Optics::Exponential:
        return in_loop ? exponential(e) : ir::None;
    case Optics::SmoothStep:
        return in_loop ? smooth_step(e) : ir::None;
    case Optics::Limit:
    case Optics::Power:
        // Of more than two it is no lobe's.
        return in_loop && e->args.size() <= signature(e).args.size() ? cosine_function(e) : ir::None;
    }
    return ir::None;
}

std::vector<Ref> OpticsLowerer::arguments(const Expr* e) {
    const ops::Signature& s = signature(e);
    std::vector<Ref> args;
    for (size_t k = 0; k < e->args.size() && k < s.args.size(); k++)
        args.push_back(expr_as(e->args[k], s.args[k].type));
    return args;
}

// The shadeop as it is written in RSL, of these arguments.
Ref OpticsLowerer::plain_source(const Expr* e, const std::vector<Ref>& args) {
    FunctionDecl* f = m_sema.source(*e->shadeop, e->signature);
    return f ? functions().inline_values(f, args, e->loc) : zero(ty(e->type));
}

void OpticsLowerer::note_occlusion(Loc at) {
    if (!m_state.lit)
        return;
    m_program.interreflection = true;
    if (!m_b.place() && !std::exchange(m_said_occlusion, true))
        m_diagnostics.info(at, "occlusion() is 0: transport occludes what light falls on. A surface that "
                               "shows 1 - occlusion() by itself is white; --integrator ao shows it");
}

// fresnel() of the view direction: factors that make dielectric lobes of what they are multiplied with.
// Where they meet something else, closures.cpp takes their values as seen from the dicing camera.
Ref OpticsLowerer::fresnel(const Expr* e) {
    const Ref i = expr_as(e->args[0], {Base::Vector});
    const ops::Signature& s = signature(e);
    if (tag(i) != Tag::View || !m_state.lit || s.args.size() < 5)
        return ir::None;
    const Ref n = expr_as(e->args[1], {Base::Normal});
    const Ref eta = expr_as(e->args[2], {Base::Float});
    const Ref front = tag(n) == Tag::Facing ? directions().turned(n, e->loc) : n;
    int values[2];
    for (int& v : values)
        v = light_loops().reference_value("fresnel", e->loc);
    if (FunctionDecl* f = m_sema.source(*e->shadeop, 0)) {
        std::vector<Binding> b(5);
        for (size_t k = 0; k < 5; k++) {
            b[k].kind = k < 3 ? Binding::Value : Binding::Variable;
            (k < 3 ? b[k].value : b[k].var) = k == 0 ? i : k == 1 ? front : k == 2 ? eta : values[k - 3];
        }
        functions().inline_with(f, std::move(b), e->loc);
    }
    for (int k = 0; k < 2; k++) {
        const Ref r = m_b.emit(Op::Closure, Ty::Float, {n, n, eta}, e->loc,
                               int(k == 0 ? Closure::FresnelReflect : Closure::FresnelTransmit));
        m_b.stage().instrs[size_t(r)].floats = {float(values[k])};
        assignments().assign_to(e->args[size_t(3 + k)], r, e->loc);
    }
    if (e->args.size() > 5 && s.args.size() > 5)
        assignments().assign_to(e->args[5],
                                tagged(functions().source_call("reflect", {i, front}, e->loc), Tag::Mirrored),
                                e->loc);
    if (e->args.size() > 6 && s.args.size() > 6)
        assignments().assign_to(
            e->args[6], tagged(functions().source_call("refract", {i, front, eta}, e->loc), Tag::Refracted),
            e->loc);
    return zero(Ty::Float);
}

// diffuse() of a normal the other way round: light from the side that N points away from comes through. A
// normal that pointed there before, as a cross product may, is N again.
Ref OpticsLowerer::diffuse(Ref normal, Loc at) {
    const Ref cosine = m_b.emit(Op::Dot, Ty::Float, {normal, input(Input::N)}, at);
    const Ref front =
        m_b.emit(Op::ToFloat, Ty::Float, {m_b.emit(Op::Ge, Ty::Bool, {cosine, m_b.constant(0.0f)}, at)}, at);
    const Ref back = m_b.emit(Op::Sub, Ty::Float, {m_b.constant(1.0f), front}, at);
    const auto part = [&](Closure kind, Ref weight) {
        return m_b.emit(Op::Mul, Ty::Triple,
                        {m_b.emit(Op::Closure, Ty::Triple, {normal}, at, int(kind)), m_b.splat(weight, at)},
                        at);
    };
    return m_b.emit(Op::Add, Ty::Triple, {part(Closure::Diffuse, front), part(Closure::DiffuseBehind, back)},
                    at);
}

Ref OpticsLowerer::blinn_exponent(Ref roughness, Loc at) {
    const Ref some = m_b.emit(Op::Max, Ty::Float, {roughness, m_b.constant(1e-4f)}, at);
    return m_b.emit(Op::Div, Ty::Float, {m_b.constant(m_program.rispec_specular ? 1.0f : 8.0f), some}, at);
}

Ref OpticsLowerer::normalize(const Expr* e) {
    const std::vector<Ref> args = arguments(e);
    const Tag t = tag(args[0]);
    return DirectionLowerer::to_light(t) ? args[0] : tagged(plain_source(e, args), t);
}

// Directions to lights are taken to be of unit length.
Ref OpticsLowerer::length(const Expr* e) {
    const std::vector<Ref> args = arguments(e);
    return DirectionLowerer::to_light(tag(args[0])) ? m_b.constant(1.0f) : plain_source(e, args);
}

Ref OpticsLowerer::face_forward(const Expr* e) {
    const std::vector<Ref> args = arguments(e);
    const Tag t = tag(args[1]);
    if (t == Tag::None)
        return plain_source(e, args);
    const bool view = t == Tag::View || t == Tag::Eye;
    const Tag side = tag(args[0]);
    if (view && (side == Tag::Behind || side == Tag::Negated)) // both are turned to the eye
        return tagged(m_b.emit(Op::Neg, Ty::Triple, {args[0]}, e->loc), Tag::Facing);
    return view && side == Tag::None ? tagged(args[0], Tag::Facing) : args[0];
}

// Space does not change what a direction is to a lobe.
Ref OpticsLowerer::transform_vector(const Expr* e) {
    const std::vector<Ref> args = arguments(e);
    const Tag t = tag(args.back());
    return tagged(plain_source(e, args), t == Tag::Mirrored || t == Tag::Refracted ? t : Tag::None);
}

// reflect() and refract(): of the view direction it is `made`.
Ref OpticsLowerer::reflect(const Expr* e, Tag made) {
    std::vector<Ref> args = arguments(e);
    if (tag(args[0]) == Tag::Light && made == Tag::Mirrored)
        return directions().to_light(Tag::LightMirrored, e->loc);
    if (tag(args[1]) == Tag::Facing || tag(args[1]) == Tag::Behind)
        args[1] = directions().turned(args[1], e->loc);
    const bool view = tag(args[0]) == Tag::View || tag(args[0]) == Tag::Eye;
    return tagged(plain_source(e, args), view ? made : Tag::None);
}

Ref OpticsLowerer::specular_brdf(const Expr* e) {
    std::vector<Ref> args = arguments(e);
    args[3] = blinn_exponent(args[3], e->loc);
    if (m_state.light.depth == 0)
        return functions().source_call("__blinn", args, e->loc);
    return directions().kernel(Closure::SpecularKernel, Ty::Triple, {args[1], args[1], args[3]}, Tag::None,
                               e->loc);
}

Ref OpticsLowerer::exponential(const Expr* e) {
    const ops::Signature& s = signature(e);
    const std::vector<Ref> args = arguments(e);
    const Ref kernel = ward().kernel(args[0], e->loc);
    return kernel != ir::None ? kernel : m_b.emit(s.op, ty(s.result), args, e->loc, s.imm);
}

// A highlight with an edge, smoothstep(low, high, pow(N . H, n)): the lobe that is as wide at half its
// height, where pow(N . H, n) is in the middle.
Ref OpticsLowerer::smooth_step(const Expr* e) {
    const std::vector<Ref> args = arguments(e);
    const Instr made = m_b.at(args[2]);
    const bool glossy = made.op == Op::Closure && (Closure(made.imm) == Closure::SpecularKernel ||
                                                   Closure(made.imm) == Closure::PhongKernel);
    if (!glossy || made.ty != Ty::Float)
        return plain_source(e, args);
    const auto op = [&](Op o, Ref a, Ref b) { return m_b.emit(o, Ty::Float, {a, b}, e->loc); };
    const auto f = [&](float x) { return m_b.constant(x); };
    const Ref middle = op(Op::Mul, op(Op::Add, args[0], args[1]), f(0.5f));
    const Ref safe = op(Op::Min, op(Op::Max, middle, f(0.01f)), f(0.99f));
    const Ref narrower =
        op(Op::Div, f(std::log(0.5f)), m_b.emit(Op::Math1, Ty::Float, {safe}, e->loc, int(Fn::Log)));
    return directions().kernel(Closure(made.imm), Ty::Float,
                               {made.args[0], made.args[1], op(Op::Mul, made.args[2], narrower)}, Tag::None,
                               e->loc);
}

// max(), clamp(), abs() and pow() of a cosine, which may be a kernel's; None = not of one, and not yet
// evaluated.
Ref OpticsLowerer::cosine_function(const Expr* e) {
    const ops::Signature& s = signature(e);
    const std::vector<Ref> args = arguments(e);
    Ref cosine = ir::None;
    bool constants = true;
    for (Ref a : args) {
        const Tag t = tag(a);
        if (t == Tag::Cosine || t == Tag::HalfCosine || t == Tag::MirrorCosine)
            cosine = a;
        else
            constants = constants && m_b.is_const(a);
    }
    if (cosine == ir::None) // evaluated already: go on with these values
        return s.impl == ops::Impl::Source
                   ? plain_source(e, args)
                   : shadeops().told_math(m_b.emit(s.op, ty(s.result), args, e->loc, s.imm), e->loc);
    if (e->shadeop->optics == ops::Optics::Limit)
        return constants ? cosine : ir::None; // limited to the front: kernels are
    if (cosine != args[0] || tag(cosine) == Tag::Cosine)
        return ir::None;
    const Instr made = m_b.at(cosine);
    const bool half = tag(cosine) == Tag::HalfCosine;
    const Ref normal = made.op == Op::Closure ? made.args[0] : m_b.triple(0);
    return directions().kernel(half ? Closure::SpecularKernel : Closure::PhongKernel, Ty::Float,
                               {normal, normal, args[1]}, Tag::None, e->loc);
}

} // namespace kanuka::sl::ir
