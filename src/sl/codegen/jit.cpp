#include "sl/codegen/codegen.h"

#include <memory>
#include <mutex>
#include <type_traits>

// Of LLVM's optimiser and code generator the C interface: the C++ headers take 15 s more to compile.
#include <llvm-c/Analysis.h>
#include <llvm-c/Core.h>
#include <llvm-c/TargetMachine.h>
#include <llvm-c/Transforms/PassBuilder.h>
#include <llvm/Config/llvm-config.h>
#include <llvm/IR/Module.h>

#include "base/cpu.h"
#include "sl/codegen/emit.h"

namespace kanuka::sl {

namespace {

constexpr const char* Triple = "x86_64-unknown-linux-gnu";

struct Disposer {
    void operator()(LLVMTargetMachineRef m) const { LLVMDisposeTargetMachine(m); }
    void operator()(LLVMTargetDataRef d) const { LLVMDisposeTargetData(d); }
    void operator()(LLVMMemoryBufferRef b) const { LLVMDisposeMemoryBuffer(b); }
    void operator()(LLVMPassBuilderOptionsRef o) const { LLVMDisposePassBuilderOptions(o); }
    void operator()(char* text) const { LLVMDisposeMessage(text); }
};
template <class Ref>
using Owned = std::unique_ptr<std::remove_pointer_t<Ref>, Disposer>;

[[noreturn]] void fail(const char* what, char* why) {
    const Owned<char*> text(why);
    throw kanuka::Error(std::string(what) + ": " + (text ? text.get() : "no reason given"),
                        ExitCode::Internal);
}

LLVMTargetRef target() {
    static std::once_flag once;
    std::call_once(once, [] {
        LLVMInitializeNativeTarget();
        LLVMInitializeNativeAsmPrinter();
    });
    LLVMTargetRef found = nullptr;
    char* why = nullptr;
    if (LLVMGetTargetFromTriple(Triple, &found, &why))
        fail("the code generator", why);
    return found;
}

Owned<LLVMTargetMachineRef> machine(int lanes, int opt_level) {
    // Fixed floors, never the host's own features: a cache entry runs wherever its lane count does.
    const char* cpu = lanes == 16 ? "x86-64-v4" : "x86-64-v3";
    const LLVMCodeGenOptLevel level = opt_level <= 0   ? LLVMCodeGenLevelNone
                                      : opt_level == 1 ? LLVMCodeGenLevelLess
                                                       : LLVMCodeGenLevelDefault;
    return Owned<LLVMTargetMachineRef>(
        LLVMCreateTargetMachine(target(), Triple, cpu, "", level, LLVMRelocPIC, LLVMCodeModelSmall));
}

// Regions are one loop each whose body is already vectorised: what pays is keeping variables in registers,
// common subexpressions and moving what is uniform out of the loop.
const char* passes(int opt_level) {
    switch (opt_level) {
    case 1:
        return "function(sroa<modify-cfg>,early-cse<memssa>,simplifycfg,instcombine,adce,simplifycfg)";
    case 2:
        return "function(sroa<modify-cfg>,early-cse<memssa>,simplifycfg,instcombine,"
               "loop-mssa(licm),gvn,instcombine,adce,simplifycfg)";
    default:
        return "default<O2>";
    }
}

void optimise(LLVMModuleRef module, LLVMTargetMachineRef machine, int opt_level) {
    if (opt_level <= 0)
        return;
    const Owned<LLVMPassBuilderOptionsRef> options(LLVMCreatePassBuilderOptions());
    if (const LLVMErrorRef error = LLVMRunPasses(module, passes(opt_level), machine, options.get())) {
        char* said = LLVMGetErrorMessage(error);
        const std::string why = said;
        LLVMDisposeErrorMessage(said);
        throw kanuka::Error("the optimiser: " + why, ExitCode::Internal);
    }
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
    Owned<LLVMTargetMachineRef> machine;
    llvm::Module module;

    LLVMModuleRef ref() { return llvm::wrap(&module); }

    Compiled(const ir::Program& program, std::span<const StageToCompile> stages, int lanes, int opt_level)
        : machine(sl::machine(lanes, opt_level)), module(program.name, context) {
        LLVMSetTarget(ref(), Triple);
        const Owned<LLVMTargetDataRef> layout(LLVMCreateTargetDataLayout(machine.get()));
        LLVMSetModuleDataLayout(ref(), layout.get());
        for (const StageToCompile& s : stages)
            StageEmitter(module, program, *s.stage, *s.plan, s.lanes, s.symbol).emit();
        if (lanes == 16)
            for (llvm::Function& f : module)
                if (!f.isDeclaration()) {
                    f.addFnAttr("prefer-vector-width", "512");
                    f.addFnAttr("min-legal-vector-width", "512");
                }
        char* said = nullptr;
        const bool bad = LLVMVerifyModule(ref(), LLVMReturnStatusAction, &said);
        const Owned<char*> problem(said);
        if (bad)
            throw kanuka::Error("shader \"" + program.name + "\" became invalid code: " + problem.get(),
                                ExitCode::Internal);
        optimise(ref(), machine.get(), opt_level);
    }

    std::string emitted(LLVMCodeGenFileType type) {
        char* why = nullptr;
        LLVMMemoryBufferRef made = nullptr;
        if (LLVMTargetMachineEmitToMemoryBuffer(machine.get(), ref(), type, &why, &made))
            fail("the code generator", why);
        const Owned<LLVMMemoryBufferRef> buffer(made);
        return {LLVMGetBufferStart(made), LLVMGetBufferSize(made)};
    }
};

} // namespace

std::string compile_object(const ir::Program& program, std::span<const StageToCompile> stages, int lanes,
                           int opt_level) {
    return Compiled(program, stages, lanes, opt_level).emitted(LLVMObjectFile);
}

std::string compile_text(const ir::Program& program, std::span<const StageToCompile> stages, int lanes,
                         int opt_level, bool assembly) {
    Compiled c(program, stages, lanes, opt_level);
    if (assembly)
        return c.emitted(LLVMAssemblyFile);
    const Owned<char*> text(LLVMPrintModuleToString(c.ref()));
    return text.get();
}

} // namespace kanuka::sl
