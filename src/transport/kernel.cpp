#include "transport/kernel.h"

#include "color/color.h"
#include "transport/stage_film.h"

namespace kanuka::transport {

std::unique_ptr<Kernel> make_kernel_w1(const SceneView& scene, const RgbFromXyz& matrix);
std::unique_ptr<Kernel> make_kernel_w8(const SceneView& scene, const RgbFromXyz& matrix);
std::unique_ptr<Kernel> make_kernel_w16(const SceneView& scene, const RgbFromXyz& matrix);

int widest_lanes() {
    return 8;
} // sixteen run as pairs of AVX2 registers, which gains nothing

std::unique_ptr<Kernel> make_kernel(const SceneView& scene, int lanes) {
    RgbFromXyz matrix;
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            matrix.m[3 * r + c] = color::rgb_from_xyz[size_t(r)][size_t(c)];
    if (lanes == 0)
        lanes = widest_lanes();
    switch (lanes) {
    case 1:
        return make_kernel_w1(scene, matrix);
    case 8:
        return make_kernel_w8(scene, matrix);
    case 16:
        return make_kernel_w16(scene, matrix);
    default:
        throw Error("lanes must be 1, 8 or 16", ExitCode::Usage);
    }
}

} // namespace kanuka::transport
