// texture() and environment().
#pragma once

#include "sl/ir/lower/lowerer.h"

namespace kanuka::sl::ir {

class TextureLowerer : public Lowerer {
  public:
    using Lowerer::Lowerer;
    Ref texture(const ast::Expr* e, const ops::Signature& s);

  private:
    std::vector<Ref> coordinates(const ast::Expr* e, bool environment);
    void place(CallSite& site, const std::vector<Ref>& where);
    void options(CallSite& site, const ast::Expr* e);
};

} // namespace kanuka::sl::ir
