// Questions to the host: attribute(), option(), rendererinfo(), textureinfo(); and rayinfo().
#pragma once

#include "sl/ir/lower/lowerer.h"

namespace kanuka::sl::ir {

class QueryLowerer : public Lowerer {
  public:
    using Lowerer::Lowerer;
    Ref query(const ast::Expr* e, const ops::Signature& s);
    Ref ray_info(const ast::Expr* e);

  private:
    void answer_array(const Binding& b, Ref known, Ref value, Loc at);
};

} // namespace kanuka::sl::ir
