// The surface of primitives without one, and of those whose shader cannot be had: RISpec's matte with Ka = Kd
// = 1.
#pragma once

#include <memory>

#include "sl/sl.h"

namespace kanuka::shade {

// What of Cs and Os varies over the primitive, and whether Os cuts out.
struct DefaultSurface {
    bool varying_color = false;
    bool has_presence = false, varying_presence = false;
};

// Needs no compiler and no shader file, so a picture can be made where neither works.
std::unique_ptr<sl::Instance> make_default_surface(const DefaultSurface& kind);

} // namespace kanuka::shade
