// Streams of hashed numbers: what rays and collisions are decided by, where points of a net would gain
// nothing. (Nets are named in base/sampling.h.) All streams stand here, so that no two decisions share one
// unseen.
#pragma once

#include "base/sampling.h"

namespace kanuka::transport {

// Differs from bounce to bounce by `step`.
struct SeedStream {
    uint32_t step, offset = 0;
};

namespace seeds {
inline constexpr SeedStream ClosestHit{0x3c6ef372u};
inline constexpr SeedStream ShadowRay{0x3c6ef372u, 0x1b873593u};
inline constexpr SeedStream FogShadowRay{0x3c6ef372u, 0x2545f491u}; // to a lamp, from a place along the ray
inline constexpr SeedStream Air{0x2545f491u, 0x7feb352du};
inline constexpr SeedStream Collisions{0x85ebca6bu, uint32_t(Net::FirstMedium) * 0x85ebca6bu};
inline constexpr SeedStream ShadowCollisions{0xc2b2ae35u}; // of a shadow ray; its segments count as bounces
// Beside the numbers of a collision's own stream.
inline constexpr int IsRealCollision = 0x68bc21eb, MarchedDepth = 0x2f6b79c5;
} // namespace seeds

// Of a path: the same at every call.
template <int W>
Int<W> seed_of(SeedStream stream, Int<W> pixel, int bounce, uint32_t reversed_progression) {
    const Int<W> of_path = pixel ^ Int<W>(int(uint32_t(bounce) * stream.step + stream.offset));
    return hash_bits(of_path ^ Int<W>(int(reversed_progression * 0x9e3779b9u + 0x51ed270bu)));
}

} // namespace kanuka::transport
