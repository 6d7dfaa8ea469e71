// Shadeops that are more than one operation: resizable arrays, questions to the host, splines.
#include <algorithm>

#include "sl/ir/lower.h"

namespace kanuka::sl::ir {

using namespace ast;

// push(), pop() and their kin. Room is made when the stage is compiled: for what the calls are seen to ask,
// and for ResizableRoom elements where loops hide that.
Ref Lower::array_op(const Expr* e, ops::Special what) {
    using ops::Special;
    const Expr* array = e->args[0];
    const Loc at = e->loc;
    if (array->type.base == Base::Struct && array->var && !array->var->fields.empty())
        return struct_array_op(e, what);
    if (what == Special::ArrayLength && array->type.array && array->kind == ExprKind::Call)
        return m_b.constant(float(shader_list(array).size()));
    if (!array->type.array || !array->var) {
        if (!array->type.array)
            m_diagnostics.error(array->loc,
                                e->shadeop->name + "() needs an array, found " + array->type.str());
        return zero(Ty::Float);
    }
    const Binding b = bind(array->var);
    if (b.kind != Binding::Variable)
        return zero(Ty::Float);
    if (what == Special::ArrayLength)
        return array_length(b, at);
    if (what == Special::ArrayCapacity)
        return m_b.constant(float(room(b)));
    if (b.length < 0) {
        m_diagnostics.error(array->loc,
                            "\"" + std::string(array->var->name) +
                                "\" has a fixed size; declare it without one: " + array->type.str());
        return zero(Ty::Float);
    }
    ast::Type element = array->type;
    element.array = false;
    element.size = 0;
    if (what == Special::Pop)
        return pop(b, ty(element), at);
    if (what == Special::Push)
        push(b, e->args[1], element, at);
    else
        resize(b, e->args[1], what == Special::Resize, at);
    return zero(Ty::Float);
}

// An array of structs is an array for each member.
Ref Lower::struct_array_op(const Expr* e, ops::Special what) {
    const std::vector<VarDecl*>& fields = e->args[0]->var->fields;
    const bool pushes = what == ops::Special::Push, pops = what == ops::Special::Pop;
    if (pops)
        m_diagnostics.error(e->loc, "pop() of structs: take the last element, then resize the array");
    std::deque<VarDecl> values; // what push() puts at the end, member by member
    std::vector<VarDecl*> parts;
    for (size_t k = 0; pushes && k < fields.size(); k++) {
        VarDecl& part = values.emplace_back(*fields[k]);
        part.type.array = part.resizable = false;
        part.kind = VarDecl::Local;
        declare(&part);
        parts.push_back(&part);
    }
    if (pushes)
        assign_struct(parts, e->args[1], e->loc);
    Ref r = zero(Ty::Float);
    for (size_t k = 0; !pops && k < fields.size(); k++) {
        Expr names[2] = {{ExprKind::Name, e->loc}, {ExprKind::Name, e->loc}};
        names[0].var = fields[k];
        names[0].type = fields[k]->type;
        Expr call = *e;
        call.args[0] = &names[0];
        if (pushes) {
            names[1].var = parts[k];
            names[1].type = parts[k]->type;
            call.args[1] = &names[1];
        }
        r = array_op(&call, what);
    }
    for (const VarDecl* part : parts)
        m_bind.erase(part);
    return r;
}

int Lower::room(const Binding& array) {
    return m_b.stage().vars[size_t(array.var)].array;
}

Ref Lower::array_length(const Binding& array, Loc at) {
    return array.length >= 0 ? m_b.load(array.length, at) : m_b.constant(float(room(array)));
}

void Lower::push(const Binding& array, const Expr* what, const ast::Type& element, Loc at) {
    const int trips = m_known_loops == m_loop_depth ? m_trips : 0;
    need_room(array.var, trips > 0 ? room(array) + trips : std::max(m_array_room, room(array) + 1));
    const Ref value = expr_as(what, element), i = array_length(array, at);
    const Ref r = m_b.emit(Op::StoreElement, Ty::Void, {i, value}, at, array.var);
    m_pushes.push_back({at, array.var, fault(at, {})});
    m_b.stage().instrs[r].floats = {float(m_pushes.back().fault)};
    m_b.store(array.length, m_b.emit(Op::Add, Ty::Float, {i, m_b.constant(1.0f)}, at), at);
}

Ref Lower::pop(const Binding& array, Ty element, Loc at) {
    const Ref less = m_b.emit(Op::Sub, Ty::Float, {array_length(array, at), m_b.constant(1.0f)}, at);
    const Ref i = m_b.emit(Op::Max, Ty::Float, {less, m_b.constant(0.0f)}, at);
    m_b.store(array.length, i, at);
    return m_b.emit(Op::LoadElement, element, {i}, at, array.var);
}

// Makes room, and sets the length.
void Lower::resize(const Binding& array, const Expr* length, bool set, Loc at) {
    const Ref wanted = expr_as(length, {Base::Float});
    need_room(array.var, m_b.is_const(wanted) ? int(std::clamp(m_b.at(wanted).floats[0], 1.0f, 65536.0f))
                                              : ResizableRoom);
    if (!set)
        return;
    const Ref some = m_b.emit(Op::Max, Ty::Float, {wanted, m_b.constant(0.0f)}, at);
    m_b.store(array.length, m_b.emit(Op::Min, Ty::Float, {some, m_b.constant(float(room(array)))}, at), at);
}

// attribute ("name", variable) and its kin: 1 and the variable's value if the host knows, else 0.
Ref Lower::query(const Expr* e, const ops::Signature& s) {
    const Query::Kind kind = Query::Kind(s.imm);
    const bool texture = kind == Query::Texture;
    const size_t names = texture ? 2 : 1;
    std::vector<Ref> args;
    for (size_t i = 0; i < names; i++)
        args.push_back(expr(e->args[i]));
    const Expr* target = e->args.size() > names ? e->args[names] : nullptr;
    const bool array = target && target->type.array;
    ast::Type element = target ? target->type : ast::Type{Base::Float};
    element.array = false;
    const Ty t = array && ty(element) == Ty::Float ? Ty::Matrix : ty(element);
    // What is asked for decides what fits: a string is no answer where a number is wanted.
    const auto ask = [&](CallKind call, Ty result) {
        CallSite site{call, e->loc};
        site.args = args;
        site.imm = int(kind) * 4 + (t == Ty::String ? 0 : t == Ty::Float ? 1 : t == Ty::Triple ? 2 : 3);
        return m_b.call(std::move(site), result);
    };
    const Ref found = ask(CallKind::Found, Ty::Float);
    if (!target || t == Ty::Void)
        return found;
    const Ref value = ask(CallKind::Query, t);
    const Ref known = truth(found);
    if (array) {
        if (target->var && ty(element) == Ty::Float)
            answer_array(bind(target->var), known, value, e->loc);
        return found;
    }
    const Ref old = expr(target);
    if (m_b.at(old).ty == t)
        assign_to(target, m_b.emit(Op::Select, t, {known, value, old}, e->loc), e->loc);
    return found;
}

// The first sixteen elements, where the host knows.
void Lower::answer_array(const Binding& b, Ref known, Ref value, Loc at) {
    if (b.kind != Binding::Variable)
        return;
    for (int i = 0; i < std::min(room(b), 16); i++) {
        const Ref old = m_b.emit(Op::LoadElement, Ty::Float, {m_b.constant(float(i))}, at, b.var);
        const Ref part = m_b.emit(Op::Extract, Ty::Float, {value}, at, i);
        const Ref now = m_b.emit(Op::Select, Ty::Float, {known, part, old}, at);
        m_b.emit(Op::StoreElement, Ty::Void, {m_b.constant(float(i)), now}, at, b.var);
    }
}

// spline([basis,] x, values…) and its inverse, "solve…": where does the spline have the value x?
Ref Lower::spline(const Expr* e, const ops::Signature& s) {
    const Loc at = e->loc;
    size_t k = s.args[0].type.is(Base::String) ? 1 : 0;
    const ast::Type element = s.result;
    const Ty t = ty(element);
    const Ref x = expr_as(e->args[k++], {Base::Float});
    // The values, in an array.
    Binding values;
    values.kind = Binding::Variable;
    if (k < e->args.size() && e->args[k]->type.array) {
        if (!e->args[k]->var)
            return zero(t);
        values = bind(e->args[k]->var);
        if (values.kind != Binding::Variable)
            return zero(t);
    } else {
        std::vector<Ref> list;
        for (; k < e->args.size(); k++) {
            if (conversion_cost(e->args[k]->type, element) < 0) {
                m_diagnostics.error(e->args[k]->loc, "found " + e->args[k]->type.str() + ", expected " +
                                                         element.str() + " for a value of the spline");
                return zero(t);
            }
            list.push_back(expr_as(e->args[k], element));
        }
        values.var = m_b.var("spline", t, at, std::max<int>(1, int(list.size())));
        m_b.declare(values.var);
        for (size_t i = 0; i < list.size(); i++)
            m_b.emit(Op::StoreElement, Ty::Void, {m_b.constant(float(i)), list[i]}, at, values.var);
    }
    const int n = m_b.stage().vars[size_t(values.var)].array;
    if (n < 4 && values.length < 0) {
        m_diagnostics.error(at, "a spline needs at least 4 values, found " + std::to_string(n));
        return zero(t);
    }
    if (!s.args[0].type.is(Base::String))
        return spline_in(*ops::find_basis("catmull-rom"), false, x, values, t, at);
    const Ref name = expr(e->args[0]);
    const auto named = [&](std::string_view basis) {
        const bool solve = basis.starts_with("solve");
        const ops::SplineBasis* b = ops::find_basis(solve ? basis.substr(5) : basis);
        if (!b || (solve && t != Ty::Float))
            m_diagnostics.error(e->args[0]->loc,
                                solve && b ? "a spline is solved for floats only"
                                           : "unknown basis \"" + std::string(basis) +
                                                 "\"; there are bezier, bspline, catmull-rom, hermite, "
                                                 "linear, and solve before each");
        return spline_in(b ? *b : *ops::find_basis("catmull-rom"), b && solve, x, values, t, at);
    };
    if (m_b.at(name).op == Op::Text)
        return named(std::string(m_b.at(name).text));
    // A basis that only the run time knows: the one among all.
    const int result = m_b.var("spline", t, at);
    m_b.declare(result);
    m_b.store(result, named("catmull-rom"), at);
    for (const std::string_view basis : {"bspline", "b-spline", "bezier", "hermite", "linear"}) {
        Item i{Item::If};
        i.ref = m_b.emit(Op::SameText, Ty::Bool, {name, m_b.text(std::string(basis))}, at);
        i.loc = at;
        i.body = in_block([&] { m_b.store(result, named(basis), at); });
        i.orelse = m_b.stage().block();
        m_b.item(i);
    }
    return m_b.load(result, at);
}

Ref Lower::spline_in(const ops::SplineBasis& basis, bool solve, Ref x, const Binding& values, Ty t, Loc at) {
    if (!solve)
        return spline_at(basis, x, values, t, at);
    // Bisection: the values rise or fall, so the spline does.
    const auto f = [&](float v) { return m_b.constant(v); };
    const auto op = [&](Op o, Ref a, Ref b) { return m_b.emit(o, Ty::Float, {a, b}, at); };
    const auto compare = [&](Op o, Ref a, Ref b) { return m_b.emit(o, Ty::Bool, {a, b}, at); };
    const Ref first = spline_at(basis, f(0), values, t, at), last = spline_at(basis, f(1), values, t, at);
    const Ref rises = compare(Op::Le, first, last);
    const int low = m_b.var("low", Ty::Float, at), high = m_b.var("high", Ty::Float, at);
    for (const auto& [var, value] : {std::pair{low, 0.0f}, std::pair{high, 1.0f}}) {
        m_b.declare(var);
        m_b.store(var, f(value), at);
    }
    for (int i = 0; i < 20; i++) {
        const Ref a = m_b.load(low, at), b = m_b.load(high, at);
        const Ref middle = op(Op::Mul, op(Op::Add, a, b), f(0.5f));
        const Ref y = spline_at(basis, middle, values, t, at);
        const Ref beyond =
            m_b.emit(Op::Select, Ty::Bool, {rises, compare(Op::Ge, y, x), compare(Op::Le, y, x)}, at);
        m_b.store(low, m_b.emit(Op::Select, Ty::Float, {beyond, a, middle}, at), at);
        m_b.store(high, m_b.emit(Op::Select, Ty::Float, {beyond, middle, b}, at), at);
    }
    return op(Op::Mul, op(Op::Add, m_b.load(low, at), m_b.load(high, at)), f(0.5f));
}

// Segment and parameter within it, then the basis' polynomials of the four values.
Ref Lower::spline_at(const ops::SplineBasis& basis, Ref x, const Binding& values, Ty t, Loc at) {
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
