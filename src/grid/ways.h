// Straight ways through air, which is made of volume shaders: what of the light at the far end is seen at the
// near one, and what joins it on the way.
#pragma once

#include <cstdint>

namespace kanuka::grid {

struct Ways {
    static constexpr int Most = 512; // that are asked about at once
    int count = 0;
    float from[3][Most], to[3][Most];     // render space
    float filter[3][Most], glow[3][Most]; // seen = filter * light at the far end + glow
    int32_t seed[Most];                   // of decisions by chance
    float time[Most], level[Most];        // bvh::RayPacket has the same
};

// Thread safety: look() may run on many threads.
class Air {
  public:
    virtual ~Air() = default;
    // Fills in filter and glow. `air`: LayeringProgram::air
    virtual void look(int air, Ways& ways) const = 0;
};

} // namespace kanuka::grid
