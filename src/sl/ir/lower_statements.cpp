// Statements: control flow becomes items of the program that is built.
#include "sl/ir/lower.h"

namespace kanuka::sl::ir {

using namespace ast;

static constexpr size_t MaxInstructions = size_t(1) << 22;

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
// The body once: continue leaves what is in it.
void Lower::pass(const LoopTargets& targets, Loc at, const std::function<void()>& body) {
    Item inner{Item::Scope};
    inner.target = targets.next;
    inner.loc = at;
    m_loops.push_back(targets);
    inner.body = in_block(body);
    m_loops.pop_back();
    m_b.item(inner);
}

void Lower::run_loop(Loc at, const std::function<Ref()>& condition_value, const std::function<void()>& body,
                     const std::function<void()>& step) {
    const LoopTargets targets{m_b.stage().targets, m_b.stage().targets + 1};
    m_b.stage().targets += 2;
    m_loop_depth++;
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
    m_loop_depth--;
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

void Lower::loop(const Stmt* s) {
    const int outer = m_trips, own = trips_of(s);
    m_trips = int(std::min<int64_t>(int64_t(outer) * own, 65536));
    m_known_loops++;
    run_for(s);
    m_known_loops--;
    m_trips = outer;
}

void Lower::run_for(const Stmt* s) {
    statement(s->first);
    if (s->init)
        expr(s->init);
    std::function<Ref()> test;
    std::function<void()> step;
    if (s->expr)
        test = [&] { return condition(s->expr); };
    if (s->step)
        step = [&] { expr(s->step); };
    run_loop(s->loc, test, [&] { statement(s->body); }, step);
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
        if (m_returns.empty())
            return;
        const Return r = m_returns.back();
        if (s->expr && !m_active.empty() && m_active.back()->result.base == Base::Struct)
            assign_struct(m_active.back()->result_fields->fields, s->expr, s->loc);
        else if (s->expr && r.var >= 0)
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
        emission(s);
        return;
    }
}

} // namespace kanuka::sl::ir
