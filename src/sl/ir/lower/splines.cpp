#include "sl/ir/lower/splines.h"

#include <algorithm>

namespace kanuka::sl::ir {

using namespace ast;

// spline([basis,] x, values…) and its inverse, "solve…": where does the spline have the value x?
Ref SplineLowerer::spline(const Expr* e, const ops::Signature& s) {
    const Loc at = e->loc;
    const bool has_basis = s.args[0].type.is(Base::String);
    const Ty t = ty(s.result);
    const Ref x = expr_as(e->args[has_basis ? 1 : 0], {Base::Float});
    Binding values;
    if (!values_of(e, has_basis ? 2 : 1, s.result, values))
        return zero(t);
    const int n = m_b.stage().vars[size_t(values.var)].array;
    if (n < 4 && values.length < 0) {
        m_diagnostics.error(at, "a spline needs at least 4 values, found " + std::to_string(n));
        return zero(t);
    }
    if (!has_basis)
        return value_at(*ops::find_basis("catmull-rom"), x, values, t, at);
    const Ref name = expr(e->args[0]);
    const Loc basis_at = e->args[0]->loc;
    if (m_b.at(name).op == Op::Text)
        return named(std::string(m_b.at(name).text), x, values, t, basis_at, at);
    // A basis that only the run time knows: the one among all.
    const int result = m_b.var("spline", t, at);
    m_b.declare(result);
    m_b.store(result, named("catmull-rom", x, values, t, basis_at, at), at);
    for (const std::string_view basis : {"bspline", "b-spline", "bezier", "hermite", "linear"}) {
        Item i{Item::If};
        i.ref = m_b.emit(Op::SameText, Ty::Bool, {name, m_b.text(std::string(basis))}, at);
        i.loc = at;
        i.body = in_block([&] { m_b.store(result, named(basis, x, values, t, basis_at, at), at); });
        i.orelse = m_b.stage().block();
        m_b.item(i);
    }
    return m_b.load(result, at);
}

// The values, in an array; false = they are none.
bool SplineLowerer::values_of(const Expr* e, size_t first, const ast::Type& element, Binding& values) {
    values.kind = Binding::Variable;
    if (first < e->args.size() && e->args[first]->type.array) {
        if (!e->args[first]->var)
            return false;
        values = bind(e->args[first]->var);
        return values.kind == Binding::Variable;
    }
    std::vector<Ref> list;
    for (size_t k = first; k < e->args.size(); k++) {
        if (conversion_cost(e->args[k]->type, element) < 0) {
            m_diagnostics.error(e->args[k]->loc, "found " + e->args[k]->type.str() + ", expected " +
                                                     element.str() + " for a value of the spline");
            return false;
        }
        list.push_back(expr_as(e->args[k], element));
    }
    values.var = m_b.var("spline", ty(element), e->loc, std::max<int>(1, int(list.size())));
    m_b.declare(values.var);
    for (size_t i = 0; i < list.size(); i++)
        m_b.emit(Op::StoreElement, Ty::Void, {m_b.constant(float(i)), list[i]}, e->loc, values.var);
    return true;
}

Ref SplineLowerer::named(std::string_view basis, Ref x, const Binding& values, Ty t, Loc basis_at, Loc at) {
    const bool inverse = basis.starts_with("solve");
    const ops::SplineBasis* b = ops::find_basis(inverse ? basis.substr(5) : basis);
    if (!b || (inverse && t != Ty::Float))
        m_diagnostics.error(basis_at, inverse && b
                                          ? "a spline is solved for floats only"
                                          : "unknown basis \"" + std::string(basis) +
                                                "\"; there are bezier, bspline, catmull-rom, hermite, "
                                                "linear, and solve before each");
    if (!b)
        b = ops::find_basis("catmull-rom");
    else if (inverse)
        return solve(*b, x, values, t, at);
    return value_at(*b, x, values, t, at);
}

// Bisection: the values rise or fall, so the spline does.
Ref SplineLowerer::solve(const ops::SplineBasis& basis, Ref x, const Binding& values, Ty t, Loc at) {
    const auto f = [&](float v) { return m_b.constant(v); };
    const auto op = [&](Op o, Ref a, Ref b) { return m_b.emit(o, Ty::Float, {a, b}, at); };
    const auto compare = [&](Op o, Ref a, Ref b) { return m_b.emit(o, Ty::Bool, {a, b}, at); };
    const Ref first = value_at(basis, f(0), values, t, at), last = value_at(basis, f(1), values, t, at);
    const Ref rises = compare(Op::Le, first, last);
    const int low = m_b.var("low", Ty::Float, at), high = m_b.var("high", Ty::Float, at);
    for (const auto& [var, value] : {std::pair{low, 0.0f}, std::pair{high, 1.0f}}) {
        m_b.declare(var);
        m_b.store(var, f(value), at);
    }
    for (int i = 0; i < 20; i++) {
        const Ref a = m_b.load(low, at), b = m_b.load(high, at);
        const Ref middle = op(Op::Mul, op(Op::Add, a, b), f(0.5f));
        const Ref y = value_at(basis, middle, values, t, at);
        const Ref beyond =
            m_b.emit(Op::Select, Ty::Bool, {rises, compare(Op::Ge, y, x), compare(Op::Le, y, x)}, at);
        m_b.store(low, m_b.emit(Op::Select, Ty::Float, {beyond, a, middle}, at), at);
        m_b.store(high, m_b.emit(Op::Select, Ty::Float, {beyond, middle, b}, at), at);
    }
    return op(Op::Mul, op(Op::Add, m_b.load(low, at), m_b.load(high, at)), f(0.5f));
}

// Segment and parameter within it, then the basis' polynomials of the four values.
Ref SplineLowerer::value_at(const ops::SplineBasis& basis, Ref x, const Binding& values, Ty t, Loc at) {
    const auto f = [&](float v) { return m_b.constant(v); };
    const auto op = [&](Op o, Ref a, Ref b) { return m_b.emit(o, m_b.at(a).ty, {a, b}, at); };
    const int n = m_b.stage().vars[size_t(values.var)].array;
    const auto whole = (n - 4) / basis.step + 1;
    Ref segments = f(float(whole));
    if (values.length >= 0) {
        const Ref more = op(Op::Div, op(Op::Sub, m_b.load(values.length, at), f(4)), f(float(basis.step)));
        segments = op(Op::Max, op(Op::Add, m_b.emit(Op::Floor, Ty::Float, {more}, at), f(1)), f(1));
    }
    const Ref scaled = op(Op::Mul, op(Op::Min, op(Op::Max, x, f(0)), f(1)), segments);
    const Ref segment =
        op(Op::Min, m_b.emit(Op::Floor, Ty::Float, {scaled}, at), op(Op::Sub, segments, f(1)));
    const Ref u = op(Op::Sub, scaled, segment);
    const Ref first = op(Op::Mul, segment, f(float(basis.step)));
    Ref sum = ir::None;
    for (int c = 0; c < 4; c++) {
        Ref w = f(basis.m[0][c]);
        for (int d = 1; d < 4; d++)
            w = op(Op::Add, op(Op::Mul, w, u), f(basis.m[d][c]));
        const Ref value = m_b.emit(Op::LoadElement, t, {op(Op::Add, first, f(float(c)))}, at, values.var);
        const Ref term = op(Op::Mul, value, t == Ty::Triple ? m_b.splat(w, at) : w);
        sum = sum == ir::None ? term : op(Op::Add, sum, term);
    }
    return sum;
}

} // namespace kanuka::sl::ir
