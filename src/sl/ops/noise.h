// The noise kernels that compiled shaders call: W points at a time, one source for every W, the same bits at
// each.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace kanuka::sl::ops {

enum class NoiseKind : uint8_t { Noise, SignedNoise, CellNoise, PeriodicNoise };

// in: `inputs` floats a lane, component after component (in[c * W + lane]); out likewise.
using NoiseFunction = void (*)(const float* in, float* out);

struct NoiseKernel {
    std::string_view symbol; // without the width
    NoiseKind kind;
    int dimensions; // 1 to 4
    int results;    // 1 or 3
    int inputs() const { return kind == NoiseKind::PeriodicNoise ? 2 * dimensions : dimensions; }
};

std::span<const NoiseKernel> noise_kernels();
int find_noise(NoiseKind kind, int dimensions, int results);
// width: 1, 8 or 16 (16 needs AVX-512: null elsewhere).
NoiseFunction noise_function(int kernel, int width);

} // namespace kanuka::sl::ops
