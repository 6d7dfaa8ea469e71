#include <nanobind/stl/array.h>
#include <nanobind/stl/vector.h>

#include "python/arguments.h"
#include "python/arrays.h"
#include "python/bindings.h"

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

// What both constructors set.
struct Lens {
    float fov;
    std::string fov_axis, projection;
    float near_clip, far_clip, f_stop, focal_length, focal_distance;
    std::optional<std::array<float, 4>> screen_window;
    int blades;
    float blade_rotation, squeeze;
};

Camera make(const Transform& camera_from_world, const Lens& lens) {
    const auto projection = projection_by_name(lens.projection);
    if (!projection)
        throw nb::value_error(
            ("projection: \"" + lens.projection + "\" is not one of " + projection_names<std::string>(", "))
                .c_str());
    if (!(lens.fov > 0 && (lens.fov < 180 || (is_fisheye(*projection) && lens.fov <= 360))))
        throw nb::value_error("fov: expected degrees between 0 and 180 (fisheyes: 360)");
    if (lens.blades != 0 && (lens.blades < 3 || lens.blades > 64))
        throw nb::value_error("blades: expected 3 to 64, or 0 for a round iris");
    if (!(lens.squeeze > 0))
        throw nb::value_error("squeeze: expected a positive number");
    Camera result;
    result.axis = axis_by_name(lens.fov_axis);
    scene::Camera& c = result.camera;
    c.projection = *projection;
    c.camera_from_world = camera_from_world;
    c.fov = lens.fov;
    c.near_clip = lens.near_clip;
    c.far_clip = lens.far_clip;
    c.f_stop = lens.f_stop;
    c.focal_length = lens.focal_length;
    c.focal_distance = lens.focal_distance;
    c.screen_window = lens.screen_window;
    c.blades = lens.blades;
    c.blade_rotation = lens.blade_rotation;
    c.squeeze = lens.squeeze;
    return result;
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
    nb::class_<Camera> camera(
        m, "Camera",
        "Where the picture is taken from.\n\n"
        "`fov` is in degrees across the side that `fov_axis` names: 'smaller', 'x' or 'y'. The world is\n"
        "right-handed unless `left_handed` is set. `f_stop` = 0 is a pinhole; else `focal_length` and\n"
        "`focal_distance` are in scene units. `screen_window` is (left, right, bottom, top).\n\n"
        "`projection` is 'perspective', 'orthographic', 'fisheye' (angles proportional to distances from "
        "the\n"
        "centre), 'equisolid' (fisheye with equal solid angles a pixel) or 'spherical' (latitude and "
        "longitude).\n"
        "A fisheye's `fov`, up to 360, is that of its image circle, which is black around; 'spherical' has "
        "none.\n"
        "The iris has `blades` straight sides (0 = round), the first corner `blade_rotation` degrees from "
        "the\n"
        "right; an anamorphic lens makes blurred lights `squeeze` times higher than wide.");
    define(
        camera, "__init__",
        [](Camera* self, nb::handle origin, nb::handle target, nb::handle up, float fov,
           const std::string& axis, const std::string& projection, float near_clip, float far_clip,
           float f_stop, float focal_length, float focal_distance, std::optional<std::array<float, 4>> window,
           int blades, float blade_rotation, float squeeze, bool left_handed) {
            const Transform t =
                look_at(vec3d(origin, "origin"), vec3d(target, "target"), vec3d(up, "up"), left_handed);
            new (self) Camera(make(t, {fov, axis, projection, near_clip, far_clip, f_stop, focal_length,
                                       focal_distance, window, blades, blade_rotation, squeeze}));
        },
        nb::arg("origin"), nb::arg("target"), nb::arg("up") = nb::make_tuple(0, 1, 0), nb::kw_only(),
        nb::arg("fov") = 45.0f, nb::arg("fov_axis") = "smaller", nb::arg("projection") = "perspective",
        nb::arg("near_clip") = 1e-4f, nb::arg("far_clip") = 1e30f, nb::arg("f_stop") = 0.0f,
        nb::arg("focal_length") = 0.0f, nb::arg("focal_distance") = 0.0f,
        nb::arg("screen_window") = nb::none(), nb::arg("blades") = 0, nb::arg("blade_rotation") = 0.0f,
        nb::arg("squeeze") = 1.0f, nb::arg("left_handed") = false,
        nb::sig("def __init__(self, origin: Sequence[float], target: Sequence[float], up: Sequence[float] = "
                "(0, 1, 0), "
                "*, fov: float = 45, fov_axis: str = 'smaller', projection: str = 'perspective', "
                "near_clip: float = 1e-4, far_clip: float = 1e30, f_stop: float = 0, focal_length: float = "
                "0, "
                "focal_distance: float = 0, screen_window: tuple[float, float, float, float] | None = None, "
                "blades: int = 0, blade_rotation: float = 0, squeeze: float = 1, "
                "left_handed: bool = False) -> None"));
    define(
        Static{camera}, "from_matrix",
        [](nb::handle world_from_camera, float fov, const std::string& axis, const std::string& projection,
           float near_clip, float far_clip, float f_stop, float focal_length, float focal_distance,
           std::optional<std::array<float, 4>> window, int blades, float blade_rotation, float squeeze) {
            if (world_from_camera.is_none())
                wrong_argument("world_from_camera", "ArrayLike", world_from_camera);
            // Looking along -z: flip to RISpec's camera space.
            const Transform t =
                Transform::scale(1, 1, -1) * transform(world_from_camera, "world_from_camera").inverse();
            return make(t, {fov, axis, projection, near_clip, far_clip, f_stop, focal_length, focal_distance,
                            window, blades, blade_rotation, squeeze});
        },
        nb::arg("world_from_camera"), nb::kw_only(), nb::arg("fov") = 45.0f, nb::arg("fov_axis") = "smaller",
        nb::arg("projection") = "perspective", nb::arg("near_clip") = 1e-4f, nb::arg("far_clip") = 1e30f,
        nb::arg("f_stop") = 0.0f, nb::arg("focal_length") = 0.0f, nb::arg("focal_distance") = 0.0f,
        nb::arg("screen_window") = nb::none(), nb::arg("blades") = 0, nb::arg("blade_rotation") = 0.0f,
        nb::arg("squeeze") = 1.0f,
        "A camera from its 4x4 placement, as OpenGL, USD and Blender have it: looking along -z, y up, "
        "columns.",
        nb::sig("def from_matrix(world_from_camera: ArrayLike, *, fov: float = 45, fov_axis: str = "
                "'smaller', "
                "projection: str = 'perspective', near_clip: float = 1e-4, far_clip: float = 1e30, "
                "f_stop: float = 0, "
                "focal_length: float = 0, focal_distance: float = 0, "
                "screen_window: tuple[float, float, float, float] | None = None, blades: int = 0, "
                "blade_rotation: float = 0, squeeze: float = 1) -> Camera"));
    define(Static{camera}, "moving", &moving, nb::arg("cameras"), nb::arg("times") = nb::none(),
           "A camera that is where each of `cameras` is at its time (default: evenly from 0 to 1); the "
           "lens is the\n"
           "first one's. Options.shutter says which part of its way the picture sees.",
           nb::sig("def moving(cameras: Sequence[Camera], times: Sequence[float] | None = None) -> Camera"));
    camera.def_prop_ro("fov", [](const Camera& c) { return c.camera.fov; });
    camera.def_prop_ro("fov_axis", [](const Camera& c) {
        return c.axis == Camera::FovAxis::X ? "x" : c.axis == Camera::FovAxis::Y ? "y" : "smaller";
    });
    camera.def_prop_ro("projection",
                       [](const Camera& c) { return std::string(kind_of(c.camera.projection).name); });
    camera.def_prop_ro("f_stop", [](const Camera& c) { return c.camera.f_stop; });
    camera.def_prop_ro(
        "camera_from_world", [](const Camera& c) { return matrix(c.camera.camera_from_world); },
        "4x4, acting on columns, into RISpec's camera space: x right, y up, z into the picture.",
        nb::sig("def camera_from_world(self) -> numpy.typing.NDArray[numpy.float64]"));
}

} // namespace kanuka::python
