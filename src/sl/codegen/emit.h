// IR to LLVM IR: one function for each region of a stage's plan, one that drives them.
#pragma once

#include <llvm/IR/IRBuilder.h>
#include <llvm/IR/Module.h>

#include "sl/codegen/frame.h"
#include "sl/ir/plan.h"

namespace kanuka::sl {

class StageEmitter {
  public:
    StageEmitter(llvm::Module& module, const ir::Program& program, const ir::Stage& stage,
                 const ir::Plan& plan, int lanes, std::string symbol);
    void emit();

  private:
    using Ref = ir::Ref;
    struct Value {
        bool varying = false;
        llvm::Value* part[16] = {};
    };
    // What a region's function has besides its instructions.
    struct Region {
        llvm::Function* function = nullptr;
        llvm::BasicBlock* entry = nullptr; // allocas, uniform loads; ends in a branch
        llvm::BasicBlock* top = nullptr;   // begin of the loop's body: loads of varying values
        llvm::Value* index = nullptr;      // of the first lane
        bool loops = false;
        std::unordered_map<Ref, Value> values;
        std::unordered_map<int, std::vector<llvm::Value*>> vars; // allocas, one a component
        std::unordered_map<int, llvm::Value*> arrays;            // allocas of local arrays
        std::vector<int> uniform_vars, varying_vars; // those that live in the frame and are used here
        std::unordered_set<int> written;
        llvm::Value* noise_in = nullptr;
        llvm::Value* noise_out = nullptr;
        llvm::BasicBlock* loop_exit = nullptr; // innermost IR loop
    };

    // emit.cpp: the driver, regions, memory
    void drive(const ir::Block& block);
    void drive_item(const ir::Item& item);
    void drive_call(const ir::Instr& instr);
    void region(const ir::Block& block, size_t begin, size_t end, bool outputs);
    bool has_varying(const ir::Block& block, size_t begin, size_t end) const;
    void store_varying_vars();
    void store_uniform_vars();
    void write_outputs();
    llvm::Value* field(int index, llvm::Type* type, const char* name);
    llvm::Value* slot_pointer(const ir::Slot& slot, int component);
    llvm::Value* constant_pointer(const ir::Instr& instr, int component);
    llvm::Value* leaf_pointer(const ir::Instr& instr, int component);
    llvm::Value* driver_flag(Ref condition);
    llvm::Value* count_turns(const ir::Item& loop, llvm::BasicBlock* entry);
    void spend(const ir::Item& loop, llvm::Value* turns, llvm::Function* function, llvm::BasicBlock* exit);
    void report_fault(int fault, llvm::Value* lanes);

    // emit_region.cpp: items within a region
    void block(const ir::Block& block, size_t begin, size_t end);
    void item(const ir::Item& item);
    void declare_var(int var);
    llvm::Value* any(llvm::Value* mask);
    Value get(Ref r, bool varying);
    Value leaf(const ir::Instr& i);
    Value frame_value(Ref r);
    Value load_var(int var, bool varying);
    void store_var(int var, const Value& v, llvm::Value* mask);
    void prepare_var(int var);
    void clear_array(int var);
    llvm::Type* scalar_type(ir::Ty ty) const;
    llvm::Type* lane_type(ir::Ty ty, bool varying) const;
    llvm::Value* widen(llvm::Value* v);
    llvm::Value* alloca_in_entry(llvm::Type* type, const char* name);
    llvm::Value* mask_bits(llvm::Value* mask) {
        return m_b.CreateICmpSLT(mask, llvm::Constant::getNullValue(mask->getType()));
    }

    // emit_ops.cpp: instructions
    void instruction(Ref r);
    Value compute(const ir::Instr& i);
    llvm::Value* scalar_op(const ir::Instr& i, llvm::Value* a, llvm::Value* b);
    llvm::Value* math(ir::Fn fn, llvm::Value* a, llvm::Value* b);
    llvm::Value* fma(llvm::Value* a, llvm::Value* b, llvm::Value* c);
    Value noise(const ir::Instr& i);
    Value trivial_call(const ir::Instr& i);
    Value same_text(const ir::Instr& i);
    Value cross(const ir::Instr& i);
    Value divide(const ir::Instr& i);
    Value math_function(const ir::Instr& i);
    Value matrix_product(const ir::Instr& i);
    Value all_lanes(const ir::Instr& i);
    void fault_where(llvm::Value* bad, bool varying, const ir::Instr& instr);

    // emit_arrays.cpp
    Value element(const ir::Instr& i);
    void store_element(const ir::Instr& i);
    llvm::Value* clamp_index(const ir::Instr& i, int size, bool varying);
    llvm::Value* element_pointer(int var, llvm::Value* index, int component);

    llvm::Module& m_module;
    llvm::LLVMContext& m_context;
    const ir::Program& m_program;
    const ir::Stage& m_stage;
    const ir::Plan& m_plan;
    const int m_lanes;
    const std::string m_symbol;
    llvm::IRBuilder<> m_b;
    llvm::Type *m_float, *m_int, *m_long, *m_pointer, *m_bool, *m_void;
    llvm::StructType* m_frame_type;
    llvm::Function* m_driver = nullptr;
    llvm::BasicBlock* m_driver_entry = nullptr;
    llvm::Value* m_frame = nullptr; // argument of the function being made
    std::unordered_map<int, llvm::BasicBlock*> m_driver_targets, m_targets;
    llvm::BasicBlock* m_driver_loop_exit = nullptr;
    int m_region_count = 0;
    Region* m_r = nullptr;
};

} // namespace kanuka::sl
