#include "render/camera.h"

#include <algorithm>
#include <cmath>

namespace kanuka::render {

namespace {

void place_film(const scene::Camera& c, const scene::Options& o, transport::CameraView& v) {
    const float aspect = float(o.width) * o.pixel_aspect / float(o.height);
    std::array<float, 4> screen = aspect >= 1 ? std::array<float, 4>{-aspect, aspect, -1, 1}
                                              : std::array<float, 4>{-1, 1, -1 / aspect, 1 / aspect};
    if (c.projection == Projection::Spherical)
        screen = {-1, 1, -1, 1}; // the whole sphere, whatever the picture's shape
    if (c.screen_window)
        screen = *c.screen_window;
    const float most = kind_of(c.projection).largest_fov;
    const float half_fov = std::clamp(c.fov, 0.01f, most > 0 ? most : 360.0f) * 0.5f * Pi / 180;
    const float half = c.projection == Projection::Perspective ? std::tan(half_fov) : 1.0f;
    v.projection = c.projection;
    v.half_angle = half_fov;
    v.left = screen[0] * half;
    v.right = screen[1] * half;
    v.bottom = screen[2] * half;
    v.top = screen[3] * half;
    v.width = o.width;
    v.height = o.height;
    const float across = std::abs(v.right - v.left), up = std::abs(v.top - v.bottom);
    if (!(across > 0 && up > 0 && std::isfinite(across) && std::isfinite(up)))
        throw Error("the camera's screen window has no size (" + std::to_string(v.left) + " to " +
                        std::to_string(v.right) + ", " + std::to_string(v.bottom) + " to " +
                        std::to_string(v.top) +
                        "): its sides must differ, and field of view and pixel aspect be numbers",
                    ExitCode::Usage);
}

void place_lens(const scene::Camera& c, transport::CameraView& v) {
    v.near_clip = c.near_clip > 1e-3f ? c.near_clip : 0;
    if (!(c.f_stop > 0 && c.f_stop < 1e10f && c.focal_length > 0))
        return;
    v.lens_radius = 0.5f * c.focal_length / c.f_stop;
    v.focal_distance = c.focal_distance;
    v.blades = c.blades;
    v.blade_cos = std::cos(c.blade_rotation * Pi / 180);
    v.blade_sin = std::sin(c.blade_rotation * Pi / 180);
    v.squeeze = c.squeeze > 0 ? c.squeeze : 1;
}

void place_pixels(const transport::CameraView& v, dice::DicingCamera& d) {
    const float across = float(v.width) / std::abs(v.right - v.left);
    const float up = float(v.height) / std::abs(v.top - v.bottom);
    switch (v.projection) {
    case Projection::Perspective:
    case Projection::Orthographic:
        d.pixels_per_tangent = across;
        // Beyond this pixels are slivers, and finer rates serve nobody.
        d.pixel_stretch = std::clamp(up / across, 1.0f / 16, 16.0f);
        break;
    case Projection::Fisheye:
    case Projection::Equisolid:
        d.pixels_per_tangent = std::sqrt(across * up) * film_per_radian(v.projection, v.half_angle);
        break;
    case Projection::Spherical:
        d.pixels_per_tangent = std::sqrt(across * InvPi * up * (2 * InvPi));
        break;
    }
}

// world_from_camera at times from 0 to 1. The camera itself goes linearly and turns evenly, not the world
// about it.
std::vector<TransformKey> keys_of(const scene::Camera& c, const Shutter& shutter) {
    std::vector<TransformKey> keys;
    for (const TransformKey& k : c.motion)
        keys.push_back({shutter.fraction(k.time), k.transform.inverse()});
    if (keys.empty())
        keys.push_back({0, c.camera_from_world.inverse()});
    return keys;
}

Transform at_the_opening(const std::vector<TransformKey>& keys) {
    return keys.size() == 1 ? keys[0].transform : MotionPath(keys).at(0.0);
}

double distance(const std::array<double, 3>& a, const std::array<double, 3>& b) {
    return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

} // namespace

std::array<double, 3> eye_of(const scene::Camera& c, const Shutter& shutter) {
    const Transform world_from_camera = at_the_opening(keys_of(c, shutter));
    return {world_from_camera.m[0][3], world_from_camera.m[1][3], world_from_camera.m[2][3]};
}

std::array<double, 3> origin_of_shot(std::span<const std::array<double, 3>> eyes, std::array<double, 3> eye) {
    constexpr double Steps = 64;
    std::vector<double> steps;
    for (size_t i = 1; i < eyes.size(); i++)
        steps.push_back(distance(eyes[i - 1], eyes[i]));
    if (steps.empty())
        return eye;
    std::ranges::nth_element(steps, steps.begin() + long(steps.size() / 2));
    const double reach = Steps * steps[steps.size() / 2];
    // Runs of frames, each no longer than that to either side of its middle one.
    std::array<double, 3> nearest = eye;
    double least = reach;
    for (size_t begin = 0; begin < eyes.size();) {
        size_t end = begin + 1;
        const auto middle = [&](size_t last) { return eyes[begin + (last - begin) / 2]; };
        const auto holds = [&](size_t last) {
            return std::all_of(eyes.begin() + long(begin), eyes.begin() + long(last),
                               [&](const auto& e) { return distance(e, middle(last)) <= reach; });
        };
        while (end < eyes.size() && holds(end + 1))
            end++;
        if (const double away = distance(eye, middle(end)); away <= least)
            least = away, nearest = middle(end);
        begin = end;
    }
    return nearest;
}

PlacedCamera place_camera(const scene::Camera& c, const scene::Options& o, const Shutter& shutter,
                          const std::array<double, 3>& origin) {
    PlacedCamera out;
    const std::vector<TransformKey> keys = keys_of(c, shutter);
    const Transform world_from_camera = at_the_opening(keys);
    out.origin = origin;
    out.render_from_world = Transform::translate(-origin[0], -origin[1], -origin[2]);
    const Transform render_from_camera = out.render_from_world * world_from_camera;
    out.camera_from_render = render_from_camera.inverse();
    out.eye = render_from_camera.point({0, 0, 0});
    out.forward = normalize(Vec3f{float(render_from_camera.m[0][2]), float(render_from_camera.m[1][2]),
                                  float(render_from_camera.m[2][2])});
    transport::CameraView& v = out.view;
    place_film(c, o, v);
    place_lens(c, v);
    for (size_t r = 0; r < 3; r++)
        for (size_t k = 0; k < 4; k++)
            v.render_from_camera[4 * r + k] = float(render_from_camera.m[r][k]);

    dice::DicingCamera& d = out.dicing;
    d.page_from_camera = render_from_camera; // until a page is chosen
    d.projection = v.projection;
    d.half_angle = v.half_angle;
    place_pixels(v, d);
    d.near_clip = c.near_clip;
    d.width = o.width;
    d.height = o.height;
    d.middle_x = 0.5f * (v.left + v.right);
    d.middle_y = 0.5f * (v.bottom + v.top);

    const MotionPath path(keys, out.render_from_world);
    if (shutter.blurs() && path.moves()) {
        out.motion.resize(12 * size_t(transport::CameraView::MotionSteps + 1));
        for (int i = 0; i <= transport::CameraView::MotionSteps; i++)
            path.at(double(i) / transport::CameraView::MotionSteps, out.motion.data() + 12 * i);
        for (const double t : {0.25, 0.5, 0.75, 1.0})
            d.also_from.push_back(path.at(t));
    }
    return out;
}

std::vector<bvh::Scene::Plane> clipping_planes(const scene::Camera& of, const PlacedCamera& camera) {
    std::vector<bvh::Scene::Plane> planes;
    if (of.clipping_planes.empty())
        return planes;
    const auto add = [&](const Transform& render_from_camera, const Transform& camera_from_render) {
        for (const auto& c : of.clipping_planes)
            planes.push_back({render_from_camera.point({c[0], c[1], c[2]}),
                              render_from_camera.normal({c[3], c[4], c[5]}, camera_from_render)});
    };
    const std::vector<float>& motion = camera.motion;
    if (motion.empty())
        add(camera.camera_from_render.inverse(), camera.camera_from_render);
    for (size_t i = 0; i + 12 <= motion.size(); i += 12) {
        Transform render_from_camera;
        for (size_t k = 0; k < 12; k++)
            render_from_camera.m[k / 4][k % 4] = double(motion[i + k]);
        add(render_from_camera, render_from_camera.inverse());
    }
    return planes;
}

} // namespace kanuka::render
