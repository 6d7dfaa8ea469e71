// Polygons and subdivision surfaces, alike for a scene and for a group of it.
#include <nanobind/stl/vector.h>

#include "python/arguments.h"
#include "python/arrays.h"
#include "python/looks.h"

namespace kanuka::python {

using scene::Detail;
using scene::Type;

namespace {

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

// Of a mesh, whose faces say how many values there are.
void add_mesh_primvars(scene::Primitive& primitive, const PointPrimvars& given, size_t points,
                       const Faces& faces, nb::handle times) {
    const DetailCount counts[] = {{Detail::Vertex, points},
                                  {Detail::Varying, points},
                                  {Detail::FaceVarying, faces.vertices.size()},
                                  {Detail::Uniform, faces.count},
                                  {Detail::Constant, 1}};
    add_primvars(primitive, given, counts, times);
}

int add_mesh(Place place, nb::handle points, nb::handle faces, nb::handle counts, PointPrimvars given,
             const Looks& looks) {
    scene::Primitive primitive;
    given.points = slices(points, 2);
    primitive.primvars.set(positions(given.points[0]));
    const size_t vertices = primitive.primvars.values[0].items();
    const Faces f = read_faces(faces, counts, vertices);
    primitive.geometry = scene::PolygonMesh{{}, f.corners, f.vertices};
    add_mesh_primvars(primitive, given, vertices, f, looks.times);
    return add(place, std::move(primitive), looks);
}

// How a surface follows its cage: OpenSubdiv's options, as tags number them.
constexpr const char* Boundaries[] = {"none", "edge-and-corner", "edge-only"};
constexpr const char* FaceVaryings[] = {"none",          "corners-only", "corners-plus1",
                                        "corners-plus2", "boundaries",   "all"};

template <size_t N>
int32_t number_of(const std::string& argument, const std::string& name, const char* const (&names)[N]) {
    std::string known;
    for (size_t i = 0; i < N; i++) {
        if (name == names[i])
            return int32_t(i);
        known += (i == 0 ? "\"" : i + 1 < N ? ", \"" : " or \"") + std::string(names[i]) + "\"";
    }
    throw nb::value_error((argument + ": expected " + known).c_str());
}

struct Creases {
    std::vector<std::vector<int32_t>> edges; // chains of vertices
    std::vector<float> sharpness;
    std::vector<int32_t> corners, holes;
    std::vector<float> corner_sharpness;
    std::string boundary, facevarying;
    bool smooth_triangles;
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
    if (const int32_t how = number_of("boundary", creases.boundary, Boundaries))
        result.push_back({"interpolateboundary", {how}, {}, {}});
    if (const int32_t how = number_of("facevarying", creases.facevarying, FaceVaryings); how != 2)
        result.push_back({"facevaryinginterpolateboundary", {how}, {}, {}});
    if (creases.smooth_triangles)
        result.push_back({"smoothtriangles", {1}, {}, {}});
    return result;
}

int add_subdivision(Place place, nb::handle points, nb::handle faces, nb::handle counts,
                    const std::string& scheme, const Creases& creases, PointPrimvars given,
                    const Looks& looks) {
    if (scheme != "catmull-clark" && scheme != "loop" && scheme != "bilinear")
        throw nb::value_error("scheme: expected \"catmull-clark\", \"loop\" or \"bilinear\"");
    scene::Primitive primitive;
    given.points = slices(points, 2);
    primitive.primvars.set(positions(given.points[0]));
    const size_t vertices = primitive.primvars.values[0].items();
    Faces f = read_faces(faces, counts, vertices);
    if (f.corners.empty())
        f.corners = std::vector<int32_t>(f.count, 3);
    primitive.geometry = scene::SubdivisionMesh{scheme, f.corners, f.vertices, tags(creases)};
    add_mesh_primvars(primitive, given, vertices, f, looks.times);
    return add(place, std::move(primitive), looks);
}

// The arguments that polygons and subdivision surfaces share.
const std::string MeshSignature = "(self, points: ArrayLike, faces: ArrayLike, counts: ArrayLike | None = "
                                  "None, *, normals: ArrayLike | None = "
                                  "None, uv: ArrayLike | None = None, primvars: dict[str, ArrayLike] = {}";

template <class Owner>
void bind_mesh(nb::class_<Owner>& c) {
    const std::string signature = "def add_mesh" + MeshSignature + looks_signature() + ") -> int";
    define(
        c, "add_mesh",
        [](Owner& owner, nb::handle points, nb::handle faces, nb::handle counts, nb::handle normals,
           nb::handle uv, nb::dict primvars, const nb::kwargs& looks) {
            return add_mesh(place(owner), points, faces, counts,
                            {{}, false, nb::none(), normals, uv, primvars}, looks_of("add_mesh", looks));
        },
        nb::arg("points"), nb::arg("faces"), nb::arg("counts") = nb::none(), nb::kw_only(),
        nb::arg("normals") = nb::none(), nb::arg("uv") = nb::none(), nb::arg("primvars") = nb::dict(),
        nb::arg("looks"),
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
        nb::sig(signature.c_str()));
}

template <class Owner>
void bind_subdivision(nb::class_<Owner>& c) {
    const std::string signature = "def add_subdivision" + MeshSignature +
                                  ", scheme: str = 'catmull-clark', creases: Sequence[Sequence[int]] = [], "
                                  "crease_sharpness: Sequence[float] "
                                  "= [], corners: Sequence[int] = [], corner_sharpness: Sequence[float] = "
                                  "[], holes: Sequence[int] = [], "
                                  "boundary: str = 'edge-and-corner', "
                                  "facevarying: str = 'corners-plus1', smooth_triangles: bool = False" +
                                  looks_signature() + ") -> int";
    define(
        c, "add_subdivision",
        [](Owner& owner, nb::handle points, nb::handle faces, nb::handle counts, nb::handle normals,
           nb::handle uv, nb::dict primvars, std::string scheme, std::vector<std::vector<int32_t>> creases,
           std::vector<float> crease_sharpness, std::vector<int32_t> corners,
           std::vector<float> corner_sharpness, std::vector<int32_t> holes, std::string boundary,
           std::string facevarying, bool smooth_triangles, const nb::kwargs& looks) {
            return add_subdivision(place(owner), points, faces, counts, scheme,
                                   {creases, crease_sharpness, corners, holes, corner_sharpness, boundary,
                                    facevarying, smooth_triangles},
                                   {{}, false, nb::none(), normals, uv, primvars},
                                   looks_of("add_subdivision", looks));
        },
        nb::arg("points"), nb::arg("faces"), nb::arg("counts") = nb::none(), nb::kw_only(),
        nb::arg("normals") = nb::none(), nb::arg("uv") = nb::none(), nb::arg("primvars") = nb::dict(),
        nb::arg("scheme") = "catmull-clark", nb::arg("creases") = nb::list(),
        nb::arg("crease_sharpness") = nb::list(), nb::arg("corners") = nb::list(),
        nb::arg("corner_sharpness") = nb::list(), nb::arg("holes") = nb::list(),
        nb::arg("boundary") = "edge-and-corner", nb::arg("facevarying") = "corners-plus1",
        nb::arg("smooth_triangles") = false, nb::arg("looks"),
        "Adds a subdivision surface: arguments as add_mesh, and its creases as chains of vertices.\n\n"
        "As OpenSubdiv has them: `boundary` tells which border is sharp (\"none\": faces there only guide "
        "the others; \"edge-only\",\n"
        "\"edge-and-corner\"), `facevarying` where face-varying values go linearly (\"none\", "
        "\"corners-only\", \"corners-plus1\",\n"
        "\"corners-plus2\", \"boundaries\", \"all\"); `smooth_triangles` are smoother than Catmull and "
        "Clark's.",
        nb::sig(signature.c_str()));
}

} // namespace

template <class Owner>
void bind_meshes(nb::class_<Owner>& c) {
    bind_mesh(c);
    bind_subdivision(c);
}
template void bind_meshes(nb::class_<Scene>& c);
template void bind_meshes(nb::class_<Group>& c);

} // namespace kanuka::python
