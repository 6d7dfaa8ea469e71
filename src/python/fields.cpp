// Shapes that are fields: blobbies, and volumes of density. Alike for a scene and for a group of it.
#include "python/arguments.h"
#include "python/arrays.h"
#include "python/looks.h"
#include "python/values.h"
#include "scene/counts.h"

namespace kanuka::python {

namespace {

using scene::Detail;

constexpr size_t Most = size_t(1) << 30; // values of a lattice

std::vector<DetailCount> counts_of(const scene::Geometry& geometry) {
    const scene::PrimvarCounts n = scene::primvar_counts(geometry, 0);
    return {{Detail::Vertex, n.vertex}, {Detail::Varying, n.varying}, {Detail::Constant, 1}};
}

template <class Owner>
void bind_blobby(nb::class_<Owner>& c) {
    const std::string signature =
        "def add_blobby(self, leaves: int, code: ArrayLike, floats: ArrayLike, *, strings: Sequence[str] = "
        "[], primvars: dict[str, ArrayLike] = {}" +
        looks_signature() + ") -> int";
    define(
        c, "add_blobby",
        [](Owner& owner, int leaves, nb::handle code, nb::handle floats, std::vector<std::string> strings,
           nb::dict primvars, const nb::kwargs& looks) {
            const Place where = place(owner);
            scene::Blobby blobby;
            blobby.leaves = leaves;
            blobby.code = int_array(code, "code").buffer;
            blobby.floats = float_array(floats, "floats").buffer;
            blobby.strings = std::move(strings);
            if (leaves < 1 || blobby.code.empty())
                throw nb::value_error("leaves, code: a blobby needs one leaf and one operation or more");
            scene::Primitive primitive;
            primitive.geometry = std::move(blobby);
            for (auto [key, value] : primvars)
                primitive.primvars.set(primvar(argument<std::string>(key, "primvars: a name"), value,
                                               counts_of(primitive.geometry)));
            return add(where, std::move(primitive), looks_of("add_blobby", looks));
        },
        nb::arg("leaves"), nb::arg("code"), nb::arg("floats"), nb::kw_only(), nb::arg("strings") = nb::list(),
        nb::arg("primvars") = nb::dict(), nb::arg("looks"),
        "Adds an implicit surface made of blobs, as RISpec 5.6 codes them.\n\n"
        "`code` has operations one behind the other, whose places are into `floats` and `strings`: 1001 and "
        "a place is an\n"
        "ellipsoid by its 4x4 matrix (of RIB: acting on rows), 1002 a segment, 0 and a count and operands "
        "their sum.\n"
        "`primvars` have a value for each of the `leaves`.",
        nb::sig(signature.c_str()));
}

scene::Volume volume_of(const std::string& shape, std::array<float, 6> bound) {
    constexpr const char* names[] = {"box", "ellipsoid", "cylinder", "cone"};
    scene::Volume volume;
    const auto found = std::ranges::find(names, shape, [](const char* n) { return std::string(n); });
    if (found == std::end(names))
        throw nb::value_error(
            ("shape: \"" + shape + "\" is not one of \"box\", \"ellipsoid\", \"cylinder\", \"cone\"")
                .c_str());
    volume.shape = scene::Volume::Shape(found - std::begin(names));
    if (!(bound[0] < bound[1] && bound[2] < bound[3] && bound[4] < bound[5]))
        throw nb::value_error("bound: expected xmin, xmax, ymin, ymax, zmin, zmax, each maximum above its "
                              "minimum");
    volume.bound = bound;
    return volume;
}

template <class Owner>
void bind_volume(nb::class_<Owner>& c) {
    const std::string signature =
        "def add_volume(self, density: ArrayLike | float = 1, *, shape: str = 'box', bound: tuple[float, "
        "float, float, float, float, float] = (-1, 1, -1, 1, -1, 1), primvars: dict[str, ArrayLike] = {}" +
        looks_signature() + ") -> int";
    define(
        c, "add_volume",
        [](Owner& owner, nb::handle density, const std::string& shape, std::array<float, 6> bound,
           nb::dict primvars, const nb::kwargs& looks) {
            const Place where = place(owner);
            scene::Volume volume = volume_of(shape, bound);
            const FloatArray values = float_array(density, "density");
            const auto& size = values.shape;
            const bool even = size.size() < 2 && values.buffer.size() == 1;
            if (!even && (size.size() != 3 || values.buffer.empty() || values.buffer.size() > Most))
                throw nb::value_error(
                    ("density: expected a number or shape (nz, ny, nx); got " + shape_text(size)).c_str());
            if (!even)
                volume.size = {int(size[2]), int(size[1]), int(size[0])};
            scene::Primitive primitive;
            primitive.geometry = volume;
            scene::Value field{.name = "density", .type = scene::Type::Float};
            field.detail = even ? Detail::Constant : Detail::Vertex;
            field.floats = values.buffer;
            primitive.primvars.set(std::move(field));
            for (auto [key, value] : primvars)
                primitive.primvars.set(primvar(argument<std::string>(key, "primvars: a name"), value,
                                               counts_of(primitive.geometry)));
            return add(where, std::move(primitive), looks_of("add_volume", looks));
        },
        nb::arg("density") = 1, nb::kw_only(), nb::arg("shape") = "box",
        nb::arg("bound") = nb::make_tuple(-1, 1, -1, 1, -1, 1), nb::arg("primvars") = nb::dict(),
        nb::arg("looks"),
        "Adds a cloud: what fills a 'box', or an 'ellipsoid', 'cylinder' or 'cone' (along z, its tip at "
        "zmax) in `bound`.\n\n"
        "`density` is a number, or (nz, ny, nx) float32 on a lattice over the bound, in 1/unit with the "
        "material's opacity\n"
        "as its scale. The material is one with an interior; by default white `cloud`.",
        nb::sig(signature.c_str()));
}

} // namespace

template <class Owner>
void bind_fields(nb::class_<Owner>& c) {
    bind_blobby(c);
    bind_volume(c);
}
template void bind_fields(nb::class_<Scene>& c);
template void bind_fields(nb::class_<Group>& c);

} // namespace kanuka::python
