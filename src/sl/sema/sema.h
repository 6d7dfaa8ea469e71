// Meaning: which declaration every name stands for, which type every expression has, which overload a call
// takes. Annotates the tree in place. Whether values are uniform or varying is not decided here but on the
// IR, where functions are inlined and all assignments are known.
#pragma once

#include <deque>
#include <map>
#include <unordered_map>

#include "sl/ops/shadeops.h"
#include "sl/parse/ast.h"
#include "sl/parse/token.h"

namespace kanuka::sl {

struct Linked;

class Sema {
  public:
    Sema(ast::Arena& arena, Diagnostics& diagnostics, Linked* linked = nullptr)
        : m_arena(arena), m_diagnostics(diagnostics), m_linked(linked) {}

    void check(ast::Unit& unit, ast::ShaderDecl& shader);
    // The variables that stand for globals which the shader uses.
    ast::VarDecl* global(std::string_view name);
    // The tree of a shadeop's own source; parsed and checked at its first use.
    ast::FunctionDecl* source(const ops::Shadeop& op, int signature);
    // Is a texture in it, whose type is that which is wanted?
    static bool asks_texture(const ast::Expr* e);
    // What the shader asks of co-shaders; after check().
    CoShaderUse coshader_use() const { return m_use; }
    Linked* linked() const { return m_linked; }

  private:
    struct Scope {
        Scope* parent = nullptr;
        std::unordered_map<std::string_view, ast::VarDecl*> vars;
        std::unordered_map<std::string_view, std::vector<ast::FunctionDecl*>> functions;
    };
    struct Candidate {
        ast::FunctionDecl* function = nullptr;
        int signature = -1;
        int cost = 0;
    };

    // sema.cpp: scopes, shaders, functions
    Scope* push();
    void pop() { m_scope = m_scope->parent; }
    void declare(ast::VarDecl* v);
    void declare(ast::FunctionDecl* f);
    void check_function(ast::FunctionDecl* f);
    void check_stages(ast::ShaderDecl& shader);
    void warn_unused(const ast::ShaderDecl& shader);
    void make_fields(ast::VarDecl* v);
    void check_struct(const ast::StructDecl* record);
    ast::VarDecl* find(std::string_view name);

    // sema_statements.cpp
    void resolve_size(ast::VarDecl* v);
    void variable(ast::VarDecl* v);
    void condition(ast::Expr* e);
    void statement(ast::Stmt* s);
    void loop(ast::Stmt* s);
    void jump(ast::Stmt* s);
    void return_statement(ast::Stmt* s);
    void light_statement(ast::Stmt* s);

    // sema_expr.cpp
    ast::Type expr(ast::Expr* e, const ast::Type* expected = nullptr);
    ast::Type expr_kind(ast::Expr* e, const ast::Type* expected);
    ast::Type name(ast::Expr* e, bool reading);
    ast::Type index(ast::Expr* e);
    ast::Type member(ast::Expr* e, const ast::Type* expected);
    ast::Type cast(ast::Expr* e);
    ast::Type tuple(ast::Expr* e, const ast::Type* expected);
    ast::Type list(ast::Expr* e, const ast::Type* expected);
    void want(ast::Expr* e, const ast::Type& to, const std::string& where);

    // sema_operators.cpp
    ast::Type unary(ast::Expr* e, const ast::Type* expected);
    ast::Type binary(ast::Expr* e, const ast::Type* expected);
    ast::Type beside(ast::Expr* open, const ast::Type& other, ast::BinOp op, bool right,
                     const ast::Type* whole);
    ast::Type arithmetic(Loc at, ast::BinOp op, const ast::Type& a, const ast::Type& b);
    ast::Type ternary(ast::Expr* e, const ast::Type* expected);
    ast::Type assign(ast::Expr* e);

    // sema_coshaders.cpp
    ast::Type coshader(ast::Expr* e, const ast::Type* expected);
    void note_use(CoShaderUse use) { m_use = std::max(m_use, use); }

    // sema_calls.cpp
    ast::Type call(ast::Expr* e, const ast::Type* expected);
    void choose(ast::Expr* e, std::span<const std::string_view> choices, std::string_view input);
    ast::Type construct(ast::Expr* e);
    ast::Type construct_struct(ast::Expr* e);
    ast::FunctionDecl* choose(ast::Expr* e, const std::vector<ast::FunctionDecl*>& candidates,
                              const ast::Type* expected);
    ast::Type no_function(ast::Expr* e, const std::vector<ast::FunctionDecl*>& candidates);
    ast::Type call_shadeop(ast::Expr* e, const ops::Shadeop& op, const ast::Type* expected);
    bool check_arguments(ast::Expr* e, const ops::Shadeop& op, const ast::Type* expected);
    void no_signature(const ast::Expr* e, const ops::Shadeop& op);
    void written(ast::Expr* e, const std::string& by);
    std::vector<ast::FunctionDecl*> find_functions(std::string_view name);

    ast::Arena& m_arena;
    Diagnostics& m_diagnostics;
    Linked* m_linked; // null = no co-shaders are known
    CoShaderUse m_use = CoShaderUse::None;
    std::deque<Scope> m_scopes;
    Scope* m_scope = nullptr;
    Scope* m_root = nullptr;
    Scope* m_shader_scope = nullptr; // of parameters and members
    ast::FunctionDecl* m_function = nullptr;
    ast::ShaderDecl* m_shader = nullptr;
    std::unordered_map<std::string_view, ast::VarDecl*> m_globals;
    std::map<std::pair<const ops::Shadeop*, int>, ast::FunctionDecl*> m_sources;
    std::deque<std::vector<Token>> m_source_tokens;
    std::unordered_map<const ast::StructDecl*, Scope*> m_struct_scopes;
    bool m_plugins = false;
    int m_loops = 0;
    int m_depth = 0;
};

// Cost of an implicit conversion: 0 = none needed, negative = there is none. From Doubtful on it is done with
// a warning: compilers of the trade let a point be a color.
inline constexpr int Doubtful = 12;
int conversion_cost(const ast::Type& from, const ast::Type& to);
bool is_condition(const ast::Type& t);
bool is_text(const ast::Type& t); // a string, or a shader by its handle
bool castable(const ast::Type& from, const ast::Type& to);

} // namespace kanuka::sl
