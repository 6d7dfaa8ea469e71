// The state of a batch of paths, structure of arrays. A batch is a run of pixels at one progression; its
// paths advance in step, one bounce at a time, and are kept dense: slot i of the arrays is the i-th living
// path.
#pragma once

#include <cstdint>
#include <vector>

#include "base/lanes.h"

namespace kanuka::transport {

inline constexpr int BatchSize = 1024;
inline constexpr int BatchPadded = BatchSize + 16; // lanes may read past the end

template <class T>
using Lane = T[BatchPadded];

// Hot: what a living path carries from bounce to bounce.
struct alignas(64) PathState {
    Lane<float> o[3], d[3];
    Lane<float> beta[4];  // throughput f / pdf(hero), a wavelength
    Lane<float> ratio[4]; // pdf(lambda_i) / pdf(hero) of the path so far; kept only where something disperses
    Lane<float> mis; // sum of ratios before the last bounce over the hero's pdf of it; 0 after a delta lobe
    // Densities with which light sampling at the last vertex would have asked for what this ray may find.
    Lane<float> ask_emitters, ask_map; // chance of the choice
    Lane<float> ask_constant;          // chance of the choice times cosine over pi
    Lane<float> ask_n[3];              // Receiver::N; kept only where scene.keeps_normals
    Lane<int32_t> ask_set;             // Receiver::set; kept only where scene.linked
    Lane<int32_t> path;                // index in the batch
    Lane<int32_t> interior;            // medium the path is in; -1 = none
};

// What a batch knows of each of its paths from first to last.
struct alignas(64) BatchState {
    Lane<float> l[4];       // normalised hero wavelengths
    Lane<float> inv_pdf[4]; // 1 / their density over [0, 1]
    Lane<float> radiance[4];
    Lane<int32_t> pixel_hash;
    // First hits, for AOVs.
    Lane<float> albedo[4], normal[3], position[3], depth, hit;
    Lane<float> alpha; // a hit, or a visible environment
    Lane<int32_t> id;
    Lane<float> filter_weight;
};

struct alignas(64) HitState {
    Lane<float> t, u, v, ng[3];
    Lane<int32_t> shape, prim, instanced;
    std::vector<float> world_from_shape[12]; // only where the scene has instances
    std::vector<int32_t> slot_shift;
};

struct alignas(64) ShadowState {
    Lane<float> o[3], d[3], t_max, contribution[4];
    Lane<int32_t> path, seed;
    Lane<int32_t> passes; // written only where scene.shadow_linked
};

} // namespace kanuka::transport
