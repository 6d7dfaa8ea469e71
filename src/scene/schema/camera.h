// What can be set of a camera, beside its place: scene::Camera, a row each.
#pragma once

#include "scene/scene.h"
#include "scene/schema/parameter.h"

namespace kanuka::scene {

using CameraParameter = Parameter<Camera>;

// ParameterText::rib is the request, or "camera:name" as Option and Hider have it.
std::span<const CameraParameter> camera_parameters();
const CameraParameter* find_camera_parameter(std::string_view name); // null = there is none

// What rows cannot say, since it takes two of them: why the field of view does not fit the projection.
std::optional<std::string> fault_of_fov(const Camera& camera);

} // namespace kanuka::scene
