#include "sl/codegen/emit.h"
#include "sl/ops/noise.h"

#include <llvm/IR/Intrinsics.h>
#include <numeric>

namespace kanuka::sl {

using namespace ir;

void StageEmitter::instruction(Ref r) {
    const Instr& i = m_stage.instrs[size_t(r)];
    switch (i.op) {
    case Op::Store: {
        const Var& var = m_stage.vars[size_t(i.imm)];
        llvm::Value* mask = i.args.size() > 1 ? mask_bits(get(i.args[1], true).part[0]) : nullptr;
        store_var(i.imm, get(i.args[0], var.varying), mask);
        return;
    }
    case Op::StoreElement:
        return store_element(i);
    default:
        break;
    }
    const Value v = compute(i);
    m_r->values[r] = v;
    // Values that outlive the region go into the frame.
    const Slot& slot = m_plan.refs[size_t(r)];
    if (slot.kind == Slot::Local)
        return;
    for (int c = 0; c < comps(i.ty); c++) {
        llvm::Value* x = v.part[c];
        if (slot.kind == Slot::Array)
            x = widen(x);
        if (i.ty == Ty::Bool)
            x = m_b.CreateUIToFP(x, lane_type(Ty::Float, slot.kind == Slot::Array));
        llvm::Value* p = slot_pointer(slot, c);
        if (slot.kind == Slot::Array)
            p = m_b.CreateGEP(m_float, p, m_r->index);
        m_b.CreateAlignedStore(x, p, llvm::Align(slot.kind == Slot::Text ? 8 : 4));
    }
}

llvm::Value* StageEmitter::scalar_op(const Instr& i, llvm::Value* a, llvm::Value* b) {
    const auto zero = [&] { return llvm::Constant::getNullValue(a->getType()); };
    switch (i.op) {
    case Op::Add:
        return m_b.CreateFAdd(a, b);
    case Op::Sub:
        return m_b.CreateFSub(a, b);
    case Op::Mul:
        return m_b.CreateFMul(a, b);
    case Op::Div:
        return m_b.CreateFDiv(a, b);
    case Op::Neg:
        return m_b.CreateFNeg(a);
    case Op::Min:
        return m_b.CreateSelect(m_b.CreateFCmpOLT(b, a), b, a);
    case Op::Max:
        return m_b.CreateSelect(m_b.CreateFCmpOGT(b, a), b, a);
    case Op::Abs:
        return m_b.CreateUnaryIntrinsic(llvm::Intrinsic::fabs, a);
    case Op::Floor:
        return m_b.CreateUnaryIntrinsic(llvm::Intrinsic::floor, a);
    case Op::Ceil:
        return m_b.CreateUnaryIntrinsic(llvm::Intrinsic::ceil, a);
    case Op::Sqrt:
        return m_b.CreateUnaryIntrinsic(llvm::Intrinsic::sqrt,
                                        m_b.CreateSelect(m_b.CreateFCmpOGT(a, zero()), a, zero()));
    case Op::Lt:
        return m_b.CreateFCmpOLT(a, b);
    case Op::Le:
        return m_b.CreateFCmpOLE(a, b);
    case Op::Gt:
        return m_b.CreateFCmpOGT(a, b);
    case Op::Ge:
        return m_b.CreateFCmpOGE(a, b);
    case Op::Eq:
        return m_b.CreateFCmpOEQ(a, b);
    case Op::Ne:
        return m_b.CreateFCmpUNE(a, b);
    case Op::And:
        return m_b.CreateAnd(a, b);
    case Op::Or:
        return m_b.CreateOr(a, b);
    case Op::AndNot:
        return m_b.CreateAnd(a, m_b.CreateNot(b));
    case Op::Not:
        return m_b.CreateNot(a);
    case Op::ToFloat:
        return m_b.CreateUIToFP(a, a->getType()->isVectorTy() ? lane_type(Ty::Float, true) : m_float);
    case Op::ToMask:
        return m_b.CreateSExt(a, a->getType()->isVectorTy() ? lane_type(Ty::Mask, true) : m_int);
    case Op::ToBool:
        return mask_bits(a);
    case Op::Math1:
    case Op::Math2:
        return math(Fn(i.imm), a, b);
    default:
        return a;
    }
}

// The 8-lane functions of glibc's libmvec, for any number of lanes: its 16-lane ones and libm's own differ
// from them in last digits. One value is a lane of eight alike, sixteen are two calls.
llvm::Value* StageEmitter::math(Fn fn, llvm::Value* a, llvm::Value* b) {
    static constexpr const char* Names[] = {"sin", "cos",  "tan",   "asin", "acos", "atan", "exp",
                                            "log", "log2", "log10", "exp2", "cbrt", "pow",  "atan2"};
    constexpr int Width = 8;
    const bool two = fn >= Fn::Pow;
    llvm::Type* eight = llvm::FixedVectorType::get(m_float, Width);
    llvm::FunctionType* ft = two ? llvm::FunctionType::get(eight, {eight, eight}, false)
                                 : llvm::FunctionType::get(eight, {eight}, false);
    const std::string name = (two ? "_ZGVdN8vv_" : "_ZGVdN8v_") + std::string(Names[int(fn)]) + "f";
    llvm::FunctionCallee f = m_module.getOrInsertFunction(name, ft);
    if (auto* function = llvm::dyn_cast<llvm::Function>(f.getCallee())) {
        function->setDoesNotAccessMemory();
        function->setDoesNotThrow();
        function->setWillReturn();
    }
    const auto call = [&](llvm::Value* x, llvm::Value* y) {
        return two ? m_b.CreateCall(f, {x, y}) : m_b.CreateCall(f, {x});
    };
    if (!a->getType()->isVectorTy()) {
        const auto splat = [&](llvm::Value* v) { return v ? m_b.CreateVectorSplat(Width, v) : nullptr; };
        return m_b.CreateExtractElement(call(splat(a), splat(b)), uint64_t(0));
    }
    if (m_lanes == Width)
        return call(a, b);
    const auto half = [&](llvm::Value* v, int first) -> llvm::Value* {
        llvm::SmallVector<int, Width> lanes(Width);
        std::iota(lanes.begin(), lanes.end(), first);
        return v ? m_b.CreateShuffleVector(v, lanes) : nullptr;
    };
    llvm::SmallVector<int, 2 * Width> whole(2 * Width);
    std::iota(whole.begin(), whole.end(), 0);
    llvm::Value* low = call(half(a, 0), half(b, 0));
    return m_b.CreateShuffleVector(low, call(half(a, Width), half(b, Width)), whole);
}

StageEmitter::Value StageEmitter::noise(const Instr& i) {
    const int lanes = i.varying ? m_lanes : 1;
    if (!m_r->noise_in) {
        llvm::Type* wide = llvm::ArrayType::get(m_float, uint64_t(8 * m_lanes));
        m_r->noise_in = alloca_in_entry(wide, "noise_in");
        m_r->noise_out = alloca_in_entry(wide, "noise_out");
    }
    const auto at = [&](llvm::Value* base, int c) {
        return m_b.CreateConstGEP1_32(m_float, base, unsigned(c * lanes));
    };
    for (size_t k = 0; k < i.args.size(); k++)
        m_b.CreateAlignedStore(get(i.args[k], i.varying).part[0], at(m_r->noise_in, int(k)), llvm::Align(4));
    const std::string name =
        "kanuka_" + std::string(ops::noise_kernels()[size_t(i.imm)].symbol) + "_w" + std::to_string(lanes);
    llvm::FunctionCallee f = m_module.getOrInsertFunction(name, m_void, m_pointer, m_pointer);
    if (auto* function = llvm::dyn_cast<llvm::Function>(f.getCallee())) {
        function->setOnlyAccessesArgMemory();
        function->setDoesNotThrow();
        function->setWillReturn();
    }
    m_b.CreateCall(f, {m_r->noise_in, m_r->noise_out});
    Value v;
    v.varying = i.varying;
    for (int c = 0; c < comps(i.ty); c++)
        v.part[c] =
            m_b.CreateAlignedLoad(lane_type(Ty::Float, i.varying), at(m_r->noise_out, c), llvm::Align(4));
    return v;
}

// A derivative of what does not vary.
StageEmitter::Value StageEmitter::trivial_call(const Instr& i) {
    Value v;
    for (int c = 0; c < comps(i.ty); c++)
        v.part[c] = llvm::Constant::getNullValue(m_float);
    return v;
}

llvm::Value* StageEmitter::fma(llvm::Value* a, llvm::Value* b, llvm::Value* c) {
    return m_b.CreateIntrinsic(llvm::Intrinsic::fma, {a->getType()}, {a, b, c});
}

StageEmitter::Value StageEmitter::same_text(const Instr& i) {
    Value v;
    v.varying = i.varying;
    llvm::FunctionCallee f = m_module.getOrInsertFunction("kanuka_sl_same", m_int, m_pointer, m_pointer);
    if (auto* function = llvm::dyn_cast<llvm::Function>(f.getCallee())) {
        function->setOnlyReadsMemory();
        function->setDoesNotThrow();
        function->setWillReturn();
    }
    llvm::Value* same = m_b.CreateCall(f, {get(i.args[0], false).part[0], get(i.args[1], false).part[0]});
    v.part[0] = m_b.CreateICmpNE(same, m_b.getInt32(0));
    if (i.varying)
        v.part[0] = widen(v.part[0]);
    return v;
}

StageEmitter::Value StageEmitter::cross(const Instr& i) {
    Value v;
    v.varying = i.varying;
    const Value a = get(i.args[0], i.varying), b = get(i.args[1], i.varying);
    for (int k = 0; k < 3; k++) {
        const int p = (k + 1) % 3, q = (k + 2) % 3;
        v.part[k] = fma(a.part[p], b.part[q], m_b.CreateFNeg(m_b.CreateFMul(a.part[q], b.part[p])));
    }
    return v;
}

// By zero, where that is a fault: 0.
StageEmitter::Value StageEmitter::divide(const Instr& i) {
    Value v;
    v.varying = i.varying;
    const Value a = get(i.args[0], i.varying), b = get(i.args[1], i.varying);
    const int n = comps(i.ty);
    if (i.floats.empty()) {
        for (int k = 0; k < n; k++)
            v.part[k] = m_b.CreateFDiv(a.part[k], b.part[k]);
        return v;
    }
    llvm::Value* bad = nullptr;
    llvm::Value* zero = llvm::Constant::getNullValue(a.part[0]->getType());
    llvm::Value* last = nullptr;
    for (int k = 0; k < n; k++) {
        if (b.part[k] != (k ? b.part[k - 1] : nullptr)) { // a splat is tested once
            last = m_b.CreateFCmpOEQ(b.part[k], zero);
            bad = bad ? m_b.CreateOr(bad, last) : last;
        }
        v.part[k] = m_b.CreateSelect(last, zero, m_b.CreateFDiv(a.part[k], b.part[k]));
    }
    fault_where(bad, i.varying, i);
    return v;
}

// The logarithm of what is not positive, a broken power of a negative number: 0, and a fault.
StageEmitter::Value StageEmitter::math_function(const Instr& i) {
    Value v;
    v.varying = i.varying;
    const Fn fn = Fn(i.imm);
    const bool log = fn == Fn::Log || fn == Fn::Log2 || fn == Fn::Log10;
    const Value a = get(i.args[0], i.varying), b = i.op == Op::Math2 ? get(i.args[1], i.varying) : Value{};
    llvm::Value* zero = llvm::Constant::getNullValue(a.part[0]->getType());
    llvm::Value* bad = nullptr;
    for (int k = 0; k < comps(i.ty); k++) {
        v.part[k] = scalar_op(i, a.part[k], b.part[k]);
        if (!log && fn != Fn::Pow)
            continue;
        llvm::Value* wrong =
            log ? m_b.CreateFCmpOLE(a.part[k], zero)
                : m_b.CreateAnd(m_b.CreateFCmpOLT(a.part[k], zero), m_b.CreateFCmpUNO(v.part[k], v.part[k]));
        v.part[k] = m_b.CreateSelect(wrong, zero, v.part[k]);
        bad = bad ? m_b.CreateOr(bad, wrong) : wrong;
    }
    if (bad && !i.floats.empty())
        fault_where(bad, i.varying, i);
    return v;
}

StageEmitter::Value StageEmitter::matrix_product(const Instr& i) {
    Value v;
    v.varying = i.varying;
    const Value a = get(i.args[0], i.varying), b = get(i.args[1], i.varying);
    for (int row = 0; row < 4; row++)
        for (int column = 0; column < 4; column++) {
            llvm::Value* sum = m_b.CreateFMul(a.part[row * 4 + 3], b.part[12 + column]);
            for (int k = 2; k >= 0; k--)
                sum = fma(a.part[row * 4 + k], b.part[k * 4 + column], sum);
            v.part[row * 4 + column] = sum;
        }
    return v;
}

// The mask of lanes that have a vertex.
StageEmitter::Value StageEmitter::all_lanes(const Instr& i) {
    Value v;
    v.varying = i.varying;
    llvm::Value* index = m_b.CreateTrunc(m_r->index, m_int);
    llvm::Value* count = field(0, m_int, "count");
    if (m_lanes > 1) {
        std::vector<llvm::Constant*> steps;
        for (int k = 0; k < m_lanes; k++)
            steps.push_back(m_b.getInt32(uint32_t(k)));
        index = m_b.CreateAdd(widen(index), llvm::ConstantVector::get(steps));
        count = widen(count);
    }
    v.part[0] = m_b.CreateSExt(m_b.CreateICmpSLT(index, count), lane_type(Ty::Mask, true));
    return v;
}

StageEmitter::Value StageEmitter::compute(const Instr& i) {
    Value v;
    v.varying = i.varying;
    const int n = comps(i.ty);
    const auto arg = [&](size_t k) { return get(i.args[k], i.varying); };
    switch (i.op) {
    case Op::Load:
        return load_var(i.imm, i.varying);
    case Op::LoadElement:
        return element(i);
    case Op::Call:
        return trivial_call(i);
    case Op::Noise:
        return noise(i);
    case Op::SameText:
        return same_text(i);
    case Op::Cross:
        return cross(i);
    case Op::Div:
        return divide(i);
    case Op::Math1:
    case Op::Math2:
        return math_function(i);
    case Op::MatMul:
        return matrix_product(i);
    case Op::AllLanes:
        return all_lanes(i);
    case Op::Select: {
        const Value c = arg(0), a = arg(1), b = arg(2);
        for (int k = 0; k < n; k++)
            v.part[k] = m_b.CreateSelect(c.part[0], a.part[k], b.part[k]);
        return v;
    }
    case Op::Splat: {
        const Value a = arg(0);
        for (int k = 0; k < n; k++)
            v.part[k] = a.part[0];
        return v;
    }
    case Op::Make:
        for (int k = 0; k < n; k++)
            v.part[k] = arg(size_t(k)).part[0];
        return v;
    case Op::Extract:
        v.part[0] = arg(0).part[i.imm];
        return v;
    case Op::Dot: {
        const Value a = arg(0), b = arg(1);
        v.part[0] =
            fma(a.part[0], b.part[0], fma(a.part[1], b.part[1], m_b.CreateFMul(a.part[2], b.part[2])));
        return v;
    }
    default: {
        const Value a = i.args.empty() ? Value{} : arg(0), b = i.args.size() > 1 ? arg(1) : Value{};
        for (int k = 0; k < n; k++)
            v.part[k] = scalar_op(i, a.part[k], b.part[k]);
        return v;
    }
    }
}

// Reports the instruction's fault, with the number of lanes that run and have it.
void StageEmitter::fault_where(llvm::Value* bad, bool varying, const Instr& i) {
    if (varying && !i.args.empty() && m_stage.instrs[size_t(i.args.back())].ty == Ty::Mask)
        bad = m_b.CreateAnd(bad, mask_bits(get(i.args.back(), true).part[0]));
    llvm::Value* some = varying ? any(bad) : bad;
    llvm::BasicBlock* report = llvm::BasicBlock::Create(m_context, "fault", m_r->function);
    llvm::BasicBlock* next = llvm::BasicBlock::Create(m_context, "next", m_r->function);
    m_b.CreateCondBr(some, report, next);
    m_b.SetInsertPoint(report);
    llvm::Value* lanes = m_b.getInt32(1);
    if (varying && m_lanes > 1) {
        llvm::Value* word = m_b.CreateBitCast(bad, m_b.getIntNTy(unsigned(m_lanes)));
        lanes = m_b.CreateZExt(m_b.CreateUnaryIntrinsic(llvm::Intrinsic::ctpop, word), m_int);
    }
    report_fault(int(i.floats[0]), lanes);
    m_b.CreateBr(next);
    m_b.SetInsertPoint(next);
}

} // namespace kanuka::sl
