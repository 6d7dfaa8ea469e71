#include "sl/parse/parser.h"

namespace kanuka::sl {

using namespace ast;

std::string_view ast::spelling(BinOp op) {
    static constexpr std::string_view Names[] = {
        "+", "-", "*", "/", ".", "^", "<", "<=", ">", ">=", "==", "!=", "&&", "||", "="};
    return Names[int(op)];
}

std::string ast::Type::str() const {
    static constexpr std::string_view Names[] = {"error",
                                                 "void",
                                                 "bool",
                                                 "float",
                                                 "color",
                                                 "point",
                                                 "vector",
                                                 "normal",
                                                 "matrix",
                                                 "string",
                                                 "shader",
                                                 "struct",
                                                 "lobe",
                                                 "MnkMaterial",
                                                 "MnkMaterialBoundary",
                                                 "MnkMaterialInterior",
                                                 "MnkObjectProperties"};
    std::string s(base == Base::Lobe               ? grid::lobe(lobe).name
                  : base == Base::Struct && record ? record->name
                                                   : Names[int(base)]);
    if (array)
        s += size > 0 ? "[" + std::to_string(size) + "]" : "[]";
    return s;
}

// Binary operators, loosest first. RISpec 3.2, appendix B: "." binds tightest, then * /, then ^, then + -.
static BinOp binary_operator(int level, const Token& t) {
    static const std::vector<std::vector<std::pair<std::string_view, BinOp>>> levels = {
        {{"||", BinOp::Or}},
        {{"&&", BinOp::And}},
        {{"==", BinOp::Eq}, {"!=", BinOp::Ne}},
        {{"<", BinOp::Lt}, {"<=", BinOp::Le}, {">", BinOp::Gt}, {">=", BinOp::Ge}},
        {{"+", BinOp::Add}, {"-", BinOp::Sub}},
        {{"^", BinOp::Cross}},
        {{"*", BinOp::Mul}, {"/", BinOp::Div}},
        {{".", BinOp::Dot}},
    };
    if (t.kind == Token::Punctuation)
        for (const auto& [s, op] : levels[level])
            if (t.text == s)
                return op;
    return BinOp::None;
}
static constexpr int BinaryLevels = 8;

Expr* Parser::expression() {
    const Nesting nesting(*this);
    Expr* left = ternary();
    static constexpr std::pair<std::string_view, BinOp> Assignments[] = {
        {"=", BinOp::None}, {"+=", BinOp::Add},   {"-=", BinOp::Sub}, {"*=", BinOp::Mul},
        {"/=", BinOp::Div}, {"^=", BinOp::Cross}, {".=", BinOp::Dot}};
    for (const auto& [s, op] : Assignments) {
        if (!peek().is(s))
            continue;
        const Token t = next();
        if (left->kind != ExprKind::Name && left->kind != ExprKind::Index &&
            (left->kind != ExprKind::Method || left->called)) {
            m_diagnostics.error(t.loc,
                                "cannot assign to this: expected a variable or an array element before \"" +
                                    std::string(s) + "\"");
            throw Failure{};
        }
        Expr* e = m_arena.expr(ExprKind::Assign, t.loc);
        e->op = op;
        e->args = {left, expression()};
        return e;
    }
    return left;
}

Expr* Parser::ternary() {
    Expr* condition = binary(0);
    if (!peek().is("?"))
        return condition;
    const Nesting nesting(*this);
    Expr* e = m_arena.expr(ExprKind::Ternary, next().loc);
    Expr* a = expression();
    expect(":", "between the two values of ?:");
    e->args = {condition, a, ternary()};
    return e;
}

Expr* Parser::binary(int level) {
    if (level == BinaryLevels)
        return unary();
    Expr* left = binary(level + 1);
    for (BinOp op; (op = binary_operator(level, peek())) != BinOp::None;) {
        Expr* e = m_arena.expr(ExprKind::Binary, next().loc);
        e->op = op;
        e->args = {left, binary(level + 1)};
        left = e;
    }
    return left;
}

Expr* Parser::unary() {
    const Token& t = peek();
    if (t.is("-") || t.is("!") || t.is("+")) {
        const Nesting nesting(*this);
        const Token op = next();
        Expr* operand = unary();
        if (op.is("+"))
            return operand;
        if (op.is("-") && operand->kind == ExprKind::Number) {
            operand->number = -operand->number;
            operand->loc = op.loc;
            return operand;
        }
        Expr* e = m_arena.expr(ExprKind::Unary, op.loc);
        e->negate = op.is("-");
        e->args = {operand};
        return e;
    }
    return postfix();
}

Expr* Parser::postfix() {
    Expr* e = primary();
    for (;;) {
        if (peek().is("[")) {
            Expr* index = m_arena.expr(ExprKind::Index, next().loc);
            index->args = {e, expression()};
            expect("]", "after the index");
            e = index;
        } else if (peek().is("->")) {
            const Token arrow = next();
            const Token name = identifier("a method's name after \"->\"");
            Expr* call = m_arena.expr(ExprKind::Method, arrow.loc);
            call->text = name.text;
            call->args = {e};
            call->called = peek().is("(");
            if (call->called)
                for (Expr* a : arguments())
                    call->args.push_back(a);
            e = call;
        } else if (peek().is("++") || peek().is("--")) {
            fail(peek(), "an operator that RSL has; write \"+= 1\" or \"-= 1\"");
        } else {
            return e;
        }
    }
}

std::vector<Expr*> Parser::arguments() {
    std::vector<Expr*> args;
    expect("(", "before the arguments");
    if (!peek().is(")")) {
        do
            args.push_back(expression());
        while (accept(","));
    }
    expect(")", "after the arguments, or \",\" between them");
    return args;
}

// A type in an expression: a cast (float noise(P)), a constructor (color (1, 0, 0)), with a space (point
// "world" (…)).
Expr* Parser::typed() {
    const Nesting nesting(*this);
    Detail detail = Detail::Unspecified;
    while (peek().is("uniform") || peek().is("varying"))
        detail = next().is("uniform") ? Detail::Uniform : Detail::Varying;
    const Loc loc = peek().loc;
    const ast::Type type = type_name();
    if (type.base == Base::Lobe || type.base == Base::Struct) {
        Expr* e = m_arena.expr(ExprKind::Construct, loc);
        e->type = type;
        e->text = type.base == Base::Lobe ? grid::lobe(type.lobe).name : type.record->name;
        e->args = arguments();
        return e;
    }
    Expr* e = in_space(type);
    e->loc = loc;
    e->detail = detail;
    return e;
}

// ["space"] (…) or ["space"] x, of a type that is known.
Expr* Parser::in_space(const ast::Type& type) {
    const Loc loc = peek().loc;
    Expr* space = nullptr;
    if (peek().kind == Token::String) {
        space = m_arena.expr(ExprKind::String, peek().loc);
        space->text = next().text;
    }
    if (peek().is("(")) {
        const Token open = peek();
        std::vector<Expr*> list = arguments();
        if (list.empty())
            fail(open, "a value to convert to " + type.str());
        if (list.size() > 1) {
            Expr* e = m_arena.expr(space ? ExprKind::TupleIn : ExprKind::Tuple, loc);
            e->type = type;
            if (space)
                list.insert(list.begin(), space);
            e->args = std::move(list);
            return e;
        }
        Expr* e = m_arena.expr(ExprKind::Cast, loc);
        e->type = type;
        e->args = {list[0]};
        if (space)
            e->args.push_back(space);
        return e;
    }
    Expr* e = m_arena.expr(ExprKind::Cast, loc);
    e->type = type;
    e->args = {unary()};
    if (space)
        e->args.push_back(space);
    return e;
}

Expr* Parser::primary() {
    const Token t = peek();
    if (t.kind == Token::Number) {
        Expr* e = m_arena.expr(ExprKind::Number, next().loc);
        e->number = t.number;
        return e;
    }
    if (t.kind == Token::String) {
        Expr* e = m_arena.expr(ExprKind::String, next().loc);
        e->text = t.text;
        if (peek().kind == Token::String) { // adjacent strings join, as in C
            std::string joined(t.text);
            while (peek().kind == Token::String)
                joined += next().text;
            e->text = m_diagnostics.sources().keep(std::move(joined));
        }
        return e;
    }
    if (t.is("(")) {
        // C's form of a cast: (float) x
        if (at_type(1) && peek(2).is(")")) {
            next();
            Expr* e = m_arena.expr(ExprKind::Cast, peek().loc);
            e->type = type_name();
            next();
            e->args = {unary()};
            return e;
        }
        next();
        Expr* e = expression();
        if (peek().is(",")) { // a tuple whose type the context gives: (1, 0, 0)
            Expr* tuple = m_arena.expr(ExprKind::Tuple, t.loc);
            tuple->args = {e};
            while (accept(","))
                tuple->args.push_back(expression());
            e = tuple;
        }
        expect(")", "to close \"(\"");
        return e;
    }
    if (t.is("{")) {
        Expr* e = m_arena.expr(ExprKind::List, next().loc);
        while (!peek().is("}")) {
            e->args.push_back(expression());
            if (!accept(","))
                break;
        }
        expect("}", "to close the list");
        return e;
    }
    if (at_type_as_name() && m_type_names.count(t.text)) {
        Expr* e = m_arena.expr(ExprKind::Name, next().loc);
        e->text = t.text;
        return e;
    }
    if (at_type() || t.is("uniform") || t.is("varying"))
        return typed();
    const Token name = identifier("an expression");
    Expr* e = m_arena.expr(peek().is("(") ? ExprKind::Call : ExprKind::Name, name.loc);
    e->text = name.text;
    if (e->kind == ExprKind::Call)
        e->args = arguments();
    return e;
}

} // namespace kanuka::sl
