// Typed tree to IR: one Stage for each entry point, functions inlined, the Mnk calls turned into channels and
// host calls. The parts, one for each concern, are in lower/: they share a LowerContext (lower/context.h).
#pragma once

#include <map>

#include "sl/ir/ir.h"
#include "sl/sema/linked.h"
#include "sl/sema/sema.h"

namespace kanuka::sl::ir {

struct LowerOptions {
    // Illuminance loops, by number, that closures.cpp could not read as lobes, and where it gave up.
    std::map<int, Loc> projected;
    std::vector<Connection> connections; // to co-shaders and layers
    bool any_shader = false;             // variables' handles stand for any co-shader
    int array_room = ResizableRoom;      // of arrays that grow in loops whose length is not seen
};

struct LowerResult {
    // A call has not reckoned with a co-shader that its handle may be: the program is of no use, and
    // any_shader is wanted.
    bool missed_shaders = false;
};

LowerResult lower(Program& program, Sema& sema, Diagnostics& diagnostics, ast::ShaderDecl& shader,
                  const LowerOptions& options);

} // namespace kanuka::sl::ir
