// Statements: control flow becomes items of the program that is built.
#pragma once

#include <functional>

#include "sl/ir/lower/lowerer.h"

namespace kanuka::sl::ir {

class StatementLowerer : public Lowerer {
  public:
    using Lowerer::Lowerer;
    void statement(const ast::Stmt* s);
    // counter = 0; scope leave { loop { if (counter >= count) leave; begin(counter); scope next { body }
    // counter
    // += 1 } }. light: what of it the loop samples, if it does.
    void repeat(const char* counter_name, Ref count, Loc at, const std::function<void(Ref)>& begin,
                const std::function<void()>& body, Ref light = ir::None);

  private:
    void branch(Ref condition, const ast::Stmt* yes, const ast::Stmt* no, Loc at);
    void loop(const ast::Stmt* s);
    void run_for(const ast::Stmt* s);
    void run_loop(Loc at, const std::function<Ref()>& condition_value, const std::function<void()>& body,
                  const std::function<void()>& step);
    void pass(const LoopTargets& targets, Loc at, const std::function<void()>& body);
    void leave_loop(const ast::Stmt* s);
    void leave_function(const ast::Stmt* s);
    void jump(int target, Loc at);
};

} // namespace kanuka::sl::ir
