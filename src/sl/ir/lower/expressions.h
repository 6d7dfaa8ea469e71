// Expressions: operators, conversions, names, components.
#pragma once

#include "sl/ir/lower/lowerer.h"

namespace kanuka::sl::ir {

class ExpressionLowerer : public Lowerer {
  public:
    using Lowerer::Lowerer;
    Ref expr(const ast::Expr* e);
    Ref convert(Ref value, const ast::Type& to, Loc at);
    Ref condition(const ast::Expr* e) { return truth(expr(e)); }
    Ref truth(Ref value);
    Ref arithmetic(ast::BinOp op, Ref a, const ast::Type& ta, Ref b, const ast::Type& tb,
                   const ast::Type& result, Loc at);
    Ref element_of_matrix(const ast::Expr* e);

  private:
    Ref name(const ast::Expr* e);
    Ref index(const ast::Expr* e);
    Ref unary(const ast::Expr* e);
    Ref binary(const ast::Expr* e);
    Ref ternary(const ast::Expr* e);
    Ref tuple(const ast::Expr* e);
    Ref in_space(Ref value, const ast::Type& type, const ast::Expr* space, Loc at);
    Ref equality(ast::BinOp op, Ref a, const ast::Type& ta, Ref b, const ast::Type& tb, Loc at);
    Ref comparison(ast::BinOp op, Ref a, Ref b, Loc at);
};

} // namespace kanuka::sl::ir
