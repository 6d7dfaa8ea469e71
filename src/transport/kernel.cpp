#include "transport/kernel.h"

#include "base/error.h"

namespace kanuka::transport {

std::unique_ptr<Kernel> make_kernel_w1(const SceneView& scene);
std::unique_ptr<Kernel> make_kernel_w8(const SceneView& scene);
std::unique_ptr<Kernel> make_kernel_w16(const SceneView& scene);

int widest_lanes() {
    return 8;
} // sixteen run as pairs of AVX2 registers, which gains nothing

std::unique_ptr<Kernel> make_kernel(const SceneView& scene, int lanes) {
    if (lanes == 0)
        lanes = widest_lanes();
    switch (lanes) {
    case 1:
        return make_kernel_w1(scene);
    case 8:
        return make_kernel_w8(scene);
    case 16:
        return make_kernel_w16(scene);
    default:
        throw Error("lanes must be 1, 8 or 16", ExitCode::Usage);
    }
}

} // namespace kanuka::transport
