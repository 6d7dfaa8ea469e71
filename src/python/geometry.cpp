// Meshes, curves, points and quadrics, alike for a scene and for a group of it.
#include <nanobind/stl/vector.h>

#include "python/arguments.h"
#include "python/arrays.h"
#include "python/values.h"

namespace kanuka::python {

using scene::Detail;
using scene::Type;

namespace {

// What every add_* takes beside its geometry.
struct Looks {
    nb::handle material, transform, area_light;
    std::string name;
    float shading_rate;
    bool visible_camera, double_sided, reverse_orientation;
    nb::handle times; // of what moves
    std::vector<std::string> lights_off, shadows_off;
};

// A Material, a surface Shader, or the name of one.
Material material_of(nb::handle given) {
    Material material;
    if (nb::isinstance<Material>(given))
        return nb::cast<const Material&>(given);
    if (nb::isinstance<scene::ShaderRef>(given))
        material.surface = nb::cast<const scene::ShaderRef&>(given);
    else if (nb::isinstance<nb::str>(given))
        material.surface.name = nb::cast<std::string>(given);
    else
        wrong_argument("material", "Material | Shader | str | None", given);
    return material;
}

std::shared_ptr<const scene::Attributes> attributes(const Looks& looks) {
    auto result = std::make_shared<scene::Attributes>();
    if (!looks.material.is_none()) {
        const Material material = material_of(looks.material);
        result->surface = material.surface;
        result->displacement = material.displacement;
        result->displacement_bound = material.displacement_bound;
        result->color = material.color;
        result->color_spectrum = material.color_spectrum;
        result->opacity = material.opacity;
    }
    if (nb::isinstance<scene::ShaderRef>(looks.area_light)) {
        result->area_light = nb::cast<scene::ShaderRef>(looks.area_light);
    } else if (!looks.area_light.is_none()) {
        scene::ShaderRef light;
        light.name = "arealight";
        const Rgb radiance = rgb(looks.area_light, "area_light");
        light.parameters.set({.name = "intensity", .type = Type::Float, .floats = std::vector<float>{1}});
        light.parameters.set({.name = "lightcolor",
                              .type = Type::Color,
                              .floats = std::vector<float>{radiance.x, radiance.y, radiance.z}});
        result->area_light = light;
    }
    result->shading_rate = looks.shading_rate;
    result->sides = looks.double_sided ? 2 : 1;
    result->reverse_orientation = looks.reverse_orientation;
    result->visible_camera = looks.visible_camera;
    result->name = looks.name;
    result->lights_off = looks.lights_off;
    result->shadows_off = looks.shadows_off;
    return result;
}

// An array with one slice for each time, (T, …), as T arrays; otherwise one.
nb::list slices(nb::handle array, size_t dimensions) {
    nb::list list;
    nb::object even;
    try {
        even = nb::module_::import_("numpy").attr("asarray")(array);
    } catch (nb::python_error&) { // what it is will be said where it is used
    }
    if (!even.is_valid() || nb::cast<size_t>(even.attr("ndim")) != dimensions + 1) {
        list.append(array);
        return list;
    }
    for (nb::handle slice : even)
        list.append(slice);
    if (list.size() == 0)
        throw nb::value_error("points: there is no time at all");
    return list;
}

scene::Value positions(nb::handle points) {
    scene::Value P;
    P.name = "P";
    P.type = Type::Point;
    P.detail = Detail::Vertex;
    P.floats = float_rows(points, 3, "points").buffer;
    return P;
}

// The mesh in every shape that `points` (and `normals`) gives for a time.
void add_shapes(scene::Primitive& primitive, nb::list points, nb::handle normals,
                std::span<const DetailCount> counts, nb::handle times) {
    if (points.size() < 2)
        return;
    const std::vector<double> at = sample_times(times, points.size(), "points");
    const nb::list n = normals.is_none() ? nb::list() : slices(normals, 2);
    if (n.size() > 1 && n.size() != points.size())
        throw nb::value_error("normals: expected as many times as points has, or one");
    auto motion = std::make_shared<scene::Motion>();
    for (size_t i = 0; i < at.size(); i++) {
        scene::Value P = positions(points[i]);
        if (P.floats.size() != primitive.primvars.values[0].floats.size())
            throw nb::value_error("points: they must be as many at all times");
        motion->shapes.push_back({at[i], primitive.geometry, primitive.primvars});
        motion->shapes.back().primvars.set(std::move(P));
        if (n.size() > 1)
            motion->shapes.back().primvars.set(primvar("normal N", n[i], counts, "normals"));
    }
    primitive.motion = std::move(motion);
}

// Faces as an array (M, k), or flat with the number of corners of each.
struct Faces {
    scene::Buffer<int32_t> vertices, corners; // corners empty = triangles
    size_t count;
};

Faces read_faces(nb::handle faces, nb::handle counts, size_t points) {
    Faces result;
    const IntArray array = int_array(faces, "faces");
    result.vertices = array.buffer;
    if (!counts.is_none()) {
        result.corners = int_array(counts, "counts").buffer;
        result.count = result.corners.size();
        int64_t total = 0;
        for (const int32_t n : result.corners) {
            if (n < 3)
                throw nb::value_error("counts: every face needs three corners or more");
            total += n;
        }
        if (size_t(total) != result.vertices.size())
            throw nb::value_error(("counts: they add up to " + std::to_string(total) + ", but faces has " +
                                   std::to_string(result.vertices.size()) + " indices")
                                      .c_str());
    } else {
        if (array.shape.size() != 2 || array.shape[1] < 3)
            throw nb::value_error(
                ("faces: expected shape (M, 3) or (M, 4), or a flat array and `counts`; got " +
                 shape_text(array.shape))
                    .c_str());
        result.count = array.shape[0];
        if (array.shape[1] != 3)
            result.corners = std::vector<int32_t>(array.shape[0], int32_t(array.shape[1]));
    }
    for (size_t i = 0; i < result.vertices.size(); i++)
        if (const int32_t v = result.vertices[i]; v < 0 || size_t(v) >= points)
            throw nb::value_error(("faces: index " + std::to_string(v) + " at position " + std::to_string(i) +
                                   ", but there are " + std::to_string(points) + " points")
                                      .c_str());
    return result;
}

struct MeshPrimvars {
    nb::handle normals, uv;
    nb::dict primvars;
    nb::list points = {}; // at every time
    nb::handle times = {};
};

void add_primvars(scene::Primitive& primitive, const MeshPrimvars& given, size_t points, const Faces& faces) {
    const DetailCount counts[] = {{Detail::Vertex, points},
                                  {Detail::Varying, points},
                                  {Detail::FaceVarying, faces.vertices.size()},
                                  {Detail::Uniform, faces.count},
                                  {Detail::Constant, 1}};
    if (!given.normals.is_none())
        primitive.primvars.set(primvar("normal N", slices(given.normals, 2)[0], counts, "normals"));
    if (!given.uv.is_none())
        primitive.primvars.set(primvar("float[2] st", given.uv, counts, "uv"));
    for (auto [key, value] : given.primvars)
        primitive.primvars.set(primvar(argument<std::string>(key, "primvars: a name"), value, counts));
    add_shapes(primitive, given.points, given.normals, counts, given.times);
}

// Where primitives go: a scene, or a group of it.
struct Place {
    Scene& scene;
    const Group* group; // null = the world
    // Arguments run code of their own as they are read, which may move groups and begin to render: this is
    // for what comes after, and before it to say early what cannot be.
    scene::Group* now() const {
        check_idle(scene);
        return group ? &group->get() : nullptr;
    }
};
Place place(Scene& s) {
    check_idle(s);
    return {s, nullptr};
}
Place place(Group& g) {
    const Place place{*g.owner, &g};
    place.now();
    return place;
}

int add(Place place, scene::Primitive primitive, const Looks& looks) {
    primitive.attributes = attributes(looks);
    const std::vector<TransformKey> places = transform_keys(looks.transform, looks.times, "transform");
    primitive.world_from_object = places[0].transform;
    if (places.size() < 2 && !primitive.motion) // nothing moves: still, they are times
        check_times(looks.times);
    if (places.size() > 1) {
        auto motion = primitive.motion ? std::make_shared<scene::Motion>(*primitive.motion)
                                       : std::make_shared<scene::Motion>();
        motion->places = places;
        primitive.motion = std::move(motion);
    }
    scene::Group* const group = place.now();
    primitive.id = place.scene.next_id++;
    scene::Editor& editor = *place.scene.editor;
    const int id = primitive.id;
    const scene::NodeId node =
        (group ? editor.add(*group, std::move(primitive)) : editor.add(std::move(primitive))).node;
    if (!place.scene.numbers.empty())
        place.scene.numbers[id] = node;
    tell_of_repeat(place.scene);
    return id;
}

int add_mesh(Place place, nb::handle points, nb::handle faces, nb::handle counts, MeshPrimvars given,
             const Looks& looks) {
    scene::Primitive primitive;
    given.points = slices(points, 2);
    given.times = looks.times;
    primitive.primvars.set(positions(given.points[0]));
    const size_t vertices = primitive.primvars.values[0].items();
    const Faces f = read_faces(faces, counts, vertices);
    primitive.geometry = scene::PolygonMesh{{}, f.corners, f.vertices};
    add_primvars(primitive, given, vertices, f);
    return add(place, std::move(primitive), looks);
}

struct Creases {
    std::vector<std::vector<int32_t>> edges; // chains of vertices
    std::vector<float> sharpness;
    std::vector<int32_t> corners, holes;
    std::vector<float> corner_sharpness;
    bool interpolate_boundary;
};

std::vector<scene::SubdivisionMesh::Tag> tags(const Creases& creases) {
    if (creases.edges.size() != creases.sharpness.size())
        throw nb::value_error("creases and crease_sharpness: one sharpness a chain of vertices");
    if (creases.corners.size() != creases.corner_sharpness.size())
        throw nb::value_error("corners and corner_sharpness: one sharpness a corner");
    std::vector<scene::SubdivisionMesh::Tag> result;
    for (size_t i = 0; i < creases.edges.size(); i++)
        result.push_back({"crease", creases.edges[i], {creases.sharpness[i]}, {}});
    if (!creases.corners.empty())
        result.push_back({"corner", creases.corners, creases.corner_sharpness, {}});
    if (!creases.holes.empty())
        result.push_back({"hole", creases.holes, {}, {}});
    if (creases.interpolate_boundary)
        result.push_back({"interpolateboundary", {1}, {}, {}});
    return result;
}

int add_subdivision(Place place, nb::handle points, nb::handle faces, nb::handle counts,
                    const std::string& scheme, const Creases& creases, MeshPrimvars given,
                    const Looks& looks) {
    if (scheme != "catmull-clark" && scheme != "loop" && scheme != "bilinear")
        throw nb::value_error("scheme: expected \"catmull-clark\", \"loop\" or \"bilinear\"");
    scene::Primitive primitive;
    given.points = slices(points, 2);
    given.times = looks.times;
    primitive.primvars.set(positions(given.points[0]));
    const size_t vertices = primitive.primvars.values[0].items();
    Faces f = read_faces(faces, counts, vertices);
    if (f.corners.empty())
        f.corners = std::vector<int32_t>(f.count, 3);
    primitive.geometry = scene::SubdivisionMesh{scheme, f.corners, f.vertices, tags(creases)};
    add_primvars(primitive, given, vertices, f);
    return add(place, std::move(primitive), looks);
}

int add_sphere(Place place, float radius, const Looks& looks) {
    if (!(radius > 0))
        throw nb::value_error("radius: expected a positive number");
    scene::Primitive primitive;
    primitive.geometry = scene::Quadric{scene::Quadric::Kind::Sphere, {radius, -radius, radius, 360}};
    return add(place, std::move(primitive), looks);
}

#define LOOKS_SIG                                                                                            \
    "material: Material | Shader | str | None = None, transform: ArrayLike | None = None, area_light: "      \
    "Sequence[float] | "                                                                                     \
    "Shader | "                                                                                              \
    "None = None, "                                                                                          \
    "name: str = '', shading_rate: float = 1, visible_camera: bool = True, double_sided: bool = True, "      \
    "reverse_orientation: bool = False, times: Sequence[float] | None = None, "                              \
    "lights_off: Sequence[str] = [], shadows_off: Sequence[str] = []"
#define MESH_SIG                                                                                             \
    "(self, points: ArrayLike, faces: ArrayLike, counts: ArrayLike | None = None, *, normals: ArrayLike | "  \
    "None = None, "                                                                                          \
    "uv: ArrayLike | None = None, primvars: dict[str, ArrayLike] = {}, "

template <class Owner>
void bind_mesh(nb::class_<Owner>& c) {
    define(
        c, "add_mesh",
        [](Owner& owner, nb::handle points, nb::handle faces, nb::handle counts, nb::handle normals,
           nb::handle uv, nb::dict primvars, nb::handle material, nb::handle transform, nb::handle area_light,
           std::string name, float shading_rate, bool visible, bool double_sided, bool reverse,
           nb::handle times, std::vector<std::string> lights_off, std::vector<std::string> shadows_off) {
            return add_mesh(place(owner), points, faces, counts, {normals, uv, primvars},
                            {material, transform, area_light, name, shading_rate, visible, double_sided,
                             reverse, times, lights_off, shadows_off});
        },
        nb::arg("points"), nb::arg("faces"), nb::arg("counts") = nb::none(), nb::kw_only(),
        nb::arg("normals") = nb::none(), nb::arg("uv") = nb::none(), nb::arg("primvars") = nb::dict(),
        nb::arg("material") = nb::none(), nb::arg("transform") = nb::none(),
        nb::arg("area_light") = nb::none(), nb::arg("name") = "", nb::arg("shading_rate") = 1.0f,
        nb::arg("visible_camera") = true, nb::arg("double_sided") = true,
        nb::arg("reverse_orientation") = false, nb::arg("times") = nb::none(),
        nb::arg("lights_off") = nb::list(), nb::arg("shadows_off") = nb::list(),
        "Adds polygons and returns the primitive's id, as in the picture's 'id' layer.\n\n"
        "`points` is (N, 3) float32, `faces` (M, 3) or (M, 4) int32. With `counts`, `faces` is flat and "
        "counts[i] is the\n"
        "number of corners of face i. `primvars` are bound to shader parameters of their name; the number of "
        "rows "
        "tells\n"
        "whether they are given for each vertex, face corner, face, or once. `area_light` is the radiance "
        "that\n"
        "the surface sends out. `transform` is 4x4, acting on columns. Lights of `lights_off`, by name or "
        "group, do not\n"
        "shine on it; those of `shadows_off` shine through it.\n\n"
        "What moves while the shutter is open (Options.shutter) is given for several times: `points` (T, N, "
        "3),\n"
        "`normals` alike or once, `transform` (T, 4, 4), at `times` (default: evenly from 0 to 1).",
        nb::sig("def add_mesh" MESH_SIG LOOKS_SIG ") -> int"));
}

template <class Owner>
void bind_subdivision(nb::class_<Owner>& c) {
    define(
        c, "add_subdivision",
        [](Owner& owner, nb::handle points, nb::handle faces, nb::handle counts, nb::handle normals,
           nb::handle uv, nb::dict primvars, std::string scheme, std::vector<std::vector<int32_t>> creases,
           std::vector<float> crease_sharpness, std::vector<int32_t> corners,
           std::vector<float> corner_sharpness, std::vector<int32_t> holes, bool interpolate_boundary,
           nb::handle material, nb::handle transform, nb::handle area_light, std::string name,
           float shading_rate, bool visible, bool double_sided, bool reverse, nb::handle times,
           std::vector<std::string> lights_off, std::vector<std::string> shadows_off) {
            return add_subdivision(
                place(owner), points, faces, counts, scheme,
                {creases, crease_sharpness, corners, holes, corner_sharpness, interpolate_boundary},
                {normals, uv, primvars},
                {material, transform, area_light, name, shading_rate, visible, double_sided, reverse, times,
                 lights_off, shadows_off});
        },
        nb::arg("points"), nb::arg("faces"), nb::arg("counts") = nb::none(), nb::kw_only(),
        nb::arg("normals") = nb::none(), nb::arg("uv") = nb::none(), nb::arg("primvars") = nb::dict(),
        nb::arg("scheme") = "catmull-clark", nb::arg("creases") = nb::list(),
        nb::arg("crease_sharpness") = nb::list(), nb::arg("corners") = nb::list(),
        nb::arg("corner_sharpness") = nb::list(), nb::arg("holes") = nb::list(),
        nb::arg("interpolate_boundary") = true, nb::arg("material") = nb::none(),
        nb::arg("transform") = nb::none(), nb::arg("area_light") = nb::none(), nb::arg("name") = "",
        nb::arg("shading_rate") = 1.0f, nb::arg("visible_camera") = true, nb::arg("double_sided") = true,
        nb::arg("reverse_orientation") = false, nb::arg("times") = nb::none(),
        nb::arg("lights_off") = nb::list(), nb::arg("shadows_off") = nb::list(),
        "Adds a subdivision surface: arguments as add_mesh, and its creases as chains of vertices.",
        nb::sig("def add_subdivision" MESH_SIG
                "scheme: str = 'catmull-clark', creases: Sequence[Sequence[int]] = [], "
                "crease_sharpness: Sequence[float] = [], corners: Sequence[int] = [], "
                "corner_sharpness: Sequence[float] = [], holes: Sequence[int] = [], "
                "interpolate_boundary: bool = True, " LOOKS_SIG ") -> int"));
}

template <class Owner>
void bind_sphere(nb::class_<Owner>& c) {
    define(
        c, "add_sphere",
        [](Owner& owner, float radius, nb::handle material, nb::handle transform, nb::handle area_light,
           std::string name, float shading_rate, bool visible, bool double_sided, bool reverse,
           nb::handle times, std::vector<std::string> lights_off, std::vector<std::string> shadows_off) {
            return add_sphere(place(owner), radius,
                              {material, transform, area_light, name, shading_rate, visible, double_sided,
                               reverse, times, lights_off, shadows_off});
        },
        nb::arg("radius") = 1.0f, nb::kw_only(), nb::arg("material") = nb::none(),
        nb::arg("transform") = nb::none(), nb::arg("area_light") = nb::none(), nb::arg("name") = "",
        nb::arg("shading_rate") = 1.0f, nb::arg("visible_camera") = true, nb::arg("double_sided") = true,
        nb::arg("reverse_orientation") = false, nb::arg("times") = nb::none(),
        nb::arg("lights_off") = nb::list(), nb::arg("shadows_off") = nb::list(),
        "Adds a sphere about the origin of its own space.",
        nb::sig("def add_sphere(self, radius: float = 1, *, " LOOKS_SIG ") -> int"));
}

template <class Owner>
void bind(nb::class_<Owner>& c) {
    bind_mesh(c);
    bind_subdivision(c);
    bind_sphere(c);
}

} // namespace

void bind_geometry(nb::class_<Scene>& scene, nb::class_<Group>& group) {
    bind(scene);
    bind(group);
}

} // namespace kanuka::python
