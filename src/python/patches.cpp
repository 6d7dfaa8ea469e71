// Patches and NURBS: lattices of control points, alike for a scene and for a group of it.
#include "python/arguments.h"
#include "python/arrays.h"
#include "python/looks.h"

namespace kanuka::python {

namespace {

// Control points as (N, 3) or (N, 4) at every time, and how many there are along u and v.
struct Lattice {
    PointPrimvars given;
    int nu, nv;
};
Lattice lattice_of(nb::handle points, bool may_be_homogeneous, const char* expected) {
    const std::vector<size_t> shape = float_array(points, "points").shape;
    const size_t d = shape.size();
    constexpr size_t Most = 1'000'000'000;
    const bool homogeneous = may_be_homogeneous && d > 0 && shape[d - 1] == 4;
    if (d < 3 || d > 4 || (shape[d - 1] != 3 && !homogeneous) || shape[d - 2] > Most || shape[d - 3] > Most)
        throw nb::value_error(
            ("points: expected shape " + std::string(expected) + "; got " + shape_text(shape)).c_str());
    const nb::object array = nb::module_::import_("numpy").attr("asarray")(points);
    const nb::tuple rows = d == 4 ? nb::make_tuple(shape[0], -1, shape[3]) : nb::make_tuple(-1, shape[2]);
    Lattice lattice{{}, int(shape[d - 2]), int(shape[d - 3])};
    lattice.given.points = slices(array.attr("reshape")(rows), 2);
    lattice.given.homogeneous = homogeneous;
    return lattice;
}

// One for u and v, or one for each.
std::pair<std::string, std::string> bases_of(nb::handle basis) {
    if (nb::isinstance<nb::str>(basis))
        return {nb::cast<std::string>(basis), nb::cast<std::string>(basis)};
    return argument<std::pair<std::string, std::string>>(basis, "basis");
}

scene::PatchMesh patches_of(const Lattice& lattice, nb::handle basis, std::pair<bool, bool> periodic) {
    const auto [u, v] = bases_of(basis);
    scene::PatchMesh mesh;
    mesh.nu = lattice.nu, mesh.nv = lattice.nv;
    mesh.u_periodic = periodic.first, mesh.v_periodic = periodic.second;
    mesh.cubic = u != "bilinear" && v != "bilinear";
    if (!mesh.cubic && u != v)
        throw nb::value_error("basis: \"bilinear\" is both or neither of them");
    if (mesh.cubic) {
        try {
            mesh.u_basis = scene::basis_by_name(u), mesh.v_basis = scene::basis_by_name(v);
        } catch (const Error& error) {
            throw nb::value_error((std::string("basis: ") + error.what()).c_str());
        }
    }
    return mesh;
}

// ---- NURBS

struct Direction { // u or v
    scene::Buffer<float> knots;
    int order;
    float least, most;
};
Direction direction_of(nb::handle knots, const char* name, size_t points, nb::handle range,
                       const char* range_name) {
    const FloatArray array = float_array(knots, name);
    if (array.shape.size() != 1 || array.shape[0] < points + 2 || array.shape[0] > points + 32)
        throw nb::value_error((std::string(name) + ": expected " + std::to_string(points) +
                               " numbers and as many as the order, 2 to 32, more; got " +
                               shape_text(array.shape))
                                  .c_str());
    Direction made{array.buffer, int(array.shape[0] - points), 0, 0};
    made.least = array.buffer[size_t(made.order - 1)], made.most = array.buffer[points];
    if (!range.is_none())
        std::tie(made.least, made.most) = argument<std::pair<float, float>>(range, range_name);
    return made;
}

// Loops of curves, a curve being (points, knots): (N, 2), or homogeneous (N, 3).
std::shared_ptr<const scene::TrimCurves> trim_of(nb::handle loops, bool outside) {
    std::vector<int32_t> counts, orders, points;
    std::vector<float> knots, least, most, coordinate[3];
    const auto every = argument<std::vector<nb::object>>(loops, "trim");
    if (every.empty())
        return nullptr;
    for (const nb::object& loop : every) {
        const auto curves = argument<std::vector<nb::object>>(loop, "trim: a loop");
        counts.push_back(int32_t(curves.size()));
        for (const nb::object& curve : curves) {
            const auto [p, k] = argument<std::pair<nb::object, nb::object>>(curve, "trim: a curve");
            const FloatArray at = float_array(p, "trim: points");
            const auto& shape = at.shape;
            if (shape.size() != 2 || (shape[1] != 2 && shape[1] != 3) || shape[0] > 1u << 20)
                throw nb::value_error(
                    ("trim: points: expected shape (N, 2) or (N, 3); got " + shape_text(shape)).c_str());
            const Direction d = direction_of(k, "trim: knots", shape[0], nb::none(), "");
            for (size_t i = 0; i < shape[0]; i++)
                for (size_t c = 0; c < 3; c++)
                    coordinate[c].push_back(c < shape[1] ? at.buffer[i * shape[1] + c] : 1);
            orders.push_back(d.order), points.push_back(int32_t(shape[0]));
            knots.insert(knots.end(), d.knots.begin(), d.knots.end());
            least.push_back(d.least), most.push_back(d.most);
        }
    }
    auto trim = std::make_shared<scene::TrimCurves>();
    trim->curves_per_loop = std::move(counts), trim->order = std::move(orders);
    trim->points = std::move(points), trim->knots = std::move(knots);
    trim->min = std::move(least), trim->max = std::move(most);
    trim->u = std::move(coordinate[0]), trim->v = std::move(coordinate[1]);
    trim->w = std::move(coordinate[2]);
    trim->outside = outside;
    return trim;
}

constexpr const char* Primvars = "normals: ArrayLike | None = None, uv: ArrayLike | None = None, primvars: "
                                 "dict[str, ArrayLike] = {}";

template <class Owner>
void bind_patch_mesh(nb::class_<Owner>& c) {
    const std::string signature =
        "def add_patches(self, points: ArrayLike, *, basis: str | tuple[str, str] = 'bezier', "
        "periodic: tuple[bool, bool] = (False, False), " +
        std::string(Primvars) + looks_signature() + ") -> int";
    define(
        c, "add_patches",
        [](Owner& owner, nb::handle points, nb::handle basis, std::pair<bool, bool> periodic,
           nb::handle normals, nb::handle uv, nb::dict primvars, const nb::kwargs& looks) {
            const Place where = place(owner);
            Lattice lattice = lattice_of(points, false, "(nv, nu, 3)");
            lattice.given.normals = normals, lattice.given.uv = uv, lattice.given.primvars = primvars;
            return add(where, patches_of(lattice, basis, periodic), lattice.given,
                       looks_of("add_patches", looks));
        },
        nb::arg("points"), nb::kw_only(), nb::arg("basis") = "bezier",
        nb::arg("periodic") = nb::make_tuple(false, false), nb::arg("normals") = nb::none(),
        nb::arg("uv") = nb::none(), nb::arg("primvars") = nb::dict(), nb::arg("looks"),
        "Adds a mesh of patches.\n\n"
        "`points` is (nv, nu, 3) float32: the lattice of control points, u along its rows. `basis` is "
        "'bilinear',\n"
        "'bezier', 'b-spline', 'catmull-rom', 'hermite' or 'power', or one for u and one for v. `periodic`: "
        "whether it\n"
        "closes along u, along v. Moving ones give `points` (T, nv, nu, 3) at `times`.",
        nb::sig(signature.c_str()));
}

template <class Owner>
void bind_nurbs(nb::class_<Owner>& c) {
    const std::string signature =
        "def add_nurbs(self, points: ArrayLike, u_knots: ArrayLike, v_knots: ArrayLike, *, u_range: "
        "tuple[float, float] | None = None, v_range: tuple[float, float] | None = None, trim: "
        "Sequence[Sequence[tuple[ArrayLike, ArrayLike]]] = [], trim_outside: bool = False, " +
        std::string(Primvars) + looks_signature() + ") -> int";
    define(
        c, "add_nurbs",
        [](Owner& owner, nb::handle points, nb::handle u_knots, nb::handle v_knots, nb::handle u_range,
           nb::handle v_range, nb::handle trim, bool trim_outside, nb::handle normals, nb::handle uv,
           nb::dict primvars, const nb::kwargs& looks) {
            const Place where = place(owner);
            Lattice lattice = lattice_of(points, true, "(nv, nu, 3) or (nv, nu, 4)");
            lattice.given.normals = normals, lattice.given.uv = uv, lattice.given.primvars = primvars;
            const Direction u = direction_of(u_knots, "u_knots", size_t(lattice.nu), u_range, "u_range"),
                            v = direction_of(v_knots, "v_knots", size_t(lattice.nv), v_range, "v_range");
            return add(where,
                       scene::NuPatch{lattice.nu, u.order, lattice.nv, v.order, u.knots, v.knots, u.least,
                                      u.most, v.least, v.most, trim_of(trim, trim_outside)},
                       lattice.given, looks_of("add_nurbs", looks));
        },
        nb::arg("points"), nb::arg("u_knots"), nb::arg("v_knots"), nb::kw_only(),
        nb::arg("u_range") = nb::none(), nb::arg("v_range") = nb::none(), nb::arg("trim") = nb::list(),
        nb::arg("trim_outside") = false, nb::arg("normals") = nb::none(), nb::arg("uv") = nb::none(),
        nb::arg("primvars") = nb::dict(), nb::arg("looks"),
        "Adds a NURBS patch.\n\n"
        "`points` is (nv, nu, 3), or homogeneous (x w, y w, z w, w) (nv, nu, 4), float32. Along u there are "
        "nu and as many\n"
        "knots as the order more; so the knots tell the order. `u_range` and `v_range` are parts of the "
        "patch; by\n"
        "default all of it. `trim` has loops of curves (points, knots) in (u, v): what lies within them "
        "stays, with\n"
        "`trim_outside` what does not. Moving ones give `points` (T, nv, nu, 3 or 4) at `times`.",
        nb::sig(signature.c_str()));
}

} // namespace

template <class Owner>
void bind_patches(nb::class_<Owner>& c) {
    bind_patch_mesh(c);
    bind_nurbs(c);
}
template void bind_patches(nb::class_<Scene>& c);
template void bind_patches(nb::class_<Group>& c);

} // namespace kanuka::python
