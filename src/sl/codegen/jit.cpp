#include "sl/codegen/codegen.h"

#include <mutex>

#include <llvm/Analysis/CGSCCPassManager.h>
#include <llvm/Analysis/LoopAnalysisManager.h>
#include <llvm/ExecutionEngine/Orc/CompileUtils.h>
#include <llvm/ExecutionEngine/Orc/JITTargetMachineBuilder.h>
#include <llvm/IR/LegacyPassManager.h>
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

#include "base/cpu.h"
#include "sl/codegen/emit.h"

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

} // namespace

int widest_lanes() {
    return has_avx512() ? 16 : 8;
}

std::string backend_version() {
    return LLVM_VERSION_STRING;
}

namespace {

// The stages as an optimised module of LLVM's.
struct Compiled {
    llvm::LLVMContext context;
    std::unique_ptr<llvm::TargetMachine> machine;
    std::unique_ptr<llvm::Module> module;

    Compiled(const ir::Program& program, std::span<const StageToCompile> stages, int lanes, int opt_level) {
        orc::JITTargetMachineBuilder builder = sl::machine(lanes, opt_level);
        auto made = builder.createTargetMachine();
        if (!made)
            fail("the code generator", made.takeError());
        machine = std::move(*made);
        module = std::make_unique<llvm::Module>(program.name, context);
        module->setTargetTriple(builder.getTargetTriple().str());
        module->setDataLayout(machine->createDataLayout());
        for (const StageToCompile& s : stages)
            StageEmitter(*module, program, *s.stage, *s.plan, s.lanes, s.symbol).emit();
        if (lanes == 16)
            for (llvm::Function& f : *module)
                if (!f.isDeclaration()) {
                    f.addFnAttr("prefer-vector-width", "512");
                    f.addFnAttr("min-legal-vector-width", "512");
                }
        std::string problem;
        llvm::raw_string_ostream stream(problem);
        if (llvm::verifyModule(*module, &stream))
            throw kanuka::Error("shader \"" + program.name + "\" became invalid code: " + stream.str(),
                                ExitCode::Internal);
        optimise(*module, *machine, opt_level);
    }
};

} // namespace

std::string compile_object(const ir::Program& program, std::span<const StageToCompile> stages, int lanes,
                           int opt_level) {
    Compiled c(program, stages, lanes, opt_level);
    auto object = orc::SimpleCompiler(*c.machine)(*c.module);
    if (!object)
        fail("the code generator", object.takeError());
    return (*object)->getBuffer().str();
}

std::string compile_text(const ir::Program& program, std::span<const StageToCompile> stages, int lanes,
                         int opt_level, bool assembly) {
    Compiled c(program, stages, lanes, opt_level);
    if (!assembly) {
        std::string text;
        llvm::raw_string_ostream(text) << *c.module;
        return text;
    }
    llvm::SmallString<0> text;
    llvm::raw_svector_ostream stream(text);
    llvm::legacy::PassManager passes;
    if (c.machine->addPassesToEmitFile(passes, stream, nullptr, llvm::CodeGenFileType::AssemblyFile))
        throw kanuka::Error("the code generator cannot write assembly", ExitCode::Internal);
    passes.run(*c.module);
    return std::string(text);
}

} // namespace kanuka::sl
