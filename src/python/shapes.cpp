// Quadrics, curves and points, alike for a scene and for a group of it.
#include "python/arguments.h"
#include "python/arrays.h"
#include "python/looks.h"
#include "scene/counts.h"

namespace kanuka::python {

using scene::Detail;

namespace {

// ---- quadrics: RISpec's, about the z axis

using Kind = scene::Quadric::Kind;

int add_quadric(Place place, Kind kind, std::vector<float> arguments, const Looks& looks) {
    scene::Primitive primitive;
    primitive.geometry = scene::Quadric{kind, std::move(arguments)};
    if (const auto fault = scene::fault_of(primitive.geometry, 0))
        throw nb::value_error(fault->c_str());
    return add(place, std::move(primitive), looks);
}

float positive(float x, const char* name) {
    if (!(x > 0))
        throw nb::value_error((std::string(name) + ": expected a positive number").c_str());
    return x;
}

std::string signature(const char* call, const char* own) {
    return "def " + std::string(call) + "(self, " + own + ", *" + looks_signature() + ") -> int";
}

template <class Owner>
void bind_quadrics(nb::class_<Owner>& c) {
    const std::string sphere = signature(
        "add_sphere",
        "radius: float = 1, bottom: float | None = None, top: float | None = None, sweep: float = 360");
    define(
        c, "add_sphere",
        [](Owner& owner, float radius, std::optional<float> bottom, std::optional<float> top, float sweep,
           const nb::kwargs& looks) {
            const float r = positive(radius, "radius");
            return add_quadric(place(owner), Kind::Sphere, {r, bottom.value_or(-r), top.value_or(r), sweep},
                               looks_of("add_sphere", looks));
        },
        nb::arg("radius") = 1.0f, nb::arg("bottom") = nb::none(), nb::arg("top") = nb::none(),
        nb::arg("sweep") = 360.0f, nb::arg("looks"),
        "Adds a sphere about the origin of its own space, or what of it lies between z = bottom and top; "
        "`sweep` in\ndegrees about the z axis.",
        nb::sig(sphere.c_str()));
    const std::string cylinder = signature(
        "add_cylinder", "radius: float = 1, bottom: float = -1, top: float = 1, sweep: float = 360");
    define(
        c, "add_cylinder",
        [](Owner& owner, float radius, float bottom, float top, float sweep, const nb::kwargs& looks) {
            return add_quadric(place(owner), Kind::Cylinder, {positive(radius, "radius"), bottom, top, sweep},
                               looks_of("add_cylinder", looks));
        },
        nb::arg("radius") = 1.0f, nb::arg("bottom") = -1.0f, nb::arg("top") = 1.0f, nb::arg("sweep") = 360.0f,
        nb::arg("looks"), "Adds an open tube about the z axis, from z = bottom to top; `sweep` in degrees.",
        nb::sig(cylinder.c_str()));
    const std::string cone =
        signature("add_cone", "radius: float = 1, height: float = 1, sweep: float = 360");
    define(
        c, "add_cone",
        [](Owner& owner, float radius, float height, float sweep, const nb::kwargs& looks) {
            return add_quadric(place(owner), Kind::Cone, {height, positive(radius, "radius"), sweep},
                               looks_of("add_cone", looks));
        },
        nb::arg("radius") = 1.0f, nb::arg("height") = 1.0f, nb::arg("sweep") = 360.0f, nb::arg("looks"),
        "Adds an open cone about the z axis: its rim at z = 0, its tip at z = height.",
        nb::sig(cone.c_str()));
}

template <class Owner>
void bind_turned(nb::class_<Owner>& c) {
    const std::string disk =
        signature("add_disk", "radius: float = 1, height: float = 0, sweep: float = 360");
    define(
        c, "add_disk",
        [](Owner& owner, float radius, float height, float sweep, const nb::kwargs& looks) {
            return add_quadric(place(owner), Kind::Disk, {height, positive(radius, "radius"), sweep},
                               looks_of("add_disk", looks));
        },
        nb::arg("radius") = 1.0f, nb::arg("height") = 0.0f, nb::arg("sweep") = 360.0f, nb::arg("looks"),
        "Adds a disk about the z axis, at z = height.", nb::sig(disk.c_str()));
    const std::string torus = signature(
        "add_torus",
        "major: float = 1, minor: float = 0.25, sweep: float = 360, start: float = 0, end: float = 360");
    define(
        c, "add_torus",
        [](Owner& owner, float major, float minor, float sweep, float start, float end,
           const nb::kwargs& looks) {
            return add_quadric(place(owner), Kind::Torus,
                               {positive(major, "major"), positive(minor, "minor"), start, end, sweep},
                               looks_of("add_torus", looks));
        },
        nb::arg("major") = 1.0f, nb::arg("minor") = 0.25f, nb::arg("sweep") = 360.0f, nb::arg("start") = 0.0f,
        nb::arg("end") = 360.0f, nb::arg("looks"),
        "Adds a torus about the z axis: `major` from there to the middle of the ring, `minor` that of the "
        "ring.\nOf the ring's own circle the part from `start` to `end`, in degrees.",
        nb::sig(torus.c_str()));
    const std::string paraboloid = signature(
        "add_paraboloid", "radius: float = 1, bottom: float = 0, top: float = 1, sweep: float = 360");
    define(
        c, "add_paraboloid",
        [](Owner& owner, float radius, float bottom, float top, float sweep, const nb::kwargs& looks) {
            return add_quadric(place(owner), Kind::Paraboloid,
                               {positive(radius, "radius"), bottom, top, sweep},
                               looks_of("add_paraboloid", looks));
        },
        nb::arg("radius") = 1.0f, nb::arg("bottom") = 0.0f, nb::arg("top") = 1.0f, nb::arg("sweep") = 360.0f,
        nb::arg("looks"),
        "Adds a paraboloid about the z axis, with its tip at the origin: what of it lies between z = bottom "
        "and top,\nwhere it has that radius.",
        nb::sig(paraboloid.c_str()));
    const std::string hyperboloid = signature(
        "add_hyperboloid", "first: Sequence[float] = (1, 0, -1), second: Sequence[float] = (1, 0, 1), "
                           "sweep: float = 360");
    define(
        c, "add_hyperboloid",
        [](Owner& owner, nb::handle first, nb::handle second, float sweep, const nb::kwargs& looks) {
            const Vec3f a = vec3(first, "first"), b = vec3(second, "second");
            return add_quadric(place(owner), Kind::Hyperboloid, {a.x, a.y, a.z, b.x, b.y, b.z, sweep},
                               looks_of("add_hyperboloid", looks));
        },
        nb::arg("first") = nb::make_tuple(1, 0, -1), nb::arg("second") = nb::make_tuple(1, 0, 1),
        nb::arg("sweep") = 360.0f, nb::arg("looks"),
        "Adds the surface that the line from `first` to `second` sweeps about the z axis.",
        nb::sig(hyperboloid.c_str()));
}

// ---- curves and points

scene::Curves curves_of(nb::handle counts, const std::string& basis, bool periodic) {
    scene::Curves curves;
    curves.periodic = periodic;
    curves.vertices_per_curve = int_array(counts, "counts").buffer;
    curves.cubic = basis != "linear";
    if (basis != "linear" && basis != "bezier" && basis != "b-spline" && basis != "catmull-rom")
        throw nb::value_error(
            ("basis: \"" + basis + "\" is not one of \"linear\", \"bezier\", \"b-spline\", \"catmull-rom\"")
                .c_str());
    curves.basis = scene::basis_by_name(curves.cubic ? basis : "bezier");
    return curves;
}

constexpr const char* StrandsSignature = "widths: ArrayLike | None = None, normals: ArrayLike | None = None, "
                                         "primvars: dict[str, ArrayLike] = {}";

template <class Owner>
void bind_strands(nb::class_<Owner>& c) {
    const std::string curves = "def add_curves(self, points: ArrayLike, counts: ArrayLike, *, basis: str = "
                               "'linear', periodic: bool = False, " +
                               std::string(StrandsSignature) + looks_signature() + ") -> int";
    define(
        c, "add_curves",
        [](Owner& owner, nb::handle points, nb::handle counts, const std::string& basis, bool periodic,
           nb::handle widths, nb::handle normals, nb::dict primvars, const nb::kwargs& looks) {
            const Place where = place(owner);
            return add(where, curves_of(counts, basis, periodic),
                       {slices(points, 2), false, widths, normals, nb::none(), primvars},
                       looks_of("add_curves", looks));
        },
        nb::arg("points"), nb::arg("counts"), nb::kw_only(), nb::arg("basis") = "linear",
        nb::arg("periodic") = false, nb::arg("widths") = nb::none(), nb::arg("normals") = nb::none(),
        nb::arg("primvars") = nb::dict(), nb::arg("looks"),
        "Adds curves: hair, fibres, or ribbons where there are `normals`.\n\n"
        "`points` is (N, 3) float32, for one curve after the other; counts[i] is how many curve i has. "
        "`basis` is\n"
        "'linear', 'bezier', 'b-spline' or 'catmull-rom'. `widths` are diameters, in object space: at each "
        "point, at\n"
        "each end of a segment, of each curve, or one. Moving curves give `points` (T, N, 3) at `times`.",
        nb::sig(curves.c_str()));
    const std::string points = "def add_points(self, points: ArrayLike, *, shape: str = 'sphere', " +
                               std::string(StrandsSignature) + looks_signature() + ") -> int";
    define(
        c, "add_points",
        [](Owner& owner, nb::handle points, const std::string& shape, nb::handle widths, nb::handle normals,
           nb::dict primvars, const nb::kwargs& looks) {
            const Place where = place(owner);
            if (shape != "sphere" && shape != "disk" && shape != "patch")
                throw nb::value_error(
                    ("shape: \"" + shape + "\" is not one of \"sphere\", \"disk\", \"patch\"").c_str());
            nb::dict all = nb::borrow<nb::dict>(primvars.attr("copy")());
            all["constant string type"] = nb::str(shape.c_str());
            return add(where, scene::Points{}, {slices(points, 2), false, widths, normals, nb::none(), all},
                       looks_of("add_points", looks));
        },
        nb::arg("points"), nb::kw_only(), nb::arg("shape") = "sphere", nb::arg("widths") = nb::none(),
        nb::arg("normals") = nb::none(), nb::arg("primvars") = nb::dict(), nb::arg("looks"),
        "Adds points: particles and spray.\n\n"
        "`points` is (N, 3) float32. `shape` is 'sphere', 'disk' (towards the camera, or across `normals`) "
        "or\n"
        "'patch' (a square). `widths` are diameters, in object space: of each point, or one.",
        nb::sig(points.c_str()));
}

} // namespace

template <class Owner>
void bind_shapes(nb::class_<Owner>& c) {
    bind_quadrics(c);
    bind_turned(c);
    bind_strands(c);
    bind_patches(c);
    bind_fields(c);
}
template void bind_shapes(nb::class_<Scene>& c);
template void bind_shapes(nb::class_<Group>& c);

} // namespace kanuka::python
