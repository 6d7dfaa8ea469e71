// Assignments: to values and their components, arrays and structs.
#pragma once

#include "sl/ir/lower/lowerer.h"

namespace kanuka::sl::ir {

class AssignmentLowerer : public Lowerer {
  public:
    using Lowerer::Lowerer;
    Ref assign(const ast::Expr* e);
    void assign_to(const ast::Expr* target, Ref value, Loc at);
    void assign_array(const Binding& to, const ast::Expr* value, const ast::Type& type, Loc at);
    void assign_struct(const std::vector<ast::VarDecl*>& fields, const ast::Expr* value, Loc at);
    void copy_fields(const std::vector<ast::VarDecl*>& to, const std::vector<ast::VarDecl*>& from, Loc at);

  private:
    void construct_struct(const std::vector<ast::VarDecl*>& fields, const ast::Expr* value, Loc at);
    void assign_struct_element(const ast::Expr* target, const ast::Expr* from, Loc at);
};

} // namespace kanuka::sl::ir
