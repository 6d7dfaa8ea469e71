#define KANUKA_NOISE_ISA avx2
#include "base/cpu.h"
#include "sl/ops/noise_kernels.h"

namespace kanuka::sl::ops {

NoiseFunction noise_function16(const NoiseKernel& kernel); // noise16.cpp

namespace {

using enum NoiseKind;
#define KANUKA_ROW(kind, name)                                                                               \
    {name "1_1", kind, 1, 1}, {name "2_1", kind, 2, 1}, {name "3_1", kind, 3, 1}, {name "4_1", kind, 4, 1},  \
        {name "1_3", kind, 1, 3}, {name "2_3", kind, 2, 3}, {name "3_3", kind, 3, 3},                        \
        {name "4_3", kind, 4, 3}
const NoiseKernel kernels[] = {KANUKA_ROW(Noise, "noise"), KANUKA_ROW(SignedNoise, "snoise"),
                               KANUKA_ROW(CellNoise, "cellnoise"), KANUKA_ROW(PeriodicNoise, "pnoise")};
#undef KANUKA_ROW

} // namespace

std::span<const NoiseKernel> noise_kernels() {
    return kernels;
}

int find_noise(NoiseKind kind, int dimensions, int results) {
    return int(kind) * 8 + (results == 3 ? 4 : 0) + dimensions - 1;
}

NoiseFunction noise_function(int kernel, int width) {
    const NoiseKernel& k = kernels[kernel];
    if (width == 16)
        return has_avx512() ? noise_function16(k) : nullptr;
    return avx2::Kernel<8>::find(k, width == 1);
}

} // namespace kanuka::sl::ops
