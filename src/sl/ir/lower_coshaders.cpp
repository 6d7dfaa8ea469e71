// Co-shaders: which one a handle stands for is followed through the stage, and the methods of those that it
// may be are inlined where they are called. A handle that is known gives plain code; one of several a chain
// of ifs.
#include <algorithm>
#include <optional>

#include "sl/ir/lower.h"

namespace kanuka::sl::ir {

using namespace ast;

// ---- which co-shader?
// ----------------------------------------------------------------------------------------------

// The handles of a parameter that is connected; null where it is not, or not of a kind that may be.
const std::vector<std::string>* Lower::connected(const std::string& parameter) const {
    const auto it = m_connections.find(parameter);
    return it == m_connections.end() ? nullptr : it->second;
}

// Handles of what is not there are null.
std::string Lower::known_handle(const std::string& handle) const {
    return m_linked && m_linked->find(handle) >= 0 ? handle : std::string();
}

// Takes up the stores that were made since the last time.
void Lower::note_stores() {
    const std::vector<Instr>& instrs = m_b.stage().instrs;
    for (; m_stores_seen < instrs.size(); m_stores_seen++) {
        const Instr& i = instrs[m_stores_seen];
        if (i.op == Op::Store && m_b.at(i.args[0]).ty == Ty::String)
            m_stored[i.imm].push_back(i.args[0]);
        else if (i.op == Op::StoreElement && m_b.at(i.args[1]).ty == Ty::String)
            m_stored[i.imm].push_back(i.args[1]);
    }
}

// The co-shaders that a handle may stand for.
std::vector<int> Lower::targets(Ref handle) {
    note_stores();
    std::vector<bool> may(m_linked->units.size(), false);
    std::vector<bool> seen(m_b.stage().vars.size(), false);
    std::vector<Ref> work = {handle};
    const auto all = [&] { may.assign(may.size(), true); };
    while (!work.empty()) {
        const Ref r = work.back();
        work.pop_back();
        const Instr& i = m_b.at(r);
        switch (i.op) {
        case Op::Text:
            if (const int u = m_linked->find(i.text); u >= 0)
                may[size_t(u)] = true;
            break;
        case Op::Select:
            work.push_back(i.args[1]);
            work.push_back(i.args[2]);
            break;
        case Op::Load:
        case Op::LoadElement:
            if (m_any_shader)
                all();
            if (!seen[size_t(i.imm)]) {
                seen[size_t(i.imm)] = true;
                const std::vector<Ref>& stored = m_stored[i.imm];
                work.insert(work.end(), stored.begin(), stored.end());
            }
            break;
        case Op::Param: // a string that names a co-shader is connected, and no parameter any more
            break;
        case Op::Member: // what mnk_init left
            if (m_program.init.root)
                all();
            break;
        default:
            all();
        }
    }
    std::vector<int> found;
    for (size_t u = 0; u < may.size(); u++)
        if (may[u])
            found.push_back(int(u));
    return found;
}

// A store that comes later in a loop may bring a co-shader that a call before it has not reckoned with.
void Lower::check_targets() {
    for (const auto& [handle, found] : m_asked)
        m_missed = m_missed || targets(handle) != found;
}

// `what` runs for each co-shader that the handle may be; where it is that one.
void Lower::for_targets(Ref handle, const std::vector<int>& found, Loc at,
                        const std::function<void(int)>& what) {
    if (m_b.at(handle).op == Op::Text) {
        for (const int u : found)
            what(u);
        return;
    }
    for (const int u : found) {
        Item i{Item::If};
        i.ref = m_b.emit(Op::SameText, Ty::Bool, {handle, m_b.text(m_linked->units[size_t(u)].given->handle)},
                         at);
        i.loc = at;
        i.body = in_block([&] { what(u); });
        i.orelse = m_b.stage().block();
        m_b.item(i);
    }
}

std::vector<int> Lower::ask_targets(Ref handle) {
    std::vector<int> found = targets(handle);
    m_asked.emplace_back(handle, found);
    return found;
}

// ---- the co-shaders' own variables
// ---------------------------------------------------------------------------------

// A co-shader that is used has members, which construct() and begin() set before the stage begins: before
// those of its callers, whose begin() may call it.
void Lower::start(int unit) {
    if (!m_started.insert(unit).second)
        return;
    const ShaderDecl& s = *m_linked->units[size_t(unit)].shader;
    Block* const here = m_b.block();
    Block* const own = m_b.stage().block();
    const Loc* const place = m_b.place();
    const int self = std::exchange(m_self, unit);
    std::vector<LoopTargets> loops;
    loops.swap(m_loops);
    const int depth = std::exchange(m_loop_depth, 0), illuminance = std::exchange(m_illuminance, 0),
              loop = std::exchange(m_loop, -1), trips = std::exchange(m_trips, 1),
              known = std::exchange(m_known_loops, 0);
    const Ref sample = std::exchange(m_sample, ir::None);
    m_b.set_place(nullptr);
    m_b.set_block(own);
    for (const VarDecl* v : s.members)
        declare(v);
    if (m_role != Role::Init && m_role != Role::Interior)
        for (const char* name : {"construct", "begin"})
            for (FunctionDecl* f : s.functions)
                if (f->name == name && f->formals.empty() && f->result.is(Base::Void))
                    run_method(f);
    if (m_linked->units[size_t(unit)].given->layer && on_grid())
        run_layer(unit);
    m_b.set_block(here);
    m_b.set_place(place);
    m_self = self;
    m_loops.swap(loops);
    m_loop_depth = depth;
    m_illuminance = illuminance;
    m_trips = trips;
    m_known_loops = known;
    m_loop = loop;
    m_sample = sample;
    m_starts.insert(m_starts.end(), own->items.begin(), own->items.end());
}

// ---- layers
// ------------------------------------------------------------------------------------------------------------

// A layer runs as the shader does that comes after it: its method for the stage, else the one it has. All
// write the same Ci, Oi, P and N, so the last to do so counts.
void Lower::run_layer(int unit) {
    const std::vector<FunctionDecl*>& functions = m_linked->units[size_t(unit)].shader->functions;
    const auto run = [&](std::string_view name) {
        for (FunctionDecl* f : functions)
            if (f->name == name && f->formals.size() == 2 && f->result.is(Base::Void)) {
                run_method(f);
                return true;
            }
        return false;
    };
    if (m_role == Role::Displace && (run("mnk_displacement") || run("displacement")))
        return;
    const bool lit = run("prelighting");
    if (!run("surface") && !lit && m_role != Role::Displace)
        run("displacement");
}

void Lower::start_layers() {
    for (size_t u = 0; m_linked && u < m_linked->units.size(); u++)
        if (m_linked->units[u].given->layer)
            start(int(u));
}

// A parameter that is connected has its value before the stage begins, once the layer has run.
bool Lower::bind_layered(const VarDecl* v, Binding& b) {
    const auto it = m_layered.find(m_program.parameters[size_t(m_parameter_index[v])].name);
    if (it == m_layered.end() || !on_grid() || !m_linked || it->second->handles.empty())
        return false;
    const int unit = m_linked->find(it->second->handles[0]);
    const VarDecl* from = unit < 0 ? nullptr : m_linked->variable(size_t(unit), it->second->output);
    if (!from || from->type.array != v->type.array)
        return false;
    start(unit);
    Block* const here = m_b.block();
    Block* const own = m_b.stage().block();
    m_b.set_block(own);
    Expr name{ExprKind::Name, v->loc};
    name.var = const_cast<VarDecl*>(from);
    name.type = from->type;
    b.kind = Binding::Variable;
    b.var = m_b.var(std::string(v->name), ty(v->type), v->loc, v->type.array ? std::max(1, v->type.size) : 0);
    m_b.declare(b.var);
    if (v->resizable) {
        b.length = m_b.var(std::string(v->name) + ".length", Ty::Float, v->loc);
        m_b.declare(b.length);
    }
    if (v->type.array)
        assign_array(b, &name, v->type, v->loc);
    else
        store_tagged(b.var, expr_as(&name, v->type), v->loc);
    m_b.set_block(here);
    m_starts.insert(m_starts.end(), own->items.begin(), own->items.end());
    return true;
}

// ---- calls
// ------------------------------------------------------------------------------------------------------------

std::string Lower::unit_name(int unit) const {
    return unit < 0 ? std::string(m_shader.name) : m_linked->units[size_t(unit)].given->handle;
}

// "a -> b -> a" if the method is running already.
std::string Lower::circle(const FunctionDecl* f, int unit) const {
    const auto it = std::find(m_active.begin(), m_active.end(), f);
    if (it == m_active.end())
        return {};
    std::string path;
    int last = -2;
    for (size_t k = size_t(it - m_active.begin()); k < m_active_units.size(); k++)
        if (std::exchange(last, m_active_units[k]) != m_active_units[k])
            path += unit_name(last) + " -> ";
    return path + unit_name(unit);
}

Ref Lower::call_method(int unit, const Linked::Target& target, Loc at) {
    FunctionDecl* f = target.function;
    if (const std::string path = circle(f, unit); !path.empty()) {
        m_diagnostics.warning(at, "co-shaders call each other in a circle: " + path +
                                      "; the call does nothing, its result is 0");
        return zero(f->result.is(Base::Void) ? Ty::Float : ty(f->result));
    }
    start(unit);
    Bindings bindings;
    std::vector<std::pair<const Expr*, int>> copies;
    for (size_t i = 0; i < f->formals.size(); i++)
        bind_formal(f->formals[i], target.args[i], bindings, copies);
    const int self = std::exchange(m_self, unit);
    const Ref result = inline_placed(f, std::move(bindings), at);
    m_self = self;
    for (const auto& [to, var] : copies)
        assign_to(to, m_b.load(var, at), at);
    return result;
}

// s->f (…), or the variable s->x. A struct that it returns goes to `fields`.
Ref Lower::coshader(const Expr* e, const std::vector<VarDecl*>* fields) {
    const Ty t = ty(e->type) == Ty::Void ? Ty::Float : ty(e->type);
    const Ref handle = expr(e->args[0]);
    if (!m_linked) {
        for (size_t i = 1; i < e->args.size(); i++)
            if (e->args[i]->type.base != Base::Struct && !e->args[i]->type.array)
                expr(e->args[i]);
        return zero(t);
    }
    const std::vector<int> found = ask_targets(handle);
    const auto calls = m_linked->calls.find(e);
    std::vector<int> able;
    for (const int u : found) {
        const bool has = e->called ? calls != m_linked->calls.end() && calls->second[size_t(u)].function
                                   : m_linked->variable(size_t(u), e->text) != nullptr;
        if (has)
            able.push_back(u);
        else
            m_diagnostics.warning(e->loc, "co-shader \"" + unit_name(u) + "\" (" +
                                              std::string(m_linked->units[size_t(u)].shader->name) +
                                              ") has no public " + (e->called ? "method \"" : "variable \"") +
                                              std::string(e->text) + "\" that fits; hasmethod() asks for it");
    }
    const auto run = [&](int u) {
        if (e->called) {
            const Linked::Target& target = calls->second[size_t(u)];
            const Ref r = call_method(u, target, e->loc);
            if (fields && target.function->result_fields)
                copy_fields(*fields, target.function->result_fields->fields, e->loc);
            return convert(r, target.function->result, e->type, e->loc);
        }
        start(u);
        Expr name{ExprKind::Name, e->loc};
        name.var = m_linked->variable(size_t(u), e->text);
        name.type = name.var->type;
        return expr_as(&name, e->type);
    };
    if (m_b.at(handle).op == Op::Text)
        return able.empty() ? zero(t) : run(able[0]);
    const int var = m_b.var(std::string(e->text), t, e->loc);
    m_b.declare(var);
    m_b.store(var, zero(t), e->loc);
    for_targets(handle, able, e->loc, [&](int u) {
        const Ref r = run(u);
        if (m_b.at(r).ty == t)
            store_tagged(var, r, e->loc);
    });
    return load_tagged(var, e->loc);
}

// ---- shadeops
// ---------------------------------------------------------------------------------------------------------

// getshader (handle): what it stands for, or null.
Ref Lower::get_shader(const Expr* e) {
    const Ref handle = expr(e->args[0]);
    if (!m_linked)
        return m_b.text("");
    if (m_b.at(handle).op == Op::Text)
        return m_b.text(known_handle(m_b.at(handle).text));
    const int var = m_b.var("shader", Ty::String, e->loc);
    m_b.declare(var);
    m_b.store(var, m_b.text(""), e->loc);
    for_targets(handle, ask_targets(handle), e->loc,
                [&](int u) { m_b.store(var, m_b.text(unit_name(u)), e->loc); });
    return m_b.load(var, e->loc);
}

// A text that must be known when the shader is compiled; nothing, with a warning, if it is not.
std::optional<std::string> Lower::plain_text(const Expr* e, const char* what) {
    const Ref r = expr(e);
    if (m_b.at(r).op == Op::Text)
        return m_b.at(r).text;
    m_diagnostics.warning(e->loc, std::string(what) + " must be a string constant here; nothing is found");
    return std::nullopt;
}

// getshaders (): the handles, which are known. Others' arrays are empty.
std::vector<std::string> Lower::shader_list(const Expr* e) {
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
    if (what != ops::Special::GetShaders || !m_linked)
        return handles;
    const std::optional<std::string> by =
        e->args.size() >= 2 ? plain_text(e->args[0], "what co-shaders are picked by") : std::nullopt;
    const std::optional<std::string> category =
        by == "category" ? plain_text(e->args[1], "a category of co-shaders") : std::nullopt;
    for (size_t u = 0; u < m_linked->units.size(); u++)
        if (category ? m_linked->in_category(u, *category) : e->args.size() < 2)
            handles.push_back(unit_name(int(u)));
    return handles;
}

// getvar (s, name, variable): 1 and the value, if it is there. hasmethod (s, name).
Ref Lower::ask_shader(const Expr* e, const ops::Signature& s) {
    const bool method = s.special == ops::Special::HasMethod;
    const Ref handle = expr(e->args[0]);
    if (!m_linked)
        return zero(Ty::Float);
    const std::optional<std::string> asked = plain_text(e->args[1], "the name of a method or variable");
    if (!asked)
        return zero(Ty::Float);
    const std::string& name = *asked;
    const Expr* target = e->args.size() > 2 ? e->args[2] : nullptr;
    std::vector<int> able;
    for (const int u : ask_targets(handle)) {
        const VarDecl* v = m_linked->variable(size_t(u), name);
        const bool fits = v && (!target || v->type.array == target->type.array) &&
                          (!target || conversion_cost(v->type, target->type) >= 0);
        if (method ? m_linked->has_method(size_t(u), name) : fits)
            able.push_back(u);
    }
    const auto take = [&](int u) {
        if (!target || method)
            return;
        start(u);
        Expr value{ExprKind::Name, e->loc};
        value.var = m_linked->variable(size_t(u), name);
        value.type = value.var->type;
        if (target->type.array && target->var)
            assign_array(Binding(bind(target->var)), &value, target->type, e->loc);
        else if (target->type.base == Base::Struct && target->var)
            copy_fields(target->var->fields, value.var->fields, e->loc);
        else if (!target->type.array)
            assign_to(target, expr_as(&value, target->type), e->loc);
    };
    if (m_b.at(handle).op == Op::Text) {
        for (const int u : able)
            take(u);
        return m_b.constant(able.empty() ? 0.0f : 1.0f);
    }
    const int var = m_b.var(name, Ty::Float, e->loc);
    m_b.declare(var);
    m_b.store(var, m_b.constant(0.0f), e->loc);
    for_targets(handle, able, e->loc, [&](int u) {
        take(u);
        m_b.store(var, m_b.constant(1.0f), e->loc);
    });
    return m_b.load(var, e->loc);
}

} // namespace kanuka::sl::ir
