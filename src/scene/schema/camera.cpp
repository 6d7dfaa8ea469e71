#include "scene/schema/camera.h"

#include <cmath>

namespace kanuka::scene {

namespace {

using C = Camera;

template <auto... Path>
constexpr auto at = At<Path...>::template in<Camera>();

std::optional<std::string> fault_of_blades(const Setting& v) {
    if (v.numbers[0] == 0 || v.numbers[0] >= 3)
        return std::nullopt;
    return "expected 3 to 64, or 0 for a round iris";
}

std::optional<std::string> fault_of_window(const Setting& v) {
    if (v.numbers.empty() || (v.numbers[0] != v.numbers[1] && v.numbers[2] != v.numbers[3]))
        return std::nullopt;
    return "the window is empty; left and right, bottom and top must differ";
}

// clang-format off
const CameraParameter Rows[] = {
    {{.name = "projection", .rib = "Projection", .about = "how the film maps to directions",
      .choices = "perspective orthographic fisheye equisolid spherical"},
     at<&C::projection>},
    {{.name = "fov", .rib = "Projection",
      .about = "field of view across the shorter side, below 180; of fisheyes the image circle's, up to 360",
      .unit = "degrees", .range = {0, 360, true}},
     at<&C::fov>},
    {{.name = "screen_window", .rib = "ScreenWindow",
      .about = "left, right, bottom, top of the film; none = as wide as the picture is for its height",
      .fault = fault_of_window, .optional = true},
     at<&C::screen_window>},
    {{.name = "near_clip", .rib = "Clipping", .about = "nothing nearer is seen", .unit = "scene units"},
     at<&C::near_clip>},
    {{.name = "far_clip", .rib = "Clipping", .about = "nothing farther is diced for", .unit = "scene units"},
     at<&C::far_clip>},
    {{.name = "f_stop", .rib = "DepthOfField", .about = "0 = a pinhole: all is in focus", .range = NotNegative},
     at<&C::f_stop>},
    {{.name = "focal_length", .rib = "DepthOfField", .about = "of the lens, whose diameter is this over f_stop",
      .unit = "scene units", .range = NotNegative},
     at<&C::focal_length>},
    {{.name = "focal_distance", .rib = "DepthOfField",
      .about = "to what is in focus: a plane; of fisheyes and spherical cameras a sphere about the eye",
      .unit = "scene units", .range = NotNegative},
     at<&C::focal_distance>},
    {{.name = "blades", .rib = "camera:aperture",
      .about = "straight sides of the iris, a regular polygon inscribed in the circle of the lens; 0 = round",
      .range = {0, 64}, .fault = fault_of_blades},
     at<&C::blades>},
    {{.name = "blade_rotation", .rib = "camera:aperture",
      .about = "where the iris' first corner lies from the right, anticlockwise", .unit = "degrees"},
     at<&C::blade_rotation>},
    {{.name = "squeeze", .rib = "camera:dofaspect",
      .about = "of an anamorphic lens: how many times higher than wide blurred lights are (dofaspect: wider than high)",
      .range = Positive},
     at<&C::squeeze>},
};
// clang-format on

} // namespace

std::span<const CameraParameter> camera_parameters() {
    return Rows;
}
const CameraParameter* find_camera_parameter(std::string_view name) {
    return find_parameter(camera_parameters(), name);
}

std::optional<std::string> fault_of_fov(const Camera& camera) {
    const float most = kind_of(camera.projection).largest_fov;
    const bool perspective = camera.projection == Projection::Perspective;
    if (most == 0 || camera.fov <= most || (perspective && camera.fov < 180))
        return std::nullopt;
    return "fov: the field of view must lie between 0 and " + std::to_string(int(std::lround(most))) +
           " degrees";
}

} // namespace kanuka::scene
