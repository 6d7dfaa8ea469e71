#include "sl/sema/sema.h"

#include "sl/parse/parser.h"
#include "sl/sema/linked.h"

namespace kanuka::sl {

using namespace ast;

Sema::Scope* Sema::push() {
    Scope& s = m_scopes.emplace_back();
    s.parent = m_scope;
    return m_scope = &s;
}

void Sema::declare(VarDecl* v) {
    if (v->is_extern && v->kind != VarDecl::Parameter) {
        // "extern float x": the enclosing x, which is visible anyway; functions outside of the shader see its
        // parameters so too. It must be there.
        VarDecl* outer = nullptr;
        for (Scope* s = m_scope->parent; s && !outer; s = s->parent)
            if (const auto it = s->vars.find(v->name); it != s->vars.end())
                outer = it->second;
        if (!outer)
            outer = global(v->name);
        if (!outer && m_shader_scope)
            if (const auto it = m_shader_scope->vars.find(v->name); it != m_shader_scope->vars.end())
                outer = it->second;
        if (!outer)
            m_diagnostics.error(v->loc,
                                "there is no \"" + std::string(v->name) + "\" outside of this function");
        else
            m_scope->vars[v->name] = outer;
        return;
    }
    const auto [it, fresh] = m_scope->vars.try_emplace(v->name, v);
    if (fresh)
        return;
    const std::string what = "\"" + std::string(v->name) + "\" is declared twice here, first in line " +
                             std::to_string(it->second->loc.line);
    if (it->second->type == v->type)
        m_diagnostics.warning(v->loc, what);
    else
        m_diagnostics.error(v->loc, what + " as a " + it->second->type.str());
    it->second = v;
}

// The functions of a struct see its members; a call binds these to those of the struct it is made on.
void Sema::check_struct(const StructDecl* record) {
    if (m_struct_scopes.count(record) || record->functions.empty())
        return;
    Scope* const scope = m_scope;
    m_scope = m_shader_scope ? m_shader_scope : m_root;
    m_struct_scopes[record] = push();
    for (VarDecl* m : record->members) {
        m->written = m->read = true;
        make_fields(m);
        m_scope->vars[m->name] = m;
    }
    for (FunctionDecl* f : record->functions)
        declare(f);
    for (FunctionDecl* f : record->functions)
        check_function(f);
    m_scope = scope;
}

// A struct's variable is a variable for each member.
void Sema::make_fields(VarDecl* v) {
    if (v->type.base != Base::Struct || !v->fields.empty())
        return;
    if (++m_depth > 64) {
        m_diagnostics.error(v->loc, "this struct contains itself");
        m_depth--;
        return;
    }
    for (VarDecl* m : v->type.record->members) {
        resolve_size(m);
        VarDecl* f = m_arena.var();
        f->name = m_diagnostics.sources().keep(std::string(v->name) + "->" + std::string(m->name));
        f->loc = v->loc;
        f->kind = v->kind;
        f->type = m->type;
        f->detail = v->detail == Detail::Unspecified ? m->detail : v->detail;
        f->output = v->output;
        f->is_extern = v->is_extern;
        f->read = f->written = true;
        f->init = m->init;
        if (v->type.array && m->type.array)
            m_diagnostics.error(v->loc, "an array of structs that have arrays; use an array for each member");
        if (v->type.array) {
            f->type.array = true;
            f->type.size = v->type.size;
            f->resizable = v->resizable;
        } else if (m->type.array && m->type.size == 0 && !m->init) {
            f->resizable = true;
        }
        if (f->init) {
            const ast::Type t = expr(f->init, &f->type);
            if (!f->type.array)
                want(f->init, f->type, "member \"" + std::string(m->name) + "\"");
            else if (f->type.size == 0 && !v->type.array)
                f->type.size = t.size;
        }
        make_fields(f);
        v->fields.push_back(f);
    }
    m_depth--;
}

void Sema::declare(FunctionDecl* f) {
    m_scope->functions[f->name].push_back(f);
    f->scope = m_scope;
    f->outer = m_function;
}

VarDecl* Sema::global(std::string_view name) {
    if (m_linked && m_linked->caller != this) // a co-shader sees what its caller sees
        return m_linked->caller->global(name);
    if (const auto it = m_globals.find(name); it != m_globals.end())
        return it->second;
    for (size_t i = 0; i < ops::globals().size(); i++) {
        const ops::Global& g = ops::globals()[i];
        if (g.name != name)
            continue;
        VarDecl* v = m_arena.var();
        v->name = g.name;
        v->kind = VarDecl::Global;
        v->type.base = g.type;
        v->global = int(i);
        v->written = true;
        return m_globals[g.name] = v;
    }
    return nullptr;
}

VarDecl* Sema::find(std::string_view name) {
    for (Scope* s = m_scope; s; s = s->parent)
        if (const auto it = s->vars.find(name); it != s->vars.end())
            return it->second;
    return global(name);
}

// ---- shaders and functions
// ----------------------------------------------------------------------------------------

void Sema::check(Unit& unit, ShaderDecl& shader) {
    m_shader = &shader;
    m_plugins = unit.plugins;
    m_root = push();
    for (FunctionDecl* f : unit.functions)
        declare(f);
    shader.constants = unit.constants;
    for (VarDecl* v : unit.constants) {
        variable(v);
        v->written = true;
    }
    m_shader_scope = push();
    for (VarDecl* v : shader.parameters) {
        variable(v);
        v->written = true;
        if (v->type.base == Base::Shader)
            note_use(CoShaderUse::Connected);
        if (!v->init && !v->type.is(Base::Shader))
            m_diagnostics.warning(v->loc, "parameter \"" + std::string(v->name) +
                                              "\" has no default value; write \"" + v->type.str() + " " +
                                              std::string(v->name) + " = …\"; it is 0 here");
        if (v->type.base == Base::Struct)
            m_diagnostics.error(v->loc, "a shader's parameter cannot be a struct");
    }
    for (VarDecl* v : shader.members) {
        variable(v);
        v->written = true;
    }
    for (FunctionDecl* f : shader.functions)
        declare(f);
    if (shader.body)
        statement(shader.body);
    for (FunctionDecl* f : shader.functions)
        check_function(f);
    // Functions that nothing calls need not be right: headers of others are full of them.
    for (FunctionDecl* f : unit.functions) {
        const std::string why = "function \"" + std::string(f->name) + "\", which nothing calls: ";
        if (f->state == FunctionDecl::Unchecked)
            m_diagnostics.set_lenient(&why);
        check_function(f);
        m_diagnostics.set_lenient(nullptr);
    }
    if (shader.kind == ShaderKind::Class)
        check_stages(shader);
    if (m_diagnostics.errors() == 0)
        warn_unused(shader);
}

void Sema::warn_unused(const ShaderDecl& shader) {
    for (const VarDecl* v : shader.parameters)
        if (!v->read && !v->output && !v->name.starts_with("__")) // "__x" are messages for others
            m_diagnostics.warning(v->loc, "parameter \"" + std::string(v->name) + "\" is never used");
}

void Sema::check_stages(ShaderDecl& shader) {
    struct Form {
        std::string_view name, text;
        std::vector<Base> formals;
    };
    static const std::vector<Form> forms = {
        {"mnk_init",
         "mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)",
         {Base::ObjectProperties, Base::Material}},
        {"mnk_interior", "mnk_interior(output MnkMaterialInterior interior)", {Base::Interior}},
        {"mnk_prelighting", "mnk_prelighting(output MnkMaterialBoundary boundary)", {Base::Boundary}},
        {"mnk_displacement",
         "mnk_displacement(output point P; output normal N)",
         {Base::Point, Base::Normal}},
        {"displacement", "displacement(output point P; output normal N)", {Base::Point, Base::Normal}},
        {"surface", "surface(output color Ci, Oi)", {Base::Color, Base::Color}},
        {"prelighting", "prelighting(output color Ci, Oi)", {Base::Color, Base::Color}},
        {"lighting", "lighting(output color Ci, Oi)", {Base::Color, Base::Color}},
        {"opacity", "opacity(output color Oi)", {Base::Color}},
        {"diffuselighting", "diffuselighting(output color Ci, Oi)", {Base::Color, Base::Color}},
        {"specularlighting", "specularlighting(output color Ci, Oi)", {Base::Color, Base::Color}},
        {"postlighting", "postlighting(output color Ci, Oi)", {Base::Color, Base::Color}},
        {"construct", "construct()", {}},
        {"begin", "begin()", {}},
    };
    bool any = false;
    for (const FunctionDecl* f : shader.functions)
        for (const Form& form : forms) {
            if (f->name != form.name)
                continue;
            any = true;
            bool fits = f->formals.size() == form.formals.size() && f->result.is(Base::Void);
            for (size_t i = 0; fits && i < form.formals.size(); i++)
                fits = f->formals[i]->type.is(form.formals[i]);
            // Of RenderMan's stages those that take something else are methods for co-shaders, and do not
            // run.
            if (!fits && !form.name.starts_with("mnk_") && form.name != "surface")
                m_diagnostics.warning(f->loc, "this does not run as a stage: that would be \"public void " +
                                                  std::string(form.text) + "\"");
            else if (!fits)
                m_diagnostics.error(f->loc,
                                    "this stage must be \"public void " + std::string(form.text) + "\"");
        }
    for (const FunctionDecl* f : shader.functions)
        any = any || f->is_public; // a co-shader
    if (!any)
        m_diagnostics.error(shader.loc, "class \"" + std::string(shader.name) +
                                            "\" has no stage; expected a method mnk_init, mnk_prelighting, "
                                            "mnk_displacement, mnk_interior or surface");
}

void Sema::check_function(FunctionDecl* f) {
    if (f->state == FunctionDecl::Checked)
        return;
    if (f->state == FunctionDecl::Checking)
        return; // recursion is reported where the call is lowered
    f->state = FunctionDecl::Checking;
    Scope* const scope = m_scope;
    FunctionDecl* const function = m_function;
    const int loops = m_loops;
    m_scope = static_cast<Scope*>(f->scope);
    m_function = f;
    m_loops = 0;
    push();
    for (VarDecl* v : f->formals) {
        variable(v);
        v->written = true;
    }
    if (f->result.base == Base::Struct) {
        f->result_fields = m_arena.var();
        f->result_fields->name = f->name;
        f->result_fields->loc = f->loc;
        f->result_fields->type = f->result;
        make_fields(f->result_fields);
    }
    statement(f->body);
    m_scope = scope;
    m_function = function;
    m_loops = loops;
    f->state = FunctionDecl::Checked;
}

FunctionDecl* Sema::source(const ops::Shadeop& op, int signature) {
    if (m_linked && m_linked->caller != this)
        return m_linked->caller->source(op, signature);
    FunctionDecl*& f = m_sources[{&op, signature}];
    if (f)
        return f;
    Sources& sources = m_diagnostics.sources();
    const uint32_t file = sources.add("<" + op.name + ">", op.signatures[signature].source);
    m_source_tokens.push_back(lex(sources, file, m_diagnostics));
    FunctionDecl* parsed = Parser(m_source_tokens.back(), m_arena, m_diagnostics).function_alone();
    if (!parsed)
        return nullptr;
    f = parsed;
    Scope* const scope = m_scope;
    m_scope = nullptr; // sees globals and shadeops only
    Scope* own = push();
    m_scope = scope;
    parsed->scope = own;
    check_function(parsed);
    return parsed;
}

} // namespace kanuka::sl
