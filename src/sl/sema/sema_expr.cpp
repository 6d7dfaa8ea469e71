#include <algorithm>

#include "sl/sema/sema.h"

namespace kanuka::sl {

using namespace ast;

static bool text(const ast::Type& t) {
    return t.is(Base::String) || t.is(Base::Shader);
}

// Numbers are true unless they are 0, strings and shaders unless they are empty.
bool is_condition(const ast::Type& t) {
    return text(t) || t.is(Base::Bool) || t.is(Base::Float) || t.triple();
}

int conversion_cost(const ast::Type& from, const ast::Type& to) {
    if (from.base == Base::Error || to.base == Base::Error)
        return 0;
    if (from.array != to.array)
        return -1;
    if (from.array) {
        ast::Type a = from, b = to;
        a.size = b.size = 0;
        const bool alike = a == b || (from.base >= Base::Point && from.base <= Base::Normal &&
                                      to.base >= Base::Point && to.base <= Base::Normal);
        return alike && (to.size == 0 || from.size == 0 || to.size == from.size) ? (a == b ? 0 : 1) : -1;
    }
    if (from == to)
        return 0;
    if (text(from) && text(to))
        return 1;
    if (from.base == Base::Bool)
        return to.base == Base::Float ? 1 : to.triple() ? 3 : -1;
    if (from.spatial() && to.spatial())
        return 1;
    if (from.base == Base::Float)
        return to.triple() ? 2 : to.base == Base::Matrix ? 3 : to.base == Base::Bool ? 4 : -1;
    if (from.triple() && to.triple())
        return Doubtful;
    return -1;
}

bool castable(const ast::Type& from, const ast::Type& to) {
    return conversion_cost(from, to) >= 0 || (from.triple() && to.triple());
}

void Sema::want(Expr* e, const ast::Type& to, const std::string& where) {
    const int cost = conversion_cost(e->type, to);
    if (cost >= Doubtful)
        m_diagnostics.warning(e->loc, "a " + e->type.str() + " is taken as a " + to.str() + " for " + where +
                                          "; a cast says that this is meant: " + to.str() + " (…)");
    if (cost < 0)
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
        return member(e, expected);
    case ExprKind::Sequence: {
        ast::Type t;
        for (Expr* a : e->args)
            t = expr(a, a == e->args.back() ? expected : nullptr);
        return t;
    }
    }
    return {};
}

ast::Type Sema::name(Expr* e, bool reading) {
    VarDecl* v = e->called ? e->var : find(e->text); // called: a struct's member, found by member()
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
            v->type.base != Base::Lobe && v->type.base != Base::Struct) {
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
    if (array.triple()) // a component: Cs[0]
        return {Base::Float};
    if (array.is(Base::Matrix)) { // m[0] is a row and m[0][1] an element
        const Expr* row = e->args[0];
        const bool element = row->kind == ExprKind::Index && row->args[0]->type.is(Base::Matrix);
        return element ? ast::Type{Base::Float} : array;
    }
    if (!array.array) {
        m_diagnostics.error(e->loc, "a " + array.str() + " has no elements; expected an array");
        return {};
    }
    e->var = e->args[0]->var;
    ast::Type element = array;
    element.array = false;
    element.size = 0;
    return element;
}

// s->x: a struct's member becomes the variable that holds it. Of a co-shader: its parameter, or a call.
ast::Type Sema::member(Expr* e, const ast::Type* expected) {
    Expr* whole = e->args[0];
    if (whole->kind == ExprKind::Name && whole->text == "this") { // the class itself
        e->kind = e->called ? ExprKind::Call : ExprKind::Name;
        e->args.erase(e->args.begin());
        const bool called = e->called;
        e->called = false;
        return called ? call(e, expected) : name(e, true);
    }
    const ast::Type t = expr(whole);
    if (t.is(Base::Shader))
        return coshader(e, expected);
    for (size_t i = 1; i < e->args.size(); i++)
        expr(e->args[i]);
    if (t.base == Base::Error)
        return {};
    if (!t.is(Base::Struct)) {
        m_diagnostics.error(e->loc, "\"->\" needs a struct or a shader before it, found " + t.str());
        return {};
    }
    const bool element = whole->kind == ExprKind::Index;
    VarDecl* owner = element ? whole->args[0]->var : whole->kind == ExprKind::Name ? whole->var : nullptr;
    if (!owner || (e->called && element)) {
        m_diagnostics.error(e->loc, "copy the struct into a variable first");
        return {};
    }
    if (e->called) {
        check_struct(t.record);
        std::vector<FunctionDecl*> named;
        for (FunctionDecl* f : t.record->functions)
            if (f->name == e->text)
                named.push_back(f);
        Expr call = *e; // its arguments alone
        call.args.erase(call.args.begin());
        if (named.empty()) {
            m_diagnostics.error(e->loc, "struct \"" + std::string(t.record->name) + "\" has no function \"" +
                                            std::string(e->text) + "\"");
            return {};
        }
        FunctionDecl* f = choose(&call, named, expected);
        if (!f)
            return no_function(&call, named);
        e->function = f;
        e->var = owner;
        for (VarDecl* field : owner->fields)
            field->assigned = true;
        return f->result;
    }
    for (size_t i = 0; i < t.record->members.size() && i < owner->fields.size(); i++) {
        if (t.record->members[i]->name != e->text)
            continue;
        VarDecl* field = owner->fields[i];
        if (element) {
            Expr* array = m_arena.expr(ExprKind::Name, e->loc);
            array->text = field->name;
            array->var = field;
            array->called = true;
            array->type = field->type;
            e->kind = ExprKind::Index;
            e->args = {array, whole->args[1]};
            e->called = false;
            return index(e);
        }
        e->kind = ExprKind::Name;
        e->args.clear();
        e->var = field;
        e->text = field->name;
        e->called = true;
        return name(e, true);
    }
    std::string have;
    for (const VarDecl* m : t.record->members)
        have += (have.empty() ? "" : ", ") + std::string(m->name);
    m_diagnostics.error(e->loc, "struct \"" + std::string(t.record->name) + "\" has no member \"" +
                                    std::string(e->text) + "\"; it has " + have);
    return {};
}

ast::Type Sema::cast(Expr* e) {
    // point space (x, y, z) with a space by its variable reads like a cast of a call.
    Expr* inner = e->args[0];
    if (e->args.size() == 1 && inner->kind == ExprKind::Call && find_functions(inner->text).empty() &&
        !ops::find_shadeop(inner->text)) {
        const VarDecl* v = find(inner->text);
        if (v && v->type.is(Base::String)) {
            Expr* space = m_arena.expr(ExprKind::Name, inner->loc);
            space->text = inner->text;
            std::vector<Expr*> values = std::move(inner->args);
            if (values.size() == 1) {
                e->args = {values[0], space};
            } else {
                e->kind = ExprKind::TupleIn;
                values.insert(values.begin(), space);
                e->args = std::move(values);
                return tuple(e, nullptr);
            }
        }
    }
    const ast::Type to = e->type;
    const ast::Type from = expr(e->args[0], &to);
    if (e->args.size() > 1)
        expr(e->args[1]);
    if (to.base == Base::Void) { // (void) f(x)
        return from;
    }
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
    if (!expected && !e->args.empty())
        element = expr(e->args[0]);
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
        if ((text(a) && text(b)) ||
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
