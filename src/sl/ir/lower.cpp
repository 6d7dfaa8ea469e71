#include "sl/ir/lower.h"

namespace kanuka::sl::ir {

using namespace ast;

Ty Lower::ty(const ast::Type& t) {
    switch (t.base) {
    case Base::Void:
        return Ty::Void;
    case Base::Bool:
        return Ty::Bool;
    case Base::Float:
        return Ty::Float;
    case Base::Matrix:
        return Ty::Matrix;
    case Base::String:
    case Base::Shader: // its handle
        return Ty::String;
    case Base::Color:
    case Base::Point:
    case Base::Vector:
    case Base::Normal:
        return Ty::Triple;
    default:
        return Ty::Void;
    }
}

static sl::Type public_type(Base b) {
    switch (b) {
    case Base::Color:
        return sl::Type::Color;
    case Base::Point:
        return sl::Type::Point;
    case Base::Vector:
        return sl::Type::Vector;
    case Base::Normal:
        return sl::Type::Normal;
    case Base::Matrix:
        return sl::Type::Matrix;
    case Base::String:
        return sl::Type::String;
    case Base::Shader:
        return sl::Type::Shader;
    default:
        return sl::Type::Float;
    }
}

static bool contains(const Stmt* s, const std::function<bool(const Stmt*)>& wanted) {
    if (!s)
        return false;
    if (wanted(s))
        return true;
    for (const Stmt* b : s->block)
        if (contains(b, wanted))
            return true;
    return contains(s->body, wanted) || contains(s->orelse, wanted);
}

bool has_return(const Stmt* s) {
    return contains(s, [](const Stmt* t) { return t->kind == StmtKind::Return; });
}

// ---- stages
// ---------------------------------------------------------------------------------------------------------

void Lower::begin_stage(Stage& stage, Role role, const char* name) {
    stage.name = name;
    stage.root = stage.block();
    m_prologue = stage.block();
    m_b.set_stage(stage);
    m_b.set_block(stage.root);
    m_role = role;
    m_bind.clear();
    m_spaces.clear();
    m_channel_vars.clear();
    m_loops.clear();
    m_returns.clear();
    m_active.clear();
    m_active_units.clear();
    m_self = -1;
    m_started.clear();
    m_starts.clear();
    m_stores_seen = 0;
    m_stored.clear();
    m_asked.clear();
    m_tags.clear();
    m_var_tags.clear();
    m_illuminance = 0;
    m_loop_depth = 0;
    m_trips = 1;
    m_known_loops = 0;
    m_pushes.clear();
    m_loop = -1;
    m_sample = ir::None;
    m_random = -1;
    m_lit = false;
    for (const VarDecl* v : m_shader.constants)
        declare(v);
    for (size_t u = 0; m_linked && u < m_linked->units.size(); u++)
        for (const VarDecl* v : m_linked->units[u].shader->constants)
            declare(v);
}

void Lower::end_stage() {
    check_targets();
    Stage& s = m_b.stage();
    for (const Push& p : m_pushes)
        s.faults[size_t(p.fault)].second =
            "array \"" + s.vars[size_t(p.var)].name + "\" is full: it has room for " +
            std::to_string(s.vars[size_t(p.var)].array) +
            " values; reserve(array, n) before the loop makes more, as does the compiler's option for it";
    std::vector<Item> items = m_prologue->items;
    items.insert(items.end(), m_starts.begin(), m_starts.end());
    items.insert(items.end(), s.root->items.begin(), s.root->items.end());
    s.root->items = std::move(items);
}

// A default value that only the surface knows (varying vector direction = dPdu) is computed where the shader
// runs.
bool Lower::late_default(const VarDecl* v) {
    const auto varies = [](auto& self, const Expr* e) -> bool {
        if (!e)
            return false;
        if (e->kind == ExprKind::Name && e->var && e->var->kind == VarDecl::Global)
            return e->text != "PI" && e->text != "ncomps" && e->text != "null";
        for (const Expr* a : e->args)
            if (self(self, a))
                return true;
        return false;
    };
    return v->init && !v->type.array && ty(v->type) != Ty::String && varies(varies, v->init);
}

void Lower::parameters() {
    // The shader's own, then the co-shaders', each under its handle.
    for (const VarDecl* v : m_shader.parameters)
        add_parameter(v, std::string(v->name));
    for (size_t u = 0; m_linked && u < m_linked->units.size(); u++)
        for (const VarDecl* v : m_linked->units[u].shader->parameters)
            add_parameter(v, m_linked->units[u].given->handle + "." + std::string(v->name));
    // Default values: constants go into the description, the rest is computed when an instance is made.
    begin_stage(m_program.defaults, Role::Defaults, "defaults");
    for (size_t index = 0; index < m_parameters.size(); index++)
        default_value(m_parameters[index], int(index));
    end_stage();
}

void Lower::add_parameter(const VarDecl* v, std::string name) {
    m_parameter_index[v] = int(m_program.parameters.size());
    m_parameters.push_back(v);
    Parameter p;
    p.name = std::move(name);
    p.type = public_type(v->type.base);
    p.varying = v->detail == Detail::Varying;
    p.output = v->output;
    p.array_size = v->type.array ? v->type.size : 0;
    p.resizable = v->resizable;
    p.doc = v->doc;
    Place place;
    place.text = ty(v->type) == Ty::String;
    const int elements = v->resizable ? std::max(ResizableRoom, p.array_size) : std::max(1, p.array_size);
    place.count = comps(ty(v->type)) * elements;
    place.varying = p.varying && !place.text && !v->type.array;
    int& size = place.text ? m_program.strings : m_program.floats;
    place.offset = size;
    size += place.count;
    if (v->resizable)
        place.length = m_program.floats++;
    if (ty(v->type) == Ty::Void)
        m_diagnostics.error(v->loc, "a parameter cannot be a " + v->type.str());
    m_program.parameters.push_back(std::move(p));
    m_program.places.push_back(place);
}

// As many values as a parameter has; those that are not given are zero.
static void fill(Parameter& p, Ty ty, size_t elements) {
    if (ty == Ty::String)
        p.strings.resize(elements);
    else
        p.floats.resize(size_t(comps(ty)) * elements);
}

void Lower::default_value(const VarDecl* v, int index) {
    Parameter& p = m_program.parameters[size_t(index)];
    ast::Type element = v->type;
    element.array = false;
    const Ty t = ty(element);
    if (!v->init)
        return fill(p, t, v->type.array ? size_t(v->type.size) : 1);
    if (late_default(v)) {
        m_program.places[size_t(index)].length = m_program.floats++;
        return fill(p, t, 1);
    }
    const std::vector<Ref> values = default_values(v, element, p.array_size);
    const bool constant = std::ranges::all_of(
        values, [&](Ref r) { return m_b.at(r).op == Op::Const || m_b.at(r).op == Op::Text; });
    if (constant) {
        for (Ref r : values)
            if (t == Ty::String)
                p.strings.push_back(m_b.at(r).text);
            else
                p.floats.insert(p.floats.end(), m_b.at(r).floats.begin(), m_b.at(r).floats.end());
        return fill(p, t, v->type.array ? size_t(std::max(0, p.array_size)) : 1);
    }
    if (element.base == Base::String && v->type.array) {
        m_diagnostics.error(v->init->loc, "the default values of an array of strings must be constants");
        return;
    }
    for (size_t k = 0; k < values.size(); k++) {
        const int var = m_b.var(p.name, t, v->loc);
        m_b.declare(var);
        m_b.store(var, values[k], v->loc);
        m_program.defaults.outputs.push_back({Output::Parameter, var, index, int(k)});
    }
}

std::vector<Ref> Lower::default_values(const VarDecl* v, const ast::Type& element, int size) {
    std::vector<Ref> values;
    if (v->init->kind == ExprKind::List)
        for (const Expr* a : v->init->args)
            values.push_back(expr_as(a, element));
    else if (!v->init->type.array) // else it is an empty array of a function
        values.assign(size_t(std::max(1, size)), expr_as(v->init, element));
    if (v->type.array && int(values.size()) > size)
        values.resize(size_t(size));
    return values;
}

void Lower::members() {
    // Structs are their members.
    std::vector<const VarDecl*> all;
    const auto flatten = [&](auto& again, const VarDecl* v) -> void {
        if (v->fields.empty())
            all.push_back(v);
        for (const VarDecl* f : v->fields)
            again(again, f);
    };
    for (const VarDecl* v : m_shader.members)
        flatten(flatten, v);
    for (const VarDecl* v : all) {
        if (v->type.handle() || v->type.base == Base::Lobe)
            continue;
        m_member_index[v] = int(m_program.members.size());
        Place place;
        place.text = ty(v->type) == Ty::String;
        place.count = comps(ty(v->type)) * (v->type.array ? std::max(1, v->type.size) : 1);
        int& size = place.text ? m_program.member_strings : m_program.member_floats;
        place.offset = size;
        size += place.count;
        m_program.members.push_back(place);
    }
}

FunctionDecl* Lower::method(std::string_view name) {
    for (FunctionDecl* f : m_shader.functions)
        if (f->name == name)
            return f;
    return nullptr;
}

// A stage method: its formals are the stage's own outputs and handles.
void Lower::run_method(FunctionDecl* f) {
    std::vector<Binding> bindings;
    for (const VarDecl* v : f->formals) {
        Binding b;
        b.kind = Binding::Handle;
        const char* global_name = v->type.is(Base::Point)    ? "P"
                                  : v->type.is(Base::Normal) ? "N"
                                  : v->type.is(Base::Color)
                                      ? (bindings.empty() && f->name != "opacity" ? "Ci" : "Oi")
                                      : nullptr;
        if (global_name)
            b = bind(m_sema.global(global_name));
        bindings.push_back(std::move(b));
    }
    inline_with(f, std::move(bindings), f->loc);
}

// N goes out where the shader sets it: more than its initial value is stored.
void Lower::normal_output() {
    const auto it = m_bind.find(m_sema.global("N"));
    if (it == m_bind.end() || it->second.kind != Binding::Variable)
        return;
    int stores = 0;
    for (const Instr& i : m_b.stage().instrs)
        stores += i.op == Op::Store && i.imm == it->second.var;
    if (stores > 1)
        m_b.stage().outputs.push_back({Output::Normal, it->second.var, 0});
}

// A surface that leaves Ci alone is one of constant colour: RISpec begins with Ci = Cs, which means Cs where
// Oi says that the surface is.
void Lower::unset_color() {
    int stores = 0;
    for (const Instr& i : m_b.stage().instrs)
        stores += i.op == Op::Store && i.imm == m_program.Ci;
    if (stores > 1)
        return;
    const Ref color = input(Input::Cs), opacity = m_b.load(m_program.Oi, {});
    m_b.store(m_program.Ci, m_b.emit(Op::Mul, Ty::Triple, {color, opacity}, {}), {});
}

// RenderMan's stages of a class fit their forms; what else has their name is a method.
FunctionDecl* Lower::stage_method(std::string_view name) {
    FunctionDecl* f = method(name);
    const size_t formals = name == "opacity" ? 1 : name == "begin" || name == "construct" ? 0 : 2;
    return f && f->formals.size() == formals && f->result.is(Base::Void) ? f : nullptr;
}

// What runs for a class with Ci and Oi: its surface(), or the pipeline that stands for one.
std::vector<FunctionDecl*> Lower::lit_methods() {
    std::vector<FunctionDecl*> all;
    const auto add = [&](std::string_view name) {
        FunctionDecl* f = stage_method(name);
        if (f)
            all.push_back(f);
        return f != nullptr;
    };
    add("opacity");
    add("prelighting");
    if (add("surface") || add("lighting"))
        return all;
    add("diffuselighting");
    add("specularlighting");
    add("postlighting");
    return all;
}

void Lower::aov_outputs() {
    for (const std::string& name : m_program.aovs)
        for (const VarDecl* v : m_shader.parameters)
            if (v->name == name && v->output && !v->type.array && ty(v->type) != Ty::String)
                m_b.stage().outputs.push_back({Output::Aov, bind(v).var, m_parameter_index[v]});
}

void Lower::class_stage(const char* name, Stage& stage, Role role) {
    std::vector<FunctionDecl*> methods = {method(name)};
    const bool lit = role == Role::Shade && !methods[0];
    if (lit)
        methods = lit_methods();
    if (methods.empty() || !methods[0])
        return;
    begin_stage(stage, role, lit ? "surface" : name);
    m_lit = lit;
    for (const VarDecl* v : m_shader.members)
        declare(v);
    for (const char* first : {"construct", "begin"})
        if (FunctionDecl* f = stage_method(first); f && role != Role::Init && role != Role::Interior)
            run_method(f);
    if (role == Role::Shade)
        take_members();
    if (lit) {
        m_program.Ci = bind(m_sema.global("Ci")).var;
        m_program.Oi = bind(m_sema.global("Oi")).var;
    }
    if (role == Role::Shade)
        start_layers();
    for (FunctionDecl* f : methods)
        run_method(f);
    if (role == Role::Init)
        check_layers();
    if (role == Role::Init)
        for (const auto& [v, index] :
             std::map<const VarDecl*, int>(m_member_index.begin(), m_member_index.end()))
            if (!v->type.array && m_bind[v].kind == Binding::Variable)
                stage.outputs.push_back({Output::Member, m_bind[v].var, index});
    if (role == Role::Displace || role == Role::Shade)
        normal_output();
    if (role == Role::Displace)
        stage.outputs.push_back({Output::Position, bind(m_sema.global("P")).var, 0});
    if (role == Role::Displace)
        leave_members();
    if (lit)
        unset_color();
    if (role == Role::Shade)
        aov_outputs();
    for (const auto& [channel, var] : std::map<int, int>(m_channel_vars.begin(), m_channel_vars.end()))
        stage.outputs.push_back({Output::Slot, var, channel});
    if (role == Role::Shade)
        drop_unread_members();
    end_stage();
}

void Lower::classic_stage() {
    const bool displaces = m_shader.kind == ShaderKind::Displacement;
    Stage& stage = displaces ? m_program.displace : m_program.shade;
    begin_stage(stage, displaces ? Role::Displace : Role::Shade, displaces ? "displacement" : "surface");
    m_lit = !displaces;
    if (!displaces) {
        m_program.Ci = bind(m_sema.global("Ci")).var;
        m_program.Oi = bind(m_sema.global("Oi")).var;
    }
    start_layers();
    // return ends the shader: a scope around its body.
    const int target = m_b.stage().targets++;
    m_returns.push_back({target, -1});
    if (has_return(m_shader.body)) {
        Item scope{Item::Scope};
        scope.target = target;
        scope.loc = m_shader.loc;
        scope.body = in_block([&] { statement(m_shader.body); });
        m_b.item(scope);
    } else {
        statement(m_shader.body);
    }
    m_returns.pop_back();
    if (!displaces)
        unset_color();
    if (displaces)
        stage.outputs.push_back({Output::Position, bind(m_sema.global("P")).var, 0});
    normal_output();
    if (!displaces)
        aov_outputs();
    end_stage();
}

void Lower::run() {
    m_program.kind = m_shader.kind;
    m_program.name = m_shader.name;
    parameters();
    members();
    switch (m_shader.kind) {
    case ShaderKind::Class:
        class_stage("mnk_init", m_program.init, Role::Init);
        class_stage("mnk_interior", m_program.interior, Role::Interior);
        class_stage(method("mnk_displacement")     ? "mnk_displacement"
                    : stage_method("displacement") ? "displacement"
                                                   : "",
                    m_program.displace, Role::Displace);
        class_stage("mnk_prelighting", m_program.shade, Role::Shade);
        break;
    case ShaderKind::Surface:
    case ShaderKind::Displacement:
        classic_stage();
        break;
    case ShaderKind::Light:
        light_stage();
        break;
    case ShaderKind::Volume:
    case ShaderKind::Imager:
        filter_stage();
        break;
    }
}

} // namespace kanuka::sl::ir
