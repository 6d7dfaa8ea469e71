// Who is told how wide rays are where they hit something: a dicing oracle (render/oracle.h).
#pragma once

#include "base/vec.h"

namespace kanuka::transport {

struct Footprint {
    int object;                    // its id
    Vec3f P;                       // in render space
    const float* world_from_shape; // of what is instanced: rows of a 3x4 matrix; null = render space
    float width;                   // of the ray, across
};

// Thread safety: note() may run at the same time.
class FootprintLog {
  public:
    virtual ~FootprintLog() = default;
    virtual void note(const Footprint& footprint) = 0;
    virtual float pixel_spread() const = 0; // of a camera ray, a unit of its length
};

} // namespace kanuka::transport
