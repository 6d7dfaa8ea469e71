// Co-shaders: the methods of those that a handle may be (handles.h) are inlined where they are called. A
// handle that is known gives plain code; one of several a chain of ifs.
#pragma once

#include <optional>
#include <set>

#include "sl/ir/lower/lowerer.h"

namespace kanuka::sl::ir {

class CoshaderLowerer : public Lowerer {
  public:
    using Lowerer::Lowerer;
    void begin_stage() { m_started.clear(); }
    void start_layers();
    // A parameter that is connected has its value before the stage begins, once the layer has run. None = it
    // is not connected.
    Binding bind_layered(const ast::VarDecl* v);

    // s->f (…), or the variable s->x. A struct that it returns goes to `fields`.
    Ref coshader(const ast::Expr* e, const std::vector<ast::VarDecl*>* fields = nullptr);
    Ref get_shader(const ast::Expr* e);
    // getshaders (): the handles, which are known. Others' arrays are empty.
    std::vector<std::string> shader_list(const ast::Expr* e);
    Ref ask_shader(const ast::Expr* e, const ops::Signature& s);

  private:
    void start(int unit);
    void run_layer(int unit);
    std::string unit_name(int unit) const;
    std::string circle(const ast::FunctionDecl* f, int unit) const;
    Ref call_method(int unit, const Linked::Target& target, Loc at);
    bool able(const ast::Expr* e, int unit);
    Ref run(const ast::Expr* e, int unit, const std::vector<ast::VarDecl*>* fields);
    void take(const ast::VarDecl* v, const ast::Expr* target, Loc at);
    std::optional<std::string> plain_text(const ast::Expr* e, const char* what);

    std::set<int> m_started; // in this stage
};

} // namespace kanuka::sl::ir
