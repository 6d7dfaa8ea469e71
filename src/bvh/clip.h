// Planes that cut away half of space each, for all rays: what Scene::clip leaves of a ray.
#pragma once

#include <vector>

#include "bvh/bvh.h"

namespace kanuka::bvh {

// One piece, since they all cut half of space.
template <int W>
RayPacket<W> clipped(RayPacket<W> rays, const std::vector<Scene::Plane>& planes, int times) {
    const size_t count = planes.size() / size_t(times);
    for (size_t p = 0; p < count; p++) {
        Vec3<Float<W>> point(planes[p].point), n(planes[p].normal);
        if (times > 1) { // linear between two times, as the camera is
            static_assert(sizeof(Scene::Plane) == 6 * sizeof(float));
            const int stride = int(6 * count);
            const Float<W> x = rays.time * Float<W>(float(times - 1));
            const Int<W> i = max(min(to_int(x), Int<W>(times - 2)), Int<W>(0)); // idle lanes have any time
            const Float<W> f = x - Float<W>(i);
            const float* first = &planes[p].point.x;
            for (int k = 0; k < 6; k++) {
                const Float<W> a = gather(first + k, i * Int<W>(stride)),
                               b = gather(first + stride + k, i * Int<W>(stride));
                (k < 3 ? point[k] : n[k - 3]) = fma(f, b - a, a);
            }
        }
        const Float<W> ahead = dot(point - rays.o, n), rises = dot(rays.d, n), t = ahead / rises;
        rays.t_max = select((rises > Float<W>(0.0f)) & (t < rays.t_max), t, rays.t_max);
        rays.t_min = select((rises < Float<W>(0.0f)) & (t > rays.t_min), t, rays.t_min);
        rays.active &= !((rises == Float<W>(0.0f)) & (ahead < Float<W>(0.0f)));
    }
    rays.active &= rays.t_min <= rays.t_max;
    return rays;
}

} // namespace kanuka::bvh
