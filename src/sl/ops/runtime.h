// The host's side of a running stage: what generated code calls for derivatives, textures, spaces, strings
// and the building of materials.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "sl/codegen/frame.h"
#include "sl/ir/plan.h"
#include "sl/sl.h"

namespace kanuka::sl::ops {

// What mnk_init and mnk_interior say.
struct MaterialBuild {
    struct Node {
        grid::LayerOp op = grid::LayerOp::Lobe;
        grid::LobeId lobe = grid::LobeId::LambertBrdf;
        std::string name, upper, lower;
        std::vector<int> given; // inputs with a value of their own
        std::vector<Vec3f> values;
        Loc loc;
    };
    std::vector<Node> nodes;
    bool has_boundary = false, has_interior = false;
    grid::Interior interior;
};

// One run of one stage.
struct Runner {
    const ir::Program& program;
    const ir::Stage& stage;
    Services& services;
    int columns = 0, rows = 0; // vertices in u and v; rows = 1: those of a mesh
    MaterialBuild* build = nullptr;
    std::deque<std::string> texts;            // made while running
    std::vector<int> faults;                  // lanes, by fault
    const grid::Stencils* stencils = nullptr; // of a mesh; null: no neighbours

    Location location(Loc loc) const;
    void report_faults();
};

// Differences to the next vertex: central inside, of second order at the edges; on a mesh by its stencils,
// and zero where it has none.
void difference_u(const Runner& runner, const float* x, float* out);
void difference_v(const Runner& runner, const float* x, float* out);

} // namespace kanuka::sl::ops
