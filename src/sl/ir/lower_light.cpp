// Illuminance loops and fresnel(), read as materials. Values are tagged with what they are to a lobe: the
// view direction, a direction to a light, half between them, mirrored, and the cosines between those. A
// cosine that is the kernel of a lobe becomes a factor for closures.cpp, which multiplies it with Cl to a
// whole term:
//
//   illuminance (P, N, PI/2) C += Cl * (N . normalize(L));              is diffuse(N)
//   … Cl * pow(max(0, N . H), 1 / roughness), H = normalize(Ln + V);    is specular(N, V, roughness)
//   … Cl * smoothstep(a, b, pow(…));                                    is as wide at half its height
//   … Cl * (N . Ln) * exp(-2 ((X . H)^2 + (Y . H)^2) / (1 + H . N)) …   is Ward's: lower_kernels.cpp
//   … Cl * pow(max(0, R . Ln), size), R = reflect(I, N);                is phong(N, V, size)
#include <algorithm>
#include <cmath>
#include <utility>

#include "sl/ir/lower.h"

namespace kanuka::sl::ir {

using namespace ast;

void Lower::store_tagged(int var, Ref value, Loc at) {
    const Tag t = tag(value);
    if (t == Tag::None)
        m_var_tags.erase(var);
    else
        m_var_tags[var] = t;
    m_b.store(var, value, at);
}

Ref Lower::load_tagged(int var, Loc at) {
    const Ref r = m_b.load(var, at);
    const auto it = m_var_tags.find(var);
    return it == m_var_tags.end() ? r : tagged(r, it->second);
}

Ref Lower::light_direction(Tag t, Loc at) {
    return kernel(Closure::LightDirection, Ty::Triple, {}, t, at);
}

// A factor of the loop that is being read.
Ref Lower::kernel(Closure kind, Ty ty, std::vector<Ref> args, Tag t, Loc at) {
    const Ref r = m_b.emit(Op::Closure, ty, std::move(args), at, int(kind));
    m_b.stage().instrs[size_t(r)].floats = {float(m_loop)};
    return tagged(r, t);
}

Ref Lower::view_direction(Loc at) {
    return tagged(m_b.emit(Op::Sub, Ty::Triple, {input(Input::P), input(Input::E)}, at), Tag::View);
}

// A normal as faceforward() means it: towards the eye; one behind away from it. Lobes take it as it is, for
// they have two sides.
Ref Lower::turned(Ref normal, Loc at) {
    const bool behind = tag(normal) == Tag::Behind;
    const Ref cosine = m_b.emit(Op::Dot, Ty::Float, {view_direction(at), normal}, at);
    const Ref wrong = m_b.emit(behind ? Op::Lt : Op::Gt, Ty::Bool, {cosine, m_b.constant(0.0f)}, at);
    return m_b.emit(Op::Select, Ty::Triple, {wrong, m_b.emit(Op::Neg, Ty::Triple, {normal}, at), normal}, at);
}

// Is it made of where the eye is?
bool Lower::depends_on_view(Ref r, std::set<Ref>& seen) {
    if (!seen.insert(r).second)
        return false;
    const std::vector<Instr>& all = m_b.stage().instrs;
    const Instr& i = all[size_t(r)];
    if (i.op == Op::Input && Input(i.imm) == Input::E)
        return true;
    const auto depends = [&](Ref a) { return depends_on_view(a, seen); };
    if (std::ranges::any_of(i.args, depends))
        return true;
    return i.op == Op::Load && std::ranges::any_of(all, [&](const Instr& s) {
               return s.op == Op::Store && s.imm == i.imm && depends(s.args[0]);
           });
}

// diffuse() of a normal the other way round: light from the side that N points away from comes through. A
// normal that pointed there before, as a cross product may, is N again.
Ref Lower::diffuse(Ref normal, Loc at) {
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

Ref Lower::negated(Ref value, bool normal, Loc at) {
    const Ref r = m_b.emit(Op::Neg, m_b.at(value).ty, {value}, at);
    switch (const Tag t = tag(value)) {
    case Tag::View:
        return tagged(r, Tag::Eye);
    case Tag::Eye:
        return tagged(r, Tag::View);
    case Tag::ViewCosine:
        return tagged(r, Tag::EyeCosine);
    case Tag::EyeCosine:
        return tagged(r, Tag::ViewCosine);
    case Tag::Facing:
        return tagged(r, Tag::Behind);
    case Tag::Behind:
        return tagged(r, Tag::Facing);
    case Tag::None:
        return normal ? tagged(r, Tag::Negated) : r;
    case Tag::Negated:
        return r;
    default:
        return tagged(r, t);
    }
}

// None = nothing special.
Ref Lower::light_arithmetic(BinOp op, Ref a, Ref b, Loc at) {
    const Tag x = side_less(tag(a)), y = side_less(tag(b));
    if (x == Tag::None && y == Tag::None)
        return ir::None;
    if (x == Tag::Ward || y == Tag::Ward)
        return ward_arithmetic(op, a, b, at);
    switch (op) {
    case BinOp::Add:
    case BinOp::Sub: // Ln + V, or Ln - I, is on the way to the half direction
        return (x == Tag::Light && is_view(y)) || (is_view(x) && y == Tag::Light)
                   ? light_direction(Tag::Half, at)
                   : ir::None;
    case BinOp::Mul:
    case BinOp::Div:
        return scaled_direction(op, a, b, at);
    case BinOp::Dot:
        return light_cosine(a, b, at);
    case BinOp::Lt:
    case BinOp::Le:
    case BinOp::Gt:
    case BinOp::Ge:
        return side_of_light(op == BinOp::Lt || op == BinOp::Le, a, b);
    default:
        return ir::None;
    }
}

// A direction times a number is that direction; a half vector need not be of unit length to be normalised.
Ref Lower::scaled_direction(BinOp op, Ref a, Ref b, Loc at) {
    const Tag x = side_less(tag(a)), y = side_less(tag(b));
    const bool scalar = m_b.at(op == BinOp::Mul && m_b.at(a).ty == Ty::Float ? a : b).ty == Ty::Float;
    if (!scalar)
        return ir::None;
    // 2 (I . Nf) Nf: what goes by the side that is seen goes with the normal of that side.
    const auto sided = [](Tag k) { return k == Tag::Facing || k == Tag::Behind; };
    if (sided(x) || sided(y)) {
        const bool first = sided(x);
        std::set<Ref> seen;
        if (!depends_on_view(first ? b : a, seen))
            return ir::None;
        const Ref n = turned(first ? a : b, at);
        const Ref s = m_b.splat(first ? b : a, at);
        return op == BinOp::Mul ? m_b.emit(Op::Mul, Ty::Triple, {n, s}, at) : ir::None;
    }
    const Tag t = x != Tag::None ? x : y;
    return to_light(t) && (x == Tag::None || y == Tag::None) ? light_direction(t, at) : ir::None;
}

// The dot product of directions: a kernel's factor where one of them is that of light.
Ref Lower::light_cosine(Ref a, Ref b, Loc at) {
    Tag x = tag(a), y = tag(b);
    const bool behind = x == Tag::Negated || y == Tag::Negated || x == Tag::Behind || y == Tag::Behind;
    x = side_less(x);
    y = side_less(y);
    if (to_light(y)) {
        std::swap(a, b);
        std::swap(x, y);
    }
    if (x == Tag::Light && behind && (y == Tag::None || y == Tag::Behind))
        return kernel(Closure::CosineBehind, Ty::Float, {b, b}, Tag::Cosine, at);
    if (x == Tag::Light && (y == Tag::None || y == Tag::Facing))
        return kernel(Closure::CosineKernel, Ty::Float, {b, b}, Tag::Cosine, at);
    if (x == Tag::Half && (y == Tag::None || y == Tag::Facing || y == Tag::Behind))
        return kernel(Closure::SpecularKernel, Ty::Float, {b, b, m_b.constant(1.0f)}, Tag::HalfCosine, at);
    if ((x == Tag::Light && y == Tag::Mirrored) || (x == Tag::LightMirrored && is_view(y)))
        return kernel(Closure::PhongKernel, Ty::Float, {m_b.triple(0), b, m_b.constant(1.0f)},
                      Tag::MirrorCosine, at);
    if (is_view(y)) {
        std::swap(a, b);
        std::swap(x, y);
    }
    if (is_view(x) && y == Tag::Behind) // its sign is not that of a front
        return m_b.emit(Op::Dot, Ty::Float, {a, turned(b, at)}, at);
    const bool facing = y == Tag::Facing || (x == Tag::Facing && y == Tag::None);
    if (is_view(x) && (y == Tag::None || facing)) {
        if (facing)
            b = turned(b, at);
        return tagged(m_b.emit(Op::Dot, Ty::Float, {a, b}, at),
                      x == Tag::View ? Tag::ViewCosine : Tag::EyeCosine);
    }
    // A loop over directions is on the side that is seen.
    if (facing && a != b && m_sample != ir::None)
        return m_b.emit(Op::Dot, Ty::Float,
                        {x == Tag::Facing ? turned(a, at) : a, y == Tag::Facing ? turned(b, at) : b}, at);
    return ir::None;
}

// Comparisons of a cosine with zero. less: a < b.
Ref Lower::side_of_light(bool less, Ref a, Ref b) {
    const auto cosine = [](Tag t) {
        return t == Tag::Cosine || t == Tag::HalfCosine || t == Tag::MirrorCosine;
    };
    const auto view_cosine = [](Tag t) { return t == Tag::ViewCosine || t == Tag::EyeCosine; };
    const Tag x = tag(a), y = tag(b);
    // Is a light in front of the surface? Kernels look after that themselves.
    if (cosine(x) && m_b.is_const(b, 0))
        return m_b.boolean(!less);
    if (cosine(y) && m_b.is_const(a, 0))
        return m_b.boolean(less);
    // Is the surface seen from its front (I . N < 0)? Both sides have the same lobes: taken as seen from
    // the front.
    if (view_cosine(x) && m_b.is_const(b, 0))
        return m_b.boolean(less == (x == Tag::ViewCosine));
    if (view_cosine(y) && m_b.is_const(a, 0))
        return m_b.boolean(less != (y == Tag::ViewCosine));
    return ir::None;
}

// A shadeop that is written in RSL, of these arguments.
Ref Lower::source_call(const char* shadeop, std::vector<Ref> args, Loc at, Ty result) {
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

// A variable that says what a closure is where its value is wanted before light is known; 0 until then.
int Lower::reference_value(const char* name, Loc at) {
    const int var = m_b.var(name, Ty::Float, at);
    in_prologue([&] {
        m_b.declare(var);
        m_b.store(var, m_b.constant(0.0f), at);
    });
    return var;
}

// fresnel() of the view direction: factors that make dielectric lobes of what they are multiplied with.
// Where they meet something else, closures.cpp takes their values as seen from the dicing camera.
Ref Lower::fresnel(const Expr* e) {
    const Ref i = expr_as(e->args[0], {Base::Vector});
    const ops::Signature& s = e->shadeop->signatures[size_t(e->signature)];
    if (tag(i) != Tag::View || !m_lit || s.args.size() < 5)
        return ir::None;
    const Ref n = expr_as(e->args[1], {Base::Normal});
    const Ref eta = expr_as(e->args[2], {Base::Float});
    const Ref front = tag(n) == Tag::Facing ? turned(n, e->loc) : n;
    int values[2];
    for (int& v : values)
        v = reference_value("fresnel", e->loc);
    if (FunctionDecl* f = m_sema.source(*e->shadeop, 0)) {
        std::vector<Binding> b(5);
        for (size_t k = 0; k < 5; k++) {
            b[k].kind = k < 3 ? Binding::Value : Binding::Variable;
            (k < 3 ? b[k].value : b[k].var) = k == 0 ? i : k == 1 ? front : k == 2 ? eta : values[k - 3];
        }
        inline_with(f, std::move(b), e->loc);
    }
    for (int k = 0; k < 2; k++) {
        const Ref r = m_b.emit(Op::Closure, Ty::Float, {n, n, eta}, e->loc,
                               int(k == 0 ? Closure::FresnelReflect : Closure::FresnelTransmit));
        m_b.stage().instrs[size_t(r)].floats = {float(values[k])};
        assign_to(e->args[size_t(3 + k)], r, e->loc);
    }
    if (e->args.size() > 5 && s.args.size() > 5)
        assign_to(e->args[5], tagged(source_call("reflect", {i, front}, e->loc), Tag::Mirrored), e->loc);
    if (e->args.size() > 6 && s.args.size() > 6)
        assign_to(e->args[6], tagged(source_call("refract", {i, front, eta}, e->loc), Tag::Refracted),
                  e->loc);
    return zero(Ty::Float);
}

// The exponent of (N . H) that the roughness of specular() and specularbrdf() stands for.
Ref Lower::blinn_exponent(Ref roughness, Loc at) {
    const Ref some = m_b.emit(Op::Max, Ty::Float, {roughness, m_b.constant(1e-4f)}, at);
    return m_b.emit(Op::Div, Ty::Float, {m_b.constant(m_program.rispec_specular ? 1.0f : 8.0f), some}, at);
}

// Shadeops of directions and cosines; None = as any other.
Ref Lower::light_shadeop(const Expr* e) {
    using ops::Optics;
    const bool in_loop = m_illuminance > 0;
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
        return m_lit ? transform_vector(e) : ir::None;
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
        return in_loop ? cosine_function(e) : ir::None;
    }
    return ir::None;
}

std::vector<Ref> Lower::arguments(const Expr* e) {
    const ops::Signature& s = signature(e);
    std::vector<Ref> args;
    for (size_t k = 0; k < e->args.size() && k < s.args.size(); k++)
        args.push_back(expr_as(e->args[k], s.args[k].type));
    return args;
}

// The shadeop as it is written in RSL, of these arguments.
Ref Lower::plain_source(const Expr* e, const std::vector<Ref>& args) {
    FunctionDecl* f = m_sema.source(*e->shadeop, e->signature);
    return f ? inline_values(f, args, e->loc) : zero(ty(e->type));
}

void Lower::note_occlusion(Loc at) {
    if (!m_lit)
        return;
    m_program.interreflection = true;
    if (!m_b.place() && !std::exchange(m_said_occlusion, true))
        m_diagnostics.info(at, "occlusion() is 0: transport occludes what light falls on. A surface that "
                               "shows 1 - occlusion() by itself is white; --integrator ao shows it");
}

bool Lower::to_light(Tag t) {
    return t == Tag::Light || t == Tag::Half || t == Tag::LightMirrored;
}

Ref Lower::normalize(const Expr* e) {
    const std::vector<Ref> args = arguments(e);
    const Tag t = tag(args[0]);
    return to_light(t) ? args[0] : tagged(plain_source(e, args), t);
}

// Directions to lights are taken to be of unit length.
Ref Lower::length(const Expr* e) {
    const std::vector<Ref> args = arguments(e);
    return to_light(tag(args[0])) ? m_b.constant(1.0f) : plain_source(e, args);
}

Ref Lower::face_forward(const Expr* e) {
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
Ref Lower::transform_vector(const Expr* e) {
    const std::vector<Ref> args = arguments(e);
    const Tag t = tag(args.back());
    return tagged(plain_source(e, args), t == Tag::Mirrored || t == Tag::Refracted ? t : Tag::None);
}

// reflect() and refract(): of the view direction it is `made`.
Ref Lower::reflect(const Expr* e, Tag made) {
    std::vector<Ref> args = arguments(e);
    if (tag(args[0]) == Tag::Light && made == Tag::Mirrored)
        return light_direction(Tag::LightMirrored, e->loc);
    if (tag(args[1]) == Tag::Facing || tag(args[1]) == Tag::Behind)
        args[1] = turned(args[1], e->loc);
    const bool view = tag(args[0]) == Tag::View || tag(args[0]) == Tag::Eye;
    return tagged(plain_source(e, args), view ? made : Tag::None);
}

Ref Lower::specular_brdf(const Expr* e) {
    std::vector<Ref> args = arguments(e);
    args[3] = blinn_exponent(args[3], e->loc);
    if (m_illuminance == 0)
        return source_call("__blinn", args, e->loc);
    return kernel(Closure::SpecularKernel, Ty::Triple, {args[1], args[1], args[3]}, Tag::None, e->loc);
}

Ref Lower::exponential(const Expr* e) {
    const ops::Signature& s = signature(e);
    const std::vector<Ref> args = arguments(e);
    const Ref kernel = ward(args[0], e->loc);
    return kernel != ir::None ? kernel : m_b.emit(s.op, ty(s.result), args, e->loc, s.imm);
}

// A highlight with an edge, smoothstep(low, high, pow(N . H, n)): the lobe that is as wide at half its
// height, where pow(N . H, n) is in the middle.
Ref Lower::smooth_step(const Expr* e) {
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
    return kernel(Closure(made.imm), Ty::Float,
                  {made.args[0], made.args[1], op(Op::Mul, made.args[2], narrower)}, Tag::None, e->loc);
}

// max(), clamp(), abs() and pow() of a cosine, which may be a kernel's; None = not of one, and not yet
// evaluated.
Ref Lower::cosine_function(const Expr* e) {
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
                   : told_math(m_b.emit(s.op, ty(s.result), args, e->loc, s.imm), e->loc);
    if (e->shadeop->optics == ops::Optics::Limit)
        return constants ? cosine : ir::None; // limited to the front: kernels are
    if (cosine != args[0] || tag(cosine) == Tag::Cosine)
        return ir::None;
    const Instr made = m_b.at(cosine);
    const bool half = tag(cosine) == Tag::HalfCosine;
    const Ref normal = made.op == Op::Closure ? made.args[0] : m_b.triple(0);
    return kernel(half ? Closure::SpecularKernel : Closure::PhongKernel, Ty::Float, {normal, normal, args[1]},
                  Tag::None, e->loc);
}

} // namespace kanuka::sl::ir
