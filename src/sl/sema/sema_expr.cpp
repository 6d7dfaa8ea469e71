#include <algorithm>

#include "sl/sema/sema.h"

namespace kanuka::sl {

using namespace ast;

bool is_text(const ast::Type& t) {
    return t.is(Base::String) || t.is(Base::Shader);
}

// Numbers are true unless they are 0, strings and shaders unless they are empty.
bool is_condition(const ast::Type& t) {
    return is_text(t) || t.is(Base::Bool) || t.is(Base::Float) || t.triple();
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
    if (is_text(from) && is_text(to))
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

} // namespace kanuka::sl
