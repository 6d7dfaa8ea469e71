// Stages to machine code. LLVM stays behind this header.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "sl/codegen/frame.h"
#include "sl/ir/plan.h"

namespace kanuka::sl {

// Machine code in memory; it lives as long as this.
class NativeCode {
  public:
    virtual ~NativeCode() = default;
    virtual StageFunction find(const std::string& symbol) const = 0;
};

struct StageToCompile {
    std::string symbol;
    const ir::Stage* stage;
    const ir::Plan* plan;
    int lanes;
};

// The widest lane count that this machine runs: 8, or 16 with AVX-512.
int widest_lanes();
// An object file, by LLVM. Throws Error if LLVM fails: a defect.
std::string compile_object(const ir::Program& program, std::span<const StageToCompile> stages, int lanes,
                           int opt_level);
// The same as text: LLVM's representation after optimisation, or assembly.
std::string compile_text(const ir::Program& program, std::span<const StageToCompile> stages, int lanes,
                         int opt_level, bool assembly);
// Links an object into memory. Throws Error for what is no object.
std::unique_ptr<NativeCode> link_object(std::string_view object);
std::string backend_version();

} // namespace kanuka::sl
