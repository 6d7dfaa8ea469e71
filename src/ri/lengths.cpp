// C arrays have no lengths: what RISpec's table 5.1 says of each primitive.

#include <algorithm>
#include <numeric>

#include "ri/session.h"

namespace kanuka::ri {

long Lengths::of(scene::Detail detail) const {
    switch (detail) {
    case scene::Detail::Constant:
        return 1;
    case scene::Detail::Uniform:
        return uniform;
    case scene::Detail::Varying:
        return varying;
    case scene::Detail::Vertex:
        return vertex;
    case scene::Detail::FaceVarying:
    case scene::Detail::FaceVertex:
        return face_varying;
    }
    return 1;
}

static long total(const std::vector<int32_t>& v) {
    return std::accumulate(v.begin(), v.end(), 0L);
}

static Lengths mesh(long faces, const std::vector<int32_t>& corners) {
    const long vertices = corners.empty() ? 0 : 1L + *std::ranges::max_element(corners);
    return {faces, vertices, vertices, long(corners.size())};
}

// Segments of a cubic through n vertices.
static long segments(long n, bool periodic, long step) {
    step = std::max(step, 1L);
    return std::max(periodic ? n / step : (n - 4) / step + 1, 0L);
}

static Lengths patch_mesh(const ingest::Call& call, int ustep, int vstep) {
    const long nu = call.i(1), nv = call.i(3);
    const bool up = call.text(2) == "periodic", vp = call.text(4) == "periodic";
    const bool cubic = call.text(0) == "bicubic";
    const long u = cubic ? segments(nu, up, ustep) : up ? nu : nu - 1;
    const long v = cubic ? segments(nv, vp, vstep) : vp ? nv : nv - 1;
    return {u * v, (u + !up) * (v + !vp), nu * nv, 4 * u * v};
}

static Lengths curves(const ingest::Call& call, int vstep) {
    const bool periodic = call.text(2) == "periodic", cubic = call.text(0) == "cubic";
    Lengths l{long(call.args[1].ints.size()), 0, 0, 0};
    for (const int32_t n : call.args[1].ints) {
        l.vertex += n;
        l.varying += cubic ? segments(n, periodic, vstep) + !periodic : n;
    }
    l.face_varying = l.varying;
    return l;
}

Lengths lengths_of(const ingest::Call& call, long vertices, int ustep, int vstep) {
    const std::string_view name = call.spec->name;
    if (name == "Polygon")
        return {1, vertices, vertices, vertices};
    if (name == "GeneralPolygon") {
        const long n = total(call.args[0].ints);
        return {1, n, n, n};
    }
    if (name == "PointsPolygons")
        return mesh(long(call.args[0].ints.size()), call.args[1].ints);
    if (name == "PointsGeneralPolygons")
        return mesh(long(call.args[0].ints.size()), call.args[2].ints);
    if (name == "SubdivisionMesh" || name == "HierarchicalSubdivisionMesh")
        return mesh(long(call.args[1].ints.size()), call.args[2].ints);
    if (name == "Patch")
        return {1, 4, call.text(0) == "bicubic" ? 16 : 4, 4};
    if (name == "PatchMesh")
        return patch_mesh(call, ustep, vstep);
    if (name == "NuPatch") {
        const long nu = call.i(0), uo = call.i(1), nv = call.i(5), vo = call.i(6);
        return {(1 + nu - uo) * (1 + nv - vo), (2 + nu - uo) * (2 + nv - vo), nu * nv,
                4 * (1 + nu - uo) * (1 + nv - vo)};
    }
    if (name == "Curves")
        return curves(call, vstep);
    if (name == "Points" || name == "Blobby")
        return {1, vertices, vertices, vertices};
    if (name == "Volume" && call.args[2].ints.size() == 3) {
        const long n = long(call.args[2].ints[0]) * call.args[2].ints[1] * call.args[2].ints[2];
        return {1, n, n, n};
    }
    if (name == "Geometry")
        return {1, 1, 1, 1};
    return {1, 4, 4, 4}; // quadrics
}

} // namespace kanuka::ri
