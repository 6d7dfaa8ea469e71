// Illuminance loops and fresnel(), read as materials. Values are tagged with what they are to a lobe: the
// view direction, a direction to a light, half between them, mirrored, and the cosines between those. A
// cosine that is the kernel of a lobe becomes a factor for closures.cpp, which multiplies it with Cl to a
// whole term:
//
//   illuminance (P, N, PI/2) C += Cl * (N . normalize(L));              is diffuse(N)
//   … Cl * pow(max(0, N . H), 1 / roughness), H = normalize(Ln + V);    is specular(N, V, roughness)
//   … Cl * pow(max(0, R . Ln), size), R = reflect(I, N);                is phong(N, V, size)
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
    return tagged(m_b.emit(Op::Closure, Ty::Triple, {}, at, int(Closure::LightDirection)), t);
}

Ref Lower::kernel(Closure kind, Ty ty, std::vector<Ref> args, Tag t, Loc at) {
    return tagged(m_b.emit(Op::Closure, ty, std::move(args), at, int(kind)), t);
}

// None = nothing special.
Ref Lower::light_arithmetic(BinOp op, Ref a, Ref b, Loc at) {
    Tag x = tag(a), y = tag(b);
    if (x == Tag::None && y == Tag::None)
        return ir::None;
    const auto cosine = [](Tag t) {
        return t == Tag::Cosine || t == Tag::HalfCosine || t == Tag::MirrorCosine;
    };
    switch (op) {
    case BinOp::Add:
        // Ln + V is on the way to the half direction.
        if ((x == Tag::Light && y == Tag::View) || (x == Tag::View && y == Tag::Light))
            return light_direction(Tag::Half, at);
        return ir::None;
    case BinOp::Mul:
    case BinOp::Div: {
        // A direction times a number is that direction; a half vector need not be of unit length to be
        // normalised.
        const bool scalar = m_b.at(op == BinOp::Mul && m_b.at(a).ty == Ty::Float ? a : b).ty == Ty::Float;
        const Tag t = x != Tag::None ? x : y;
        if (scalar && (t == Tag::Light || t == Tag::Half || t == Tag::LightMirrored) &&
            (x == Tag::None || y == Tag::None))
            return light_direction(t, at);
        return ir::None;
    }
    case BinOp::Dot: {
        if (y == Tag::Light || y == Tag::Half || y == Tag::LightMirrored) {
            std::swap(a, b);
            std::swap(x, y);
        }
        if (x == Tag::Light && y == Tag::None)
            return kernel(Closure::CosineKernel, Ty::Float, {b, b}, Tag::Cosine, at);
        if (x == Tag::Half && y == Tag::None)
            return kernel(Closure::SpecularKernel, Ty::Float, {b, b, m_b.constant(1.0f)}, Tag::HalfCosine,
                          at);
        if ((x == Tag::Light && y == Tag::Mirrored) || (x == Tag::LightMirrored && y == Tag::View))
            return kernel(Closure::PhongKernel, Ty::Float, {m_b.triple(0), b, m_b.constant(1.0f)},
                          Tag::MirrorCosine, at);
        if ((x == Tag::View && y == Tag::None) || (y == Tag::View && x == Tag::None))
            return tagged(m_b.emit(Op::Dot, Ty::Float, {a, b}, at), Tag::ViewCosine);
        return ir::None;
    }
    case BinOp::Lt:
    case BinOp::Le:
    case BinOp::Gt:
    case BinOp::Ge: {
        const bool less = op == BinOp::Lt || op == BinOp::Le;
        // Is a light in front of the surface? Kernels look after that themselves.
        if (cosine(x) && m_b.is_const(b, 0))
            return m_b.boolean(!less);
        if (cosine(y) && m_b.is_const(a, 0))
            return m_b.boolean(less);
        // Is the surface seen from its front (I . N < 0)? Both sides have the same lobes: taken as seen from
        // the front.
        if (x == Tag::ViewCosine && m_b.is_const(b, 0))
            return m_b.boolean(less);
        if (y == Tag::ViewCosine && m_b.is_const(a, 0))
            return m_b.boolean(!less);
        return ir::None;
    }
    default:
        return ir::None;
    }
}

Ref Lower::fresnel(const Expr* e) {
    const Ref i = expr_as(e->args[0], {Base::Vector});
    if (tag(i) != Tag::View)
        return ir::None;
    const Ref n = expr_as(e->args[1], {Base::Normal});
    const Ref eta = expr_as(e->args[2], {Base::Float});
    assign_to(e->args[3], kernel(Closure::FresnelReflect, Ty::Float, {n, n, eta}, Tag::None, e->loc), e->loc);
    assign_to(e->args[4], kernel(Closure::FresnelTransmit, Ty::Float, {n, n, eta}, Tag::None, e->loc),
              e->loc);
    // Directions only say which is which; their values are not needed.
    for (size_t k = 5; k < e->args.size() && k < 7; k++)
        assign_to(
            e->args[k],
            tagged(m_b.emit(Op::Add, Ty::Triple, {i, n}, e->loc), k == 5 ? Tag::Mirrored : Tag::Refracted),
            e->loc);
    return zero(Ty::Float);
}

// Shadeops of directions and cosines; None = as any other.
Ref Lower::light_shadeop(const Expr* e) {
    const std::string& n = e->shadeop->name;
    const ops::Signature& s = e->shadeop->signatures[size_t(e->signature)];
    const auto source = [&](std::vector<Ref> args) {
        FunctionDecl* f = m_sema.source(*e->shadeop, e->signature);
        if (!f)
            return zero(ty(e->type));
        std::vector<Binding> b(f->formals.size());
        for (size_t k = 0; k < b.size(); k++) {
            b[k].kind = Binding::Value;
            b[k].value = args[k];
        }
        return inline_with(f, std::move(b), e->loc);
    };
    const auto arguments = [&] {
        std::vector<Ref> args;
        for (size_t k = 0; k < e->args.size() && k < s.args.size(); k++)
            args.push_back(expr_as(e->args[k], s.args[k].type));
        return args;
    };
    if (n == "fresnel")
        return fresnel(e);
    if (n == "normalize") {
        const std::vector<Ref> args = arguments();
        const Tag t = tag(args[0]);
        if (t == Tag::Light || t == Tag::Half || t == Tag::LightMirrored)
            return args[0];
        return tagged(source(args), t);
    }
    if (n == "reflect" || n == "refract") {
        const std::vector<Ref> args = arguments();
        if (tag(args[0]) == Tag::Light)
            return n == "reflect" ? light_direction(Tag::LightMirrored, e->loc) : ir::None;
        const bool view = tag(args[0]) == Tag::View;
        return tagged(source(args), !view ? Tag::None : n == "reflect" ? Tag::Mirrored : Tag::Refracted);
    }
    if (m_illuminance == 0)
        return ir::None;
    if (n == "specularbrdf") {
        const std::vector<Ref> args = arguments();
        const Ref exponent = m_b.emit(
            Op::Div, Ty::Float,
            {m_b.constant(1.0f), m_b.emit(Op::Max, Ty::Float, {args[3], m_b.constant(1e-4f)}, e->loc)},
            e->loc);
        return kernel(Closure::SpecularKernel, Ty::Triple, {args[1], args[1], exponent}, Tag::None, e->loc);
    }
    if (n == "max" || n == "clamp" || n == "abs" || n == "pow") {
        const std::vector<Ref> args = arguments();
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
            return n == "clamp" ? source(args) : m_b.emit(s.op, ty(s.result), args, e->loc, s.imm);
        if (n == "pow") {
            if (cosine != args[0] || tag(cosine) == Tag::Cosine)
                return ir::None;
            const Instr made = m_b.at(cosine);
            const bool half = tag(cosine) == Tag::HalfCosine;
            const Ref normal = made.op == Op::Closure ? made.args[0] : m_b.triple(0);
            return kernel(half ? Closure::SpecularKernel : Closure::PhongKernel, Ty::Float,
                          {normal, normal, args[1]}, Tag::None, e->loc);
        }
        return constants ? cosine : ir::None; // limited to the front: kernels are
    }
    return ir::None;
}

// The loop over lights is the integral that a lobe stands for: its body is read once.
void Lower::illuminance(const Stmt* s) {
    if (m_role == Role::Filter) {
        m_diagnostics.warning(
            s->loc, "light is not known in a volume shader: the loop is not run; interiors that scatter "
                    "are lit while tracing");
        return;
    }
    if (m_role != Role::Shade || m_program.kind == ShaderKind::Class) {
        m_diagnostics.error(s->loc, "an illuminance loop belongs into a surface shader; here use a lobe");
        return;
    }
    m_illuminance++;
    statement(s->body);
    m_illuminance--;
}

} // namespace kanuka::sl::ir
