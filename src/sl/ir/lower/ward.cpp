#include "sl/ir/lower/ward.h"

#include <numbers>

#include "sl/ir/light_terms.h"
#include "sl/ir/lower/directions.h"

namespace kanuka::sl::ir {

using namespace ast;

// Is there light in it? Kernels are closures, and variables that hold a cosine are known by their tag.
bool WardLowerer::of_light(Ref r, int depth) const {
    const Instr& i = m_b.at(r);
    if (i.op == Op::Closure || tag(r) != Tag::None || depth > 12)
        return true;
    for (const Ref a : i.args)
        if (of_light(a, depth + 1))
            return true;
    return false;
}

// Its factors but N . L.
Ref WardLowerer::without_cosine(Ref r, Loc at) {
    if (tag(r) == Tag::Cosine)
        return m_b.constant(1.0f);
    const Instr i = m_b.at(r);
    if (i.op != Op::Mul || i.ty != Ty::Float)
        return r;
    return m_b.emit(Op::Mul, Ty::Float, {without_cosine(i.args[0], at), without_cosine(i.args[1], at)}, at);
}

// The direction T of (T . H)^2; None = it is none.
Ref WardLowerer::squared_half(Ref r) const {
    const Instr& i = m_b.at(r);
    if (i.op == Op::Closure && Closure(i.imm) == Closure::SpecularKernel && i.args.size() == 3 &&
        tag(r) == Tag::None && m_b.is_const(i.args[2], 2))
        return i.args[0];
    const bool square = i.op == Op::Mul && i.args[0] == i.args[1] && tag(i.args[0]) == Tag::HalfCosine;
    return square && m_b.at(i.args[0]).op == Op::Closure ? m_b.at(i.args[0]).args[0] : ir::None;
}

// What exp() is asked of in such a loop: factor * ((X . H)^2 + (Y . H)^2), the denominator taken as on the
// axis; no normal = something else.
WardLowerer::Exponent WardLowerer::read(Ref exponent) const {
    float factor = 1;
    Ref r = exponent, normal = ir::None;
    for (bool more = true; more;) {
        const Instr& i = m_b.at(r);
        more = false;
        if (i.op == Op::Neg) {
            factor = -factor;
            r = i.args[0];
            more = true;
        } else if (i.op == Op::Mul || i.op == Op::Div) {
            const int k = i.op == Op::Mul && m_b.is_const(i.args[0]) ? 0 : 1;
            if (m_b.is_const(i.args[size_t(k)])) {
                const float c = m_b.at(i.args[size_t(k)]).floats[0];
                factor *= i.op == Op::Mul ? c : 1 / c;
                r = i.args[size_t(1 - k)];
                more = true;
            } else if (i.op == Op::Div && normal == ir::None) {
                const Instr& below = m_b.at(i.args[1]);
                normal = squared_half(i.args[1]); // (N . H)^2, or 1 + N . H
                if (normal == ir::None && below.op == Op::Add) {
                    const int one = m_b.is_const(below.args[0], 1) ? 0 : 1;
                    const Ref cosine = below.args[size_t(1 - one)];
                    if (m_b.is_const(below.args[size_t(one)], 1) && tag(cosine) == Tag::HalfCosine &&
                        m_b.at(cosine).op == Op::Closure)
                        normal = m_b.at(cosine).args[0];
                    factor *= 0.5f;
                }
                more = normal != ir::None;
                r = i.args[0];
            }
        }
    }
    const Instr& sum = m_b.at(r);
    if (sum.op != Op::Add || !(factor < 0) || normal == ir::None)
        return {};
    const Ref X = squared_half(sum.args[0]), Y = squared_half(sum.args[1]);
    return X == ir::None || Y == ir::None ? Exponent{} : Exponent{factor, normal, X, Y};
}

Ref WardLowerer::kernel(Ref exponent, Loc at) {
    const Exponent e = read(exponent);
    if (e.normal == ir::None)
        return ir::None;
    const Ref X = e.X, Y = e.Y;
    // Widths: alpha^2 = 1 / (-factor T . T); grooves run where it is narrow
    const auto op = [&](Op o, Ref a, Ref b) { return m_b.emit(o, m_b.at(a).ty, {a, b}, at); };
    const auto dot = [&](Ref a, Ref b) { return m_b.emit(Op::Dot, Ty::Float, {a, b}, at); };
    const auto root = [&](Ref a) { return m_b.emit(Op::Sqrt, Ty::Float, {a}, at); };
    const auto f = [&](float x) { return m_b.constant(x); };
    const auto width2 = [&](Ref t) {
        return op(Op::Div, f(1), op(Op::Max, op(Op::Mul, f(-e.factor), dot(t, t)), f(1e-6f)));
    };
    const Ref x2 = width2(X), y2 = width2(Y);
    const Ref alpha2 = root(op(Op::Mul, x2, y2)); // Blinn's n: alpha^2 = 2 / (n + 2) (Walter et al. 2007)
    const Ref n = op(Op::Max, op(Op::Sub, op(Op::Div, f(2), alpha2), f(2)), f(1e-3f));
    const Ref ratio = root(op(Op::Div, op(Op::Min, x2, y2), op(Op::Max, x2, y2)));
    const Ref anisotropy = op(Op::Min, op(Op::Div, op(Op::Sub, f(1), ratio), f(Stretch)), f(1));
    const Ref narrow = m_b.emit(Op::Lt, Ty::Bool, {x2, y2}, at);
    const Ref grooves = m_b.emit(Op::Select, Ty::Triple, {narrow, X, Y}, at);
    const Ref u = input(Input::dPdu), v = m_b.emit(Op::Cross, Ty::Triple, {input(Input::N), u}, at);
    const auto along = [&](Ref axis) {
        return op(Op::Div, dot(grooves, axis), root(op(Op::Max, dot(axis, axis), f(1e-20f))));
    };
    const Ref angle = m_b.emit(Op::Math2, Ty::Float, {along(v), along(u)}, at, int(Fn::Atan2));
    const Ref turn = op(Op::Mul, angle, f(0.5f * std::numbers::inv_pi_v<float>));
    // Half a turn changes nothing. Values between vertices must not cross the jump from one turn to none, so
    // it lies where grooves seldom run: along dPdu is 1/2, along dPdv 3/4, of [3/8, 7/8).
    const Ref halves = m_b.emit(Op::Floor, Ty::Float, {op(Op::Add, op(Op::Mul, turn, f(2)), f(0.25f))}, at);
    const Ref rotation = op(Op::Add, op(Op::Sub, turn, op(Op::Mul, halves, f(0.5f))), f(0.5f));
    return directions().kernel(Closure::SpecularKernel, Ty::Float,
                               {e.normal, e.normal, n, anisotropy, rotation}, Tag::Ward, at);
}

Ref WardLowerer::arithmetic(BinOp op, Ref a, Ref b, Loc at) {
    const bool first = tag(a) == Tag::Ward, second = tag(b) == Tag::Ward;
    if (m_b.at(a).ty != Ty::Float || m_b.at(b).ty != Ty::Float || first == second)
        return ir::None;
    if (op == BinOp::Div && first)
        return of_light(b) ? a : tagged(m_b.emit(Op::Div, Ty::Float, {a, b}, at), Tag::Ward);
    if (op != BinOp::Mul)
        return ir::None;
    const Ref kernel = first ? a : b;
    Ref factor = first ? b : a;
    if (of_light(factor))
        factor = without_cosine(factor, at);
    if (of_light(factor))
        return ir::None;
    return m_b.is_const(factor, 1) ? kernel
                                   : tagged(m_b.emit(Op::Mul, Ty::Float, {kernel, factor}, at), Tag::Ward);
}

} // namespace kanuka::sl::ir
