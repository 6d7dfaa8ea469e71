#include "transport/kernel_impl.h"

namespace kanuka::transport {

std::unique_ptr<Kernel> make_kernel_w1(const SceneView& scene) {
    return std::make_unique<KernelOf<1>>(scene);
}

} // namespace kanuka::transport
