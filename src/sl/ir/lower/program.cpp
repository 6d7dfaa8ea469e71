#include "sl/ir/lower/program.h"

#include "sl/ir/lower/arrays.h"
#include "sl/ir/lower/coshaders.h"
#include "sl/ir/lower/emission.h"
#include "sl/ir/lower/functions.h"
#include "sl/ir/lower/handles.h"
#include "sl/ir/lower/materials.h"
#include "sl/ir/lower/members.h"
#include "sl/ir/lower/parameters.h"
#include "sl/ir/lower/shadeops.h"
#include "sl/ir/lower/statements.h"
#include "sl/ir/lower/variables.h"

namespace kanuka::sl::ir {

using namespace ast;

void ProgramLowerer::begin_stage(Stage& stage, Role role, const char* name) {
    stage.name = name;
    stage.root = stage.block();
    m_b.set_stage(stage);
    m_b.set_block(stage.root);
    m_state = {};
    m_state.prologue = stage.block();
    m_state.role = role;
    shadeops().begin_stage();
    arrays().begin_stage();
    materials().begin_stage();
    tracker().begin_stage();
    coshaders().begin_stage();
    for (const VarDecl* v : m_context.shader.constants)
        variables().declare(v);
    for (size_t u = 0; m_context.linked && u < m_context.linked->units.size(); u++)
        for (const VarDecl* v : m_context.linked->units[u].shader->constants)
            variables().declare(v);
}

void ProgramLowerer::end_stage() {
    tracker().end_stage();
    arrays().end_stage();
    Stage& s = m_b.stage();
    std::vector<Item> items = m_state.prologue->items;
    items.insert(items.end(), m_state.starts.begin(), m_state.starts.end());
    items.insert(items.end(), s.root->items.begin(), s.root->items.end());
    s.root->items = std::move(items);
}

FunctionDecl* ProgramLowerer::method(std::string_view name) {
    for (FunctionDecl* f : m_context.shader.functions)
        if (f->name == name)
            return f;
    return nullptr;
}

// RenderMan's stages of a class fit their forms; what else has their name is a method.
FunctionDecl* ProgramLowerer::stage_method(std::string_view name) {
    FunctionDecl* f = method(name);
    const size_t formals = name == "opacity" ? 1 : name == "begin" || name == "construct" ? 0 : 2;
    return f && f->formals.size() == formals && f->result.is(Base::Void) ? f : nullptr;
}

// What runs for a class with Ci and Oi: its surface(), or the pipeline that stands for one.
std::vector<FunctionDecl*> ProgramLowerer::lit_methods() {
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

// N goes out where the shader sets it: more than its initial value is stored.
void ProgramLowerer::normal_output() {
    const auto it = m_state.bindings.find(m_sema.global("N"));
    if (it == m_state.bindings.end() || it->second.kind != Binding::Variable)
        return;
    int stores = 0;
    for (const Instr& i : m_b.stage().instrs)
        stores += i.op == Op::Store && i.imm == it->second.var;
    if (stores > 1)
        m_b.stage().outputs.push_back({Output::Normal, it->second.var, 0});
}

// A surface that leaves Ci alone is one of constant colour: RISpec begins with Ci = Cs, which means Cs where
// Oi says that the surface is.
void ProgramLowerer::unset_color() {
    int stores = 0;
    for (const Instr& i : m_b.stage().instrs)
        stores += i.op == Op::Store && i.imm == m_program.Ci;
    if (stores > 1)
        return;
    const Ref color = input(Input::Cs), opacity = m_b.load(m_program.Oi, {});
    m_b.store(m_program.Ci, m_b.emit(Op::Mul, Ty::Triple, {color, opacity}, {}), {});
}

void ProgramLowerer::aov_outputs() {
    for (const std::string& name : m_program.aovs)
        for (const VarDecl* v : m_context.shader.parameters)
            if (v->name == name && v->output && !v->type.array && ty(v->type) != Ty::String)
                m_b.stage().outputs.push_back({Output::Aov, bind(v).var, parameters().index(v)});
}

// Where the material is read from.
void ProgramLowerer::take_result() {
    m_program.Ci = bind(m_sema.global("Ci")).var;
    m_program.Oi = bind(m_sema.global("Oi")).var;
}

void ProgramLowerer::class_stages() {
    class_stage("mnk_init", m_program.init, Role::Init);
    class_stage("mnk_interior", m_program.interior, Role::Interior);
    class_stage(method("mnk_displacement")     ? "mnk_displacement"
                : stage_method("displacement") ? "displacement"
                                               : "",
                m_program.displace, Role::Displace);
    class_stage("mnk_prelighting", m_program.shade, Role::Shade);
}

void ProgramLowerer::class_stage(const char* name, Stage& stage, Role role) {
    std::vector<FunctionDecl*> methods = {method(name)};
    const bool lit = role == Role::Shade && !methods[0];
    if (lit)
        methods = lit_methods();
    if (methods.empty() || !methods[0])
        return;
    begin_stage(stage, role, lit ? "surface" : name);
    m_state.lit = lit;
    for (const VarDecl* v : m_context.shader.members)
        variables().declare(v);
    for (const char* first : {"construct", "begin"})
        if (FunctionDecl* f = stage_method(first); f && role != Role::Init && role != Role::Interior)
            functions().run_method(f);
    if (role == Role::Shade)
        members().take();
    if (lit)
        take_result();
    if (role == Role::Shade)
        coshaders().start_layers();
    for (FunctionDecl* f : methods)
        functions().run_method(f);
    class_outputs(stage, role, lit);
    end_stage();
}

void ProgramLowerer::class_outputs(Stage& stage, Role role, bool lit) {
    if (role == Role::Init) {
        materials().check_layers();
        members().keep(stage);
    }
    if (role == Role::Displace || role == Role::Shade)
        normal_output();
    if (role == Role::Displace) {
        stage.outputs.push_back({Output::Position, bind(m_sema.global("P")).var, 0});
        members().leave();
    }
    if (lit)
        unset_color();
    if (role == Role::Shade)
        aov_outputs();
    materials().channel_outputs(stage);
    if (role == Role::Shade)
        members().drop_unread();
}

void ProgramLowerer::classic_stage() {
    const bool displaces = m_context.shader.kind == ShaderKind::Displacement;
    Stage& stage = displaces ? m_program.displace : m_program.shade;
    begin_stage(stage, displaces ? Role::Displace : Role::Shade, displaces ? "displacement" : "surface");
    m_state.lit = !displaces;
    if (!displaces)
        take_result();
    coshaders().start_layers();
    // return ends the shader: a scope around its body.
    const int target = m_b.stage().targets++;
    m_state.returns.push_back({target, -1});
    if (has_return(m_context.shader.body)) {
        Item scope{Item::Scope};
        scope.target = target;
        scope.loc = m_context.shader.loc;
        scope.body = in_block([&] { statements().statement(m_context.shader.body); });
        m_b.item(scope);
    } else {
        statements().statement(m_context.shader.body);
    }
    m_state.returns.pop_back();
    if (!displaces)
        unset_color();
    if (displaces)
        stage.outputs.push_back({Output::Position, bind(m_sema.global("P")).var, 0});
    normal_output();
    if (!displaces)
        aov_outputs();
    end_stage();
}

void ProgramLowerer::light_stage() {
    begin_stage(m_program.light, Role::Light, "light");
    emission().begin();
    statements().statement(m_context.shader.body);
    emission().outputs(m_program.light);
    end_stage();
}

// Volume and imager shaders take a colour and an opacity and hand them on changed. They come in as Cs and Os.
void ProgramLowerer::filter_stage() {
    Stage& stage = m_program.filter;
    begin_stage(stage, Role::Filter, "filter");
    const int vars[] = {bind(m_sema.global("Ci")).var, bind(m_sema.global("Oi")).var,
                        bind(m_sema.global("alpha")).var};
    statements().statement(m_context.shader.body);
    for (int k = 0; k < 3; k++)
        stage.outputs.push_back({Output::Filtered, vars[k], k});
    end_stage();
}

void ProgramLowerer::run() {
    m_program.kind = m_context.shader.kind;
    m_program.name = m_context.shader.name;
    parameters().declare();
    begin_stage(m_program.defaults, Role::Defaults, "defaults");
    parameters().default_values();
    end_stage();
    members().declare();
    switch (m_context.shader.kind) {
    case ShaderKind::Class:
        return class_stages();
    case ShaderKind::Surface:
    case ShaderKind::Displacement:
        return classic_stage();
    case ShaderKind::Light:
        return light_stage();
    case ShaderKind::Volume:
    case ShaderKind::Imager:
        return filter_stage();
    }
}

} // namespace kanuka::sl::ir
