#include "sl/ir/lower/coshaders.h"

#include <algorithm>
#include <utility>

#include "sl/ir/lower/assignments.h"
#include "sl/ir/lower/expressions.h"
#include "sl/ir/lower/functions.h"
#include "sl/ir/lower/handles.h"
#include "sl/ir/lower/parameters.h"
#include "sl/ir/lower/variables.h"

namespace kanuka::sl::ir {

using namespace ast;

// A co-shader that is used has members, which construct() and begin() set before the stage begins: before
// those of its callers, whose begin() may call it.
void CoshaderLowerer::start(int unit) {
    if (!m_started.insert(unit).second)
        return;
    const ShaderDecl& s = *m_context.linked->units[size_t(unit)].shader;
    const Loc* const place = m_b.place();
    const int self = std::exchange(m_state.self, unit);
    const LoopState loops = std::exchange(m_state.loops, {});
    const LightState light = std::exchange(m_state.light, {});
    m_b.set_place(nullptr);
    const Block* own = in_block([&] {
        for (const VarDecl* v : s.members)
            variables().declare(v);
        if (m_state.role != Role::Init && m_state.role != Role::Interior)
            for (const char* name : {"construct", "begin"})
                for (FunctionDecl* f : s.functions)
                    if (f->name == name && f->formals.empty() && f->result.is(Base::Void))
                        functions().run_method(f);
        if (m_context.linked->units[size_t(unit)].given->layer && on_grid())
            run_layer(unit);
    });
    m_b.set_place(place);
    m_state.self = self;
    m_state.loops = loops;
    m_state.light = light;
    m_state.starts.insert(m_state.starts.end(), own->items.begin(), own->items.end());
}

// A layer runs as the shader does that comes after it: its method for the stage, else the one it has. All
// write the same Ci, Oi, P and N, so the last to do so counts.
void CoshaderLowerer::run_layer(int unit) {
    const std::vector<FunctionDecl*>& methods = m_context.linked->units[size_t(unit)].shader->functions;
    const auto run = [&](std::string_view name) {
        for (FunctionDecl* f : methods)
            if (f->name == name && f->formals.size() == 2 && f->result.is(Base::Void)) {
                functions().run_method(f);
                return true;
            }
        return false;
    };
    if (m_state.role == Role::Displace && (run("mnk_displacement") || run("displacement")))
        return;
    const bool lit = run("prelighting");
    if (!run("surface") && !lit && m_state.role != Role::Displace)
        run("displacement");
}

void CoshaderLowerer::start_layers() {
    for (size_t u = 0; m_context.linked && u < m_context.linked->units.size(); u++)
        if (m_context.linked->units[u].given->layer)
            start(int(u));
}

Binding CoshaderLowerer::bind_layered(const VarDecl* v) {
    Binding b;
    const Connection* connection =
        tracker().layered(m_program.parameters[size_t(parameters().index(v))].name);
    if (!connection || !on_grid() || !m_context.linked || connection->handles.empty())
        return b;
    const int unit = m_context.linked->find(connection->handles[0]);
    const VarDecl* from = unit < 0 ? nullptr : m_context.linked->variable(size_t(unit), connection->output);
    if (!from || from->type.array != v->type.array)
        return b;
    start(unit);
    Expr name{ExprKind::Name, v->loc};
    name.var = const_cast<VarDecl*>(from);
    name.type = from->type;
    const Block* own = in_block([&] {
        b.kind = Binding::Variable;
        b.var =
            m_b.var(std::string(v->name), ty(v->type), v->loc, v->type.array ? std::max(1, v->type.size) : 0);
        m_b.declare(b.var);
        if (v->resizable) {
            b.length = m_b.var(std::string(v->name) + ".length", Ty::Float, v->loc);
            m_b.declare(b.length);
        }
        if (v->type.array)
            assignments().assign_array(b, &name, v->type, v->loc);
        else
            store_tagged(b.var, expr_as(&name, v->type), v->loc);
    });
    m_state.starts.insert(m_state.starts.end(), own->items.begin(), own->items.end());
    return b;
}

std::string CoshaderLowerer::unit_name(int unit) const {
    return unit < 0 ? std::string(m_context.shader.name)
                    : m_context.linked->units[size_t(unit)].given->handle;
}

// "a -> b -> a" if the method is running already.
std::string CoshaderLowerer::circle(const FunctionDecl* f, int unit) const {
    auto it = std::ranges::find(m_state.active, f, &ActiveFunction::function);
    if (it == m_state.active.end())
        return {};
    std::string path;
    for (int last = -2; it != m_state.active.end(); ++it)
        if (std::exchange(last, it->unit) != it->unit)
            path += unit_name(last) + " -> ";
    return path + unit_name(unit);
}

Ref CoshaderLowerer::call_method(int unit, const Linked::Target& target, Loc at) {
    FunctionDecl* f = target.function;
    if (const std::string path = circle(f, unit); !path.empty()) {
        m_diagnostics.warning(at, "co-shaders call each other in a circle: " + path +
                                      "; the call does nothing, its result is 0");
        return zero(f->result.is(Base::Void) ? Ty::Float : ty(f->result));
    }
    start(unit);
    FunctionLowerer::Bindings bindings;
    FunctionLowerer::Copies copies;
    for (size_t i = 0; i < f->formals.size(); i++)
        functions().bind_formal(f->formals[i], target.args[i], bindings, copies);
    const int self = std::exchange(m_state.self, unit);
    const Ref result = functions().inline_placed(f, std::move(bindings), at);
    m_state.self = self;
    for (const auto& [to, var] : copies)
        assignments().assign_to(to, m_b.load(var, at), at);
    return result;
}

Ref CoshaderLowerer::coshader(const Expr* e, const std::vector<VarDecl*>* fields) {
    const Ty t = ty(e->type) == Ty::Void ? Ty::Float : ty(e->type);
    const Ref handle = expr(e->args[0]);
    if (!m_context.linked) {
        for (size_t i = 1; i < e->args.size(); i++)
            if (e->args[i]->type.base != Base::Struct && !e->args[i]->type.array)
                expr(e->args[i]);
        return zero(t);
    }
    std::vector<int> fit;
    for (const int u : tracker().targets(handle))
        if (able(e, u))
            fit.push_back(u);
    if (m_b.at(handle).op == Op::Text)
        return fit.empty() ? zero(t) : run(e, fit[0], fields);
    const int var = m_b.var(std::string(e->text), t, e->loc);
    m_b.declare(var);
    m_b.store(var, zero(t), e->loc);
    tracker().for_targets(handle, fit, e->loc, [&](int u) {
        const Ref r = run(e, u, fields);
        if (m_b.at(r).ty == t)
            store_tagged(var, r, e->loc);
    });
    return load_tagged(var, e->loc);
}

// Has it the method or variable? A warning, if not.
bool CoshaderLowerer::able(const Expr* e, int unit) {
    const auto calls = m_context.linked->calls.find(e);
    const bool has = e->called
                         ? calls != m_context.linked->calls.end() && calls->second[size_t(unit)].function
                         : m_context.linked->variable(size_t(unit), e->text) != nullptr;
    if (!has)
        m_diagnostics.warning(e->loc, "co-shader \"" + unit_name(unit) + "\" (" +
                                          std::string(m_context.linked->units[size_t(unit)].shader->name) +
                                          ") has no public " + (e->called ? "method \"" : "variable \"") +
                                          std::string(e->text) + "\" that fits; hasmethod() asks for it");
    return has;
}

Ref CoshaderLowerer::run(const Expr* e, int unit, const std::vector<VarDecl*>* fields) {
    if (e->called) {
        const Linked::Target& target = m_context.linked->calls.find(e)->second[size_t(unit)];
        const Ref r = call_method(unit, target, e->loc);
        if (fields && target.function->result_fields)
            assignments().copy_fields(*fields, target.function->result_fields->fields, e->loc);
        return expressions().convert(r, e->type, e->loc);
    }
    start(unit);
    Expr name{ExprKind::Name, e->loc};
    name.var = m_context.linked->variable(size_t(unit), e->text);
    name.type = name.var->type;
    return expr_as(&name, e->type);
}

// getshader (handle): what it stands for, or null.
Ref CoshaderLowerer::get_shader(const Expr* e) {
    const Ref handle = expr(e->args[0]);
    if (!m_context.linked)
        return m_b.text("");
    if (m_b.at(handle).op == Op::Text)
        return m_b.text(tracker().known(m_b.at(handle).text));
    const int var = m_b.var("shader", Ty::String, e->loc);
    m_b.declare(var);
    m_b.store(var, m_b.text(""), e->loc);
    tracker().for_targets(handle, tracker().targets(handle), e->loc,
                          [&](int u) { m_b.store(var, m_b.text(unit_name(u)), e->loc); });
    return m_b.load(var, e->loc);
}

// A text that must be known when the shader is compiled; nothing, with a warning, if it is not.
std::optional<std::string> CoshaderLowerer::plain_text(const Expr* e, const char* what) {
    const Ref r = expr(e);
    if (m_b.at(r).op == Op::Text)
        return m_b.at(r).text;
    m_diagnostics.warning(e->loc, std::string(what) + " must be a string constant here; nothing is found");
    return std::nullopt;
}

std::vector<std::string> CoshaderLowerer::shader_list(const Expr* e) {
    std::vector<std::string> handles;
    if (!e->shadeop || e->kind != ExprKind::Call)
        return handles;
    const ops::Special what = e->shadeop->signatures[size_t(e->signature)].special;
    if (what == ops::Special::GetLights) {
        m_diagnostics.warning(e->loc,
                              "no lights are known while shading: the array is empty. Use illuminance, or "
                              "diffuse() and specular()");
        return handles;
    }
    if (what != ops::Special::GetShaders || !m_context.linked)
        return handles;
    const std::optional<std::string> by =
        e->args.size() >= 2 ? plain_text(e->args[0], "what co-shaders are picked by") : std::nullopt;
    const std::optional<std::string> category =
        by == "category" ? plain_text(e->args[1], "a category of co-shaders") : std::nullopt;
    for (size_t u = 0; u < m_context.linked->units.size(); u++)
        if (category ? m_context.linked->in_category(u, *category) : e->args.size() < 2)
            handles.push_back(unit_name(int(u)));
    return handles;
}

void CoshaderLowerer::take(const VarDecl* v, const Expr* target, Loc at) {
    Expr value{ExprKind::Name, at};
    value.var = const_cast<VarDecl*>(v);
    value.type = v->type;
    if (target->type.array && target->var)
        assignments().assign_array(Binding(bind(target->var)), &value, target->type, at);
    else if (target->type.base == Base::Struct && target->var)
        assignments().copy_fields(target->var->fields, v->fields, at);
    else if (!target->type.array)
        assignments().assign_to(target, expr_as(&value, target->type), at);
}

// getvar (s, name, variable): 1 and the value, if it is there. hasmethod (s, name).
Ref CoshaderLowerer::ask_shader(const Expr* e, const ops::Signature& s) {
    const bool method = s.special == ops::Special::HasMethod;
    const Ref handle = expr(e->args[0]);
    if (!m_context.linked)
        return zero(Ty::Float);
    const std::optional<std::string> asked = plain_text(e->args[1], "the name of a method or variable");
    if (!asked)
        return zero(Ty::Float);
    const std::string& name = *asked;
    const Expr* target = e->args.size() > 2 ? e->args[2] : nullptr;
    std::vector<int> fit;
    for (const int u : tracker().targets(handle)) {
        const VarDecl* v = m_context.linked->variable(size_t(u), name);
        const bool fits = v && (!target || v->type.array == target->type.array) &&
                          (!target || conversion_cost(v->type, target->type) >= 0);
        if (method ? m_context.linked->has_method(size_t(u), name) : fits)
            fit.push_back(u);
    }
    const auto answer = [&](int u) {
        if (!target || method)
            return;
        start(u);
        take(m_context.linked->variable(size_t(u), name), target, e->loc);
    };
    if (m_b.at(handle).op == Op::Text) {
        for (const int u : fit)
            answer(u);
        return m_b.constant(fit.empty() ? 0.0f : 1.0f);
    }
    const int var = m_b.var(name, Ty::Float, e->loc);
    m_b.declare(var);
    m_b.store(var, m_b.constant(0.0f), e->loc);
    tracker().for_targets(handle, fit, e->loc, [&](int u) {
        answer(u);
        m_b.store(var, m_b.constant(1.0f), e->loc);
    });
    return m_b.load(var, e->loc);
}

} // namespace kanuka::sl::ir
