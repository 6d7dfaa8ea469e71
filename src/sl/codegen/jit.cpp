#include "sl/codegen/codegen.h"

#include <mutex>

#include <llvm/Analysis/CGSCCPassManager.h>
#include <llvm/Analysis/LoopAnalysisManager.h>
#include <llvm/ExecutionEngine/Orc/CompileUtils.h>
#include <llvm/ExecutionEngine/Orc/JITTargetMachineBuilder.h>
#include <llvm/ExecutionEngine/Orc/LLJIT.h>
#include <llvm/IR/Verifier.h>
#include <llvm/Passes/PassBuilder.h>
#include <llvm/Support/TargetSelect.h>
#include <llvm/Target/TargetMachine.h>
#include <llvm/Transforms/InstCombine/InstCombine.h>
#include <llvm/Transforms/Scalar/ADCE.h>
#include <llvm/Transforms/Scalar/EarlyCSE.h>
#include <llvm/Transforms/Scalar/GVN.h>
#include <llvm/Transforms/Scalar/LICM.h>
#include <llvm/Transforms/Scalar/LoopPassManager.h>
#include <llvm/Transforms/Scalar/SROA.h>
#include <llvm/Transforms/Scalar/SimplifyCFG.h>

#include "sl/codegen/emit.h"
#include "sl/ops/noise.h"

// libmvec's functions, by address only.
#define KANUKA_MATH1(X)                                                                                      \
    X(sin) X(cos) X(tan) X(asin) X(acos) X(atan) X(exp) X(log) X(log2) X(log10) X(exp2) X(cbrt)
#define KANUKA_DECLARE1(name)                                                                                \
    void _ZGVdN8v_##name##f();                                                                               \
    void _ZGVeN16v_##name##f();                                                                              \
    float name##f(float);
extern "C" {
#undef log
KANUKA_MATH1(KANUKA_DECLARE1)
void _ZGVdN8vv_powf();
void _ZGVdN8vv_atan2f();
void _ZGVeN16vv_powf();
void _ZGVeN16vv_atan2f();
float powf(float, float);
float atan2f(float, float);
}

namespace kanuka::sl {

namespace orc = llvm::orc;

namespace {

void initialise_llvm() {
    static std::once_flag once;
    std::call_once(once, [] {
        llvm::InitializeNativeTarget();
        llvm::InitializeNativeTargetAsmPrinter();
    });
}

orc::JITTargetMachineBuilder machine(int lanes, int opt_level) {
    initialise_llvm();
    // Fixed floors, never the host's own features: a cache entry runs wherever its lane count does.
    orc::JITTargetMachineBuilder m{llvm::Triple("x86_64-unknown-linux-gnu")};
    m.setCPU(lanes == 16 ? "x86-64-v4" : "x86-64-v3");
    m.setRelocationModel(llvm::Reloc::PIC_);
    m.setCodeModel(llvm::CodeModel::Small);
    m.setCodeGenOptLevel(opt_level <= 0   ? llvm::CodeGenOptLevel::None
                         : opt_level == 1 ? llvm::CodeGenOptLevel::Less
                                          : llvm::CodeGenOptLevel::Default);
    return m;
}

[[noreturn]] void fail(const char* what, llvm::Error error) {
    throw kanuka::Error(std::string(what) + ": " + llvm::toString(std::move(error)), ExitCode::Internal);
}

// Regions are one loop each whose body is already vectorised: what pays is keeping variables in registers,
// common subexpressions and moving what is uniform out of the loop.
void optimise(llvm::Module& module, llvm::TargetMachine& tm, int opt_level) {
    if (opt_level <= 0)
        return;
    llvm::LoopAnalysisManager lam;
    llvm::FunctionAnalysisManager fam;
    llvm::CGSCCAnalysisManager cgam;
    llvm::ModuleAnalysisManager mam;
    llvm::PassBuilder pb(&tm);
    pb.registerModuleAnalyses(mam);
    pb.registerCGSCCAnalyses(cgam);
    pb.registerFunctionAnalyses(fam);
    pb.registerLoopAnalyses(lam);
    pb.crossRegisterProxies(lam, fam, cgam, mam);
    if (opt_level >= 3) {
        pb.buildPerModuleDefaultPipeline(llvm::OptimizationLevel::O2).run(module, mam);
        return;
    }
    llvm::FunctionPassManager fpm;
    fpm.addPass(llvm::SROAPass(llvm::SROAOptions::ModifyCFG));
    fpm.addPass(llvm::EarlyCSEPass(true));
    fpm.addPass(llvm::SimplifyCFGPass());
    fpm.addPass(llvm::InstCombinePass());
    if (opt_level >= 2) {
        fpm.addPass(llvm::createFunctionToLoopPassAdaptor(llvm::LICMPass(llvm::LICMOptions()), true));
        fpm.addPass(llvm::GVNPass());
        fpm.addPass(llvm::InstCombinePass());
    }
    fpm.addPass(llvm::ADCEPass());
    fpm.addPass(llvm::SimplifyCFGPass());
    llvm::ModulePassManager mpm;
    mpm.addPass(llvm::createModuleToFunctionPassAdaptor(std::move(fpm)));
    mpm.run(module, mam);
}

orc::SymbolMap host_symbols(orc::MangleAndInterner& mangle) {
    orc::SymbolMap map;
    const auto add = [&](const std::string& name, void* address) {
        map[mangle(name)] = {orc::ExecutorAddr::fromPtr(address), llvm::JITSymbolFlags::Exported};
    };
    const auto function = [&](const std::string& name, auto* f) { add(name, reinterpret_cast<void*>(f)); };
    function("kanuka_sl_call", &kanuka_sl_call);
    function("kanuka_sl_fault", &kanuka_sl_fault);
    function("kanuka_sl_any", &kanuka_sl_any);
    function("kanuka_sl_same", &kanuka_sl_same);
#define KANUKA_ADD1(name)                                                                                    \
    function("_ZGVdN8v_" #name "f", &_ZGVdN8v_##name##f);                                                    \
    function("_ZGVeN16v_" #name "f", &_ZGVeN16v_##name##f);                                                  \
    function(#name "f", &::name##f);
    KANUKA_MATH1(KANUKA_ADD1)
    function("_ZGVdN8vv_powf", &_ZGVdN8vv_powf);
    function("_ZGVeN16vv_powf", &_ZGVeN16vv_powf);
    function("powf", &::powf);
    function("_ZGVdN8vv_atan2f", &_ZGVdN8vv_atan2f);
    function("_ZGVeN16vv_atan2f", &_ZGVeN16vv_atan2f);
    function("atan2f", &::atan2f);
    // What the code generator may call by itself.
    function("memcpy", &memcpy);
    function("memset", &memset);
    function("memmove", &memmove);
    for (size_t k = 0; k < ops::noise_kernels().size(); k++)
        for (int width : {1, 8, 16})
            if (ops::NoiseFunction f = ops::noise_function(int(k), width))
                function("kanuka_" + std::string(ops::noise_kernels()[k].symbol) + "_w" +
                             std::to_string(width),
                         f);
    return map;
}

class LinkedCode : public NativeCode {
  public:
    explicit LinkedCode(std::unique_ptr<orc::LLJIT> jit) : m_jit(std::move(jit)) {}
    StageFunction find(const std::string& symbol) const override {
        auto found = m_jit->lookup(symbol);
        if (!found)
            fail("linking a shader", found.takeError());
        return found->toPtr<StageFunction>();
    }

  private:
    std::unique_ptr<orc::LLJIT> m_jit;
};

} // namespace

int widest_lanes() {
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
                   __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl")
               ? 16
               : 8;
}

std::string backend_version() {
    return LLVM_VERSION_STRING;
}

std::string compile_object(const ir::Program& program, std::span<const StageToCompile> stages, int lanes,
                           int opt_level) {
    orc::JITTargetMachineBuilder builder = machine(lanes, opt_level);
    auto tm = builder.createTargetMachine();
    if (!tm)
        fail("the code generator", tm.takeError());
    llvm::LLVMContext context;
    llvm::Module module(program.name, context);
    module.setTargetTriple(builder.getTargetTriple().str());
    module.setDataLayout((*tm)->createDataLayout());
    for (const StageToCompile& s : stages)
        StageEmitter(module, program, *s.stage, *s.plan, s.lanes, s.symbol).emit();
    if (lanes == 16)
        for (llvm::Function& f : module)
            if (!f.isDeclaration()) {
                f.addFnAttr("prefer-vector-width", "512");
                f.addFnAttr("min-legal-vector-width", "512");
            }
    std::string problem;
    llvm::raw_string_ostream stream(problem);
    if (llvm::verifyModule(module, &stream))
        throw kanuka::Error("shader \"" + program.name + "\" became invalid code: " + stream.str(),
                            ExitCode::Internal);
    optimise(module, **tm, opt_level);
    auto object = orc::SimpleCompiler(**tm)(module);
    if (!object)
        fail("the code generator", object.takeError());
    return (*object)->getBuffer().str();
}

std::unique_ptr<NativeCode> link_object(const std::string& object, int lanes) {
    auto jit = orc::LLJITBuilder()
                   .setJITTargetMachineBuilder(machine(lanes, 2))
                   .setPlatformSetUp(orc::setUpInactivePlatform)
                   .setLinkProcessSymbolsByDefault(false)
                   .create();
    if (!jit)
        fail("linking a shader", jit.takeError());
    orc::MangleAndInterner mangle((*jit)->getExecutionSession(), (*jit)->getDataLayout());
    (*jit)->getExecutionSession().setErrorReporter([](llvm::Error e) { llvm::consumeError(std::move(e)); });
    if (auto e = (*jit)->getMainJITDylib().define(orc::absoluteSymbols(host_symbols(mangle))))
        fail("linking a shader", std::move(e));
    if (auto e = (*jit)->addObjectFile(llvm::MemoryBuffer::getMemBufferCopy(object)))
        fail("linking a shader", std::move(e));
    return std::make_unique<LinkedCode>(std::move(*jit));
}

} // namespace kanuka::sl
