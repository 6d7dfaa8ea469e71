#include "shade/spaces.h"

#include "scene/coordinate_system.h"

#include <cmath>

#include "base/error.h"

namespace kanuka::shade {

namespace {

// RISpec 3.2, "Camera": screen space has the shorter side of the picture in [-1, 1]; depth is 0 on the near
// clipping plane and 1 on the far one.
Transform screen_from_camera(const scene::Camera& camera) {
    Transform t;
    const double n = camera.near_clip, f = camera.far_clip;
    if (camera.projection == scene::Camera::Projection::Orthographic) {
        t.m[2][2] = 1 / (f - n);
        t.m[2][3] = -n / (f - n);
        return t;
    }
    // No matrix makes a fisheye's or a spherical picture: names of spaces mean a flat picture of 90 degrees
    // there.
    const double tangent = camera.projection == scene::Camera::Projection::Perspective
                               ? std::tan(double(camera.fov) * 3.14159265358979323846 / 360)
                               : 1;
    t.m[0][0] = t.m[1][1] = tangent > 0 ? 1 / tangent : 1;
    t.m[2] = {0, 0, f / (f - n), -f * n / (f - n)};
    t.m[3] = {0, 0, 1, 0};
    return t;
}

Transform ndc_from_screen(const scene::Options& options, const scene::Camera& camera) {
    const double aspect = double(options.width) * options.pixel_aspect / std::max(1, options.height);
    std::array<double, 4> window{-1, 1, -1, 1}; // left right bottom top
    if (camera.screen_window)
        for (size_t i = 0; i < 4; i++)
            window[i] = (*camera.screen_window)[i];
    else if (aspect >= 1)
        window = {-aspect, aspect, -1, 1};
    else
        window = {-1, 1, -1 / aspect, 1 / aspect};
    Transform t; // x = 0 on the left edge, y = 0 on the top edge
    const double width = window[1] - window[0], height = window[3] - window[2];
    t.m[0] = {1 / width, 0, 0, -window[0] / width};
    t.m[1] = {0, -1 / height, 0, window[3] / height};
    return t;
}

} // namespace

WorldSpaces::WorldSpaces(const scene::Scene& scene, const scene::Options& options,
                         const scene::Camera& camera, const Transform& camera_from_world)
    : camera_from_world(camera_from_world), screen_from_camera(shade::screen_from_camera(camera)),
      ndc_from_camera(ndc_from_screen(options, camera) * screen_from_camera),
      raster_from_camera(Transform::scale(options.width, options.height, 1) * ndc_from_camera),
      world_from_named(scene.coordinate_systems) {}

std::optional<Transform> Spaces::current_from(std::string_view name) const {
    if (name == "current")
        return Transform{};
    if (name == "object")
        return current_from_object;
    if (name == "shader")
        return current_from_shader;
    if (name == "world")
        return current_from_world;
    try {
        const Transform current_from_camera = current_from_world * shared->camera_from_world.inverse();
        if (name == "camera" || name == "eye")
            return current_from_camera;
        if (name == "screen")
            return current_from_camera * shared->screen_from_camera.inverse();
        if (name == "NDC")
            return current_from_camera * shared->ndc_from_camera.inverse();
        if (name == "raster")
            return current_from_camera * shared->raster_from_camera.inverse();
    } catch (const Error&) {
        return std::nullopt;
    }
    if (const scene::Value* v = scoped ? scoped->find(scene::coordinate_system_name(name)) : nullptr)
        return current_from_world * scene::matrix_of(*v);
    const auto named = shared->world_from_named.find(std::string(name));
    if (named == shared->world_from_named.end())
        return std::nullopt;
    return current_from_world * named->second;
}

std::optional<Transform> Spaces::to_from(std::string_view to, std::string_view from) const {
    if (to == from)
        return Transform{};
    const std::optional<Transform> current_from_from = current_from(from), current_from_to = current_from(to);
    if (!current_from_from || !current_from_to)
        return std::nullopt;
    try {
        return to == "current" ? *current_from_from : current_from_to->inverse() * *current_from_from;
    } catch (const Error&) { // a space squashed flat cannot be gone back to
        return std::nullopt;
    }
}

Vec3f Spaces::eye() const {
    return (current_from_world * inverse_or_identity(shared->camera_from_world)).point({0, 0, 0});
}

void SpacesRead::add(const SpacesRead& other) {
    transforms.insert(other.transforms.begin(), other.transforms.end());
    files.insert(other.files.begin(), other.files.end());
    eye |= other.eye;
    world |= other.world;
}

static void put_floats(Digester& d, const Transform& t) {
    for (const auto& row : t.m)
        for (const double x : row)
            d(float(x));
}

Digest Spaces::digest_of(const SpacesRead& read) const {
    Digester d;
    for (const auto& [to, from] : read.transforms) {
        const std::optional<Transform> t = to_from(to, from);
        d(to, from, t.has_value());
        if (t)
            put_floats(d, *t);
    }
    d(read.eye, read.world);
    if (read.eye) {
        const Vec3f e = eye();
        d(e.x, e.y, e.z);
    }
    if (read.world)
        put_floats(d, current_from_world);
    return d.digest();
}

Transform inverse_or_identity(const Transform& transform) {
    try {
        return transform.inverse();
    } catch (const Error&) {
        return {};
    }
}

} // namespace kanuka::shade
