#include "sl/ir/lower/statements.h"

#include <algorithm>

#include "sl/ir/lower/assignments.h"
#include "sl/ir/lower/emission.h"
#include "sl/ir/lower/expressions.h"
#include "sl/ir/lower/light_loops.h"
#include "sl/ir/lower/variables.h"

namespace kanuka::sl::ir {

using namespace ast;

static constexpr size_t MaxInstructions = size_t(1) << 22;

void StatementLowerer::jump(int target, Loc at) {
    Item i{Item::Jump};
    i.target = target;
    i.loc = at;
    m_b.item(i);
}

void StatementLowerer::branch(Ref c, const Stmt* yes, const Stmt* no, Loc at) {
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

// The body once: continue leaves what is in it.
void StatementLowerer::pass(const LoopTargets& targets, Loc at, const std::function<void()>& body) {
    Item inner{Item::Scope};
    inner.target = targets.next;
    inner.loc = at;
    m_state.loops.targets.push_back(targets);
    inner.body = in_block(body);
    m_state.loops.targets.pop_back();
    m_b.item(inner);
}

// scope L { loop { if (!condition) jump L; scope N { body } step } }: break jumps to the end of L, continue
// to that of N.
void StatementLowerer::run_loop(Loc at, const std::function<Ref()>& condition_value,
                                const std::function<void()>& body, const std::function<void()>& step) {
    const LoopTargets targets{m_b.stage().targets, m_b.stage().targets + 1};
    m_b.stage().targets += 2;
    m_state.loops.depth++;
    Item outer{Item::Scope};
    outer.target = targets.leave;
    outer.loc = at;
    outer.body = in_block([&] {
        Item forever{Item::Loop};
        forever.loc = at;
        forever.fault = fault(at, "this loop does not end: it is left after " + std::to_string(LoopBudget) +
                                      " iterations of all loops over a grid, or " +
                                      std::to_string(LoopPatience) + " of its own");
        forever.body = in_block([&] {
            if (condition_value) {
                Item leave{Item::If};
                const Ref c = condition_value();
                leave.ref = m_b.emit(Op::Not, Ty::Bool, {c}, at);
                leave.loc = at;
                if (m_b.is_const(leave.ref)) {
                    if (m_b.at(leave.ref).floats[0] != 0)
                        jump(targets.leave, at);
                } else {
                    leave.body = in_block([&] { jump(targets.leave, at); });
                    leave.orelse = m_b.stage().block();
                    m_b.item(leave);
                }
            }
            pass(targets, at, body);
            if (step)
                step();
        });
        m_b.item(forever);
    });
    m_b.item(outer);
    m_state.loops.depth--;
}

void StatementLowerer::repeat(const char* counter_name, Ref count, Loc at,
                              const std::function<void(Ref)>& begin, const std::function<void()>& body,
                              Ref light) {
    const int counter = m_b.var(counter_name, Ty::Float, at);
    const LoopTargets targets{m_b.stage().targets, m_b.stage().targets + 1};
    m_b.stage().targets += 2;
    Item outer{Item::Scope};
    outer.target = targets.leave;
    outer.loc = at;
    outer.light = light;
    outer.body = in_block([&] {
        m_b.declare(counter);
        m_b.store(counter, m_b.constant(0.0f), at);
        Item forever{Item::Loop};
        forever.loc = at;
        forever.body = in_block([&] {
            const Ref now = m_b.load(counter, at);
            Item done{Item::If};
            done.ref = m_b.emit(Op::Ge, Ty::Bool, {now, count}, at);
            done.loc = at;
            done.body = in_block([&] { jump(targets.leave, at); });
            done.orelse = m_b.stage().block();
            m_b.item(done);
            begin(now);
            pass(targets, at, body);
            m_b.store(counter, m_b.emit(Op::Add, Ty::Float, {m_b.load(counter, at), m_b.constant(1.0f)}, at),
                      at);
        });
        m_b.item(forever);
    });
    m_b.item(outer);
}

// for (i = a; i < b; i += c) with constants, and a body that leaves i alone: how often it runs; 0 = who
// knows.
static int trips_of(const Stmt* s) {
    const Expr *test = s->expr, *step = s->step;
    if (s->kind != StmtKind::For || !test || !step || test->kind != ExprKind::Binary ||
        (test->op != BinOp::Lt && test->op != BinOp::Le) || test->args[0]->kind != ExprKind::Name ||
        test->args[1]->kind != ExprKind::Number || step->kind != ExprKind::Assign)
        return 0;
    const VarDecl* i = test->args[0]->var;
    const Expr* from = nullptr;
    if (s->init && s->init->kind == ExprKind::Assign && s->init->op == BinOp::None &&
        s->init->args[0]->var == i)
        from = s->init->args[1];
    if (s->first && s->first->kind == StmtKind::Declare && s->first->vars.size() == 1 &&
        s->first->vars[0] == i)
        from = i->init;
    const Expr* by = step->args[1]; // i += c, i = i + c
    if (step->op == BinOp::None && by->kind == ExprKind::Binary && by->op == BinOp::Add &&
        by->args[0]->var == i)
        by = by->args[1];
    else if (step->op != BinOp::Add)
        return 0;
    if (!i || !from || from->kind != ExprKind::Number || by->kind != ExprKind::Number || !(by->number > 0) ||
        step->args[0]->var != i)
        return 0;
    const float n = (test->args[1]->number - from->number) / by->number;
    return n >= 0 && n < 65536 ? int(n) + 1 : 0;
}

void StatementLowerer::loop(const Stmt* s) {
    const int outer = m_state.loops.trips, own = trips_of(s);
    m_state.loops.trips = int(std::min<int64_t>(int64_t(outer) * own, 65536));
    m_state.loops.known++;
    run_for(s);
    m_state.loops.known--;
    m_state.loops.trips = outer;
}

void StatementLowerer::run_for(const Stmt* s) {
    statement(s->first);
    if (s->init)
        expr(s->init);
    std::function<Ref()> test;
    std::function<void()> step;
    if (s->expr)
        test = [&] { return expressions().condition(s->expr); };
    if (s->step)
        step = [&] { expr(s->step); };
    run_loop(s->loc, test, [&] { statement(s->body); }, step);
}

void StatementLowerer::leave_loop(const Stmt* s) {
    if (m_state.loops.targets.size() < size_t(s->levels))
        return;
    const LoopTargets& t = m_state.loops.targets[m_state.loops.targets.size() - size_t(s->levels)];
    jump(s->kind == StmtKind::Break ? t.leave : t.next, s->loc);
}

void StatementLowerer::leave_function(const Stmt* s) {
    if (m_state.returns.empty())
        return;
    const ReturnTarget r = m_state.returns.back();
    const FunctionDecl* f = m_state.active.empty() ? nullptr : m_state.active.back().function;
    if (s->expr && f && f->result.base == Base::Struct)
        assignments().assign_struct(f->result_fields->fields, s->expr, s->loc);
    else if (s->expr && r.var >= 0)
        m_b.store(r.var, expr_as(s->expr, f->result), s->loc);
    jump(r.target, s->loc);
}

void StatementLowerer::statement(const Stmt* s) {
    if (!s || m_context.overflow)
        return;
    if (m_b.stage().instrs.size() > MaxInstructions) {
        m_context.overflow = true;
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
            variables().declare(v);
        return;
    case StmtKind::Expression:
        expr(s->expr);
        return;
    case StmtKind::If:
        branch(expressions().condition(s->expr), s->body, s->orelse, s->loc);
        return;
    case StmtKind::While:
    case StmtKind::For:
        loop(s);
        return;
    case StmtKind::Break:
    case StmtKind::Continue:
        return leave_loop(s);
    case StmtKind::Return:
        return leave_function(s);
    case StmtKind::Illuminance:
        light_loops().illuminance(s);
        return;
    case StmtKind::Gather:
        light_loops().gather(s);
        return;
    case StmtKind::Illuminate:
    case StmtKind::Solar:
        emission().emission(s);
        return;
    }
}

} // namespace kanuka::sl::ir
