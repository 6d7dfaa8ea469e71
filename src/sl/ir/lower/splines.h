// spline() and its inverse.
#pragma once

#include "sl/ir/lower/lowerer.h"

namespace kanuka::sl::ir {

class SplineLowerer : public Lowerer {
  public:
    using Lowerer::Lowerer;
    Ref spline(const ast::Expr* e, const ops::Signature& s);

  private:
    bool values_of(const ast::Expr* e, size_t first, const ast::Type& element, Binding& values);
    Ref named(std::string_view basis, Ref x, const Binding& values, Ty t, Loc basis_at, Loc at);
    Ref solve(const ops::SplineBasis& basis, Ref x, const Binding& values, Ty t, Loc at);
    Ref value_at(const ops::SplineBasis& basis, Ref x, const Binding& values, Ty t, Loc at);
};

} // namespace kanuka::sl::ir
