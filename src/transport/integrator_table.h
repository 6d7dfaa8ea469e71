// Who makes each integrator's kernel at 1, 8 and 16 lanes, and at 16 with AVX-512.
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
    Make w1, w8, w16, w16_avx512; // null: not built with as many lanes
};

const std::vector<IntegratorRow>& integrator_table();

} // namespace kanuka::transport
