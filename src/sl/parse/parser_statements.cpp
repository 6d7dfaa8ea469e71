// Statements and blocks.
#include "sl/parse/parser.h"

namespace kanuka::sl {

using namespace ast;

Stmt* Parser::block() {
    const Token open = expect("{", "to begin a block");
    Stmt* b = m_arena.stmt(StmtKind::Block, open.loc);
    while (!peek().is("}")) {
        if (peek().kind == Token::End)
            fail(peek(), "\"}\" for the block that begins in line " + std::to_string(open.loc.line));
        const size_t before = m_pos;
        try {
            if (Stmt* s = statement())
                b->block.push_back(s);
        } catch (const Failure&) {
            recover();
            if (m_pos == before)
                next();
        }
    }
    next();
    return b;
}

Stmt* Parser::light_statement(StmtKind kind) {
    Stmt* s = m_arena.stmt(kind, next().loc);
    s->args = arguments();
    s->body = statement();
    if (kind == StmtKind::Gather && accept("else"))
        s->orelse = statement();
    return s;
}

// a, b, …: in a for statement
Expr* Parser::sequence() {
    Expr* first = expression();
    if (!peek().is(","))
        return first;
    Expr* e = m_arena.expr(ExprKind::Sequence, first->loc);
    e->args = {first};
    while (accept(","))
        e->args.push_back(expression());
    return e;
}

Stmt* Parser::jump(StmtKind kind) {
    Stmt* s = m_arena.stmt(kind, next().loc);
    if (kind == StmtKind::Return) {
        if (!peek().is(";"))
            s->expr = expression();
    } else if (peek().kind == Token::Number) {
        s->levels = int(next().number);
    }
    expect(";", kind == StmtKind::Return ? "after return" : "after break or continue");
    return s;
}

Stmt* Parser::statement() {
    const Nesting nesting(*this);
    const Token& t = peek();
    if (t.is("{"))
        return block();
    if (accept(";"))
        return nullptr;
    if (t.is("if")) {
        Stmt* s = m_arena.stmt(StmtKind::If, next().loc);
        expect("(", "after if");
        s->expr = expression();
        expect(")", "after the condition");
        s->body = statement();
        if (accept("else"))
            s->orelse = statement();
        return s;
    }
    if (t.is("while")) {
        Stmt* s = m_arena.stmt(StmtKind::While, next().loc);
        expect("(", "after while");
        s->expr = expression();
        expect(")", "after the condition");
        s->body = statement();
        return s;
    }
    if (t.is("for")) {
        Stmt* s = m_arena.stmt(StmtKind::For, next().loc);
        expect("(", "after for");
        if (at_declaration())
            s->first = declaration(specifiers(), VarDecl::Local, nullptr);
        else {
            if (!peek().is(";"))
                s->init = sequence();
            expect(";", "after the loop's initialisation");
        }
        if (!peek().is(";"))
            s->expr = expression();
        expect(";", "after the loop's condition");
        if (!peek().is(")"))
            s->step = sequence();
        expect(")", "after the loop's step");
        s->body = statement();
        return s;
    }
    if (t.is("break"))
        return jump(StmtKind::Break);
    if (t.is("continue"))
        return jump(StmtKind::Continue);
    if (t.is("return"))
        return jump(StmtKind::Return);
    if (t.is("illuminance") && peek(1).is("("))
        return light_statement(StmtKind::Illuminance);
    if (t.is("gather") && peek(1).is("("))
        return light_statement(StmtKind::Gather);
    if (t.is("illuminate") && peek(1).is("("))
        return light_statement(StmtKind::Illuminate);
    if (t.is("solar") && peek(1).is("("))
        return light_statement(StmtKind::Solar);
    if (at_declaration()) {
        const Specifiers s = specifiers();
        if (peek(1).is("(") && !is_keyword(peek().text)) {
            Stmt* f = m_arena.stmt(StmtKind::Function, s.loc);
            f->function = function(s);
            return f->function ? f : nullptr;
        }
        return declaration(s, VarDecl::Local, nullptr);
    }
    Stmt* s = m_arena.stmt(StmtKind::Expression, t.loc);
    s->expr = sequence();
    expect(";", "after the statement");
    return s;
}

} // namespace kanuka::sl
