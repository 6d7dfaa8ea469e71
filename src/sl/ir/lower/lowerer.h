// What every part of the lowering is made of: the context, the other parts, and what all do all the time.
#pragma once

#include "sl/ir/lower/context.h"

namespace kanuka::sl::ir {

class Lowerer {
  public:
    explicit Lowerer(LowerContext& context)
        : m_context(context), m_program(context.program), m_sema(context.sema),
          m_diagnostics(context.diagnostics), m_b(context.builder), m_state(context.stage) {}
    Lowerer(const Lowerer&) = delete;
    Lowerer& operator=(const Lowerer&) = delete;

  protected:
    // ---- the other parts
    ParameterLowerer& parameters() const { return *m_context.parameters; }
    MemberLowerer& members() const { return *m_context.members; }
    VariableLowerer& variables() const { return *m_context.variables; }
    AssignmentLowerer& assignments() const { return *m_context.assignments; }
    ExpressionLowerer& expressions() const { return *m_context.expressions; }
    StatementLowerer& statements() const { return *m_context.statements; }
    FunctionLowerer& functions() const { return *m_context.functions; }
    ShadeopLowerer& shadeops() const { return *m_context.shadeops; }
    TextureLowerer& textures() const { return *m_context.textures; }
    QueryLowerer& queries() const { return *m_context.queries; }
    ArrayLowerer& arrays() const { return *m_context.arrays; }
    SplineLowerer& splines() const { return *m_context.splines; }
    MaterialLowerer& materials() const { return *m_context.materials; }
    DirectionLowerer& directions() const { return *m_context.directions; }
    OpticsLowerer& optics() const { return *m_context.optics; }
    WardLowerer& ward() const { return *m_context.ward; }
    LightLoopLowerer& light_loops() const { return *m_context.light_loops; }
    HandleTracker& tracker() const { return *m_context.tracker; }
    CoshaderLowerer& coshaders() const { return *m_context.coshaders; }
    EmissionLowerer& emission() const { return *m_context.emission; }

    // ---- shorthands
    Ref expr(const ast::Expr* e);
    Ref expr_as(const ast::Expr* e, const ast::Type& to);
    Binding& bind(const ast::VarDecl* v);
    bool on_grid() const { return m_state.role >= Role::Displace; }

    Ref zero(Ty ty);
    Ref input(Input input) { return m_b.leaf(Op::Input, input_info(input).ty, int(input)); }
    int fault(Loc at, std::string what); // its number, for what may have it

    // Variables keep what their values are to light.
    Tag tag(Ref r) const;
    Ref tagged(Ref r, Tag t);
    void store_tagged(int var, Ref value, Loc at);
    Ref load_tagged(int var, Loc at);

    template <class F>
    Block* in_block(F&& body) {
        Block* const b = m_b.stage().block();
        const BlockScope scope(m_b, b);
        body();
        return b;
    }
    template <class F>
    auto in_prologue(F&& make) {
        const BlockScope scope(m_b, m_state.prologue);
        return make();
    }

    LowerContext& m_context;
    Program& m_program;
    Sema& m_sema;
    Diagnostics& m_diagnostics;
    Builder& m_b;
    StageState& m_state;
};

} // namespace kanuka::sl::ir
