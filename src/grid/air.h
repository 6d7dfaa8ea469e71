// Segments of rays through air, which is made of volume shaders: transmittance, and what is scattered in.
#pragma once

#include <cstdint>

namespace kanuka::grid {

struct AirSegments {
    static constexpr int Most = 512; // evaluated at once
    int count = 0;
    float from[3][Most], to[3][Most]; // render space
    // seen = transmittance * light at the far end + inscatter
    float transmittance[3][Most], inscatter[3][Most];
    int32_t seed[Most];            // of decisions by chance
    float time[Most], level[Most]; // bvh::RayPacket has the same
};

// Thread safety: evaluate() may run on many threads.
class Air {
  public:
    virtual ~Air() = default;
    // Fills in transmittance and inscatter. `air`: LayeringProgram::air
    virtual void evaluate(int air, AirSegments& segments) const = 0;
};

} // namespace kanuka::grid
