// Variables: how they come to life, and what those are that every shader sees.
#pragma once

#include "sl/ir/lower/lowerer.h"

namespace kanuka::sl::ir {

class VariableLowerer : public Lowerer {
  public:
    using Lowerer::Lowerer;
    void declare(const ast::VarDecl* v);
    // Parameters and globals get theirs at first use.
    Binding& binding(const ast::VarDecl* v);
    Ref global(const ast::VarDecl* v, Loc at);
    Ref global(const char* name, Loc at) { return global(m_sema.global(name), at); }
    void need_room(int array, int elements);
    // A row of the matrix from shader to current space: 3 is the light's own place, 2 the axis along which it
    // looks.
    Ref shader_frame(int row, Loc at);

  private:
    void declare_array(const ast::VarDecl* v);
    Binding bind_global(const ast::VarDecl* v);
    Ref initial_value(const ast::VarDecl* v, const ops::Global& g);
};

} // namespace kanuka::sl::ir
