// Blobby, Volume, Geometry, and ClippingPlane.

#include <algorithm>
#include <cmath>

#include "ingest/rib/context.h"
#include "ingest/rib/handlers.h"
#include "ingest/rib/search_path.h"

namespace kanuka::ingest::handlers {

using namespace scene;

void blobby(Context& c, Call& call) {
    Blobby b;
    b.leaves = call.i(0);
    b.code = std::vector<int32_t>(call.args[1].ints);
    b.floats = std::vector<float>(call.args[2].floats);
    std::vector<std::string> files = call.args[3].strings; // of depths: the ground
    for (std::string& name : files)
        if (auto found = find_file(name, c.options.options.texture_path))
            name = *found;
    b.strings = std::move(files);
    if (b.code.empty() || b.leaves < 1) {
        c.reports.error("shape of Blobby", call.where,
                        "Blobby was left out: it needs one leaf and one operation or more");
        return;
    }
    c.add_primitive(call, std::move(b));
}

void volume(Context& c, Call& call) {
    constexpr std::string_view shapes[] = {"box", "ellipsoid", "cylinder", "cone"};
    const std::string& type = call.text(0);
    const auto left_out = [&](const std::string& why) {
        c.reports.error("Volume", call.where, "Volume \"" + type + "\" was left out: " + why);
    };
    const auto shape = std::ranges::find(shapes, type);
    if (shape == std::end(shapes))
        return left_out(type.starts_with("blobbydso:")
                            ? "plug-ins of volumes are not supported; bake it to a lattice "
                              "and give that to Volume \"box\""
                            : "there are box, ellipsoid, cylinder and cone");
    Volume v;
    v.shape = Volume::Shape(shape - std::begin(shapes));
    const auto& bound = call.args[1].floats;
    if (bound.size() != 6 || !(bound[0] < bound[1] && bound[2] < bound[3] && bound[4] < bound[5]))
        return left_out("its bound must be xmin xmax ymin ymax zmin zmax, each maximum above its minimum");
    std::copy(bound.begin(), bound.end(), v.bound.begin());
    const auto& size = call.args[2].ints;
    constexpr int64_t Most = int64_t(1) << 30;
    int64_t total = size.size() == 3 ? 1 : 0;
    for (size_t k = 0; k < 3 && total > 0; k++) { // 0 0 0: no values but constant ones
        v.size[k] = std::max(size[k], 1);
        total = size[k] < 0 || v.size[k] > Most / total ? 0 : total * v.size[k];
    }
    if (total == 0)
        return left_out("nvertices must be three counts of at most " + std::to_string(Most) + " together");
    c.add_primitive(call, v);
}

// What lies on the side that the normal points to is cut away (RISpec 4.1.1).
void clipping_plane(Context& c, Call& call) {
    const auto& v = call.args[0].floats;
    if (!c.finite(call, 1))
        return;
    const Transform camera_from_here = c.camera_from_current();
    if (camera_from_here.determinant3() == 0 || (v[3] == 0 && v[4] == 0 && v[5] == 0)) {
        c.reports.error("ClippingPlane", call.where, "ClippingPlane was left out: it has no direction");
        return;
    }
    const Vec3f p = camera_from_here.point({v[0], v[1], v[2]});
    const Vec3f n = camera_from_here.normal({v[3], v[4], v[5]}, camera_from_here.inverse());
    c.options.camera.clipping_planes.push_back({p.x, p.y, p.z, n.x, n.y, n.z});
}

namespace {

// Martin Newell's teapot (1975) with Jim Blinn's bottom, z up, as its 32 Bezier patches are tabulated in
// Crow, "The Origins of the Teapot", IEEE Computer Graphics and Applications 7(1), 1987. What turns about the
// axis is there as quarters whose inner points lie at 0.56; handle and spout are mirrored in y.
struct ProfilePoint {
    float radius, z;
};
constexpr ProfilePoint Body[] = {{1.4f, 2.4f},    {1.3375f, 2.53125f}, {1.4375f, 2.53125f}, {1.5f, 2.4f},
                                 {1.75f, 1.875f}, {2, 1.35f},          {2, 0.9f},           {2, 0.45f},
                                 {1.5f, 0.225f},  {1.5f, 0.15f},       {1.5f, 0.075f},      {1.425f, 0},
                                 {0, 0}};
constexpr ProfilePoint Lid[] = {{0, 3.15f},    {0.8f, 3.15f}, {0, 2.85f},  {0.2f, 2.7f},
                                {0.4f, 2.55f}, {1.3f, 2.55f}, {1.3f, 2.4f}};
// A cross section: its upper point, its lower one, and half its width.
struct Section {
    float x0, z0, x1, z1, half;
};
constexpr Section Handle[] = {{-1.6f, 2.025f, -1.5f, 2.25f, 0.3f}, {-2.3f, 2.025f, -2.5f, 2.25f, 0.3f},
                              {-2.7f, 2.025f, -3, 2.25f, 0.3f},    {-2.7f, 1.8f, -3, 1.8f, 0.3f},
                              {-2.7f, 1.575f, -3, 1.35f, 0.3f},    {-2.5f, 1.125f, -2.65f, 0.9375f, 0.3f},
                              {-2, 0.9f, -1.9f, 0.6f, 0.3f}};
constexpr Section Spout[] = {{1.7f, 1.425f, 1.7f, 0.6f, 0.66f},       {2.6f, 1.425f, 3.1f, 0.825f, 0.66f},
                             {2.3f, 2.1f, 2.4f, 2.025f, 0.25f},       {2.7f, 2.4f, 3.3f, 2.4f, 0.25f},
                             {2.8f, 2.475f, 3.525f, 2.49375f, 0.25f}, {2.9f, 2.475f, 3.45f, 2.5125f, 0.15f},
                             {2.8f, 2.4f, 3.2f, 2.4f, 0.15f}};

std::vector<float> turned(std::span<const ProfilePoint> profile) {
    constexpr float k = 0.56f;
    constexpr float circle[13][2] = {{1, 0},  {1, -k}, {k, -1}, {0, -1}, {-k, -1}, {-1, -k}, {-1, 0},
                                     {-1, k}, {-k, 1}, {0, 1},  {k, 1},  {1, k},   {1, 0}};
    std::vector<float> p;
    for (const ProfilePoint& q : profile)
        for (const auto& d : circle)
            p.insert(p.end(), {d[0] * q.radius, d[1] * q.radius, q.z});
    return p;
}

std::vector<float> swept(std::span<const Section> sections) {
    std::vector<float> p;
    for (const Section& s : sections)
        for (const auto& [low, y] :
             {std::pair{0, 0.0f}, {0, -s.half}, {1, -s.half}, {1, 0.0f}, {1, s.half}, {0, s.half}, {0, 0.0f}})
            p.insert(p.end(), {low ? s.x1 : s.x0, y, low ? s.z1 : s.z0});
    return p;
}

Value places(std::vector<float> points, const Location& where) {
    Value p;
    p.name = "P";
    p.type = Type::Point;
    p.detail = Detail::Vertex;
    p.floats = std::move(points);
    p.where = where;
    return p;
}

void add_teapot(Context& c, Call& call) {
    // What is said of the whole holds for its four meshes.
    for (Value& v : call.params.values)
        if (v.detail == Detail::Uniform && v.items() == 1)
            v.detail = Detail::Constant;
    std::erase_if(call.params.values, [](const Value& v) { return v.detail != Detail::Constant; });
    const ValueList constants = call.params;
    const auto add = [&](int nu, std::vector<float> points) {
        PatchMesh mesh;
        mesh.nu = nu;
        mesh.nv = int(points.size() / 3) / nu;
        mesh.u_basis = mesh.v_basis = basis_by_name("bezier");
        call.params = constants;
        call.params.set(places(std::move(points), call.where));
        c.add_primitive(call, std::move(mesh));
    };
    add(13, turned(Body));
    add(13, turned(Lid));
    add(7, swept(Handle));
    add(7, swept(Spout));
}

// Of side 1 about the origin, as PRMan has had it since its version 17.
void add_cube(Context& c, Call& call) {
    PolygonMesh mesh;
    mesh.loops_per_face = std::vector<int32_t>(6, 1);
    mesh.vertices_per_loop = std::vector<int32_t>(6, 4);
    mesh.vertices =
        std::vector<int32_t>{0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5};
    std::vector<float> points;
    for (int k = 0; k < 8; k++)
        points.insert(points.end(), {k & 1 ? 0.5f : -0.5f, k & 2 ? 0.5f : -0.5f, k & 4 ? 0.5f : -0.5f});
    call.params.set(places(std::move(points), call.where));
    c.add_primitive(call, std::move(mesh));
}

} // namespace

void geometry(Context& c, Call& call) {
    if (call.text(0) == "teapot")
        add_teapot(c, call);
    else if (call.text(0) == "cube")
        add_cube(c, call);
    else if (!light_geometry(c, call))
        c.reports.error("Geometry", call.where,
                        "Geometry \"" + call.text(0) + "\" was left out: there are \"teapot\" and \"cube\"");
}

} // namespace kanuka::ingest::handlers
