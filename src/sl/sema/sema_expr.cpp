#include "sl/sema/sema.h"

namespace kanuka::sl {

using namespace ast;

int conversion_cost(const ast::Type& from, const ast::Type& to) {
    if (from.base == Base::Error || to.base == Base::Error)
        return 0;
    if (from.array != to.array)
        return -1;
    if (from.array)
        return from.base == to.base && (to.size == 0 || to.size == from.size) ? 0 : -1;
    if (from == to)
        return 0;
    if (from.base == Base::Bool)
        return to.base == Base::Float ? 1 : to.triple() ? 3 : -1;
    if (from.spatial() && to.spatial())
        return 1;
    if (from.base == Base::Float)
        return to.triple() ? 2 : to.base == Base::Matrix ? 3 : to.base == Base::Bool ? 4 : -1;
    return -1;
}

bool castable(const ast::Type& from, const ast::Type& to) {
    return conversion_cost(from, to) >= 0 || (from.triple() && to.triple());
}

void Sema::want(Expr* e, const ast::Type& to, const std::string& where) {
    if (conversion_cost(e->type, to) < 0)
        m_diagnostics.error(e->loc, "found " + e->type.str() + ", expected " + to.str() + " for " + where +
                                        (castable(e->type, to) ? "; cast it: " + to.str() + " (…)" : ""));
}

ast::Type Sema::expr(Expr* e, const ast::Type* expected) {
    // Chains like a + b + … are deep to the left; anything deeper than this is not written by hand.
    if (++m_depth > 20000) {
        m_diagnostics.error(e->loc, "this expression nests too deep");
        m_depth--;
        return e->type = {};
    }
    const ast::Type t = expr_kind(e, expected);
    m_depth--;
    return e->type = t;
}

ast::Type Sema::expr_kind(Expr* e, const ast::Type* expected) {
    switch (e->kind) {
    case ExprKind::Number:
        return {Base::Float};
    case ExprKind::String:
        return {Base::String};
    case ExprKind::Name:
        return name(e, true);
    case ExprKind::Index:
        return index(e);
    case ExprKind::Call:
        return call(e, expected);
    case ExprKind::Construct:
        return construct(e);
    case ExprKind::Cast:
        return cast(e);
    case ExprKind::Tuple:
    case ExprKind::TupleIn:
        return tuple(e, expected);
    case ExprKind::List:
        return list(e, expected);
    case ExprKind::Unary:
        return unary(e, expected);
    case ExprKind::Binary:
        return binary(e, expected);
    case ExprKind::Ternary:
        return ternary(e, expected);
    case ExprKind::Assign:
        return assign(e);
    case ExprKind::Method:
        m_diagnostics.error(e->loc,
                            "methods of co-shaders are not available yet; call a function, or put \"" +
                                std::string(e->text) + "\" into this shader");
        return {};
    }
    return {};
}

ast::Type Sema::name(Expr* e, bool reading) {
    VarDecl* v = find(e->text);
    if (!v) {
        std::vector<std::string_view> names;
        for (Scope* s = m_scope; s; s = s->parent)
            for (const auto& [n, var] : s->vars)
                names.push_back(n);
        for (const ops::Global& g : ops::globals())
            names.push_back(g.name);
        std::sort(names.begin(), names.end());
        const std::string near = closest(e->text, names);
        m_diagnostics.error(e->loc, "\"" + std::string(e->text) + "\" is not declared" +
                                        (near.empty() ? "" : "; did you mean \"" + near + "\"?"));
        // Declared now, so that further uses stay silent.
        VarDecl* made = m_arena.var();
        made->name = e->text;
        made->loc = e->loc;
        made->read = made->written = true;
        m_scope->vars[e->text] = made;
        return {};
    }
    e->var = v;
    if (reading) {
        if (v->kind == VarDecl::Local && !v->written && !v->type.array && !v->type.handle() &&
            v->type.base != Base::Lobe) {
            m_diagnostics.warning(e->loc, "\"" + std::string(v->name) +
                                              "\" is used before it has a value; it is 0 here");
            v->written = true;
        }
        v->read = true;
    }
    return v->type;
}

ast::Type Sema::index(Expr* e) {
    const ast::Type array = expr(e->args[0]);
    const ast::Type i = expr(e->args[1]);
    if (i.base != Base::Error && !i.is(Base::Float))
        m_diagnostics.error(e->args[1]->loc, "an index must be a float, found " + i.str());
    if (array.base == Base::Error)
        return {};
    if (array.is(Base::String)) // a texture's channel: "name"[2]
        return array;
    if (!array.array) {
        m_diagnostics.error(e->loc, "a " + array.str() + " has no elements; expected an array" +
                                        (array.triple() ? ", or comp(x, i)" : ""));
        return {};
    }
    e->var = e->args[0]->var;
    ast::Type element = array;
    element.array = false;
    element.size = 0;
    return element;
}

ast::Type Sema::cast(Expr* e) {
    const ast::Type to = e->type;
    const ast::Type from = expr(e->args[0], &to);
    if (e->args.size() > 1)
        expr(e->args[1]);
    if (!castable(from, to)) {
        m_diagnostics.error(e->loc, "a " + from.str() + " cannot be converted to a " + to.str());
        return {};
    }
    return to;
}

ast::Type Sema::tuple(Expr* e, const ast::Type* expected) {
    const size_t first = e->kind == ExprKind::TupleIn ? 1 : 0;
    if (first)
        expr(e->args[0]);
    const size_t n = e->args.size() - first;
    for (size_t i = first; i < e->args.size(); i++) {
        const ast::Type scalar{Base::Float};
        expr(e->args[i], &scalar);
        want(e->args[i], scalar, "a component");
    }
    ast::Type t = e->type;
    if (t.base == Base::Error && expected && (expected->triple() || expected->is(Base::Matrix)))
        t = *expected;
    if (t.base == Base::Error)
        t.base = n == 16 ? Base::Matrix : Base::Vector;
    const size_t need = t.is(Base::Matrix) ? 16 : t.triple() ? 3 : 1;
    if (n != need) {
        m_diagnostics.error(e->loc, "a " + t.str() + " has " + std::to_string(need) + " components, found " +
                                        std::to_string(n));
        return {};
    }
    return t;
}

ast::Type Sema::list(Expr* e, const ast::Type* expected) {
    ast::Type element = expected ? *expected : ast::Type{Base::Float};
    element.array = false;
    element.size = 0;
    for (Expr* a : e->args) {
        expr(a, &element);
        want(a, element, "an element");
    }
    element.array = true;
    element.size = int(e->args.size());
    return element;
}

ast::Type Sema::unary(Expr* e, const ast::Type* expected) {
    const ast::Type t = expr(e->args[0], e->negate ? expected : nullptr);
    if (t.base == Base::Error)
        return t;
    if (e->negate) {
        if (t.numeric() && !t.is(Base::Matrix))
            return t.is(Base::Bool) ? ast::Type{Base::Float} : t;
        m_diagnostics.error(e->loc, "\"-\" needs a float, color, point, vector or normal, found " + t.str());
        return {};
    }
    if (!t.is(Base::Bool) && !t.is(Base::Float)) {
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
        if ((a.is(Base::Bool) || a.is(Base::Float)) && (b.is(Base::Bool) || b.is(Base::Float)))
            return {Base::Bool};
        return bad("; expected conditions");
    case BinOp::Eq:
    case BinOp::Ne:
        if ((a.is(Base::String) && b.is(Base::String)) ||
            (a.numeric() && b.numeric() && (conversion_cost(a, b) >= 0 || conversion_cost(b, a) >= 0)))
            return {Base::Bool};
        return bad("");
    case BinOp::Lt:
    case BinOp::Le:
    case BinOp::Gt:
    case BinOp::Ge:
        if (conversion_cost(a, {Base::Float}) >= 0 && conversion_cost(b, {Base::Float}) >= 0)
            return {Base::Bool};
        return bad("; expected floats");
    case BinOp::Dot:
        if (a.triple() && b.triple())
            return {Base::Float};
        return bad("; expected vectors");
    case BinOp::Cross:
        if (a.spatial() && b.spatial())
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
    if (a.is(Base::Color) || b.is(Base::Color))
        return a.is(Base::Color) && b.is(Base::Color) ? ast::Type{Base::Color} : bad("; cast one of them");
    // Points, vectors, normals (RISpec 3.2, 12.1): point - point is a vector, point + vector a point.
    if (op == BinOp::Sub && a.is(Base::Point) && b.is(Base::Point))
        return {Base::Vector};
    if (a.is(Base::Point) || b.is(Base::Point))
        return {Base::Point};
    return a == b ? a : ast::Type{Base::Vector};
}

// True where an expression's type follows from what is wanted of it: noise() and texture() return what one
// asks for.
static bool adapts(const Expr* e, int depth = 0) {
    if (depth > 6)
        return false;
    if (e->kind == ExprKind::Call) {
        const ops::Shadeop* op = ops::find_shadeop(e->text);
        return op && (op->signatures[0].impl == ops::Impl::Noise || op->category == "Textures" ||
                      op->name == "random");
    }
    if (e->kind == ExprKind::Unary)
        return adapts(e->args[0], depth + 1);
    if (e->kind == ExprKind::Binary && (e->op == BinOp::Add || e->op == BinOp::Sub || e->op == BinOp::Mul))
        return adapts(e->args[0], depth + 1) || adapts(e->args[1], depth + 1);
    return false;
}

ast::Type Sema::binary(Expr* e, const ast::Type* expected) {
    Expr *a = e->args[0], *b = e->args[1];
    const bool sum = e->op == BinOp::Add || e->op == BinOp::Sub;
    const bool product = e->op == BinOp::Mul || e->op == BinOp::Div;
    if ((!sum && !product) || !(adapts(a) || adapts(b))) {
        expr(a);
        expr(b);
        return arithmetic(e->loc, e->op, a->type, b->type);
    }
    // The operand that knows its type goes first. Beside a triple, a factor is a float (N * noise(P)) and a
    // summand is of the same type; beside a float, what is wanted of the whole is wanted of the other (color
    // c = 0.5 * noise(P)).
    const ast::Type* whole =
        expected && (expected->triple() || expected->is(Base::Float)) ? expected : nullptr;
    if (adapts(a) && adapts(b)) {
        expr(a, whole);
        expr(b, e->op == BinOp::Div ? nullptr : whole);
        return arithmetic(e->loc, e->op, a->type, b->type);
    }
    Expr* const known = adapts(a) ? b : a;
    Expr* const open = known == a ? b : a;
    const ast::Type t = expr(known);
    const ast::Type scalar{Base::Float};
    if (t.triple())
        expr(open, sum ? &t : &scalar);
    else
        expr(open, e->op == BinOp::Div && open == b ? &scalar : whole);
    return arithmetic(e->loc, e->op, a->type, b->type);
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
        to = expr(target);
    }
    const ast::Type from = expr(e->args[1], &to);
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
