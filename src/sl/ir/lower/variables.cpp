#include "sl/ir/lower/variables.h"

#include <algorithm>

#include "sl/ir/lower/assignments.h"
#include "sl/ir/lower/directions.h"
#include "sl/ir/lower/materials.h"
#include "sl/ir/lower/members.h"
#include "sl/ir/lower/parameters.h"

namespace kanuka::sl::ir {

using namespace ast;

Binding& VariableLowerer::binding(const VarDecl* v) {
    const auto it = m_state.bindings.find(v);
    if (it != m_state.bindings.end() && it->second.kind != Binding::None)
        return it->second;
    Binding b;
    if (v->kind == VarDecl::Parameter)
        b = parameters().bind(v);
    else if (v->kind == VarDecl::Global)
        b = bind_global(v);
    return m_state.bindings[v] = b;
}

Binding VariableLowerer::bind_global(const VarDecl* v) {
    const ops::Global& g = ops::globals()[size_t(v->global)];
    const Ref initial = initial_value(v, g);
    const bool written = g.written || v->assigned || (m_state.role == Role::Light && g.name == "L");
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
Ref VariableLowerer::initial_value(const VarDecl* v, const ops::Global& g) {
    if (m_state.role == Role::Light && m_program.area_light) {
        if (g.name == "Ps")
            return in_prologue(
                [&] { return m_b.emit(Op::Add, Ty::Triple, {input(Input::P), input(Input::N)}, v->loc); });
        if (g.input >= 0)
            return input(Input(g.input));
    }
    if (m_state.role == Role::Light && g.name == "Ps")
        return input(Input::P);
    if (m_state.role == Role::Light && (g.name == "P" || g.name == "N" || g.name == "Ng"))
        return shader_frame(g.name == "P" ? 3 : 2, v->loc);
    if (m_state.role == Role::Filter && g.name == "alpha")
        return in_prologue([&] { return m_b.emit(Op::Extract, Ty::Float, {input(Input::Os)}, v->loc, 0); });
    if (g.name == "Ci")
        return input(Input::Cs);
    if (g.name == "Oi")
        return input(Input::Os);
    if (g.input >= 0)
        return input(Input(g.input));
    if (g.name == "I" && on_grid())
        return in_prologue([&] { return directions().view(v->loc); });
    return zero(ty(v->type));
}

Ref VariableLowerer::shader_frame(int row, Loc at) {
    return in_prologue([&] {
        CallSite site{CallKind::SpaceMatrix, at};
        site.args = {m_b.text("shader"), m_b.text("current")};
        const Ref m = m_b.call(std::move(site), Ty::Matrix);
        std::vector<Ref> parts;
        for (int c = 0; c < 3; c++)
            parts.push_back(m_b.emit(Op::Extract, Ty::Float, {m}, at, 4 * row + c));
        return m_b.emit(Op::Make, Ty::Triple, std::move(parts), at);
    });
}

Ref VariableLowerer::global(const VarDecl* v, Loc at) {
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
        return directions().view(at);
    if (n == "Ps" && m_state.role == Role::Shade)
        return global(m_sema.global("P"), at);
    const bool in_loop = m_state.light.depth > 0 || m_state.light.sample != ir::None;
    if (in_loop && n == "L" && !v->assigned)
        return m_state.light.depth > 0 ? directions().to_light(Tag::Light, at) : m_state.light.sample;
    if (in_loop && n == "Ol")
        return m_b.triple(1);
    const bool known =
        m_state.role == Role::Light || (m_state.role == Role::Filter && n == "alpha") || in_loop;
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

void VariableLowerer::declare(const VarDecl* v) {
    if (v->type.handle()) {
        m_state.bindings[v].kind = Binding::Handle;
        if (v->init)
            expr(v->init);
        return;
    }
    if (v->type.base == Base::Lobe)
        return materials().bind_lobe(v, v->init);
    if (v->is_extern)
        return;
    if (v->type.base == Base::Struct) {
        for (const VarDecl* f : v->fields)
            declare(f);
        if (v->init)
            assignments().assign_struct(v->fields, v->init, v->loc);
        return;
    }
    if (v->type.array)
        return declare_array(v);
    if (v->type.is(Base::Shader) && v->init && !v->assigned) { // its co-shader is known where the value's is
        Binding b;
        b.kind = Binding::Value;
        b.value = expr_as(v->init, v->type);
        m_state.bindings[v] = b;
        return;
    }
    Binding b;
    b.kind = Binding::Variable;
    b.var = m_b.var(std::string(v->name), ty(v->type), v->loc);
    m_b.stage().vars[b.var].must_be_uniform = v->detail == Detail::Uniform;
    // The initial value is computed before the variable comes to life: float x = x is the outer x.
    Ref value = ir::None;
    if (v->init)
        value = expr_as(v->init, v->type);
    m_b.declare(b.var);
    if (v->kind == VarDecl::Member && !v->init) // a co-shader's begin anew
        value = members().initial_value(v);
    store_tagged(b.var, value != ir::None ? value : zero(ty(v->type)), v->loc);
    m_state.bindings[v] = b;
}

void VariableLowerer::declare_array(const VarDecl* v) {
    Binding b;
    b.kind = Binding::Variable;
    b.var = m_b.var(std::string(v->name), ty(v->type), v->loc, std::max(1, v->type.size));
    m_b.stage().vars[b.var].must_be_uniform = v->detail == Detail::Uniform;
    m_b.declare(b.var);
    if (v->resizable) {
        b.length = m_b.var(std::string(v->name) + ".length", Ty::Float, v->loc);
        m_b.declare(b.length);
        Ref n = m_b.constant(float(v->type.size));
        if (v->size && v->type.size == 0) {
            n = expr_as(v->size, {Base::Float});
            need_room(b.var,
                      m_b.is_const(n) ? int(std::clamp(m_b.at(n).floats[0], 0.0f, 65536.0f)) : ResizableRoom);
            n = m_b.emit(Op::Min, Ty::Float, {n, m_b.constant(float(m_b.stage().vars[size_t(b.var)].array))},
                         v->loc);
        }
        m_b.store(b.length, n, v->loc);
    }
    m_state.bindings[v] = b;
    const bool whole =
        v->init && (v->init->kind != ExprKind::List || int(v->init->args.size()) >= v->type.size);
    m_b.stage().vars[b.var].clear = !whole || v->resizable;
    if (v->init)
        assignments().assign_array(b, v->init, v->type, v->loc);
}

void VariableLowerer::need_room(int var, int elements) {
    ir::Var& v = m_b.stage().vars[size_t(var)];
    v.array = std::max(v.array, std::min(elements, 65536));
}

} // namespace kanuka::sl::ir
