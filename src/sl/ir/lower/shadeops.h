// Calls of shadeops, by what their row of the table says; those that are one operation or one call.
#pragma once

#include "sl/ir/lower/lowerer.h"

namespace kanuka::sl::ir {

class ShadeopLowerer : public Lowerer {
  public:
    using Lowerer::Lowerer;
    void begin_stage();
    Ref shadeop(const ast::Expr* e);
    Ref host(CallKind kind, const ast::Expr* e, const ops::Signature& s);
    // pow() and log() are 0 where they have no value. That is told, as a division by zero is, unless it
    // cannot be.
    Ref told_math(Ref r, Loc at);

  private:
    Ref primitive(const ast::Expr* e, const ops::Signature& s);
    Ref noise(const ast::Expr* e, const ops::Signature& s);
    Ref closure(const ast::Expr* e, const ops::Signature& s);
    Ref special(const ast::Expr* e, const ops::Signature& s);
    Ref absent(const ast::Expr* e, const ops::Signature& s);
    Ref component(const ast::Expr* e, const ops::Signature& s);
    Ref space(const ast::Expr* e);
    Ref difference(const ast::Expr* e, const ops::Signature& s);
    Ref calculate_normal(const ast::Expr* e, const ops::Signature& s);
    Ref random(const ast::Expr* e, const ops::Signature& s);
    Ref shader_name(const ast::Expr* e);

    // Of the stage
    std::map<std::string, Ref> m_spaces;
    int m_random = -1; // variable: calls of random() so far, in this run
};

} // namespace kanuka::sl::ir
