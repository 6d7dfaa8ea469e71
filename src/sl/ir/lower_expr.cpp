#include "sl/ir/lower.h"

namespace kanuka::sl::ir {

using namespace ast;

Ref Lower::zero(Ty ty) {
    if (ty == Ty::String)
        return m_b.text("");
    return m_b.constant(std::vector<float>(size_t(comps(ty)), 0.0f), ty);
}

int Lower::fault(Loc at, std::string what) {
    m_b.stage().faults.emplace_back(at, std::move(what));
    return int(m_b.stage().faults.size() - 1);
}

Ref Lower::input(Input input) {
    return m_b.leaf(Op::Input, input_info(input).ty, int(input));
}

// The binding of a variable; parameters and globals get theirs at first use.
Lower::Binding& Lower::bind(const VarDecl* v) {
    const auto it = m_bind.find(v);
    if (it != m_bind.end() && it->second.kind != Binding::None)
        return it->second;
    Binding b;
    if (v->kind == VarDecl::Parameter)
        b = bind_parameter(v);
    else if (v->kind == VarDecl::Global)
        b = bind_global(v);
    return m_bind[v] = b;
}

Lower::Binding Lower::bind_parameter(const VarDecl* v) {
    const int index = m_parameter_index[v];
    const Ty t = ty(v->type);
    // What a co-shader's handle is known to be
    const Parameter& parameter = m_program.parameters[size_t(index)];
    const std::vector<std::string>* handles =
        t == Ty::String && m_linked ? connected(parameter.name) : nullptr;
    if (!handles && v->type.base == Base::Shader)
        handles = &parameter.strings;
    const auto value = [&] {
        return handles ? m_b.text(handles->empty() ? std::string() : known_handle((*handles)[0]))
                       : m_b.leaf(Op::Param, t, index);
    };
    Binding b;
    if (bind_layered(v, b)) // what a layer leaves
        return b;
    if (late_default(v))
        return bind_late(v, index);
    if (!v->output && !v->type.array && !v->assigned) {
        b.kind = Binding::Value;
        b.value = value();
        return b;
    }
    if (v->type.array)
        return bind_array(v, index, handles);
    b.kind = Binding::Variable;
    b.var = m_b.var(std::string(v->name), t, v->loc);
    in_prologue([&] {
        m_b.declare(b.var);
        m_b.store(b.var, value(), v->loc);
    });
    return b;
}

// Its default value, unless one is given.
Lower::Binding Lower::bind_late(const VarDecl* v, int index) {
    Binding b;
    b.kind = Binding::Variable;
    b.var = m_b.var(std::string(v->name), ty(v->type), v->loc);
    in_prologue([&] {
        const Ref value = expr_as(v->init, v->type); // may bind globals, in the prologue too
        const Ref given = m_b.leaf(Op::Param, Ty::Float, index);
        m_b.stage().instrs[given].floats = {0, 0};
        const Ref own = m_b.leaf(Op::Param, ty(v->type), index);
        m_b.declare(b.var);
        m_b.store(b.var, m_b.emit(Op::Select, ty(v->type), {truth(given), own, value}, v->loc), v->loc);
    });
    return b;
}

// Elements are copied: constants of the instance, so the copies fold away where they are not indexed.
Lower::Binding Lower::bind_array(const VarDecl* v, int index, const std::vector<std::string>* handles) {
    const Ty t = ty(v->type);
    const int room = m_program.places[size_t(index)].count / comps(t);
    const int count = handles ? std::min(room, int(handles->size())) : room;
    const auto element = [&](std::vector<float> which, Ty type) {
        const Ref r = m_b.leaf(Op::Param, type, index);
        m_b.stage().instrs[r].floats = std::move(which);
        return r;
    };
    Binding b;
    b.kind = Binding::Variable;
    b.var = m_b.var(std::string(v->name), t, v->loc, room);
    in_prologue([&] {
        m_b.declare(b.var);
        for (int i = 0; i < count; i++) {
            const Ref r = handles ? m_b.text(known_handle((*handles)[size_t(i)])) : element({float(i)}, t);
            m_b.emit(Op::StoreElement, Ty::Void, {m_b.constant(float(i)), r}, v->loc, b.var);
        }
        if (!v->resizable)
            return;
        b.length = m_b.var(std::string(v->name) + ".length", Ty::Float, v->loc);
        m_b.declare(b.length);
        m_b.store(b.length, handles ? m_b.constant(float(count)) : element({0, 0}, Ty::Float), v->loc);
    });
    return b;
}

Lower::Binding Lower::bind_global(const VarDecl* v) {
    const ops::Global& g = ops::globals()[size_t(v->global)];
    const Ref initial = initial_value(v, g);
    const bool written = g.written || v->assigned || (m_role == Role::Light && g.name == "L");
    Binding b;
    if (!written || !on_grid()) {
        b.kind = Binding::Value;
        b.value = initial;
        return b;
    }
    b.kind = Binding::Variable;
    b.var = m_b.var(std::string(v->name), ty(v->type), v->loc);
    in_prologue([&] {
        m_b.declare(b.var);
        store_tagged(b.var, initial, v->loc);
    });
    return b;
}

// What a global is when the stage begins.
Ref Lower::initial_value(const VarDecl* v, const ops::Global& g) {
    if (m_role == Role::Light && m_program.area_light) {
        if (g.name == "Ps")
            return in_prologue(
                [&] { return m_b.emit(Op::Add, Ty::Triple, {input(Input::P), input(Input::N)}, v->loc); });
        if (g.input >= 0)
            return input(Input(g.input));
    }
    if (m_role == Role::Light && g.name == "Ps")
        return input(Input::P);
    if (m_role == Role::Light && (g.name == "P" || g.name == "N" || g.name == "Ng"))
        return shader_frame(g.name == "P" ? 3 : 2, v->loc);
    if (m_role == Role::Filter && g.name == "alpha")
        return in_prologue([&] { return m_b.emit(Op::Extract, Ty::Float, {input(Input::Os)}, v->loc, 0); });
    if (g.name == "Ci")
        return input(Input::Cs);
    if (g.name == "Oi")
        return input(Input::Os);
    if (g.input >= 0)
        return input(Input(g.input));
    if (g.name == "I" && on_grid())
        return in_prologue([&] { return view_direction(v->loc); });
    return zero(ty(v->type));
}

Ref Lower::global(const VarDecl* v, Loc at) {
    const std::string_view n = v->name;
    if (n == "PI")
        return m_b.constant(3.14159265358979f);
    if (n == "ncomps")
        return m_b.constant(3.0f);
    if (n == "null")
        return m_b.text("");
    if (!on_grid()) {
        m_diagnostics.error(
            at, "\"" + std::string(n) +
                    "\" varies over the surface; it is not known where this runs (once a primitive)");
        return zero(ty(v->type));
    }
    if (n == "I" && !v->assigned)
        return view_direction(at);
    if (n == "Ps" && m_role == Role::Shade)
        return global(m_sema.global("P"), at);
    const bool in_loop = m_illuminance > 0 || m_sample != ir::None;
    if (in_loop && n == "L" && !v->assigned)
        return m_illuminance > 0 ? light_direction(Tag::Light, at) : m_sample;
    if (in_loop && n == "Ol")
        return m_b.triple(1);
    const bool known = m_role == Role::Light || (m_role == Role::Filter && n == "alpha") || in_loop;
    if (!known && (n == "L" || n == "Cl" || n == "Ol" || n == "alpha")) {
        const std::string what = "\"" + std::string(n) + "\" is not known here: light comes after shading";
        if (m_program.kind != ShaderKind::Class)
            m_diagnostics.warning(at, what + "; it is 0 outside of an illuminance loop");
        else
            m_diagnostics.error(at, what);
        return zero(ty(v->type));
    }
    if ((n == "dtime" || n == "dPdtime") && !v->assigned)
        return zero(ty(v->type));
    const Binding& b = bind(v);
    return b.kind == Binding::Value ? b.value : load_tagged(b.var, at);
}

Ref Lower::name(const Expr* e) {
    const VarDecl* v = e->var;
    if (!v)
        return zero(ty(e->type));
    if (v->kind == VarDecl::Global)
        return global(v, e->loc);
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

Ref Lower::truth(Ref value) {
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

Ref Lower::condition(const Expr* e) {
    return truth(expr(e));
}

Ref Lower::convert(Ref value, const ast::Type& from, const ast::Type& to, Loc at) {
    if (value == ir::None)
        return zero(ty(to));
    const Ty have = m_b.at(value).ty, need = ty(to);
    (void)from;
    if (have == need || need == Ty::Void)
        return value;
    if (have == Ty::Bool)
        return convert(m_b.emit(Op::ToFloat, Ty::Float, {value}, at), from, to, at);
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

Ref Lower::expr(const Expr* e) {
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
        return call(e);
    case ExprKind::Construct:
        return ir::None;
    case ExprKind::Cast: {
        const Ref v = expr_as(e->args[0], e->type);
        return e->args.size() > 1 ? in_space(v, e->type, e->args[1], e->loc) : v;
    }
    case ExprKind::Tuple:
    case ExprKind::TupleIn:
        return tuple(e);
    case ExprKind::Unary: {
        if (!e->negate)
            return m_b.emit(Op::Not, Ty::Bool, {condition(e->args[0])}, e->loc);
        const Ref v = expr_as(e->args[0], e->type);
        if (tag(v) == Tag::Light || tag(v) == Tag::LightMirrored)
            return v; // which way it points does not matter to a kernel
        return negated(v, e->type.is(Base::Normal), e->loc);
    }
    case ExprKind::Binary:
        return binary(e);
    case ExprKind::Ternary:
        return ternary(e);
    case ExprKind::Assign:
        return assign(e);
    case ExprKind::Sequence: {
        Ref last = ir::None;
        for (const Expr* a : e->args)
            last = expr(a);
        return last;
    }
    case ExprKind::Method:
        if (e->function)
            return struct_call(e);
        return coshader(e);
    case ExprKind::List:
        break;
    }
    const Ty t = ty(e->type);
    return zero(t == Ty::Void ? Ty::Float : t);
}

// An array's element, a colour's or point's component, a matrix's element.
Ref Lower::index(const Expr* e) {
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
        return component_of(expr(whole), expr_as(e->args[1], {Base::Float}), e->loc);
    if (whole->type.is(Base::Matrix) && e->type.is(Base::Float)) // m[row][column]
        return component_of(expr(whole->args[0]), element_of_matrix(e), e->loc);
    m_diagnostics.error(e->loc, whole->type.is(Base::Matrix)
                                    ? "a row of a matrix is no value: expected m[row][column]"
                                    : "a string has no elements; a channel is picked within texture() alone");
    return zero(ty(e->type));
}

// m[row][column] as an index into the sixteen elements.
Ref Lower::element_of_matrix(const Expr* e) {
    const Ref row = expr_as(e->args[0]->args[1], {Base::Float});
    const Ref column = expr_as(e->args[1], {Base::Float});
    const Ref whole = m_b.emit(Op::Floor, Ty::Float, {row}, e->loc);
    return m_b.emit(Op::Add, Ty::Float,
                    {m_b.emit(Op::Mul, Ty::Float, {whole, m_b.constant(4.0f)}, e->loc), column}, e->loc);
}

Ref Lower::tuple(const Expr* e) {
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
Ref Lower::in_space(Ref value, const ast::Type& type, const Expr* space, Loc at) {
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
        return inline_values(f, {from, to, value}, at);
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

Ref Lower::binary(const Expr* e) {
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
Ref Lower::comparison(BinOp op, Ref a, Ref b, Loc at) {
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

Ref Lower::arithmetic(BinOp op, Ref a, const ast::Type& ta, Ref b, const ast::Type& tb,
                      const ast::Type& result, Loc at) {
    if (const Ref r = light_arithmetic(op, a, b, at); r != ir::None)
        return r;
    switch (op) {
    case BinOp::And:
    case BinOp::Or:
        return m_b.emit(op == BinOp::And ? Op::And : Op::Or, Ty::Bool, {truth(a), truth(b)}, at);
    case BinOp::Eq:
    case BinOp::Ne: {
        Ref equal;
        if (m_b.at(a).ty == Ty::String || m_b.at(b).ty == Ty::String) {
            equal = m_b.emit(Op::SameText, Ty::Bool, {a, b}, at);
        } else {
            const ast::Type wide = comps(m_b.at(a).ty) >= comps(m_b.at(b).ty) ? ta : tb;
            const ast::Type common = wide.is(Base::Bool) ? ast::Type{Base::Float} : wide;
            a = convert(a, ta, common, at);
            b = convert(b, tb, common, at);
            if (comps(ty(common)) == 1)
                return m_b.emit(op == BinOp::Eq ? Op::Eq : Op::Ne, Ty::Bool, {a, b}, at);
            equal = comparison(BinOp::Eq, a, b, at);
        }
        return op == BinOp::Eq ? equal : m_b.emit(Op::Not, Ty::Bool, {equal}, at);
    }
    case BinOp::Lt:
    case BinOp::Le:
    case BinOp::Gt:
    case BinOp::Ge: {
        const ast::Type f{ta.triple() || tb.triple() ? Base::Vector : Base::Float};
        return comparison(op, convert(a, ta, f, at), convert(b, tb, f, at), at);
    }
    case BinOp::Dot:
        return m_b.emit(Op::Dot, Ty::Float, {a, b}, at);
    case BinOp::Cross:
        return m_b.emit(Op::Cross, Ty::Triple, {a, b}, at);
    default:
        break;
    }
    if (result.is(Base::Matrix)) {
        a = convert(a, ta, result, at);
        b = convert(b, tb, result, at);
        return matrix_arithmetic(op, a, b, at);
    }
    a = convert(a, ta, result, at);
    b = convert(b, tb, result, at);
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

Ref Lower::matrix_arithmetic(BinOp op, Ref a, Ref b, Loc at) {
    switch (op) {
    case BinOp::Add:
        return m_b.emit(Op::Add, Ty::Matrix, {a, b}, at);
    case BinOp::Sub:
        return m_b.emit(Op::Sub, Ty::Matrix, {a, b}, at);
    case BinOp::Div:
        return m_b.emit(Op::MatMul, Ty::Matrix, {a, inverse(b, at)}, at);
    default:
        return m_b.emit(Op::MatMul, Ty::Matrix, {a, b}, at);
    }
}

namespace {

// The 2x2 minors of the upper two rows (s) and the lower two (c) give determinant and inverse (Laplace
// expansion).
struct Minors {
    Ref m[16], s[6], c[6];
};

Minors minors(Builder& b, Ref matrix, Loc at) {
    Minors r;
    for (int i = 0; i < 16; i++)
        r.m[i] = b.emit(Op::Extract, Ty::Float, {matrix}, at, i);
    const auto minor = [&](int row, int i, int j) {
        const Ref x = b.emit(Op::Mul, Ty::Float, {r.m[row * 4 + i], r.m[row * 4 + 4 + j]}, at);
        const Ref y = b.emit(Op::Mul, Ty::Float, {r.m[row * 4 + 4 + i], r.m[row * 4 + j]}, at);
        return b.emit(Op::Sub, Ty::Float, {x, y}, at);
    };
    static constexpr int Columns[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
    for (int k = 0; k < 6; k++) {
        r.s[k] = minor(0, Columns[k][0], Columns[k][1]);
        r.c[k] = minor(2, Columns[k][0], Columns[k][1]);
    }
    return r;
}

Ref sum(Builder& b, Loc at, std::initializer_list<std::tuple<int, Ref, Ref>> terms) {
    Ref total = ir::None;
    for (const auto& [sign, x, y] : terms) {
        Ref t = b.emit(Op::Mul, Ty::Float, {x, y}, at);
        if (total == ir::None)
            total = sign > 0 ? t : b.emit(Op::Neg, Ty::Float, {t}, at);
        else
            total = b.emit(sign > 0 ? Op::Add : Op::Sub, Ty::Float, {total, t}, at);
    }
    return total;
}

Ref determinant_of(Builder& b, const Minors& q, Loc at) {
    return sum(b, at,
               {{1, q.s[0], q.c[5]},
                {-1, q.s[1], q.c[4]},
                {1, q.s[2], q.c[3]},
                {1, q.s[3], q.c[2]},
                {-1, q.s[4], q.c[1]},
                {1, q.s[5], q.c[0]}});
}

} // namespace

Ref Lower::determinant(Ref m, Loc at) {
    return determinant_of(m_b, minors(m_b, m, at), at);
}

Ref Lower::inverse(Ref matrix, Loc at) {
    const Minors q = minors(m_b, matrix, at);
    const Ref* m = q.m;
    const Ref *s = q.s, *c = q.c;
    const Ref det = determinant_of(m_b, q, at);
    // A singular matrix has the inverse zero.
    const Ref singular = m_b.emit(Op::Eq, Ty::Bool, {det, m_b.constant(0.0f)}, at);
    const Ref safe = m_b.emit(Op::Select, Ty::Float, {singular, m_b.constant(1.0f), det}, at);
    const Ref one = m_b.emit(Op::Select, Ty::Float, {singular, m_b.constant(0.0f), m_b.constant(1.0f)}, at);
    const Ref scale = m_b.emit(Op::Div, Ty::Float, {one, safe}, at);
    const std::vector<Ref> adjugate = {
        sum(m_b, at, {{1, m[5], c[5]}, {-1, m[6], c[4]}, {1, m[7], c[3]}}),
        sum(m_b, at, {{-1, m[1], c[5]}, {1, m[2], c[4]}, {-1, m[3], c[3]}}),
        sum(m_b, at, {{1, m[13], s[5]}, {-1, m[14], s[4]}, {1, m[15], s[3]}}),
        sum(m_b, at, {{-1, m[9], s[5]}, {1, m[10], s[4]}, {-1, m[11], s[3]}}),
        sum(m_b, at, {{-1, m[4], c[5]}, {1, m[6], c[2]}, {-1, m[7], c[1]}}),
        sum(m_b, at, {{1, m[0], c[5]}, {-1, m[2], c[2]}, {1, m[3], c[1]}}),
        sum(m_b, at, {{-1, m[12], s[5]}, {1, m[14], s[2]}, {-1, m[15], s[1]}}),
        sum(m_b, at, {{1, m[8], s[5]}, {-1, m[10], s[2]}, {1, m[11], s[1]}}),
        sum(m_b, at, {{1, m[4], c[4]}, {-1, m[5], c[2]}, {1, m[7], c[0]}}),
        sum(m_b, at, {{-1, m[0], c[4]}, {1, m[1], c[2]}, {-1, m[3], c[0]}}),
        sum(m_b, at, {{1, m[12], s[4]}, {-1, m[13], s[2]}, {1, m[15], s[0]}}),
        sum(m_b, at, {{-1, m[8], s[4]}, {1, m[9], s[2]}, {-1, m[11], s[0]}}),
        sum(m_b, at, {{-1, m[4], c[3]}, {1, m[5], c[1]}, {-1, m[6], c[0]}}),
        sum(m_b, at, {{1, m[0], c[3]}, {-1, m[1], c[1]}, {1, m[2], c[0]}}),
        sum(m_b, at, {{-1, m[12], s[3]}, {1, m[13], s[1]}, {-1, m[14], s[0]}}),
        sum(m_b, at, {{1, m[8], s[3]}, {-1, m[9], s[1]}, {1, m[10], s[0]}}),
    };
    std::vector<Ref> out;
    for (Ref a : adjugate)
        out.push_back(m_b.emit(Op::Mul, Ty::Float, {a, scale}, at));
    return m_b.emit(Op::Make, Ty::Matrix, std::move(out), at);
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

Ref Lower::ternary(const Expr* e) {
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
