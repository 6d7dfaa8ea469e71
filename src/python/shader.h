// What the bindings of compiled shaders share.
#pragma once

#include "python/bindings.h"
#include "sl/sl.h"

namespace kanuka::python {

// A compiled shader for those who only want to know it; Material names shaders by themselves.
struct ShaderInfo {
    std::shared_ptr<const sl::Shader> shader;
    std::string file; // its name; relative pictures are beside it
};

// A layering program as Python sees it: nodes, slots, bytes.
nb::dict describe(const grid::LayeringProgram& program);
void bind_shader_run(nb::class_<ShaderInfo>& shader);

} // namespace kanuka::python
