// push(), pop() and their kin.
#pragma once

#include "sl/ir/lower/lowerer.h"

namespace kanuka::sl::ir {

class ArrayLowerer : public Lowerer {
  public:
    using Lowerer::Lowerer;
    void begin_stage() { m_pushes.clear(); }
    void end_stage();
    Ref array_op(const ast::Expr* e, ops::Special what);

  private:
    Ref struct_array_op(const ast::Expr* e, ops::Special what);
    int room(const Binding& array);
    Ref length(const Binding& array, Loc at);
    void push(const Binding& array, const ast::Expr* what, const ast::Type& element, Loc at);
    Ref pop(const Binding& array, Ty element, Loc at);
    void resize(const Binding& array, const ast::Expr* length, bool set, Loc at);

    struct Push {
        int var, fault;
    };
    std::vector<Push> m_pushes; // their faults say how much room there is, which is known at the stage's end
};

} // namespace kanuka::sl::ir
