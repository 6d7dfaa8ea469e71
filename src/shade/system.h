// The shading system with its compiler passed in, so that tests can do without one.
#pragma once

#include <functional>

#include "shade/shade.h"
#include "sl/sl.h"

namespace kanuka::shade {

// Null = did not compile; why is in the journal.
using CompileShader = std::function<std::shared_ptr<const sl::Shader>(const std::string& path,
                                                                      const sl::CompileOptions&, Journal&)>;

std::unique_ptr<ShadingSystem> make_shading_system(const ShadingOptions& options, const scene::Scene& scene,
                                                   Journal& journal, CompileShader compile);

} // namespace kanuka::shade
