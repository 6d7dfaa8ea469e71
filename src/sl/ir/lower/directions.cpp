#include "sl/ir/lower/directions.h"

#include <algorithm>

#include "sl/ir/lower/ward.h"

namespace kanuka::sl::ir {

using namespace ast;

Ref DirectionLowerer::to_light(Tag t, Loc at) {
    return kernel(Closure::LightDirection, Ty::Triple, {}, t, at);
}

Ref DirectionLowerer::kernel(Closure kind, Ty ty, std::vector<Ref> args, Tag t, Loc at) {
    const Ref r = m_b.emit(Op::Closure, ty, std::move(args), at, int(kind));
    m_b.stage().instrs[size_t(r)].floats = {float(m_state.light.number)};
    return tagged(r, t);
}

Ref DirectionLowerer::view(Loc at) {
    return tagged(m_b.emit(Op::Sub, Ty::Triple, {input(Input::P), input(Input::E)}, at), Tag::View);
}

Ref DirectionLowerer::turned(Ref normal, Loc at) {
    const bool behind = tag(normal) == Tag::Behind;
    const Ref cosine = m_b.emit(Op::Dot, Ty::Float, {view(at), normal}, at);
    const Ref wrong = m_b.emit(behind ? Op::Lt : Op::Gt, Ty::Bool, {cosine, m_b.constant(0.0f)}, at);
    return m_b.emit(Op::Select, Ty::Triple, {wrong, m_b.emit(Op::Neg, Ty::Triple, {normal}, at), normal}, at);
}

// Is it made of where the eye is?
bool DirectionLowerer::depends_on_view(Ref r, std::set<Ref>& seen) {
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

Ref DirectionLowerer::negated(Ref value, bool normal, Loc at) {
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

Ref DirectionLowerer::arithmetic(BinOp op, Ref a, Ref b, Loc at) {
    const Tag x = side_less(tag(a)), y = side_less(tag(b));
    if (x == Tag::None && y == Tag::None)
        return ir::None;
    if (x == Tag::Ward || y == Tag::Ward)
        return ward().arithmetic(op, a, b, at);
    switch (op) {
    case BinOp::Add:
    case BinOp::Sub: // Ln + V, or Ln - I, is on the way to the half direction
        return (x == Tag::Light && is_view(y)) || (is_view(x) && y == Tag::Light) ? to_light(Tag::Half, at)
                                                                                  : ir::None;
    case BinOp::Mul:
    case BinOp::Div:
        return scaled(op, a, b, at);
    case BinOp::Dot:
        return dot(a, b, at);
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
Ref DirectionLowerer::scaled(BinOp op, Ref a, Ref b, Loc at) {
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
    return to_light(t) && (x == Tag::None || y == Tag::None) ? to_light(t, at) : ir::None;
}

// The dot product of directions: a kernel's factor where one of them is that of light.
Ref DirectionLowerer::dot(Ref a, Ref b, Loc at) {
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
    if (facing && a != b && m_state.light.sample != ir::None)
        return m_b.emit(Op::Dot, Ty::Float,
                        {x == Tag::Facing ? turned(a, at) : a, y == Tag::Facing ? turned(b, at) : b}, at);
    return ir::None;
}

// Comparisons of a cosine with zero. less: a < b.
Ref DirectionLowerer::side_of_light(bool less, Ref a, Ref b) {
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

} // namespace kanuka::sl::ir
