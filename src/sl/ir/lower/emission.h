// Light shaders: what they send to a point Ps, and from where. illuminate and solar say the form of the
// light; a light with neither shines from everywhere.
#pragma once

#include "sl/ir/lower/lowerer.h"

namespace kanuka::sl::ir {

class EmissionLowerer : public Lowerer {
  public:
    using Lowerer::Lowerer;
    void begin();
    void outputs(Stage& stage);
    void emission(const ast::Stmt* s);

  private:
    bool fits(const ast::Stmt* s, size_t args);
    Ref in_cone(Ref L, Ref axis, Ref angle, Loc at);

    int m_vars[int(Emission::Count)] = {};
};

} // namespace kanuka::sl::ir
