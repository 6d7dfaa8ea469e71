// From film to rays: the projection, the lens, and where the camera is at a time.
#pragma once

#include "base/projection.h"
#include "scene/shutter.h"
#include "transport/scene_view.h"

namespace kanuka::transport {

// Linear interpolation in a table of `segments` + 1 entries over [0, 1).
template <int W>
Float<W> quantile(const float* table, int segments, Float<W> u) {
    const Float<W> x = u * Float<W>(float(segments));
    const Int<W> i = min(to_int(x), Int<W>(segments - 1));
    const Float<W> a = gather(table, i), b = gather(table + 1, i);
    return fma(x - Float<W>(i), b - a, a);
}

// A point of the iris, every part of its area as likely as any other.
template <int W>
void sample_lens(const CameraView& cam, Float<W> u0, Float<W> u1, Float<W>& x, Float<W>& y) {
    using F = Float<W>;
    const F r = sqrt(u1) * F(cam.lens_radius); // in a disk, or in one of the triangles about the centre
    F s, c;
    if (cam.blades < 3) {
        sincos_2pi(u0, s, c);
        x = r * c;
        y = r * s;
    } else {
        const F n(float(cam.blades)), scaled = u0 * n;
        const F k = min(floor(scaled), n - F(1.0f)), f = scaled - k;
        const F next = k + F(1.0f);
        F s1, c1;
        sincos_2pi(k / n, s, c);
        sincos_2pi(select(next >= n, F(0.0f), next / n), s1, c1);
        const F px = fma(f, c1 - c, c), py = fma(f, s1 - s, s);
        x = r * (px * F(cam.blade_cos) - py * F(cam.blade_sin));
        y = r * (px * F(cam.blade_sin) + py * F(cam.blade_cos));
    }
    x = x / F(cam.squeeze);
}

// In camera space; d is not normalised. False where a fisheye sees nothing. A thin lens bends rays through
// what is in focus: a plane for flat pictures, a sphere about the eye for fisheyes and spherical cameras,
// whose lens faces every ray.
template <int W>
Mask<W> camera_ray(const CameraView& cam, Float<W> fx, Float<W> fy, Float<W> lens_x, Float<W> lens_y,
                   Vec3<Float<W>>& o, Vec3<Float<W>>& d) {
    using F = Float<W>;
    const bool flat = cam.projection == Projection::Perspective || cam.projection == Projection::Orthographic;
    o = {F(0.0f), F(0.0f), F(0.0f)};
    Mask<W> seen = F(1.0f) > F(0.0f);
    if (cam.projection == Projection::Orthographic) {
        o = {fx, fy, F(0.0f)};
        d = {F(0.0f), F(0.0f), F(1.0f)};
    } else {
        seen = direction_of_film(cam.projection, cam.half_angle, fx, fy, d);
    }
    if (cam.lens_radius > 0) {
        const Vec3<F> focus = o + d * F(cam.focal_distance);
        Vec3<F> shift(lens_x, lens_y, F(0.0f));
        if (!flat) {
            Vec3<F> t, b;
            coordinate_frame(d, t, b);
            shift = t * lens_x + b * lens_y;
        }
        o += shift;
        d = focus - o;
        d = flat ? d / d.z : normalize(d);
    }
    o += d * F(cam.near_clip);
    return seen;
}

// To render space, where the camera is at `time`.
template <int W>
void leave_camera(const CameraView& cam, const Vec3<Float<W>>& o, const Vec3<Float<W>>& d, Float<W> time,
                  Vec3<Float<W>>& O, Vec3<Float<W>>& D) {
    using F = Float<W>;
    F m[12];
    if (cam.motion.empty()) {
        for (int k = 0; k < 12; k++)
            m[k] = F(cam.render_from_camera[k]);
    } else {
        const F x = time * F(float(CameraView::MotionSteps));
        const Int<W> i = min(to_int(x), Int<W>(CameraView::MotionSteps - 1));
        const F f = x - F(i);
        for (int k = 0; k < 12; k++) {
            const F a = gather(cam.motion.data() + k, i * Int<W>(12)),
                    b = gather(cam.motion.data() + 12 + k, i * Int<W>(12));
            m[k] = fma(f, b - a, a);
        }
    }
    const auto turn = [&](const Vec3<F>& v, int r, float w) {
        return fma(m[4 * r], v.x, fma(m[4 * r + 1], v.y, fma(m[4 * r + 2], v.z, m[4 * r + 3] * F(w))));
    };
    O = {turn(o, 0, 1), turn(o, 1, 1), turn(o, 2, 1)};
    D = normalize(Vec3<F>(turn(d, 0, 0), turn(d, 1, 0), turn(d, 2, 0)));
}

} // namespace kanuka::transport
