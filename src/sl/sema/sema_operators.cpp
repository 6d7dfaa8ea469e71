// Operators and assignments, and what operands that adapt are wanted to be.
#include <algorithm>

#include "sl/sema/sema.h"

namespace kanuka::sl {

using namespace ast;

ast::Type Sema::unary(Expr* e, const ast::Type* expected) {
    const ast::Type t = expr(e->args[0], e->negate ? expected : nullptr);
    if (t.base == Base::Error)
        return t;
    if (e->negate) {
        if (t.numeric())
            return t.is(Base::Bool) ? ast::Type{Base::Float} : t;
        m_diagnostics.error(e->loc, "\"-\" needs a float, color, point, vector or normal, found " + t.str());
        return {};
    }
    if (!is_condition(t)) {
        m_diagnostics.error(e->loc, "\"!\" needs a condition, found " + t.str());
        return {};
    }
    return {Base::Bool};
}

ast::Type Sema::arithmetic(Loc at, BinOp op, const ast::Type& a, const ast::Type& b) {
    const auto bad = [&](const std::string& hint) -> ast::Type {
        m_diagnostics.error(at, "\"" + std::string(spelling(op)) + "\" does not go between " + a.str() +
                                    " and " + b.str() + hint);
        return {};
    };
    if (a.base == Base::Error || b.base == Base::Error)
        return {};
    if (a.array || b.array)
        return bad("; arrays are used element by element");
    switch (op) {
    case BinOp::And:
    case BinOp::Or:
        if (is_condition(a) && is_condition(b))
            return {Base::Bool};
        return bad("; expected conditions");
    case BinOp::Eq:
    case BinOp::Ne:
        if ((is_text(a) && is_text(b)) ||
            (a.numeric() && b.numeric() && (conversion_cost(a, b) >= 0 || conversion_cost(b, a) >= 0)))
            return {Base::Bool};
        return bad("");
    case BinOp::Lt:
    case BinOp::Le:
    case BinOp::Gt:
    case BinOp::Ge:
        // Of colours and points: true of all components.
        if (a.numeric() && b.numeric() && !a.is(Base::Matrix) && !b.is(Base::Matrix))
            return {Base::Bool};
        return bad("; expected floats");
    case BinOp::Dot:
        if (a.triple() && b.triple())
            return {Base::Float};
        return bad("; expected vectors");
    case BinOp::Cross:
        if (a.triple() && b.triple())
            return {Base::Vector};
        return bad("; expected vectors");
    default:
        break;
    }
    if (!a.numeric() || !b.numeric())
        return bad(a.is(Base::String) && op == BinOp::Add ? "; use concat()" : "");
    const auto number = [](const ast::Type& t) { return t.is(Base::Float) || t.is(Base::Bool); };
    if (number(a) && number(b))
        return {Base::Float};
    if (a.is(Base::Matrix) || b.is(Base::Matrix)) {
        const bool both = a.is(Base::Matrix) && b.is(Base::Matrix);
        if ((both || number(a) || number(b)) && (op == BinOp::Mul || op == BinOp::Div))
            return {Base::Matrix};
        if (both && (op == BinOp::Add || op == BinOp::Sub))
            return {Base::Matrix};
        return bad("; use transform() for points");
    }
    if (number(a))
        return b;
    if (number(b))
        return a;
    if (a.is(Base::Color) && b.is(Base::Color))
        return {Base::Color};
    if (a.is(Base::Color) || b.is(Base::Color)) {
        m_diagnostics.warning(at, "\"" + std::string(spelling(op)) + "\" goes between a " + a.str() +
                                      " and a " + b.str() + "; the result is taken as a color");
        return {Base::Color};
    }
    // Points, vectors, normals (RISpec 3.2, 12.1): point - point is a vector, point + vector a point.
    if (op == BinOp::Sub && a.is(Base::Point) && b.is(Base::Point))
        return {Base::Vector};
    if (a.is(Base::Point) || b.is(Base::Point))
        return {Base::Point};
    return a == b ? a : ast::Type{Base::Vector};
}

// (1, 0, 0) without a type
static bool open_tuple(const Expr* e) {
    return e->kind == ExprKind::Tuple && e->type.base == Base::Error && e->args.size() == 3;
}

// mix(), max(), pow() … of textures: a colour where one is wanted.
static bool open_call(const ops::Shadeop& op, const Expr* e) {
    bool colors = false;
    for (const ops::Signature& s : op.signatures)
        colors = colors || (op.signatures.size() > 1 && s.result.is(Base::Color) && !s.args.empty() &&
                            s.args[0].type.is(Base::Color));
    return colors && std::any_of(e->args.begin(), e->args.end(), Sema::asks_texture);
}

// True where an expression's type follows from what is wanted of it: noise() and texture() return what one
// asks for.
static bool adapts(const Expr* e, int depth = 0) {
    if (depth > 6)
        return false;
    if (e->kind == ExprKind::Call) {
        const ops::Shadeop* op = ops::find_shadeop(e->text);
        return op && (op->signatures[0].impl == ops::Impl::Noise || op->category == "Textures" ||
                      op->name == "random" || open_call(*op, e));
    }
    if (open_tuple(e) || e->kind == ExprKind::Method) // of a co-shader that is not known
        return true;
    if (e->kind == ExprKind::Unary)
        return adapts(e->args[0], depth + 1);
    if (e->kind == ExprKind::Ternary)
        return adapts(e->args[1], depth + 1) || adapts(e->args[2], depth + 1);
    if (e->kind == ExprKind::Binary && (e->op == BinOp::Add || e->op == BinOp::Sub || e->op == BinOp::Mul))
        return adapts(e->args[0], depth + 1) || adapts(e->args[1], depth + 1);
    return false;
}

bool Sema::asks_texture(const Expr* e) {
    if (e->kind == ExprKind::Call) {
        const ops::Shadeop* op = ops::find_shadeop(e->text);
        return op && ((op->category == "Textures" && op->name != "shadow") || open_call(*op, e));
    }
    const bool open =
        e->kind == ExprKind::Unary || e->kind == ExprKind::Binary || e->kind == ExprKind::Ternary;
    return open && std::any_of(e->args.begin(), e->args.end(), asks_texture);
}

ast::Type Sema::binary(Expr* e, const ast::Type* expected) {
    Expr *a = e->args[0], *b = e->args[1];
    const bool sum = e->op == BinOp::Add || e->op == BinOp::Sub;
    const bool product = e->op == BinOp::Mul || e->op == BinOp::Div;
    if ((!sum && !product) || !(adapts(a) || adapts(b))) {
        const ast::Type vector{Base::Vector};
        const bool spatial = e->op == BinOp::Dot || e->op == BinOp::Cross;
        expr(a, spatial && a->kind == ExprKind::Method ? &vector : nullptr);
        expr(b, spatial && b->kind == ExprKind::Method ? &vector : nullptr);
        return arithmetic(e->loc, e->op, a->type, b->type);
    }
    const ast::Type* whole =
        expected && (expected->triple() || expected->is(Base::Float)) ? expected : nullptr;
    if (adapts(a) && adapts(b)) {
        expr(a, whole);
        expr(b, e->op == BinOp::Div ? nullptr : whole);
        return arithmetic(e->loc, e->op, a->type, b->type);
    }
    // The operand that knows its type goes first.
    Expr* const known = adapts(a) ? b : a;
    Expr* const open = known == a ? b : a;
    beside(open, expr(known), e->op, open == b, whole);
    return arithmetic(e->loc, e->op, a->type, b->type);
}

// The operand of a sum or product whose type follows from the other one's. Beside a triple, a factor is a
// float (N * noise(P)) and a summand is of the same type; beside a float, what is wanted of the whole is
// wanted of it (color c = 0.5 * noise(P)). Textures beside a colour are colours.
ast::Type Sema::beside(Expr* open, const ast::Type& other, BinOp op, bool right, const ast::Type* whole) {
    const bool sum = op == BinOp::Add || op == BinOp::Sub;
    const ast::Type scalar{Base::Float};
    if (other.triple())
        return expr(open, sum || open_tuple(open) || (other.is(Base::Color) && asks_texture(open)) ? &other
                                                                                                   : &scalar);
    return expr(open, op == BinOp::Div && right ? &scalar : whole);
}

ast::Type Sema::ternary(Expr* e, const ast::Type* expected) {
    condition(e->args[0]);
    const ast::Type a = expr(e->args[1], expected), b = expr(e->args[2], expected);
    if (a.base == Base::Error || b.base == Base::Error)
        return {};
    if (conversion_cost(b, a) >= 0 && !(a.is(Base::Float) && b.triple()))
        return a.is(Base::Bool) ? ast::Type{Base::Float} : a;
    if (conversion_cost(a, b) >= 0)
        return b;
    m_diagnostics.error(e->loc, "the two values of ?: are a " + a.str() + " and a " + b.str());
    return {};
}

ast::Type Sema::assign(Expr* e) {
    Expr* target = e->args[0];
    // The target is read only by compound assignments.
    ast::Type to;
    if (target->kind == ExprKind::Name) {
        const bool was_read = find(target->text) && find(target->text)->read;
        to = target->type = name(target, e->op != BinOp::None);
        if (target->var && e->op != BinOp::None && target->var->kind == VarDecl::Local)
            target->var->read = was_read;
    } else {
        to = target->type = expr(target);
    }
    // c *= x is c = c * x.
    Expr* const value = e->args[1];
    const ast::Type from = e->op == BinOp::None ? expr(value, &to)
                           : adapts(value)
                               ? beside(value, to, e->op, true, to.is(Base::Float) ? &to : nullptr)
                               : expr(value);
    if (to.base == Base::Error)
        return {};
    written(target, "assigned to");
    if (e->op == BinOp::None) {
        if (to.array && !from.array && from.base != Base::Error)
            m_diagnostics.error(e->loc, "an array takes an array of the same type, found " + from.str());
        else
            want(e->args[1], to, "the assignment");
        return to;
    }
    const ast::Type result = arithmetic(e->loc, e->op, to, from);
    if (result.base != Base::Error && conversion_cost(result, to) < 0)
        m_diagnostics.error(e->loc,
                            "the result is a " + result.str() + ", which a " + to.str() + " cannot hold");
    return to;
}

} // namespace kanuka::sl
