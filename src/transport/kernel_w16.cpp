// Compiled for the floor of AVX2, where sixteen lanes are pairs of registers: no faster than eight, but what
// AVX-512 will run is built and tested everywhere.
#include "transport/kernel_impl.h"

namespace kanuka::transport {

std::unique_ptr<Kernel> make_kernel_w16(const SceneView& scene) {
    return std::make_unique<KernelOf<16>>(scene);
}

} // namespace kanuka::transport
