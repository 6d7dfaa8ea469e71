#include "sl/codegen/emit.h"

namespace kanuka::sl {

using namespace ir;
using llvm::BasicBlock;

llvm::Type* StageEmitter::scalar_type(Ty ty) const {
    return ty == Ty::Bool ? m_bool : ty == Ty::String ? m_pointer : ty == Ty::Mask ? m_int : m_float;
}

llvm::Type* StageEmitter::lane_type(Ty ty, bool varying) const {
    llvm::Type* t = scalar_type(ty);
    return varying && m_lanes > 1 ? llvm::FixedVectorType::get(t, unsigned(m_lanes)) : t;
}

llvm::Value* StageEmitter::widen(llvm::Value* v) {
    return m_lanes > 1 && !v->getType()->isVectorTy() ? m_b.CreateVectorSplat(unsigned(m_lanes), v) : v;
}

llvm::Value* StageEmitter::alloca_in_entry(llvm::Type* type, const char* name) {
    llvm::IRBuilder<> entry(m_r->entry, m_r->entry->begin());
    return entry.CreateAlloca(type, nullptr, name);
}

llvm::Value* StageEmitter::any(llvm::Value* mask) {
    llvm::Value* bits = mask->getType()->getScalarType()->isIntegerTy(1) ? mask : mask_bits(mask);
    if (m_lanes == 1)
        return bits;
    llvm::Value* word = m_b.CreateBitCast(bits, m_b.getIntNTy(unsigned(m_lanes)));
    return m_b.CreateICmpNE(word, llvm::Constant::getNullValue(word->getType()));
}

// ---- values
// -----------------------------------------------------------------------------------------------------------

// Constants, parameters, inputs. Uniform ones are loaded before the loop, varying ones at the top of its
// body, so that each is there wherever it is used.
StageEmitter::Value StageEmitter::leaf(const Instr& i) {
    Value v;
    const int n = comps(i.ty);
    if (i.op == Op::Const) {
        for (int c = 0; c < n; c++) {
            const float f = i.floats[size_t(c)];
            v.part[c] = i.ty == Ty::Bool   ? static_cast<llvm::Value*>(m_b.getInt1(f != 0))
                        : i.ty == Ty::Mask ? static_cast<llvm::Value*>(m_b.getInt32(f != 0 ? 0xffffffffu : 0))
                                           : llvm::ConstantFP::get(m_float, double(f));
        }
        return v;
    }
    const llvm::IRBuilder<>::InsertPointGuard guard(m_b);
    v.varying = i.varying;
    m_b.SetInsertPoint((i.varying ? m_r->top : m_r->entry)->getTerminator());
    if (i.op == Op::Text) {
        v.part[0] = m_b.CreateGlobalString(i.text);
        return v;
    }
    for (int c = 0; c < n; c++) {
        llvm::Value* p = leaf_pointer(i, c);
        llvm::LoadInst* load = nullptr;
        if (i.varying)
            load = m_b.CreateAlignedLoad(lane_type(i.ty, true), m_b.CreateGEP(m_float, p, m_r->index),
                                         llvm::Align(4));
        else
            load = m_b.CreateLoad(scalar_type(i.ty), p);
        load->setMetadata(llvm::LLVMContext::MD_invariant_load, llvm::MDNode::get(m_context, {}));
        v.part[c] = load;
    }
    return v;
}

// A value that another region or the host made.
StageEmitter::Value StageEmitter::frame_value(Ref r) {
    const Instr& i = m_stage.instrs[size_t(r)];
    const Slot& slot = m_plan.refs[size_t(r)];
    const llvm::IRBuilder<>::InsertPointGuard guard(m_b);
    Value v;
    v.varying = slot.kind == Slot::Array;
    m_b.SetInsertPoint((v.varying ? m_r->top : m_r->entry)->getTerminator());
    for (int c = 0; c < comps(i.ty); c++) {
        llvm::Value* p = slot_pointer(slot, c);
        llvm::Type* type = i.ty == Ty::String ? m_pointer : i.ty == Ty::Mask ? m_int : m_float;
        if (v.varying) {
            llvm::Type* wide = m_lanes > 1 ? llvm::FixedVectorType::get(type, unsigned(m_lanes)) : type;
            v.part[c] = m_b.CreateAlignedLoad(wide, m_b.CreateGEP(m_float, p, m_r->index), llvm::Align(4));
        } else {
            v.part[c] = m_b.CreateLoad(type, p);
        }
        if (i.ty == Ty::Bool)
            v.part[c] = m_b.CreateFCmpUNE(v.part[c], llvm::Constant::getNullValue(v.part[c]->getType()));
    }
    return v;
}

StageEmitter::Value StageEmitter::get(Ref r, bool varying) {
    const Instr& i = m_stage.instrs[size_t(r)];
    auto it = m_r->values.find(r);
    if (it == m_r->values.end())
        it = m_r->values.emplace(r, is_leaf(i.op) ? leaf(i) : frame_value(r)).first;
    Value v = it->second;
    if (varying && !v.varying) {
        for (int c = 0; c < comps(i.ty); c++)
            v.part[c] = widen(v.part[c]);
        v.varying = true;
    }
    return v;
}

// ---- variables
// ----------------------------------------------------------------------------------------------------------

// Gives a variable its place in this region; those of the frame are loaded at its begin.
void StageEmitter::prepare_var(int v) {
    if (m_r->vars.count(v) || m_r->arrays.count(v))
        return;
    const Var& var = m_stage.vars[size_t(v)];
    const Slot& slot = m_plan.vars[size_t(v)];
    const int n = comps(var.ty);
    llvm::Type* type = lane_type(var.ty, var.varying);
    if (var.array) {
        if (slot.kind == Slot::Array) {
            m_r->arrays[v] = nullptr; // used in place
            m_r->varying_vars.push_back(v);
            return;
        }
        llvm::Value* array =
            alloca_in_entry(llvm::ArrayType::get(type, uint64_t(n * var.array)), var.name.c_str());
        m_r->arrays[v] = array;
        if (slot.kind != Slot::Local) {
            m_r->uniform_vars.push_back(v);
            const llvm::IRBuilder<>::InsertPointGuard guard(m_b);
            m_b.SetInsertPoint(m_r->top->getTerminator());
            for (int c = 0; c < n * var.array; c++)
                m_b.CreateStore(m_b.CreateLoad(type, slot_pointer(slot, c)),
                                m_b.CreateConstGEP1_32(type, array, unsigned(c)));
        }
        return;
    }
    std::vector<llvm::Value*>& parts = m_r->vars[v];
    for (int c = 0; c < n; c++)
        parts.push_back(alloca_in_entry(type, var.name.c_str()));
    if (slot.kind == Slot::Local)
        return;
    (slot.kind == Slot::Array ? m_r->varying_vars : m_r->uniform_vars).push_back(v);
    const llvm::IRBuilder<>::InsertPointGuard guard(m_b);
    for (int c = 0; c < n; c++) {
        llvm::Type* stored = var.ty == Ty::Bool ? lane_type(Ty::Float, var.varying) : type;
        llvm::Value* x;
        if (slot.kind == Slot::Array) {
            m_b.SetInsertPoint(m_r->top->getTerminator());
            x = m_b.CreateAlignedLoad(stored, m_b.CreateGEP(m_float, slot_pointer(slot, c), m_r->index),
                                      llvm::Align(4));
        } else {
            m_b.SetInsertPoint(m_r->entry->getTerminator());
            x = m_b.CreateLoad(stored, slot_pointer(slot, c));
            m_b.SetInsertPoint(m_r->top->getTerminator());
        }
        if (var.ty == Ty::Bool)
            x = m_b.CreateFCmpUNE(x, llvm::Constant::getNullValue(x->getType()));
        m_b.CreateStore(x, parts[size_t(c)]);
    }
}

StageEmitter::Value StageEmitter::load_var(int v, bool varying) {
    prepare_var(v);
    const Var& var = m_stage.vars[size_t(v)];
    Value value;
    value.varying = var.varying;
    for (int c = 0; c < comps(var.ty); c++) {
        value.part[c] = m_b.CreateLoad(lane_type(var.ty, var.varying), m_r->vars[v][size_t(c)]);
        if (varying)
            value.part[c] = widen(value.part[c]);
    }
    value.varying = value.varying || varying;
    return value;
}

void StageEmitter::store_var(int v, const Value& value, llvm::Value* mask) {
    prepare_var(v);
    m_r->written.insert(v);
    const Var& var = m_stage.vars[size_t(v)];
    for (int c = 0; c < comps(var.ty); c++) {
        llvm::Value* p = m_r->vars[v][size_t(c)];
        llvm::Value* x = value.part[c];
        if (mask)
            x = m_b.CreateSelect(mask, x, m_b.CreateLoad(x->getType(), p));
        m_b.CreateStore(x, p);
    }
}

void StageEmitter::clear_array(int v) {
    prepare_var(v);
    m_r->written.insert(v);
    const Var& var = m_stage.vars[size_t(v)];
    const Slot& slot = m_plan.vars[size_t(v)];
    const int n = comps(var.ty) * var.array;
    llvm::Type* type = lane_type(var.ty, var.varying);
    llvm::Value* zero = llvm::Constant::getNullValue(type);
    if (slot.kind == Slot::Array) {
        for (int c = 0; c < n; c++)
            m_b.CreateAlignedStore(zero, m_b.CreateGEP(m_float, slot_pointer(slot, c), m_r->index),
                                   llvm::Align(4));
        return;
    }
    const uint64_t bytes = m_module.getDataLayout().getTypeAllocSize(type) * uint64_t(n);
    m_b.CreateMemSet(m_r->arrays[v], m_b.getInt8(0), bytes, llvm::MaybeAlign(4));
}

// ---- items
// ----------------------------------------------------------------------------------------------------------------

void StageEmitter::block(const Block& block, size_t begin, size_t end) {
    for (size_t i = begin; i < end; i++) {
        item(block.items[i]);
        if (block.items[i].kind == Item::Jump)
            return;
    }
}

void StageEmitter::item(const Item& item) {
    const auto make = [&](const char* name) { return BasicBlock::Create(m_context, name, m_r->function); };
    const auto nested = [&](const Block* b) {
        if (b)
            block(*b, 0, b->items.size());
    };
    const auto end_with = [&](BasicBlock* next) {
        if (!m_b.GetInsertBlock()->getTerminator())
            m_b.CreateBr(next);
    };
    switch (item.kind) {
    case Item::Instruction:
        instruction(item.ref);
        break;
    case Item::Declare:
        if (m_stage.vars[size_t(item.target)].clear)
            clear_array(item.target);
        break;
    case Item::If: {
        BasicBlock *yes = make("then"), *no = make("else"), *join = make("join");
        m_b.CreateCondBr(get(item.ref, false).part[0], yes, no);
        m_b.SetInsertPoint(yes);
        nested(item.body);
        end_with(join);
        m_b.SetInsertPoint(no);
        nested(item.orelse);
        end_with(join);
        m_b.SetInsertPoint(join);
        break;
    }
    case Item::Guard: {
        BasicBlock *yes = make("some"), *join = make("join");
        m_b.CreateCondBr(any(load_var(item.target, true).part[0]), yes, join);
        m_b.SetInsertPoint(yes);
        nested(item.body);
        end_with(join);
        m_b.SetInsertPoint(join);
        break;
    }
    case Item::LeaveLoop: {
        BasicBlock* on = make("on");
        m_b.CreateCondBr(any(load_var(item.target, true).part[0]), on, m_r->loop_exit);
        m_b.SetInsertPoint(on);
        break;
    }
    case Item::Loop: {
        BasicBlock *body = make("loop"), *exit = make("leave");
        BasicBlock* const outer = m_r->loop_exit;
        m_r->loop_exit = exit;
        llvm::Value* const turns = count_turns(item, m_r->entry);
        m_b.CreateBr(body);
        m_b.SetInsertPoint(body);
        spend(item, turns, m_r->function, exit);
        nested(item.body);
        end_with(body);
        m_r->loop_exit = outer;
        m_b.SetInsertPoint(exit);
        break;
    }
    case Item::Scope: {
        BasicBlock* end = make("end");
        m_targets[item.target] = end;
        nested(item.body);
        end_with(end);
        m_b.SetInsertPoint(end);
        break;
    }
    case Item::Jump:
        m_b.CreateBr(m_targets[item.target]);
        break;
    }
}

} // namespace kanuka::sl
