// Recursive descent over RSL: RISpec 3.2, section 16 and appendix B, and the class form of RSL 2.0.
#pragma once

#include <unordered_map>
#include <unordered_set>

#include "sl/parse/ast.h"
#include "sl/parse/token.h"

namespace kanuka::sl {

class Parser {
  public:
    Parser(const std::vector<Token>& tokens, ast::Arena& arena, Diagnostics& diagnostics)
        : m_tokens(tokens), m_arena(arena), m_diagnostics(diagnostics) {}

    ast::Unit unit();
    ast::FunctionDecl* function_alone(); // a shadeop's own source

  private:
    struct Failure {}; // thrown after a diagnostic; caught where parsing can go on
    struct Specifiers {
        ast::Type type;
        ast::Detail detail = ast::Detail::Unspecified;
        bool output = false, is_extern = false, is_public = false;
        Loc loc;
    };

    // parser.cpp
    void top_level(ast::Unit& unit);
    bool at_shader() const;
    ast::ShaderDecl* shader();
    void class_body(ast::ShaderDecl& shader);
    void builtin_structs();
    void recover();
    static bool is_keyword(std::string_view s);

    // parser_declarations.cpp
    ast::FunctionDecl* function(const Specifiers& result);
    ast::StructDecl* structure();
    std::vector<ast::VarDecl*> formals(ast::VarDecl::Kind kind);
    ast::VarDecl* declarator(const Specifiers& s, ast::VarDecl::Kind kind);
    bool at_type(size_t offset = 0) const;
    ast::Type type_named(std::string_view word) const;
    bool at_specifier(size_t offset = 0) const;
    bool at_type_as_name(size_t offset = 0) const;
    bool at_declaration() const;
    Specifiers specifiers(bool need_type = true);
    ast::Type type_name();
    ast::Stmt* declaration(const Specifiers& s, ast::VarDecl::Kind kind, std::vector<ast::VarDecl*>* into);

    // parser_statements.cpp
    ast::Stmt* statement();
    ast::Stmt* block();
    ast::Stmt* light_statement(ast::StmtKind kind);
    ast::Expr* sequence();
    ast::Stmt* jump(ast::StmtKind kind);

    // parser_expr.cpp
    ast::Expr* expression();
    ast::Expr* ternary();
    ast::Expr* binary(int level);
    ast::Expr* unary();
    ast::Expr* postfix();
    ast::Expr* primary();
    ast::Expr* typed();
    ast::Expr* in_space(const ast::Type& type);
    std::vector<ast::Expr*> arguments();

    const Token& peek(size_t offset = 0) const {
        return m_tokens[std::min(m_pos + offset, m_tokens.size() - 1)];
    }
    Token next() {
        const Token t = peek();
        if (m_pos + 1 < m_tokens.size())
            m_pos++;
        return t;
    }
    bool accept(std::string_view s) {
        if (!peek().is(s))
            return false;
        next();
        return true;
    }
    Token expect(std::string_view s, const char* where);
    Token identifier(const char* what);
    [[noreturn]] void fail(const Token& found, const std::string& expected);
    static std::string describe(const Token& t);

    // Sources nest no deeper than this: a guard for the machine's stack.
    static constexpr int MaxDepth = 600;
    struct Nesting {
        Parser& parser;
        explicit Nesting(Parser& p) : parser(p) {
            if (++p.m_depth > MaxDepth) {
                p.m_depth--;
                p.fail(p.peek(),
                       "simpler nesting here: more than " + std::to_string(MaxDepth) + " levels deep");
            }
        }
        ~Nesting() { parser.m_depth--; }
    };

    const std::vector<Token>& m_tokens;
    ast::Arena& m_arena;
    Diagnostics& m_diagnostics;
    size_t m_pos = 0;
    int m_depth = 0;
    std::unordered_map<std::string_view, ast::StructDecl*> m_structs;
    std::unordered_set<std::string_view> m_type_names; // types' names that name variables in this file
};

} // namespace kanuka::sl
