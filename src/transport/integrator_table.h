// Who makes each integrator's kernel at 1, 8 and 16 lanes, and the wider two of AVX-512's instructions.
#pragma once

#include <memory>
#include <vector>

#include "transport/integrator.h"
#include "transport/kernel.h"

namespace kanuka::transport {

struct IntegratorRow {
    std::string_view name;
    const IntegratorInfo* info;
    using Make = std::unique_ptr<Kernel> (*)(const SceneView&, const IntegratorValues&);
    Make w1, w8, w8_avx512, w16, w16_avx512; // null: not built so
};

const std::vector<IntegratorRow>& integrator_table();

} // namespace kanuka::transport
