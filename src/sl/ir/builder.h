// Makes IR, folding constants as it goes.
#pragma once

#include "sl/ir/ir.h"

namespace kanuka::sl::ir {

class Builder {
  public:
    explicit Builder(Stage& stage) : m_stage(&stage) {}
    void set_stage(Stage& stage) { m_stage = &stage; }
    void set_block(Block* block) { m_block = block; }
    Block* block() { return m_block; }
    Stage& stage() { return *m_stage; }
    const Instr& at(Ref r) const { return m_stage->instrs[r]; }

    Ref constant(std::vector<float> floats, Ty ty = Ty::Float);
    Ref constant(float x) { return constant(std::vector<float>{x}); }
    Ref boolean(bool b) { return constant({b ? 1.0f : 0.0f}, Ty::Bool); }
    Ref triple(float x) { return constant({x, x, x}, Ty::Triple); }
    Ref text(std::string s);
    Ref leaf(Op op, Ty ty, int imm);
    // Emits, or folds. Arithmetic takes its type from its operands, which must be of one type.
    Ref emit(Op op, Ty ty, std::vector<Ref> args, Loc loc, int imm = 0);
    Ref arithmetic(Op op, Ref a, Ref b, Loc loc) { return emit(op, at(a).ty, {a, b}, loc); }
    Ref load(int var, Loc loc) { return emit(Op::Load, m_stage->vars[var].ty, {}, loc, var); }
    void store(int var, Ref value, Loc loc) { emit(Op::Store, Ty::Void, {value}, loc, var); }
    Ref splat(Ref x, Loc loc) { return at(x).ty == Ty::Triple ? x : emit(Op::Splat, Ty::Triple, {x}, loc); }
    Ref call(CallSite site, Ty ty);

    int var(std::string name, Ty ty, Loc loc, int array = 0);
    void declare(int var);
    Item& item(Item item);

    // While set, everything made is at this place: a shadeop's own source is at its call.
    void set_place(const Loc* at) { m_place = at; }
    const Loc* place() const { return m_place; }

    bool is_const(Ref r) const { return at(r).op == Op::Const; }
    bool is_const(Ref r, float x) const;

  private:
    Ref push(Instr instr);
    Ref fold(Op op, Ty ty, const std::vector<Ref>& args, int imm);
    Ref fold_binary(Op op, Ty ty, Ref a, Ref b);
    Stage* m_stage;
    Block* m_block = nullptr;
    const Loc* m_place = nullptr;
};

// What is made goes to another block, until the end of the scope.
class BlockScope {
  public:
    BlockScope(Builder& builder, Block* block) : m_builder(builder), m_outer(builder.block()) {
        builder.set_block(block);
    }
    ~BlockScope() { m_builder.set_block(m_outer); }
    BlockScope(const BlockScope&) = delete;
    BlockScope& operator=(const BlockScope&) = delete;

  private:
    Builder& m_builder;
    Block* m_outer;
};

} // namespace kanuka::sl::ir
