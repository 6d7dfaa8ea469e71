// Coordinate systems that a shader may name.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "base/vec.h"
#include "scene/scene.h"

namespace kanuka::shade {

// What all primitives of a scene share. "screen", "NDC" and "raster" are RISpec's: projective, z kept as
// screen depth.
struct WorldSpaces {
    Transform camera_from_world;
    Transform screen_from_camera, ndc_from_camera, raster_from_camera;
    std::map<std::string, Transform> world_from_named;

    WorldSpaces(const scene::Scene& scene, const Transform& camera_from_world)
        : WorldSpaces(scene, scene.options, scene.camera, camera_from_world) {}
    // With the picture and the camera that a render has, which may differ from the scene's.
    WorldSpaces(const scene::Scene& scene, const scene::Options& options, const scene::Camera& camera,
                const Transform& camera_from_world);
};

// One primitive's: "current" is the space of Grid::P, that is render space, or group space for a group's
// primitives.
struct Spaces {
    const WorldSpaces* shared = nullptr;
    const scene::ValueList* scoped = nullptr; // attributes with coordinate systems of its own; null = none
    Transform current_from_object, current_from_world, current_from_shader;

    // current, object, shader, world, camera (eye), screen, NDC, raster, or a CoordinateSystem by name.
    std::optional<Transform> current_from(std::string_view name) const;
    std::optional<Transform> to_from(std::string_view to, std::string_view from) const;
    Vec3f eye() const; // the camera's position, in current space
};

// The inverse, or the identity for a singular matrix.
Transform inverse_or_identity(const Transform& transform);

} // namespace kanuka::shade
