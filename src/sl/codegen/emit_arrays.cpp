// Elements of arrays.
#include "sl/codegen/emit.h"

#include <llvm/IR/Intrinsics.h>

namespace kanuka::sl {

using namespace ir;

// The index as an integer within the array; lanes outside of it are reported once and take the nearest
// element.
llvm::Value* StageEmitter::clamp_index(const Instr& i, int size, bool varying) {
    const Instr& index = m_stage.instrs[size_t(i.args[0])];
    if (index.op == Op::Const) {
        const float f = index.floats[0];
        llvm::Value* k = m_b.getInt32(uint32_t(f >= 0 && f < float(size) ? int(f) : f < 0 ? 0 : size - 1));
        return varying ? widen(k) : k;
    }
    llvm::Value* f = get(i.args[0], varying).part[0];
    llvm::Value* zero = llvm::Constant::getNullValue(f->getType());
    llvm::Value* last = llvm::ConstantFP::get(f->getType(), double(size - 1));
    // An index is a whole number carried in a float: a hair below it is still that number.
    llvm::Value* whole = m_b.CreateUnaryIntrinsic(
        llvm::Intrinsic::floor, m_b.CreateFAdd(f, llvm::ConstantFP::get(f->getType(), 1e-4)));
    llvm::Value* low = m_b.CreateFCmpOGE(whole, zero);
    if (!i.floats.empty()) // nor is a hair below the end outside of it
        fault_where(m_b.CreateNot(m_b.CreateAnd(
                        low, m_b.CreateFCmpOLT(f, llvm::ConstantFP::get(f->getType(), double(size))))),
                    varying, i);
    whole = m_b.CreateSelect(low, whole, zero);
    whole = m_b.CreateSelect(m_b.CreateFCmpOLE(whole, last), whole, last);
    return m_b.CreateFPToSI(whole, f->getType()->isVectorTy() ? lane_type(Ty::Mask, true) : m_int);
}

// Address of an element's component: a pointer, or one for each lane where the index varies.
llvm::Value* StageEmitter::element_pointer(int v, llvm::Value* index, int component) {
    const Var& var = m_stage.vars[size_t(v)];
    const Slot& slot = m_plan.vars[size_t(v)];
    const int n = comps(var.ty);
    const bool wide_index = index->getType()->isVectorTy();
    const auto number = [&](uint64_t k) -> llvm::Value* {
        llvm::Value* c = m_b.getInt64(k);
        return wide_index ? widen(c) : c;
    };
    const auto spread = [&](llvm::Value* x) { return wide_index ? widen(x) : x; };
    llvm::Value* lanes = nullptr;
    if (wide_index) {
        std::vector<llvm::Constant*> steps;
        for (int k = 0; k < m_lanes; k++)
            steps.push_back(m_b.getInt64(uint64_t(k)));
        lanes = llvm::ConstantVector::get(steps);
    }
    llvm::Value* wide =
        m_b.CreateZExt(index, wide_index ? llvm::FixedVectorType::get(m_long, unsigned(m_lanes)) : m_long);
    llvm::Value* element =
        m_b.CreateAdd(m_b.CreateMul(wide, number(uint64_t(n))), number(uint64_t(component)));
    if (slot.kind == Slot::Array) {
        llvm::Value* base = slot_pointer(slot, 0);
        llvm::Value* offset =
            m_b.CreateAdd(m_b.CreateMul(element, spread(field(2, m_long, "stride"))), spread(m_r->index));
        if (lanes)
            offset = m_b.CreateAdd(offset, lanes);
        return m_b.CreateGEP(m_float, base, offset);
    }
    llvm::Value* base = m_r->arrays[v];
    if (var.varying && wide_index) {
        llvm::Value* offset = m_b.CreateAdd(m_b.CreateMul(element, number(uint64_t(m_lanes))), lanes);
        return m_b.CreateGEP(m_float, base, offset);
    }
    return m_b.CreateGEP(lane_type(var.ty, var.varying), base, element);
}

StageEmitter::Value StageEmitter::element(const Instr& i) {
    const Var& var = m_stage.vars[size_t(i.imm)];
    prepare_var(i.imm);
    const bool wide_index = m_stage.instrs[size_t(i.args[0])].varying && m_lanes > 1;
    llvm::Value* index = clamp_index(i, var.array, m_stage.instrs[size_t(i.args[0])].varying);
    Value v;
    v.varying = i.varying;
    for (int c = 0; c < comps(var.ty); c++) {
        llvm::Value* p = element_pointer(i.imm, index, c);
        if (wide_index) {
            v.part[c] = m_b.CreateMaskedGather(lane_type(var.ty, true), p, llvm::Align(4));
        } else {
            v.part[c] = m_b.CreateAlignedLoad(lane_type(var.ty, var.varying), p,
                                              llvm::Align(var.ty == Ty::String ? 8 : 4));
            if (i.varying)
                v.part[c] = widen(v.part[c]);
        }
    }
    return v;
}

void StageEmitter::store_element(const Instr& i) {
    const Var& var = m_stage.vars[size_t(i.imm)];
    prepare_var(i.imm);
    m_r->written.insert(i.imm);
    const bool wide_index = m_stage.instrs[size_t(i.args[0])].varying && m_lanes > 1;
    const bool masked = i.args.size() > 2;
    const Value value = get(i.args[1], var.varying);
    llvm::Value* index = clamp_index(i, var.array, m_stage.instrs[size_t(i.args[0])].varying);
    llvm::Value* mask = masked ? mask_bits(get(i.args[2], true).part[0]) : nullptr;
    for (int c = 0; c < comps(var.ty); c++) {
        llvm::Value* p = element_pointer(i.imm, index, c);
        if (wide_index) {
            llvm::Value* all = mask ? mask : widen(m_b.getInt1(true));
            m_b.CreateMaskedScatter(value.part[c], p, llvm::Align(4), all);
            continue;
        }
        llvm::Value* x = value.part[c];
        const llvm::Align align(var.ty == Ty::String ? 8 : 4);
        if (mask)
            x = m_b.CreateSelect(mask, x, m_b.CreateAlignedLoad(x->getType(), p, align));
        m_b.CreateAlignedStore(x, p, align);
    }
}

} // namespace kanuka::sl
