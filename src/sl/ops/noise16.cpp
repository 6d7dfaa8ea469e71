// The 16-lane noise kernels: this file alone is built for AVX-512 and is called only where the machine has
// it.
#define KANUKA_NOISE_ISA avx512
#include "sl/ops/noise_kernels.h"

namespace kanuka::sl::ops {

NoiseFunction noise_function16(const NoiseKernel& kernel) {
    return avx512::Kernel<16>::find(kernel, false);
}

} // namespace kanuka::sl::ops
