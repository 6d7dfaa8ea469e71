#include <nanobind/stl/array.h>
#include <nanobind/stl/vector.h>

#include "python/arguments.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "python/keywords.h"
#include "python/parameters.h"
#include "scene/schema/camera.h"

namespace kanuka::python {

scene::Camera Camera::resolve(const scene::Options& options, int width, int height) const {
    scene::Camera resolved = camera;
    if (camera.projection != Projection::Perspective && !is_fisheye(camera.projection))
        return resolved; // no field of view
    const double aspect = double(width) * options.pixel_aspect / height;
    const bool smaller_is_x = aspect < 1;
    if (axis == FovAxis::Smaller || (axis == FovAxis::X) == smaller_is_x)
        return resolved;
    const double ratio = smaller_is_x ? aspect : 1 / aspect;
    if (is_fisheye(camera.projection)) { // the image circle fits the longer side
        const float across = smaller_is_x ? float(aspect) : 1, down = smaller_is_x ? 1 : float(1 / aspect);
        if (!camera.screen_window)
            resolved.screen_window = {-across, across, -down, down};
        else
            resolved.screen_window = camera.screen_window;
        return resolved;
    }
    // Given across the longer side: tangents scale with lengths.
    const double tangent = std::tan(camera.fov * 3.14159265358979323846 / 360) * ratio;
    resolved.fov = float(std::atan(tangent) * 360 / 3.14159265358979323846);
    return resolved;
}

namespace {

struct Vec3d {
    double x, y, z;
};
Vec3d operator-(Vec3d a, Vec3d b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
Vec3d cross(Vec3d a, Vec3d b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
double dot(Vec3d a, Vec3d b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

Vec3d unit(Vec3d v, const char* message) {
    const double length = std::sqrt(dot(v, v));
    if (!(length > 1e-12))
        throw nb::value_error(message);
    return {v.x / length, v.y / length, v.z / length};
}

Vec3d vec3d(nb::handle value, const char* what) {
    const Vec3f v = vec3(value, what);
    return {v.x, v.y, v.z};
}

// Camera space is x right, y up, z into the picture. In a right-handed world, right is forward x up; in a
// left-handed one it is up x forward. Either way the picture is not mirrored.
Transform look_at(Vec3d origin, Vec3d target, Vec3d up, bool left_handed) {
    const Vec3d forward = unit(target - origin, "camera: origin and target are the same point");
    const Vec3d side = left_handed ? cross(up, forward) : cross(forward, up);
    const Vec3d right = unit(side, "camera: up points along the line of sight; give another up");
    const Vec3d above = left_handed ? cross(forward, right) : cross(right, forward);
    Transform t;
    const Vec3d rows[] = {right, above, forward};
    for (size_t i = 0; i < 3; i++)
        t.m[i] = {rows[i].x, rows[i].y, rows[i].z, -dot(rows[i], origin)};
    return t;
}

Camera::FovAxis axis_by_name(const std::string& name) {
    if (name == "smaller")
        return Camera::FovAxis::Smaller;
    if (name == "x")
        return Camera::FovAxis::X;
    if (name == "y")
        return Camera::FovAxis::Y;
    throw nb::value_error(("fov_axis: \"" + name + "\" is not one of \"smaller\", \"x\", \"y\"").c_str());
}

// Beside the rows of scene/schema/camera; `left_handed` of the one that looks from a place at another.
constexpr const char* FovAxisType = "fov_axis: str = 'smaller'";
constexpr float UsualFov = 45;

Camera make(const char* call, const nb::kwargs& given, bool& left_handed) {
    Camera result;
    scene::Camera& c = result.camera;
    c.fov = UsualFov;
    for (auto [key, value] : given) {
        const auto name = nb::cast<std::string>(key);
        if (name == "fov_axis") {
            result.axis = axis_by_name(argument<std::string>(value, "fov_axis"));
        } else if (name == "left_handed") {
            left_handed = argument<bool>(value, "left_handed");
        } else if (const scene::CameraParameter* row = scene::find_camera_parameter(name)) {
            row->put(c, setting(*row, value, row->name));
        } else {
            std::vector<std::string> known{"fov_axis"};
            for (const scene::CameraParameter& r : scene::camera_parameters())
                known.emplace_back(r.name);
            unknown_argument(call, name, known);
        }
    }
    if (const auto fault = scene::fault_of_fov(c))
        throw nb::value_error(fault->c_str());
    return result;
}

std::string keyword_signature() {
    std::string text = ", *, " + std::string(FovAxisType);
    scene::Camera usual;
    usual.fov = UsualFov;
    for (const scene::CameraParameter& row : scene::camera_parameters())
        text += ", " + std::string(row.name) + ": " + annotation(row, false) + " = " +
                nb::cast<std::string>(nb::repr(object_of(row, row.get(usual))));
    return text;
}

std::string about() {
    std::string text =
        "Where the picture is taken from.\n\n"
        "The world is right-handed unless `left_handed` is set. `fov_axis` names the side that `fov` spans:\n"
        "'smaller', 'x' or 'y'.\n";
    for (const scene::CameraParameter& row : scene::camera_parameters())
        text += "\n    " + std::string(row.name) + ": " + row.about +
                (*row.unit ? " (" + std::string(row.unit) + ")" : "");
    return text;
}

Camera moving(const std::vector<Camera>& cameras, nb::handle times) {
    if (cameras.empty())
        throw nb::value_error("cameras: there is none");
    Camera result = cameras[0];
    const std::vector<double> at = sample_times(times, cameras.size(), "cameras");
    result.camera.motion.clear();
    for (size_t i = 0; i < at.size() && at.size() > 1; i++)
        result.camera.motion.push_back({at[i], cameras[i].camera.camera_from_world});
    return result;
}

nb::object matrix(const Transform& t) {
    nb::list rows;
    for (const auto& row : t.m)
        rows.append(nb::make_tuple(row[0], row[1], row[2], row[3]));
    return nb::module_::import_("numpy").attr("array")(rows);
}

} // namespace

void bind_camera(nb::module_& m) {
    static const std::string words = about(), keywords = keyword_signature(); // nanobind keeps the pointers
    static const std::string look =
                                 "def __init__(self, origin: Sequence[float], target: Sequence[float], up: "
                                 "Sequence[float] = (0, 1, 0)" +
                                 keywords + ", left_handed: bool = False) -> None",
                             placed =
                                 "def from_matrix(world_from_camera: ArrayLike" + keywords + ") -> Camera";
    nb::class_<Camera> camera(m, "Camera", words.c_str());
    define(
        camera, "__init__",
        [](Camera* self, nb::handle origin, nb::handle target, nb::handle up, const nb::kwargs& given) {
            bool left_handed = false;
            Camera made = make("Camera", given, left_handed);
            made.camera.camera_from_world =
                look_at(vec3d(origin, "origin"), vec3d(target, "target"), vec3d(up, "up"), left_handed);
            new (self) Camera(std::move(made));
        },
        nb::arg("origin"), nb::arg("target"), nb::arg("up") = nb::make_tuple(0, 1, 0), nb::arg("parameters"),
        nb::sig(look.c_str()));
    define(
        Static{camera}, "from_matrix",
        [](nb::handle world_from_camera, const nb::kwargs& given) {
            if (world_from_camera.is_none())
                wrong_argument("world_from_camera", "ArrayLike", world_from_camera);
            bool left_handed = false;
            Camera made = make("Camera.from_matrix", given, left_handed);
            if (given.contains("left_handed"))
                throw nb::type_error("from_matrix() has no argument left_handed; the matrix says it");
            // Looking along -z: flip to RISpec's camera space.
            made.camera.camera_from_world =
                Transform::scale(1, 1, -1) * transform(world_from_camera, "world_from_camera").inverse();
            return made;
        },
        nb::arg("world_from_camera"), nb::arg("parameters"),
        "A camera from its 4x4 placement, as OpenGL, USD and Blender have it: looking along -z, y up, "
        "columns.",
        nb::sig(placed.c_str()));
    define(Static{camera}, "moving", &moving, nb::arg("cameras"), nb::arg("times") = nb::none(),
           "A camera that is where each of `cameras` is at its time (default: evenly from 0 to 1); the "
           "lens is the\n"
           "first one's. Options.shutter says which part of its way the picture sees.",
           nb::sig("def moving(cameras: Sequence[Camera], times: Sequence[float] | None = None) -> Camera"));
    for (const scene::CameraParameter& row : scene::camera_parameters())
        camera.def_prop_ro(
            row.name, [&row](const Camera& c) { return object_of(row, row.get(c.camera)); }, row.about,
            nb::sig(("def " + std::string(row.name) + "(self) -> " + annotation(row, true)).c_str()));
    camera.def_prop_ro("fov_axis", [](const Camera& c) {
        return c.axis == Camera::FovAxis::X ? "x" : c.axis == Camera::FovAxis::Y ? "y" : "smaller";
    });
    camera.def_prop_ro(
        "camera_from_world", [](const Camera& c) { return matrix(c.camera.camera_from_world); },
        "4x4, acting on columns, into RISpec's camera space: x right, y up, z into the picture.",
        nb::sig("def camera_from_world(self) -> numpy.typing.NDArray[numpy.float64]"));
}

} // namespace kanuka::python
