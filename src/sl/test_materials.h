// Instances of shaders and their lobes.
#pragma once

#include "sl/test_support.h"

namespace kanuka::sl::test {

using grid::LayerOp;
using grid::LobeId;

inline std::unique_ptr<Instance> make(const std::string& source, TestServices& services,
                                      std::span<const Argument> args = {}) {
    const auto shader = compile(source);
    return shader ? shader->instantiate(args, services) : nullptr;
}

inline std::vector<LobeId> lobes(const grid::LayeringProgram& p) {
    std::vector<LobeId> l;
    for (const auto& n : p.nodes)
        if (n.op == LayerOp::Lobe)
            l.push_back(n.lobe);
    return l;
}

} // namespace kanuka::sl::test
