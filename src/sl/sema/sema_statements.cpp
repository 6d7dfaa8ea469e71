// Declarations and statements.
#include <cmath>
#include <limits>

#include "sl/sema/sema.h"

namespace kanuka::sl {

using namespace ast;

void Sema::resolve_size(VarDecl* v) {
    if (!v->size)
        return;
    expr(v->size);
    // Constant, or a sum or product of constants.
    const auto value = [](auto& self, const Expr* e) -> double {
        if (e->kind == ExprKind::Number)
            return e->number;
        if (e->kind == ExprKind::Cast && e->args.size() == 1)
            return self(self, e->args[0]);
        if (e->kind == ExprKind::Binary && e->args.size() == 2) {
            const double a = self(self, e->args[0]), b = self(self, e->args[1]);
            switch (e->op) {
            case BinOp::Add:
                return a + b;
            case BinOp::Sub:
                return a - b;
            case BinOp::Mul:
                return a * b;
            case BinOp::Div:
                return b != 0 ? a / b : 0;
            default:
                break;
            }
        }
        return std::numeric_limits<double>::quiet_NaN();
    };
    const double n = value(value, v->size);
    if (std::isnan(n) && v->kind == VarDecl::Local && v->size->type.is(Base::Float)) {
        v->resizable = true; // as long as the run time says
        return;
    }
    if (!(n >= 1 && n <= 65536))
        m_diagnostics.error(v->size->loc, "an array's size must be a constant from 1 to 65536");
    v->type.size = n >= 1 && n <= 65536 ? int(n) : 1;
}

void Sema::variable(VarDecl* v) {
    resolve_size(v);
    if (v->type.base == Base::Void)
        m_diagnostics.error(v->loc, "a variable cannot be void");
    v->resizable = v->type.array && v->type.size == 0 && v->kind != VarDecl::Formal;
    make_fields(v);
    if (v->init) {
        const ast::Type t = expr(v->init, &v->type);
        if (v->type.array) {
            if (v->init->kind == ExprKind::List) {
                const int given = int(v->init->args.size());
                if (v->type.size == 0)
                    v->type.size = given;
                if (given > v->type.size)
                    m_diagnostics.warning(v->init->loc, std::to_string(given) + " values for an array of " +
                                                            std::to_string(v->type.size) +
                                                            "; the last are left out");
            } else if (!t.array && t.base != Base::Error) {
                ast::Type element = v->type;
                element.array = false;
                want(v->init, element, "array \"" + std::string(v->name) + "\"");
            } else if (t.array && v->type.size == 0) {
                v->type.size = t.size;
            }
        } else {
            want(v->init, v->type, "variable \"" + std::string(v->name) + "\"");
        }
        v->written = true;
    }
    declare(v);
}

void Sema::condition(Expr* e) {
    const ast::Type t = expr(e);
    if (t.base != Base::Error && !is_condition(t))
        m_diagnostics.error(e->loc, "a condition must be a comparison or a float, found " + t.str());
}

// while, for
void Sema::loop(Stmt* s) {
    push();
    statement(s->first);
    if (s->init)
        expr(s->init);
    if (s->expr)
        condition(s->expr);
    m_loops++;
    statement(s->body);
    m_loops--;
    if (s->step)
        expr(s->step);
    pop();
}

// break, continue
void Sema::jump(Stmt* s) {
    const char* word = s->kind == StmtKind::Break ? "break" : "continue";
    if (m_loops == 0)
        m_diagnostics.error(s->loc, std::string(word) + " outside of a loop");
    else if (s->levels < 1 || s->levels > m_loops)
        m_diagnostics.error(s->loc, std::string(word) + " " + std::to_string(s->levels) + " inside of " +
                                        std::to_string(m_loops) + " loops");
}

void Sema::return_statement(Stmt* s) {
    if (!m_function) {
        if (s->expr)
            m_diagnostics.error(s->loc, "a shader returns no value");
    } else if (s->expr) {
        expr(s->expr, &m_function->result);
        if (m_function->result.is(Base::Void))
            m_diagnostics.error(s->loc, "function \"" + std::string(m_function->name) +
                                            "\" is void: it returns no value");
        else
            want(s->expr, m_function->result, "the result of \"" + std::string(m_function->name) + "\"");
    } else if (!m_function->result.is(Base::Void)) {
        m_diagnostics.warning(s->loc, "function \"" + std::string(m_function->name) + "\" must return a " +
                                          m_function->result.str());
    }
}

// illuminance, illuminate, solar, gather
void Sema::light_statement(Stmt* s) {
    // After the strings in a gather or illuminance come variables that it sets.
    for (size_t i = 0; i < s->args.size(); i++) {
        Expr* a = s->args[i];
        if (i > 0 && s->args[i - 1]->kind == ExprKind::String && a->kind == ExprKind::Name)
            if (VarDecl* v = find(a->text))
                v->written = v->assigned = true;
        expr(a);
    }
    m_loops++;
    statement(s->body);
    m_loops--;
    statement(s->orelse);
}

void Sema::statement(Stmt* s) {
    if (!s)
        return;
    switch (s->kind) {
    case StmtKind::Empty:
        return;
    case StmtKind::Block:
        push();
        for (Stmt* b : s->block)
            statement(b);
        return pop();
    case StmtKind::Declare:
        for (VarDecl* v : s->vars)
            variable(v);
        return;
    case StmtKind::Expression:
        expr(s->expr);
        return;
    case StmtKind::If:
        condition(s->expr);
        statement(s->body);
        return statement(s->orelse);
    case StmtKind::While:
    case StmtKind::For:
        return loop(s);
    case StmtKind::Break:
    case StmtKind::Continue:
        return jump(s);
    case StmtKind::Return:
        return return_statement(s);
    case StmtKind::Illuminance:
    case StmtKind::Illuminate:
    case StmtKind::Solar:
    case StmtKind::Gather:
        return light_statement(s);
    case StmtKind::Function:
        declare(s->function);
        return check_function(s->function);
    }
}

} // namespace kanuka::sl
