#include "sl/codegen/emit.h"

namespace kanuka::sl {

using namespace ir;
using llvm::BasicBlock;
using llvm::Function;

// Indices of Frame's fields.
enum Field {
    Count,
    Padding,
    Stride,
    Uniforms,
    Texts,
    Scratch,
    Inputs,
    UniformInputs,
    Params,
    ParamTexts,
    VaryingParams,
    Members,
    MemberTexts,
    Channels,
    Outputs,
    Host,
    Budget,
    Patience
};

StageEmitter::StageEmitter(llvm::Module& module, const Program& program, const Stage& stage, const Plan& plan,
                           int lanes, std::string symbol)
    : m_module(module), m_context(module.getContext()), m_program(program), m_stage(stage), m_plan(plan),
      m_lanes(lanes), m_symbol(std::move(symbol)), m_b(m_context) {
    m_float = m_b.getFloatTy();
    m_int = m_b.getInt32Ty();
    m_long = m_b.getInt64Ty();
    m_pointer = m_b.getPtrTy();
    m_bool = m_b.getInt1Ty();
    m_void = m_b.getVoidTy();
    std::vector<llvm::Type*> fields = {m_int, m_int, m_long};
    fields.resize(Budget, m_pointer);
    fields.push_back(m_long);
    fields.push_back(m_long);
    m_frame_type = llvm::StructType::get(m_context, fields);
}

llvm::Value* StageEmitter::field(int index, llvm::Type* type, const char* name) {
    llvm::Value* p = m_b.CreateStructGEP(m_frame_type, m_frame, unsigned(index));
    llvm::LoadInst* load = m_b.CreateLoad(type, p, name);
    load->setMetadata(llvm::LLVMContext::MD_invariant_load, llvm::MDNode::get(m_context, {}));
    return load;
}

void StageEmitter::emit() {
    m_driver = Function::Create(llvm::FunctionType::get(m_void, {m_pointer}, false),
                                Function::ExternalLinkage, m_symbol, m_module);
    m_driver->addFnAttr(llvm::Attribute::NoUnwind);
    m_frame = m_driver->getArg(0);
    m_driver_entry = BasicBlock::Create(m_context, "entry", m_driver);
    BasicBlock* start = BasicBlock::Create(m_context, "start", m_driver);
    m_b.SetInsertPoint(start);
    drive(*m_stage.root);
    if (m_plan.outputs_apart)
        region(*m_stage.root, 0, 0, true);
    m_b.CreateRetVoid();
    m_b.SetInsertPoint(m_driver_entry);
    m_b.CreateBr(start);
}

// ---- the driver
// -----------------------------------------------------------------------------------------------------

void StageEmitter::drive(const Block& block) {
    for (size_t i = 0; i < block.items.size();) {
        const Item& item = block.items[i];
        if (m_plan.is_grid(item)) {
            drive_item(item);
            if (item.kind == Item::Jump)
                return; // what follows is not reached
            i++;
            continue;
        }
        size_t end = i + 1;
        while (end < block.items.size() && !m_plan.is_grid(block.items[end]) &&
               !m_plan.first.count(&block.items[end]))
            end++;
        const bool last = &block == m_stage.root && end == block.items.size();
        region(block, i, end, last && !m_plan.outputs_apart);
        i = end;
    }
}

llvm::Value* StageEmitter::driver_flag(Ref condition) {
    const Instr& i = m_stage.instrs[size_t(condition)];
    llvm::Value* p = is_leaf(i.op) ? leaf_pointer(i, 0) : slot_pointer(m_plan.refs[size_t(condition)], 0);
    return m_b.CreateFCmpUNE(m_b.CreateLoad(m_float, p), llvm::ConstantFP::get(m_float, 0.0));
}

void StageEmitter::drive_item(const Item& item) {
    const auto block = [&](const char* name) { return BasicBlock::Create(m_context, name, m_driver); };
    const auto end_with = [&](BasicBlock* next) {
        if (!m_b.GetInsertBlock()->getTerminator())
            m_b.CreateBr(next);
    };
    switch (item.kind) {
    case Item::Instruction:
        drive_call(m_stage.instrs[size_t(item.ref)]);
        break;
    case Item::If: {
        BasicBlock *yes = block("then"), *no = block("else"), *join = block("join");
        m_b.CreateCondBr(driver_flag(item.ref), yes, no);
        m_b.SetInsertPoint(yes);
        drive(*item.body);
        end_with(join);
        m_b.SetInsertPoint(no);
        if (item.orelse)
            drive(*item.orelse);
        end_with(join);
        m_b.SetInsertPoint(join);
        break;
    }
    case Item::Guard: {
        BasicBlock *yes = block("some"), *join = block("join");
        llvm::FunctionCallee f = m_module.getOrInsertFunction("kanuka_sl_any", m_int, m_pointer, m_pointer);
        llvm::Value* n = m_b.CreateCall(f, {m_frame, slot_pointer(m_plan.vars[size_t(item.target)], 0)});
        m_b.CreateCondBr(m_b.CreateICmpNE(n, m_b.getInt32(0)), yes, join);
        m_b.SetInsertPoint(yes);
        drive(*item.body);
        end_with(join);
        m_b.SetInsertPoint(join);
        break;
    }
    case Item::LeaveLoop: {
        BasicBlock* on = block("on");
        llvm::FunctionCallee f = m_module.getOrInsertFunction("kanuka_sl_any", m_int, m_pointer, m_pointer);
        llvm::Value* n = m_b.CreateCall(f, {m_frame, slot_pointer(m_plan.vars[size_t(item.target)], 0)});
        m_b.CreateCondBr(m_b.CreateICmpNE(n, m_b.getInt32(0)), on, m_driver_loop_exit);
        m_b.SetInsertPoint(on);
        break;
    }
    case Item::Loop: {
        BasicBlock *body = block("loop"), *exit = block("leave");
        BasicBlock* const outer = m_driver_loop_exit;
        m_driver_loop_exit = exit;
        llvm::Value* const turns = count_turns(item, m_driver_entry);
        m_b.CreateBr(body);
        m_b.SetInsertPoint(body);
        spend(item, turns, m_driver, exit);
        drive(*item.body);
        end_with(body);
        m_driver_loop_exit = outer;
        m_b.SetInsertPoint(exit);
        break;
    }
    case Item::Scope: {
        BasicBlock* end = block("end");
        m_driver_targets[item.target] = end;
        drive(*item.body);
        end_with(end);
        m_b.SetInsertPoint(end);
        break;
    }
    case Item::Jump:
        m_b.CreateBr(m_driver_targets[item.target]);
        break;
    case Item::Declare:
        break;
    }
}

// Before a loop: where its own iterations are counted.
llvm::Value* StageEmitter::count_turns(const Item& loop, BasicBlock* entry) {
    if (loop.fault < 0)
        return nullptr;
    llvm::IRBuilder<> at_entry(entry, entry->begin());
    llvm::Value* turns = at_entry.CreateAlloca(m_long, nullptr, "turns");
    m_b.CreateStore(m_b.getInt64(0), turns);
    return turns;
}

// One more iteration of a loop: leaves it where the run or the loop has had its share. Then the run has
// nothing left: all other loops are left, too.
void StageEmitter::spend(const Item& loop, llvm::Value* turns, Function* function, BasicBlock* exit) {
    if (loop.fault < 0)
        return;
    llvm::Value* p = m_b.CreateStructGEP(m_frame_type, m_frame, Budget);
    llvm::Value* turn = m_b.CreateAdd(m_b.CreateLoad(m_long, turns), m_b.getInt64(1));
    m_b.CreateStore(turn, turns);
    llvm::Value* endless = m_b.CreateICmpSGT(turn, field(Patience, m_long, "patience"));
    llvm::Value* left = m_b.CreateSelect(endless, m_b.getInt64(-1),
                                         m_b.CreateSub(m_b.CreateLoad(m_long, p), m_b.getInt64(1)));
    m_b.CreateStore(left, p);
    BasicBlock* spent = BasicBlock::Create(m_context, "spent", function);
    BasicBlock* go = BasicBlock::Create(m_context, "go", function);
    m_b.CreateCondBr(m_b.CreateICmpSLT(left, m_b.getInt64(0)), spent, go);
    m_b.SetInsertPoint(spent);
    report_fault(loop.fault, m_b.getInt32(1));
    m_b.CreateBr(exit);
    m_b.SetInsertPoint(go);
}

void StageEmitter::report_fault(int fault, llvm::Value* lanes) {
    llvm::FunctionCallee f = m_module.getOrInsertFunction("kanuka_sl_fault", m_void, m_pointer, m_int, m_int);
    m_b.CreateCall(f, {m_frame, m_b.getInt32(uint32_t(fault)), lanes});
}

llvm::Value* StageEmitter::slot_pointer(const Slot& slot, int component) {
    if (slot.kind == Slot::Array) {
        llvm::Value* base = field(Scratch, m_pointer, "scratch");
        llvm::Value* offset =
            m_b.CreateMul(field(Stride, m_long, "stride"), m_b.getInt64(uint64_t(slot.index + component)));
        return m_b.CreateGEP(m_float, base, offset);
    }
    if (slot.kind == Slot::Text)
        return m_b.CreateConstGEP1_32(m_pointer, field(Texts, m_pointer, "texts"),
                                      unsigned(slot.index + component));
    return m_b.CreateConstGEP1_32(m_float, field(Uniforms, m_pointer, "uniforms"),
                                  unsigned(slot.index + component));
}

llvm::Value* StageEmitter::constant_pointer(const Instr& i, int component) {
    llvm::Constant* value;
    if (i.op == Op::Text)
        value = llvm::cast<llvm::Constant>(m_b.CreateGlobalString(i.text));
    else
        value = llvm::ConstantFP::get(m_float, double(i.floats[size_t(component)]));
    auto* g = new llvm::GlobalVariable(m_module, value->getType(), true, llvm::GlobalValue::PrivateLinkage,
                                       value, "arg");
    return g;
}

// Where a leaf's value lies in memory: for calls to the host.
llvm::Value* StageEmitter::leaf_pointer(const Instr& i, int component) {
    const auto floats = [&](int f, int offset) {
        return m_b.CreateConstGEP1_32(m_float, field(f, m_pointer, "base"), unsigned(offset + component));
    };
    const auto texts = [&](int f, int offset) {
        return m_b.CreateConstGEP1_32(m_pointer, field(f, m_pointer, "base"), unsigned(offset));
    };
    switch (i.op) {
    case Op::Input: {
        const int offset = i.imm * 3;
        if (!i.varying)
            return floats(UniformInputs, offset);
        return m_b.CreateLoad(m_pointer, texts(Inputs, offset + component));
    }
    case Op::Param: {
        const Place& p = m_program.places[size_t(i.imm)];
        if (i.floats.size() > 1)
            return floats(Params, p.length);
        const int offset = p.offset + (i.floats.empty() ? 0 : int(i.floats[0]) * comps(i.ty));
        if (p.text)
            return texts(ParamTexts, offset);
        if (i.varying)
            return m_b.CreateLoad(m_pointer, texts(VaryingParams, offset + component));
        return floats(Params, offset);
    }
    case Op::Member: {
        const Place& p = m_program.members[size_t(i.imm)];
        return p.text ? texts(MemberTexts, p.offset) : floats(Members, p.offset);
    }
    case Op::Channel:
        return floats(Channels, i.imm * 3);
    default:
        return constant_pointer(i, component);
    }
}

void StageEmitter::drive_call(const Instr& instr) {
    const CallSite& site = m_stage.calls[size_t(instr.imm)];
    std::vector<llvm::Value*> pointers;
    const auto add = [&](Ref r) {
        const Instr& a = m_stage.instrs[size_t(r)];
        for (int c = 0; c < comps(a.ty); c++)
            pointers.push_back(is_leaf(a.op) ? leaf_pointer(a, c) : slot_pointer(m_plan.refs[size_t(r)], c));
    };
    for (Ref a : instr.args)
        add(a);
    if (instr.ty != Ty::Void)
        add(site.result);
    llvm::Type* list = llvm::ArrayType::get(m_pointer, std::max<size_t>(1, pointers.size()));
    llvm::IRBuilder<> entry(m_driver_entry, m_driver_entry->begin());
    llvm::Value* args = entry.CreateAlloca(list);
    for (size_t k = 0; k < pointers.size(); k++)
        m_b.CreateStore(pointers[k], m_b.CreateConstInBoundsGEP2_32(list, args, 0, unsigned(k)));
    llvm::FunctionCallee f =
        m_module.getOrInsertFunction("kanuka_sl_call", m_void, m_pointer, m_int, m_pointer);
    m_b.CreateCall(f, {m_frame, m_b.getInt32(uint32_t(instr.imm)), args});
}

// ---- regions
// --------------------------------------------------------------------------------------------------------

bool StageEmitter::has_varying(const Block& block, size_t begin, size_t end) const {
    for (size_t k = begin; k < end; k++) {
        const Item& i = block.items[k];
        if (i.kind == Item::Instruction && m_stage.instrs[size_t(i.ref)].varying)
            return true;
        if (i.kind == Item::Guard || i.kind == Item::LeaveLoop)
            return true;
        if ((i.body && has_varying(*i.body, 0, i.body->items.size())) ||
            (i.orelse && has_varying(*i.orelse, 0, i.orelse->items.size())))
            return true;
    }
    return false;
}

// Variables of the frame go back: varying ones at the end of the loop's body, uniform ones after the loop.
void StageEmitter::store_varying_vars() {
    for (int v : m_r->varying_vars) {
        const Var& var = m_stage.vars[size_t(v)];
        if (var.array || !m_r->written.count(v))
            continue;
        for (int c = 0; c < comps(var.ty); c++) {
            llvm::Value* x = m_b.CreateLoad(lane_type(var.ty, true), m_r->vars[v][size_t(c)]);
            if (var.ty == Ty::Bool)
                x = m_b.CreateUIToFP(x, lane_type(Ty::Float, true));
            m_b.CreateAlignedStore(
                x, m_b.CreateGEP(m_float, slot_pointer(m_plan.vars[size_t(v)], c), m_r->index),
                llvm::Align(4));
        }
    }
}

void StageEmitter::store_uniform_vars() {
    for (int v : m_r->uniform_vars) {
        const Var& var = m_stage.vars[size_t(v)];
        if (!m_r->written.count(v))
            continue;
        const int n = comps(var.ty) * std::max(1, var.array);
        for (int c = 0; c < n; c++) {
            llvm::Type* type = scalar_type(var.ty);
            llvm::Value* from = var.array ? m_b.CreateConstGEP1_32(type, m_r->arrays[v], unsigned(c))
                                          : m_r->vars[v][size_t(c)];
            llvm::Value* x = m_b.CreateLoad(type, from);
            if (var.ty == Ty::Bool)
                x = m_b.CreateUIToFP(x, m_float);
            m_b.CreateStore(x, slot_pointer(m_plan.vars[size_t(v)], c));
        }
    }
}

// A function of its own:  entry: uniform loads → for (index = 0; index < count; index += lanes) { top:
// varying loads → body → end: varying stores } → exit: uniform stores.
void StageEmitter::region(const Block& code, size_t begin, size_t end, bool outputs) {
    bool loops = has_varying(code, begin, end);
    if (outputs)
        for (const Output& o : m_stage.outputs)
            loops = loops || (o.var >= 0 && m_stage.vars[size_t(o.var)].varying);
    Region r;
    r.loops = loops;
    r.function =
        Function::Create(llvm::FunctionType::get(m_void, {m_pointer}, false), Function::InternalLinkage,
                         m_symbol + ".r" + std::to_string(m_region_count++), m_module);
    r.function->addFnAttr(llvm::Attribute::NoUnwind);
    r.function->addFnAttr(llvm::Attribute::NoInline);
    m_b.CreateCall(r.function, {m_frame});

    const llvm::IRBuilder<>::InsertPointGuard guard(m_b);
    llvm::Value* const driver_frame = m_frame;
    m_frame = r.function->getArg(0);
    m_r = &r;
    r.entry = BasicBlock::Create(m_context, "entry", r.function);
    r.top = BasicBlock::Create(m_context, "top", r.function);
    BasicBlock* body = BasicBlock::Create(m_context, "body", r.function);
    BasicBlock* done = BasicBlock::Create(m_context, "done", r.function);
    BasicBlock* exit = BasicBlock::Create(m_context, "exit", r.function);
    llvm::PHINode* index = nullptr;
    if (loops) {
        m_b.SetInsertPoint(r.top);
        index = m_b.CreatePHI(m_long, 2, "index");
        index->addIncoming(m_b.getInt64(0), r.entry);
        r.index = index;
    }
    m_b.SetInsertPoint(r.entry);
    m_b.CreateBr(r.top);
    m_b.SetInsertPoint(r.top);
    m_b.CreateBr(body);
    m_b.SetInsertPoint(body);
    block(code, begin, end);
    if (outputs)
        write_outputs();
    m_b.CreateBr(done);
    m_b.SetInsertPoint(done);
    store_varying_vars();
    if (loops) {
        llvm::Value* next = m_b.CreateAdd(index, m_b.getInt64(uint64_t(m_lanes)));
        index->addIncoming(next, done);
        llvm::Value* count = nullptr;
        {
            const llvm::IRBuilder<>::InsertPointGuard entry_guard(m_b);
            m_b.SetInsertPoint(r.entry->getTerminator());
            count = m_b.CreateSExt(field(Count, m_int, "count"), m_long);
        }
        m_b.CreateCondBr(m_b.CreateICmpSLT(next, count), r.top, exit);
    } else {
        m_b.CreateBr(exit);
    }
    m_b.SetInsertPoint(exit);
    store_uniform_vars();
    m_b.CreateRetVoid();
    m_r = nullptr;
    m_frame = driver_frame;
}

// A position or normal that is not finite stays what it was. Slots are kept within their ranges by
// Instance::shade (ranges.cpp).
void StageEmitter::write_outputs() {
    const int padded = 16;
    for (size_t k = 0; k < m_stage.outputs.size(); k++) {
        const Output& o = m_stage.outputs[k];
        if (o.var < 0)
            continue;
        const Var& var = m_stage.vars[size_t(o.var)];
        const bool geometry = o.kind == Output::Position || o.kind == Output::Normal;
        Value v = load_var(o.var, var.varying || geometry);
        const bool varying = var.varying || geometry;
        if (geometry && !m_r->loops)
            continue; // a uniform position: nothing was moved
        const int n = comps(var.ty);
        if (geometry) {
            Instr original{Op::Input, Ty::Triple};
            original.imm = int(o.kind == Output::Position ? Input::P : Input::N);
            original.varying = true;
            const Value old = leaf(original);
            llvm::Value* good = nullptr;
            for (int c = 0; c < n; c++) {
                llvm::Value* size = m_b.CreateUnaryIntrinsic(llvm::Intrinsic::fabs, v.part[c]);
                llvm::Value* ok = m_b.CreateFCmpOLT(size, llvm::ConstantFP::get(size->getType(), 1e30));
                good = good ? m_b.CreateAnd(good, ok) : ok;
            }
            for (int c = 0; c < n; c++)
                v.part[c] = m_b.CreateSelect(good, v.part[c], old.part[c]);
        }
        llvm::Value* outs = field(Outputs, m_pointer, "outputs");
        for (int c = 0; c < n; c++) {
            llvm::Value* p = m_b.CreateLoad(
                m_pointer, m_b.CreateConstGEP1_32(m_pointer, outs, unsigned(int(k) * padded + c)));
            if (varying && m_r->loops)
                p = m_b.CreateGEP(m_float, p, m_r->index);
            m_b.CreateAlignedStore(v.part[c], p, llvm::Align(4));
        }
    }
}

} // namespace kanuka::sl
