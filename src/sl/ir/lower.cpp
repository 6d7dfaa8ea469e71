#include "sl/ir/lower.h"

namespace kanuka::sl::ir {

using namespace ast;

static constexpr size_t MaxInstructions = size_t(1) << 22;

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
    default:
        return sl::Type::Float;
    }
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
    m_tags.clear();
    m_var_tags.clear();
    m_illuminance = 0;
    m_loop = -1;
    m_sample = ir::None;
    m_lit = false;
}

void Lower::end_stage() {
    Stage& s = m_b.stage();
    std::vector<Item> items = m_prologue->items;
    items.insert(items.end(), s.root->items.begin(), s.root->items.end());
    s.root->items = std::move(items);
}

void Lower::parameters() {
    for (const VarDecl* v : m_shader.parameters) {
        m_parameter_index[v] = int(m_program.parameters.size());
        Parameter p;
        p.name = v->name;
        p.type = public_type(v->type.base);
        p.varying = v->detail == Detail::Varying;
        p.output = v->output;
        p.array_size = v->type.array ? v->type.size : 0;
        p.doc = v->doc;
        Place place;
        place.text = v->type.base == Base::String;
        place.count = comps(ty(v->type)) * std::max(1, p.array_size);
        place.varying = p.varying && !place.text && !v->type.array;
        int& size = place.text ? m_program.strings : m_program.floats;
        place.offset = size;
        size += place.count;
        if (ty(v->type) == Ty::Void)
            m_diagnostics.error(v->loc, "a parameter cannot be a " + v->type.str());
        m_program.parameters.push_back(std::move(p));
        m_program.places.push_back(place);
    }
    // Default values: constants go into the description, the rest is computed when an instance is made.
    begin_stage(m_program.defaults, Role::Defaults, "defaults");
    for (const VarDecl* v : m_shader.parameters) {
        const int index = m_parameter_index[v];
        Parameter& p = m_program.parameters[index];
        if (!v->init)
            continue;
        ast::Type element = v->type;
        element.array = false;
        std::vector<Ref> values;
        if (v->init->kind == ExprKind::List)
            for (const Expr* a : v->init->args)
                values.push_back(expr_as(a, element));
        else
            values.assign(size_t(std::max(1, p.array_size)), expr_as(v->init, element));
        bool constant = true;
        for (Ref r : values)
            constant = constant && (m_b.at(r).op == Op::Const || m_b.at(r).op == Op::Text);
        if (constant) {
            for (Ref r : values)
                if (element.base == Base::String)
                    p.strings.push_back(m_b.at(r).text);
                else
                    p.floats.insert(p.floats.end(), m_b.at(r).floats.begin(), m_b.at(r).floats.end());
            const size_t count = size_t(m_program.places[index].count);
            if (element.base == Base::String)
                p.strings.resize(count);
            else
                p.floats.resize(count);
            continue;
        }
        if (v->type.array) {
            m_diagnostics.error(v->init->loc, "the default values of an array must be constants");
            continue;
        }
        const int var = m_b.var(p.name, ty(element), v->loc);
        m_b.declare(var);
        m_b.store(var, values[0], v->loc);
        m_program.defaults.outputs.push_back({Output::Parameter, var, index});
    }
    end_stage();
}

void Lower::members() {
    for (const VarDecl* v : m_shader.members) {
        if (v->type.handle() || v->type.base == Base::Lobe)
            continue;
        m_member_index[v] = int(m_program.members.size());
        Place place;
        place.text = v->type.base == Base::String;
        place.count = comps(ty(v->type)) * (v->type.array ? v->type.size : 1);
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
                                  : v->type.is(Base::Color)  ? (bindings.empty() ? "Ci" : "Oi")
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

void Lower::class_stage(const char* name, Stage& stage, Role role) {
    FunctionDecl* f = method(name);
    if (!f)
        return;
    begin_stage(stage, role, name);
    m_lit = f->name == "surface";
    for (const VarDecl* v : m_shader.members)
        declare(v);
    FunctionDecl* const begin = method("begin");
    if (begin && role != Role::Init && role != Role::Interior)
        run_method(begin);
    run_method(f);
    if (role == Role::Init)
        for (const VarDecl* v : m_shader.members)
            if (const auto it = m_member_index.find(v); it != m_member_index.end() && !v->type.array)
                stage.outputs.push_back({Output::Member, m_bind[v].var, it->second});
    if (role == Role::Displace || role == Role::Shade)
        normal_output();
    if (role == Role::Displace)
        stage.outputs.push_back({Output::Position, bind(m_sema.global("P")).var, 0});
    if (f->name == "surface") {
        m_program.Ci = bind(m_sema.global("Ci")).var;
        m_program.Oi = bind(m_sema.global("Oi")).var;
        unset_color();
    }
    for (const auto& [channel, var] : std::map<int, int>(m_channel_vars.begin(), m_channel_vars.end()))
        stage.outputs.push_back({Output::Slot, var, channel});
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
    statement(m_shader.body);
    if (!displaces)
        unset_color();
    if (displaces)
        stage.outputs.push_back({Output::Position, bind(m_sema.global("P")).var, 0});
    normal_output();
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
        class_stage(method("mnk_displacement") ? "mnk_displacement" : "displacement", m_program.displace,
                    Role::Displace);
        class_stage(method("mnk_prelighting") ? "mnk_prelighting" : "surface", m_program.shade, Role::Shade);
        break;
    case ShaderKind::Surface:
    case ShaderKind::Displacement:
        classic_stage();
        break;
    default:
        break; // lights, volumes and imagers: parameters and checks alone
    }
}

// ---- declarations and statements
// ------------------------------------------------------------------------------------

void Lower::declare(const VarDecl* v) {
    if (v->type.handle()) {
        m_bind[v].kind = Binding::Handle;
        if (v->init)
            expr(v->init);
        return;
    }
    if (v->type.base == Base::Lobe)
        return bind_lobe(v, v->init);
    if (v->is_extern)
        return;
    Binding b;
    b.kind = Binding::Variable;
    b.var = m_b.var(std::string(v->name), ty(v->type), v->loc, v->type.array ? std::max(1, v->type.size) : 0);
    m_b.stage().vars[b.var].must_be_uniform = v->detail == Detail::Uniform;
    ast::Type element = v->type;
    element.array = false;
    // The initial value is computed before the variable comes to life: float x = x is the outer x.
    const bool list = v->init && v->init->kind == ExprKind::List;
    Ref value = ir::None;
    if (v->init && !list && !v->init->type.array)
        value = expr_as(v->init, element);
    m_b.declare(b.var);
    if (v->kind == VarDecl::Member && !v->init && !v->type.array) {
        value = m_b.leaf(Op::Member, ty(v->type), m_member_index[v]);
    } else if (v->type.array) {
        if (v->init)
            assign_array(b.var, v->init, v->type, v->loc);
        m_bind[v] = b;
        return;
    }
    store_tagged(b.var, value != ir::None ? value : zero(ty(v->type)), v->loc);
    m_bind[v] = b;
}

void Lower::jump(int target, Loc at) {
    Item i{Item::Jump};
    i.target = target;
    i.loc = at;
    m_b.item(i);
}

void Lower::branch(Ref c, const Stmt* yes, const Stmt* no, Loc at) {
    if (m_b.is_const(c)) {
        statement(m_b.at(c).floats[0] != 0 ? yes : no);
        return;
    }
    Item i{Item::If};
    i.ref = c;
    i.loc = at;
    i.body = in_block([&] { statement(yes); });
    i.orelse = in_block([&] { statement(no); });
    m_b.item(i);
}

// scope L { loop { if (!condition) jump L; scope N { body } step } }: break jumps to the end of L, continue
// to that of N.
void Lower::loop(const Stmt* s) {
    statement(s->first);
    if (s->init)
        expr(s->init);
    const LoopTargets targets{m_b.stage().targets, m_b.stage().targets + 1};
    m_b.stage().targets += 2;
    Item outer{Item::Scope};
    outer.target = targets.leave;
    outer.loc = s->loc;
    outer.body = in_block([&] {
        Item forever{Item::Loop};
        forever.loc = s->loc;
        forever.body = in_block([&] {
            if (s->expr) {
                Item leave{Item::If};
                const Ref c = condition(s->expr);
                leave.ref = m_b.emit(Op::Not, Ty::Bool, {c}, s->loc);
                leave.loc = s->expr->loc;
                if (m_b.is_const(leave.ref)) {
                    if (m_b.at(leave.ref).floats[0] != 0)
                        jump(targets.leave, s->loc);
                } else {
                    leave.body = in_block([&] { jump(targets.leave, s->loc); });
                    leave.orelse = m_b.stage().block();
                    m_b.item(leave);
                }
            }
            Item inner{Item::Scope};
            inner.target = targets.next;
            inner.loc = s->loc;
            m_loops.push_back(targets);
            inner.body = in_block([&] { statement(s->body); });
            m_loops.pop_back();
            m_b.item(inner);
            if (s->step)
                expr(s->step);
        });
        m_b.item(forever);
    });
    m_b.item(outer);
}

void Lower::statement(const Stmt* s) {
    if (!s || m_overflow)
        return;
    if (m_b.stage().instrs.size() > MaxInstructions) {
        m_overflow = true;
        m_diagnostics.error(s->loc,
                            "the shader grows beyond 4 million operations when its functions are inlined");
        return;
    }
    switch (s->kind) {
    case StmtKind::Empty:
    case StmtKind::Function:
        return;
    case StmtKind::Block:
        for (const Stmt* b : s->block)
            statement(b);
        return;
    case StmtKind::Declare:
        for (const VarDecl* v : s->vars)
            declare(v);
        return;
    case StmtKind::Expression:
        expr(s->expr);
        return;
    case StmtKind::If:
        branch(condition(s->expr), s->body, s->orelse, s->loc);
        return;
    case StmtKind::While:
    case StmtKind::For:
        loop(s);
        return;
    case StmtKind::Break:
    case StmtKind::Continue: {
        if (m_loops.size() < size_t(s->levels))
            return;
        const LoopTargets& t = m_loops[m_loops.size() - size_t(s->levels)];
        jump(s->kind == StmtKind::Break ? t.leave : t.next, s->loc);
        return;
    }
    case StmtKind::Return: {
        if (m_returns.empty()) {
            m_diagnostics.error(s->loc,
                                "return belongs into a function; in a shader, put the rest into an if");
            return;
        }
        const Return r = m_returns.back();
        if (s->expr && r.var >= 0)
            m_b.store(r.var, expr_as(s->expr, m_active.back()->result), s->loc);
        jump(r.target, s->loc);
        return;
    }
    case StmtKind::Illuminance:
        illuminance(s);
        return;
    case StmtKind::Gather:
        gather(s);
        return;
    case StmtKind::Illuminate:
    case StmtKind::Solar:
        m_diagnostics.error(s->loc, "illuminate and solar belong into light shaders");
        return;
    }
}

} // namespace kanuka::sl::ir
