// Polygons, subdivision meshes, quadrics, curves, points.

#include <cmath>

#include "ingest/rib/context.h"
#include "ingest/rib/handlers.h"

namespace kanuka::ingest::handlers {

using namespace scene;

// Exact-size copy of an argument: the argument's own storage serves the next call.
static Buffer<int32_t> ints(const Call& call, size_t i) {
    return std::vector<int32_t>(call.args[i].ints);
}

static size_t count_positions(const Call& call) {
    const Value* p = call.params.find("P");
    p = p ? p : call.params.find("Pw");
    return p ? p->items() : 0;
}

void polygon(Context& c, Call& call) {
    PolygonMesh mesh;
    const size_t n = count_positions(call);
    if (n < 3 && (call.params.find("P") || call.params.find("Pw"))) {
        c.reports.error("shape of Polygon", call.where,
                        "Polygon was left out: it has " + std::to_string(n) +
                            " vertices; it needs 3 or more");
        return;
    }
    mesh.vertices_per_loop = std::vector<int32_t>{int32_t(std::max<size_t>(n, 3))};
    c.add_primitive(call, std::move(mesh));
}

void general_polygon(Context& c, Call& call) {
    PolygonMesh mesh;
    mesh.loops_per_face = std::vector<int32_t>{int32_t(call.args[0].ints.size())};
    mesh.vertices_per_loop = ints(call, 0);
    c.add_primitive(call, std::move(mesh));
}

static void polygon_mesh(Context& c, Call& call, PolygonMesh mesh, size_t first) {
    mesh.vertices_per_loop = ints(call, first);
    mesh.vertices = ints(call, first + 1);
    if (mesh.vertices_per_loop.empty() || mesh.vertices.empty()) {
        c.reports.warning("empty mesh", call.where,
                          std::string(call.spec->name) + " has no faces and was left out");
        return;
    }
    c.add_primitive(call, std::move(mesh));
}

void points_polygons(Context& c, Call& call) {
    polygon_mesh(c, call, {}, 0);
}

void points_general_polygons(Context& c, Call& call) {
    PolygonMesh mesh;
    mesh.loops_per_face = ints(call, 0);
    polygon_mesh(c, call, std::move(mesh), 1);
}

// Tags take their arguments from flat arrays; nargs has two counts a tag (integers, floats), in PRMan's
// longer form three (and strings).
static std::vector<SubdivisionMesh::Tag> subdivision_tags(Context& c, Call& call) {
    std::vector<SubdivisionMesh::Tag> tags;
    const auto& names = call.args[3].strings;
    const auto& counts = call.args[4].ints;
    if (names.empty())
        return tags;
    const size_t each = counts.size() / names.size();
    if (counts.size() % names.size() != 0 || each < 2 || each > 3) {
        c.reports.error("subdivision tags", call.where,
                        std::string(call.spec->name) + ": nargs: expected " +
                            std::to_string(2 * names.size()) +
                            " counts (integers and floats of each tag), found " +
                            std::to_string(counts.size()) + "; the tags were left out");
        return tags;
    }
    size_t at[3] = {0, 0, 0};
    const size_t sizes[3] = {call.args[5].ints.size(), call.args[6].floats.size(),
                             call.args[7].strings.size()};
    for (size_t t = 0; t < names.size(); t++) {
        SubdivisionMesh::Tag tag;
        tag.name = names[t];
        for (size_t k = 0; k < each; k++) {
            const int32_t n = counts[t * each + k];
            constexpr const char* what[] = {"intargs", "floatargs", "stringargs"};
            if (n < 0 || size_t(n) > sizes[k] - at[k]) {
                c.reports.error("subdivision tags", call.where,
                                std::string(call.spec->name) + ": tag \"" + tag.name + "\" takes " +
                                    std::to_string(n) + " of " + what[k] + ", of which " +
                                    std::to_string(sizes[k] - at[k]) +
                                    " are left; this tag and those after it were left out");
                return tags;
            }
            const auto first = long(at[k]), last = first + n;
            if (k == 0)
                tag.ints.assign(call.args[5].ints.begin() + first, call.args[5].ints.begin() + last);
            else if (k == 1)
                tag.floats.assign(call.args[6].floats.begin() + first, call.args[6].floats.begin() + last);
            else
                tag.strings.assign(call.args[7].strings.begin() + first, call.args[7].strings.begin() + last);
            at[k] += size_t(n);
        }
        tags.push_back(std::move(tag));
    }
    return tags;
}

// A crease is a chain of vertices with one sharpness, or one an edge; a corner is vertices with one
// sharpness, or one each; a hole is faces. What names a vertex or face that is not there is left out.
static bool fits(const SubdivisionMesh::Tag& tag, size_t vertices, size_t faces, std::string& problem) {
    const bool hole = tag.name == "hole";
    if (tag.name == "crease" || tag.name == "corner" || hole) {
        for (const int32_t i : tag.ints)
            if (i < 0 || size_t(i) >= (hole ? faces : vertices)) {
                problem = std::string(hole ? "face " : "vertex ") + std::to_string(i) +
                          " is out of range: the mesh has " + std::to_string(hole ? faces : vertices);
                return false;
            }
        const size_t edges = tag.ints.empty() ? 0 : tag.ints.size() - (tag.name == "crease" ? 1 : 0);
        if (tag.name == "crease" && edges < 1) {
            problem = "it needs 2 vertices or more, found " + std::to_string(tag.ints.size());
            return false;
        }
        if (!hole && tag.floats.size() != 1 && tag.floats.size() != edges) {
            problem = "expected 1 or " + std::to_string(edges) + " sharpnesses, found " +
                      std::to_string(tag.floats.size());
            return false;
        }
    }
    return true;
}

void subdivision_mesh(Context& c, Call& call) {
    SubdivisionMesh mesh;
    mesh.scheme = call.text(0);
    if (mesh.scheme != "catmull-clark" && mesh.scheme != "loop" && mesh.scheme != "bilinear") {
        c.reports.error("subdivision scheme", call.where,
                        "SubdivisionMesh: there is no scheme \"" + mesh.scheme +
                            "\"; catmull-clark was used (others are loop, bilinear)");
        mesh.scheme = "catmull-clark";
    }
    mesh.vertices_per_face = ints(call, 1);
    mesh.vertices = ints(call, 2);
    if (mesh.vertices_per_face.empty() || mesh.vertices.empty()) {
        c.reports.warning("empty mesh", call.where, "SubdivisionMesh has no faces and was left out");
        return;
    }
    if (mesh.scheme == "loop")
        for (const int32_t n : mesh.vertices_per_face)
            if (n != 3) {
                c.reports.error("subdivision scheme", call.where,
                                "SubdivisionMesh: the scheme loop takes triangles alone, found a face of " +
                                    std::to_string(n) + " vertices; catmull-clark was used");
                mesh.scheme = "catmull-clark";
                break;
            }
    int64_t largest = -1;
    for (const int32_t v : mesh.vertices)
        largest = std::max(largest, int64_t(v));
    for (SubdivisionMesh::Tag& tag : subdivision_tags(c, call)) {
        std::string problem;
        if (fits(tag, size_t(largest + 1), mesh.vertices_per_face.size(), problem))
            mesh.tags.push_back(std::move(tag));
        else
            c.reports.error("subdivision tags", call.where,
                            "SubdivisionMesh: tag \"" + tag.name + "\" was left out: " + problem);
    }
    c.add_primitive(call, std::move(mesh));
}

void quadric(Context& c, Call& call) {
    constexpr std::pair<std::string_view, Quadric::Kind> kinds[] = {
        {"Sphere", Quadric::Kind::Sphere},
        {"Cone", Quadric::Kind::Cone},
        {"Cylinder", Quadric::Kind::Cylinder},
        {"Hyperboloid", Quadric::Kind::Hyperboloid},
        {"Paraboloid", Quadric::Kind::Paraboloid},
        {"Disk", Quadric::Kind::Disk},
        {"Torus", Quadric::Kind::Torus}};
    if (!c.finite(call, 1))
        return;
    for (const auto& [name, kind] : kinds)
        if (name == call.spec->name)
            c.add_primitive(call, Quadric{kind, call.args[0].floats});
}

void curves(Context& c, Call& call) {
    Curves curves;
    const std::string& type = call.text(0);
    const std::string& wrap = call.text(2);
    if ((type != "linear" && type != "cubic") ||
        (wrap != "periodic" && wrap != "nonperiodic" && wrap != "nowrap")) {
        c.reports.error(
            "kind of Curves", call.where,
            "Curves \"" + type + "\" \"" + wrap +
                "\" was left out: the type must be linear or cubic, the wrap periodic or nonperiodic");
        return;
    }
    curves.cubic = type == "cubic";
    curves.periodic = wrap == "periodic";
    curves.basis = c.attributes.v_basis; // RISpec 5.6: the v basis
    curves.vertices_per_curve = ints(call, 1);
    c.add_primitive(call, std::move(curves));
}

void points(Context& c, Call& call) {
    if (count_positions(call) == 0 && call.params.find("P")) {
        c.reports.warning("empty points", call.where, "Points has no positions and was left out");
        return;
    }
    c.add_primitive(call, Points{});
}

} // namespace kanuka::ingest::handlers
