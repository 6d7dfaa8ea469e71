#include "sl/ir/lower/expressions.h"

#include "sl/ir/lower/assignments.h"
#include "sl/ir/lower/coshaders.h"
#include "sl/ir/lower/directions.h"
#include "sl/ir/lower/functions.h"
#include "sl/ir/lower/matrix.h"
#include "sl/ir/lower/variables.h"

namespace kanuka::sl::ir {

using namespace ast;

Ref ExpressionLowerer::convert(Ref value, const ast::Type& to, Loc at) {
    if (value == ir::None)
        return zero(ty(to));
    const Ty have = m_b.at(value).ty, need = ty(to);
    if (have == need || need == Ty::Void)
        return value;
    if (have == Ty::Bool)
        return convert(m_b.emit(Op::ToFloat, Ty::Float, {value}, at), to, at);
    if (need == Ty::Bool)
        return truth(value);
    if (need == Ty::Triple)
        return m_b.splat(value, at);
    if (need == Ty::Matrix) { // a float times the identity
        std::vector<Ref> m(16, m_b.constant(0.0f));
        for (int i = 0; i < 4; i++)
            m[size_t(5 * i)] = value;
        return m_b.emit(Op::Make, Ty::Matrix, std::move(m), at);
    }
    return zero(need); // sema has complained
}

Ref ExpressionLowerer::truth(Ref value) {
    const Loc at = m_b.at(value).loc;
    switch (m_b.at(value).ty) {
    case Ty::Bool:
        return value;
    case Ty::String: {
        const Ref empty = m_b.emit(Op::SameText, Ty::Bool, {value, m_b.text("")}, at);
        return m_b.emit(Op::Not, Ty::Bool, {empty}, at);
    }
    case Ty::Triple: {
        const Ref none = comparison(BinOp::Eq, value, m_b.triple(0), at);
        return m_b.emit(Op::Not, Ty::Bool, {none}, at);
    }
    default:
        break;
    }
    return m_b.emit(Op::Ne, Ty::Bool, {value, m_b.constant(0.0f)}, at);
}

Ref ExpressionLowerer::name(const Expr* e) {
    const VarDecl* v = e->var;
    if (!v)
        return zero(ty(e->type));
    if (v->kind == VarDecl::Global)
        return variables().global(v, e->loc);
    const Binding& b = bind(v);
    switch (b.kind) {
    case Binding::Value:
        return b.value;
    case Binding::Variable:
        return load_tagged(b.var, e->loc);
    default:
        return zero(Ty::Float);
    }
}

Ref ExpressionLowerer::expr(const Expr* e) {
    switch (e->kind) {
    case ExprKind::Number:
        return m_b.constant(e->number);
    case ExprKind::String:
        return m_b.text(std::string(e->text));
    case ExprKind::Name:
        return name(e);
    case ExprKind::Index:
        return index(e);
    case ExprKind::Call:
        return functions().call(e);
    case ExprKind::Construct:
        return ir::None;
    case ExprKind::Cast: {
        const Ref v = expr_as(e->args[0], e->type);
        return e->args.size() > 1 ? in_space(v, e->type, e->args[1], e->loc) : v;
    }
    case ExprKind::Tuple:
    case ExprKind::TupleIn:
        return tuple(e);
    case ExprKind::Unary:
        return unary(e);
    case ExprKind::Binary:
        return binary(e);
    case ExprKind::Ternary:
        return ternary(e);
    case ExprKind::Assign:
        return assignments().assign(e);
    case ExprKind::Sequence: {
        Ref last = ir::None;
        for (const Expr* a : e->args)
            last = expr(a);
        return last;
    }
    case ExprKind::Method:
        if (e->function)
            return functions().struct_call(e);
        return coshaders().coshader(e);
    case ExprKind::List:
        break;
    }
    const Ty t = ty(e->type);
    return zero(t == Ty::Void ? Ty::Float : t);
}

Ref ExpressionLowerer::unary(const Expr* e) {
    if (!e->negate)
        return m_b.emit(Op::Not, Ty::Bool, {condition(e->args[0])}, e->loc);
    const Ref v = expr_as(e->args[0], e->type);
    if (tag(v) == Tag::Light || tag(v) == Tag::LightMirrored)
        return v; // which way it points does not matter to a kernel
    return directions().negated(v, e->type.is(Base::Normal), e->loc);
}

// An array's element, a colour's or point's component, a matrix's element.
Ref ExpressionLowerer::index(const Expr* e) {
    const Expr* whole = e->args[0];
    if (whole->type.array) {
        const Ref i = expr_as(e->args[1], {Base::Float});
        if (!whole->var)
            return zero(ty(e->type));
        const Binding& b = bind(whole->var);
        if (b.kind != Binding::Variable)
            return zero(ty(e->type));
        const int var = b.var;
        const Ref r = m_b.emit(Op::LoadElement, ty(e->type), {i}, e->loc, var);
        m_b.stage().instrs[r].floats = {float(
            fault(e->args[1]->loc, "index outside of array \"" + std::string(whole->var->name) + "\""))};
        return r;
    }
    if (whole->type.triple())
        return component_of(m_b, expr(whole), expr_as(e->args[1], {Base::Float}), e->loc);
    if (whole->type.is(Base::Matrix) && e->type.is(Base::Float)) // m[row][column]
        return component_of(m_b, expr(whole->args[0]), element_of_matrix(e), e->loc);
    m_diagnostics.error(e->loc, whole->type.is(Base::Matrix)
                                    ? "a row of a matrix is no value: expected m[row][column]"
                                    : "a string has no elements; a channel is picked within texture() alone");
    return zero(ty(e->type));
}

// m[row][column] as an index into the sixteen elements.
Ref ExpressionLowerer::element_of_matrix(const Expr* e) {
    const Ref row = expr_as(e->args[0]->args[1], {Base::Float});
    const Ref column = expr_as(e->args[1], {Base::Float});
    const Ref whole = m_b.emit(Op::Floor, Ty::Float, {row}, e->loc);
    return m_b.emit(Op::Add, Ty::Float,
                    {m_b.emit(Op::Mul, Ty::Float, {whole, m_b.constant(4.0f)}, e->loc), column}, e->loc);
}

Ref ExpressionLowerer::tuple(const Expr* e) {
    const size_t first = e->kind == ExprKind::TupleIn ? 1 : 0;
    std::vector<Ref> parts;
    for (size_t i = first; i < e->args.size(); i++)
        parts.push_back(expr_as(e->args[i], {Base::Float}));
    const Ty t = ty(e->type);
    if (int(parts.size()) != comps(t))
        return zero(t);
    const Ref v = t == Ty::Float ? parts[0] : m_b.emit(Op::Make, t, std::move(parts), e->loc);
    return first ? in_space(v, e->type, e->args[0], e->loc) : v;
}

// point "world" (…): given in that space, wanted in the current one.
Ref ExpressionLowerer::in_space(Ref value, const ast::Type& type, const Expr* space, Loc at) {
    const char* op = type.is(Base::Color)    ? "ctransform"
                     : type.is(Base::Vector) ? "vtransform"
                     : type.is(Base::Normal) ? "ntransform"
                     : type.is(Base::Matrix) ? "mtransform"
                                             : "transform";
    const ops::Shadeop* shadeop = ops::find_shadeop(op);
    for (size_t k = 0; shadeop && k < shadeop->signatures.size(); k++) {
        const ops::Signature& s = shadeop->signatures[k];
        if (s.args.size() != 3)
            continue;
        FunctionDecl* f = m_sema.source(*shadeop, int(k));
        if (!f)
            continue;
        const Ref from = expr(space);
        const Ref to = m_b.text(type.is(Base::Color) ? "rgb" : "current");
        return functions().inline_values(f, {from, to, value}, at);
    }
    return value;
}

// Does it divide by what may be zero, or ask pow() or log() for what they do not have? Then it runs only
// where it is wanted: the condition may be there to guard it.
static bool divides(const Expr* e) {
    if (e->kind == ExprKind::Call && e->shadeop && (e->shadeop->name == "pow" || e->shadeop->name == "log"))
        return true;
    if (e->kind == ExprKind::Binary && e->op == BinOp::Div && e->args[1]->kind != ExprKind::Number)
        return true;
    for (const Expr* a : e->args)
        if (a && divides(a))
            return true;
    return false;
}

Ref ExpressionLowerer::binary(const Expr* e) {
    const Expr *x = e->args[0], *y = e->args[1];
    const Ref a = expr(x);
    if ((e->op == BinOp::And || e->op == BinOp::Or) && !m_b.place() && divides(y)) {
        // b != 0 && a / b > 1: the second is asked where the first leaves it open.
        const Ref first = truth(a);
        const int var = m_b.var("?", Ty::Bool, e->loc);
        m_b.declare(var);
        m_b.store(var, first, e->loc);
        Item i{Item::If};
        i.ref = e->op == BinOp::And ? first : m_b.emit(Op::Not, Ty::Bool, {first}, e->loc);
        i.loc = e->loc;
        i.body = in_block([&] { m_b.store(var, condition(y), e->loc); });
        i.orelse = m_b.stage().block();
        m_b.item(i);
        return m_b.load(var, e->loc);
    }
    const Ref b = expr(y);
    return arithmetic(e->op, a, x->type, b, y->type, e->type, e->loc);
}

// Of triples and matrices: true of all components.
Ref ExpressionLowerer::comparison(BinOp op, Ref a, Ref b, Loc at) {
    const Op o = op == BinOp::Lt   ? Op::Lt
                 : op == BinOp::Le ? Op::Le
                 : op == BinOp::Gt ? Op::Gt
                 : op == BinOp::Ge ? Op::Ge
                                   : Op::Eq;
    const int n = comps(m_b.at(a).ty);
    if (n == 1)
        return m_b.emit(o, Ty::Bool, {a, b}, at);
    Ref all = m_b.boolean(true);
    for (int i = 0; i < n; i++) {
        const Ref p = m_b.emit(Op::Extract, Ty::Float, {a}, at, i),
                  q = m_b.emit(Op::Extract, Ty::Float, {b}, at, i);
        all = m_b.emit(Op::And, Ty::Bool, {all, m_b.emit(o, Ty::Bool, {p, q}, at)}, at);
    }
    return all;
}

Ref ExpressionLowerer::equality(BinOp op, Ref a, const ast::Type& ta, Ref b, const ast::Type& tb, Loc at) {
    Ref equal;
    if (m_b.at(a).ty == Ty::String || m_b.at(b).ty == Ty::String) {
        equal = m_b.emit(Op::SameText, Ty::Bool, {a, b}, at);
    } else {
        const ast::Type wide = comps(m_b.at(a).ty) >= comps(m_b.at(b).ty) ? ta : tb;
        const ast::Type common = wide.is(Base::Bool) ? ast::Type{Base::Float} : wide;
        a = convert(a, common, at);
        b = convert(b, common, at);
        if (comps(ty(common)) == 1)
            return m_b.emit(op == BinOp::Eq ? Op::Eq : Op::Ne, Ty::Bool, {a, b}, at);
        equal = comparison(BinOp::Eq, a, b, at);
    }
    return op == BinOp::Eq ? equal : m_b.emit(Op::Not, Ty::Bool, {equal}, at);
}

Ref ExpressionLowerer::arithmetic(BinOp op, Ref a, const ast::Type& ta, Ref b, const ast::Type& tb,
                                  const ast::Type& result, Loc at) {
    if (const Ref r = directions().arithmetic(op, a, b, at); r != ir::None)
        return r;
    switch (op) {
    case BinOp::And:
    case BinOp::Or:
        return m_b.emit(op == BinOp::And ? Op::And : Op::Or, Ty::Bool, {truth(a), truth(b)}, at);
    case BinOp::Eq:
    case BinOp::Ne:
        return equality(op, a, ta, b, tb, at);
    case BinOp::Lt:
    case BinOp::Le:
    case BinOp::Gt:
    case BinOp::Ge: {
        const ast::Type f{ta.triple() || tb.triple() ? Base::Vector : Base::Float};
        return comparison(op, convert(a, f, at), convert(b, f, at), at);
    }
    case BinOp::Dot:
        return m_b.emit(Op::Dot, Ty::Float, {a, b}, at);
    case BinOp::Cross:
        return m_b.emit(Op::Cross, Ty::Triple, {a, b}, at);
    default:
        break;
    }
    if (result.is(Base::Matrix)) {
        a = convert(a, result, at);
        b = convert(b, result, at);
        if (op == BinOp::Add || op == BinOp::Sub)
            return m_b.emit(op == BinOp::Add ? Op::Add : Op::Sub, Ty::Matrix, {a, b}, at);
        return m_b.emit(Op::MatMul, Ty::Matrix, {a, op == BinOp::Div ? inverse(m_b, b, at) : b}, at);
    }
    a = convert(a, result, at);
    b = convert(b, result, at);
    const Op o = op == BinOp::Add   ? Op::Add
                 : op == BinOp::Sub ? Op::Sub
                 : op == BinOp::Mul ? Op::Mul
                                    : Op::Div;
    const size_t before = m_b.stage().instrs.size();
    const Ref r = m_b.emit(o, ty(result), {a, b}, at);
    // A division by zero gives 0 and is told. Shadeops of the library look after theirs.
    if (o == Op::Div && size_t(r) == before && m_b.at(r).op == Op::Div && !m_b.place() && !m_b.is_const(b))
        m_b.stage().instrs[r].floats = {float(fault(at, "division by zero"))};
    return r;
}

// True if evaluating the expression costs or does something: then it is evaluated only where it is wanted.
static bool heavy(const Expr* e) {
    if (e->kind == ExprKind::Call || e->kind == ExprKind::Assign || e->kind == ExprKind::Method)
        return true;
    for (const Expr* a : e->args)
        if (a && heavy(a))
            return true;
    return false;
}

Ref ExpressionLowerer::ternary(const Expr* e) {
    const Ref c = condition(e->args[0]);
    if (m_b.is_const(c))
        return expr_as(e->args[m_b.at(c).floats[0] != 0 ? 1 : 2], e->type);
    const bool guarded = !m_b.place() && (divides(e->args[1]) || divides(e->args[2]));
    if (!guarded && !heavy(e->args[1]) && !heavy(e->args[2])) {
        const Ref a = expr_as(e->args[1], e->type);
        const Ref b = expr_as(e->args[2], e->type);
        return m_b.emit(Op::Select, ty(e->type), {c, a, b}, e->loc);
    }
    const int var = m_b.var("?", ty(e->type), e->loc);
    m_b.declare(var);
    Item i{Item::If};
    i.ref = c;
    i.loc = e->loc;
    i.body = in_block([&] { m_b.store(var, expr_as(e->args[1], e->type), e->loc); });
    i.orelse = in_block([&] { m_b.store(var, expr_as(e->args[2], e->type), e->loc); });
    m_b.item(i);
    return m_b.load(var, e->loc);
}

} // namespace kanuka::sl::ir
