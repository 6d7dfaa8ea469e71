// Calls of functions: they are inlined, for RSL has no recursion.
#pragma once

#include "sl/ir/lower/lowerer.h"

namespace kanuka::sl::ir {

class FunctionLowerer : public Lowerer {
  public:
    using Lowerer::Lowerer;
    // What formals stand for; of outputs that are no plain variables a copy, which goes back after the call.
    using Bindings = std::vector<std::pair<const ast::VarDecl*, Binding>>;
    using Copies = std::vector<std::pair<const ast::Expr*, int>>;

    Ref call(const ast::Expr* e);
    Ref struct_call(const ast::Expr* e);
    Ref inline_function(ast::FunctionDecl* f, const std::vector<const ast::Expr*>& args, Loc at);
    Ref inline_with(ast::FunctionDecl* f, std::vector<Binding> bindings, Loc at);
    Ref inline_values(ast::FunctionDecl* f, const std::vector<Ref>& args, Loc at);
    Ref inline_placed(ast::FunctionDecl* f, Bindings bindings, Loc at);
    Ref inline_bound(ast::FunctionDecl* f, Bindings bindings, const Copies& copies, Loc at);
    void bind_formal(const ast::VarDecl* formal, const ast::Expr* a, Bindings& bindings, Copies& copies);
    // A shadeop that is written in RSL, of these arguments.
    Ref source_call(const char* shadeop, std::vector<Ref> args, Loc at, Ty result = Ty::Triple);
    // A stage's: its formals are the stage's own outputs and handles.
    void run_method(ast::FunctionDecl* f);

  private:
    void bind_struct(const ast::VarDecl* formal, const ast::Expr* a, Bindings& bindings, Copies& copies);
    Ref inline_body(ast::FunctionDecl* f, Bindings bindings, Loc at);
    Ref scoped_body(ast::FunctionDecl* f, Ty result, Loc at);
    Ref plain_body(ast::FunctionDecl* f);
    bool returns_early(const ast::FunctionDecl* f);

    std::unordered_map<const ast::FunctionDecl*, bool> m_early;
};

} // namespace kanuka::sl::ir
