#include "ingest/rib/view_bound.h"

#include <cmath>
#include <limits>

#include "ingest/rib/context.h"

namespace kanuka::ingest {

static ViewBound view_bound(const Context& c, const scene::Camera& camera,
                            const std::optional<float>& frame_aspect_ratio, const Bounds3f& b,
                            const Transform& camera_from_bound) {
    using Projection = scene::Camera::Projection;
    const bool flat = camera.projection == Projection::Orthographic;
    const bool perspective = !flat; // for sizes, fisheyes too
    ViewBound result;
    double lo[2] = {1e300, 1e300}, hi[2] = {-1e300, -1e300};
    int behind = 0;
    for (int corner = 0; corner < 8; corner++) {
        const Vec3f p = camera_from_bound.point(
            {corner & 1 ? b.hi.x : b.lo.x, corner & 2 ? b.hi.y : b.lo.y, corner & 4 ? b.hi.z : b.lo.z});
        if (perspective && p.z <= camera.near_clip) {
            behind++;
            continue;
        }
        for (int k = 0; k < 2; k++) {
            const double s = perspective ? double(p[k]) / p.z : double(p[k]);
            lo[k] = std::min(lo[k], s);
            hi[k] = std::max(hi[k], s);
        }
    }
    result.outside = behind == 8 && camera.projection == Projection::Perspective;
    if (behind > 0) {
        result.area = std::numeric_limits<double>::infinity();
        return result;
    }
    const scene::Options& o = c.options.options;
    const double aspect = o.width * double(o.pixel_aspect) / o.height;
    std::array<float, 4> window{-1, 1, -1, 1};
    if (camera.screen_window)
        window = *camera.screen_window;
    else if (const double f = frame_aspect_ratio ? double(*frame_aspect_ratio) : aspect; f >= 1)
        window = {float(-f), float(f), -1, 1};
    else
        window = {-1, 1, float(-1 / f), float(1 / f)};
    const double focal = perspective ? 1 / std::tan(double(camera.fov) * 3.14159265358979323846 / 360) : 1;
    const double sx = focal * o.width / std::abs(double(window[1]) - window[0]);
    const double sy = focal * o.height / std::abs(double(window[3]) - window[2]);
    result.area = (hi[0] - lo[0]) * sx * (hi[1] - lo[1]) * sy * c.options.relative_detail;
    if (flat || camera.projection == Projection::Perspective)
        result.outside = hi[0] * focal < std::min(window[0], window[1]) ||
                         lo[0] * focal > std::max(window[0], window[1]) ||
                         hi[1] * focal < std::min(window[2], window[3]) ||
                         lo[1] * focal > std::max(window[2], window[3]);
    return result;
}

ViewBound view_bound(const Context& c, const Bounds3f& b, const Transform& camera_from_bound) {
    return view_bound(c, c.options.camera, c.options.frame_aspect_ratio, b, camera_from_bound);
}

ViewBound view_bound(const Context& c, const scene::Camera& camera, const Bounds3f& b,
                     const Transform& world_from_bound) {
    return view_bound(c, camera, std::nullopt, b, camera.camera_from_world * world_from_bound);
}

} // namespace kanuka::ingest
