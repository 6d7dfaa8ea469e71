#include "geom/subdivision.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <utility>

namespace kanuka::geom {
namespace {

using Sdc = osd::Sdc::Options;
constexpr float InfinitelySharp = 10; // to OpenSubdiv

// Kept faces, by the least of their vertices.
class KnownFaces {
  public:
    explicit KnownFaces(size_t points) : m_head(points, -1) {}

    // Is there one with the same vertices in the same order, wherever that begins? Else it is noted.
    bool has(const Cage& cage, const int* face, int n) {
        const int least = int(std::min_element(face, face + n) - face);
        int& head = m_head[size_t(face[least])];
        for (int other = head; other >= 0; other = m_next[size_t(other)]) {
            if (cage.sizes[size_t(other)] != n)
                continue;
            const int* v = cage.vertices.data() + cage.first[size_t(other)];
            const int start = int(std::min_element(v, v + n) - v);
            int i = 0;
            while (i < n && v[(start + i) % n] == face[(least + i) % n])
                i++;
            if (i == n)
                return true;
        }
        m_next.push_back(std::exchange(head, int(m_next.size())));
        return false;
    }

  private:
    std::vector<int> m_head, m_next;
};

void read_faces(const scene::SubdivisionMesh& mesh, const ControlPoints& points, bool triangles_only,
                Cage& cage, Dropped& dropped) {
    cage.vertices.reserve(mesh.vertices.size());
    for (std::vector<int>* v : {&cage.first, &cage.sizes, &cage.face, &cage.corner})
        v->reserve(mesh.vertices_per_face.size() + 1);
    cage.first.push_back(0);
    cage.faces = mesh.vertices_per_face.size();
    constexpr int Few = 32;
    std::vector<int> sorted;
    KnownFaces known(points.size());
    size_t corner = 0;
    for (size_t f = 0; f < cage.faces; f++) {
        const int n = mesh.vertices_per_face[f];
        const size_t begin = corner;
        if (n < 3 || corner + n > mesh.vertices.size() || (triangles_only && n != 3)) {
            dropped.bad_index++;
            corner += std::max(0, n);
            continue;
        }
        corner += n;
        bool good = true, finite = true;
        for (int i = 0; i < n && good; i++) {
            const int v = mesh.vertices[begin + i];
            good = uint32_t(v) < points.size();
            for (int k = 0; k < i && good && n <= Few; k++)
                good = mesh.vertices[begin + k] != v;
            finite = finite && good && points.finite(v);
        }
        if (good && n > Few) {
            sorted.assign(&mesh.vertices[begin], &mesh.vertices[begin] + n);
            std::sort(sorted.begin(), sorted.end());
            good = std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end();
        }
        if (!good || !finite) {
            (good ? dropped.non_finite : dropped.bad_index)++;
            continue;
        }
        if (known.has(cage, &mesh.vertices[begin], n)) { // OpenSubdiv 3.5 writes out of bounds at many
            dropped.copies++;
            continue;
        }
        for (int i = 0; i < n; i++)
            cage.vertices.push_back(mesh.vertices[begin + i]);
        cage.first.push_back(int(cage.vertices.size()));
        cage.sizes.push_back(n);
        cage.face.push_back(int(f));
        cage.corner.push_back(int(begin));
    }
    cage.corners = corner;
}

// Work and memory for what is around a vertex or in a face go with the cube of its edges (a face of 400
// corners takes 6 s, one of 1 000 minutes), and refinement beside it would cost less than looking at it.
bool has_huge_parts(const Cage& cage, size_t points, std::string& what) {
    constexpr int MostCorners = 128, MostValence = 256;
    std::vector<int> valence(points, 0);
    for (const int v : cage.vertices)
        valence[size_t(v)]++;
    const int corners = *std::max_element(cage.sizes.begin(), cage.sizes.end());
    const int edges = *std::max_element(valence.begin(), valence.end());
    if (corners > MostCorners)
        what =
            "a face of " + std::to_string(corners) + " corners (at most " + std::to_string(MostCorners) + ")";
    else if (edges > MostValence)
        what =
            "a vertex of " + std::to_string(edges) + " faces (at most " + std::to_string(MostValence) + ")";
    return !what.empty();
}

class TagReader {
  public:
    TagReader(const scene::Primitive& primitive, Cage& cage, Journal& journal)
        : m_primitive(primitive), m_cage(cage), m_journal(journal) {}

    void read(const scene::SubdivisionMesh::Tag& tag) {
        if (tag.name == "crease")
            crease(tag);
        else if (tag.name == "corner")
            corner(tag);
        else if (tag.name == "hole")
            hole(tag);
        else if (tag.name == "interpolateboundary")
            boundary(tag);
        else if (tag.name == "facevaryinginterpolateboundary")
            face_varying(tag);
        else if (tag.name == "creasemethod")
            m_cage.options.SetCreasingMethod(!tag.strings.empty() && tag.strings[0] == "chaikin"
                                                 ? Sdc::CREASE_CHAIKIN
                                                 : Sdc::CREASE_UNIFORM);
        else if (tag.name == "smoothtriangles")
            m_cage.options.SetTriangleSubdivision(
                tag.ints.empty() || tag.ints[0] != 0 ? Sdc::TRI_SUB_SMOOTH : Sdc::TRI_SUB_CATMARK);
        else if (tag.name != "facevaryingpropagatecorners" && tag.name != "vertexedit" &&
                 tag.name != "edgeedit" && tag.name != "faceedit") // subdivision_edits.cpp
            m_journal.warning(
                m_primitive.where,
                "unknown subdivision tag \"" + tag.name +
                    "\"; one of crease, corner, hole, interpolateboundary, "
                    "facevaryinginterpolateboundary, facevaryingpropagatecorners, creasemethod, "
                    "smoothtriangles, vertexedit, edgeedit, faceedit");
    }

    void finish() const {
        if (m_missing > 0)
            m_journal.warning(
                m_primitive.where,
                std::to_string(m_missing) +
                    " creases, corners or holes name edges, vertices or faces that the mesh has not");
    }

  private:
    static float sharpness(const scene::SubdivisionMesh::Tag& tag, size_t i) {
        if (tag.floats.empty())
            return InfinitelySharp;
        const float s = tag.floats[std::min(i, tag.floats.size() - 1)];
        return std::isfinite(s) ? std::clamp(s, 0.0f, InfinitelySharp) : InfinitelySharp;
    }

    void list_edges() {
        m_edges.reserve(m_cage.vertices.size());
        for (size_t f = 0; f < m_cage.sizes.size(); f++)
            for (int i = m_cage.first[f]; i < m_cage.first[f + 1]; i++)
                m_edges.push_back(
                    std::minmax(m_cage.vertices[i],
                                m_cage.vertices[i + 1 < m_cage.first[f + 1] ? i + 1 : m_cage.first[f]]));
        std::ranges::sort(m_edges);
    }

    void crease(const scene::SubdivisionMesh::Tag& tag) {
        if (m_edges.empty())
            list_edges();
        for (size_t i = 0; i + 1 < tag.ints.size(); i++) {
            const int a = tag.ints[i], b = tag.ints[i + 1];
            if (!std::ranges::binary_search(m_edges, std::pair<int, int>(std::minmax(a, b)))) {
                m_missing++;
                continue;
            }
            m_cage.crease_pairs.insert(m_cage.crease_pairs.end(), {a, b});
            m_cage.crease_weights.push_back(sharpness(tag, i));
        }
    }
    void corner(const scene::SubdivisionMesh::Tag& tag) {
        if (m_vertices.empty()) {
            m_vertices = m_cage.vertices;
            std::ranges::sort(m_vertices);
        }
        for (size_t i = 0; i < tag.ints.size(); i++) {
            if (!std::ranges::binary_search(m_vertices, tag.ints[i])) {
                m_missing++;
                continue;
            }
            m_cage.corner_vertices.push_back(tag.ints[i]);
            m_cage.corner_weights.push_back(sharpness(tag, i));
        }
    }
    void hole(const scene::SubdivisionMesh::Tag& tag) {
        for (const int f : tag.ints) {
            const auto at = std::lower_bound(m_cage.face.begin(), m_cage.face.end(), f);
            if (at == m_cage.face.end() || *at != f)
                m_missing++;
            else
                m_cage.holes.push_back(int(at - m_cage.face.begin()));
        }
    }
    void boundary(const scene::SubdivisionMesh::Tag& tag) {
        const int how = tag.ints.empty() ? 1 : tag.ints[0];
        m_cage.options.SetVtxBoundaryInterpolation(how == 0   ? Sdc::VTX_BOUNDARY_NONE
                                                   : how == 2 ? Sdc::VTX_BOUNDARY_EDGE_ONLY
                                                              : Sdc::VTX_BOUNDARY_EDGE_AND_CORNER);
    }
    void face_varying(const scene::SubdivisionMesh::Tag& tag) {
        constexpr Sdc::FVarLinearInterpolation How[] = {
            Sdc::FVAR_LINEAR_NONE,          Sdc::FVAR_LINEAR_CORNERS_ONLY, Sdc::FVAR_LINEAR_CORNERS_PLUS1,
            Sdc::FVAR_LINEAR_CORNERS_PLUS2, Sdc::FVAR_LINEAR_BOUNDARIES,   Sdc::FVAR_LINEAR_ALL};
        const int how = tag.ints.empty() ? 1 : std::clamp(tag.ints[0], 0, 5);
        m_cage.options.SetFVarLinearInterpolation(How[how]);
    }

    const scene::Primitive& m_primitive;
    Cage& m_cage;
    Journal& m_journal;
    // Sorted; made for the tags that name some (most meshes have but the tag of their boundary).
    std::vector<std::pair<int, int>> m_edges;
    std::vector<int> m_vertices;
    size_t m_missing = 0;
};

// Calls found(face, other) for pairs of faces that have more than a side in common.
template <class Found>
void for_each_overlap(const Cage& cage, size_t points, const Found& found) {
    std::vector<std::vector<int>> faces_at(points);
    std::vector<int> common(cage.sizes.size()), beside;
    for (size_t f = 0; f < cage.sizes.size(); f++) {
        beside.clear();
        for (int i = cage.first[f]; i < cage.first[f + 1]; i++) {
            auto& at = faces_at[size_t(cage.vertices[size_t(i)])];
            for (const int other : at)
                if (common[size_t(other)]++ == 0)
                    beside.push_back(other);
            at.push_back(int(f));
        }
        for (const int other : beside) {
            if (common[size_t(other)] > 2)
                found(int(f), other);
            common[size_t(other)] = 0;
        }
    }
}

// Vertices where the surface is no surface: at edges of more than two faces or of two that run the same way,
// and where several borders meet.
std::vector<char> torn_vertices(const Cage& cage, size_t points) {
    std::map<std::pair<int, int>, std::array<int, 2>> edges; // how many faces go up it, and down
    for (size_t f = 0; f < cage.sizes.size(); f++)
        for (int i = cage.first[f]; i < cage.first[f + 1]; i++) {
            const int a = cage.vertices[size_t(i)],
                      b = cage.vertices[size_t(i + 1 < cage.first[f + 1] ? i + 1 : cage.first[f])];
            edges[{std::min(a, b), std::max(a, b)}][a < b ? 0 : 1]++;
        }
    std::vector<char> torn(points);
    std::vector<int> borders(points);
    for (const auto& [edge, faces] : edges)
        for (const int v : {edge.first, edge.second}) {
            torn[size_t(v)] |= faces[0] > 1 || faces[1] > 1;
            borders[size_t(v)] += faces[0] + faces[1] == 1;
        }
    for (size_t v = 0; v < points; v++)
        torn[v] |= borders[v] > 2;
    for_each_overlap(cage, points, [&](int face, int other) { // two faces have one side in common at most
        for (const int f : {face, other})
            for (int i = cage.first[size_t(f)]; i < cage.first[size_t(f) + 1]; i++)
                torn[size_t(cage.vertices[size_t(i)])] = 1;
    });
    return torn;
}

// Bfr (OpenSubdiv 3.5) writes out of bounds where it makes a patch of a face with a torn vertex and a sharp
// edge or corner: sharpness gives way there.
void leave_out_sharpness_at_tears(Cage& cage, size_t points, const Location& where, Journal& journal) {
    if (cage.crease_weights.empty() && cage.corner_weights.empty())
        return;
    const std::vector<char> torn = torn_vertices(cage, points);
    std::vector<char> beside(points);
    for (size_t f = 0; f < cage.sizes.size(); f++) {
        const auto begin = cage.vertices.begin() + cage.first[f],
                   end = cage.vertices.begin() + cage.first[f + 1];
        if (std::any_of(begin, end, [&](int v) { return torn[size_t(v)]; }))
            std::for_each(begin, end, [&](int v) { beside[size_t(v)] = 1; });
    }
    size_t creases = 0, corners = 0;
    for (size_t i = 0; i < cage.crease_weights.size(); i++) {
        const int a = cage.crease_pairs[2 * i], b = cage.crease_pairs[2 * i + 1];
        if (beside[size_t(a)] || beside[size_t(b)])
            continue;
        cage.crease_pairs[2 * creases] = a, cage.crease_pairs[2 * creases + 1] = b;
        cage.crease_weights[creases++] = cage.crease_weights[i];
    }
    for (size_t i = 0; i < cage.corner_weights.size(); i++)
        if (!beside[size_t(cage.corner_vertices[i])]) {
            cage.corner_vertices[corners] = cage.corner_vertices[i];
            cage.corner_weights[corners++] = cage.corner_weights[i];
        }
    const size_t lost = cage.crease_weights.size() + cage.corner_weights.size() - creases - corners;
    cage.crease_pairs.resize(2 * creases), cage.crease_weights.resize(creases);
    cage.corner_vertices.resize(corners), cage.corner_weights.resize(corners);
    if (lost > 0)
        journal.warning(where,
                        std::to_string(lost) +
                            " creases or corners were left out beside edges of more than two faces, or "
                            "vertices where several borders meet");
}

} // namespace

bool read_cage(const scene::Primitive& primitive, const scene::SubdivisionMesh& mesh,
               const ControlPoints& points, Cage& cage, Journal& journal) {
    if (mesh.scheme == "loop")
        cage.scheme = osd::Sdc::SCHEME_LOOP;
    else if (mesh.scheme == "bilinear")
        cage.scheme = osd::Sdc::SCHEME_BILINEAR;
    else if (mesh.scheme != "catmull-clark")
        journal.warning(primitive.where,
                        "unknown subdivision scheme \"" + mesh.scheme +
                            "\", catmull-clark is used; one of catmull-clark, loop, bilinear");
    Dropped dropped;
    read_faces(mesh, points, cage.scheme == osd::Sdc::SCHEME_LOOP, cage, dropped);
    dropped.report(cage.faces, "subdivision faces", primitive.where, journal);
    if (cage.sizes.empty())
        return false;
    if (std::string what;
        cage.scheme != osd::Sdc::SCHEME_BILINEAR && has_huge_parts(cage, points.size(), what)) {
        cage.scheme = osd::Sdc::SCHEME_BILINEAR;
        journal.warning(primitive.where,
                        "a subdivision mesh has " + what +
                            ": it is shown as the polygons that it is made of. Cut such faces, "
                            "or refine the mesh around such vertices");
    }
    // RISpec: without the tag, faces at a boundary only guide the others.
    cage.options.SetVtxBoundaryInterpolation(Sdc::VTX_BOUNDARY_NONE);
    cage.options.SetFVarLinearInterpolation(Sdc::FVAR_LINEAR_CORNERS_PLUS1);
    if (cage.scheme == osd::Sdc::SCHEME_BILINEAR)
        cage.options.SetVtxBoundaryInterpolation(Sdc::VTX_BOUNDARY_EDGE_AND_CORNER);
    if (!mesh.tags.empty()) {
        TagReader reader(primitive, cage, journal);
        for (const auto& tag : mesh.tags)
            reader.read(tag);
        reader.finish();
        leave_out_sharpness_at_tears(cage, points.size(), primitive.where, journal);
    }
    return true;
}

bool leave_out_overlaps(Cage& cage, const osd::Far::TopologyLevel& level, const Location& where,
                        Journal& journal) {
    bool surface = true;
    for (int v = 0; v < level.GetNumVertices() && surface; v++)
        surface = !level.IsVertexNonManifold(v);
    if (surface)
        return false;
    std::vector<char> overlapped(size_t(level.GetNumVertices()));
    for_each_overlap(cage, overlapped.size(), [&](int face, int other) {
        for (const int f : {face, other})
            for (int i = cage.first[size_t(f)]; i < cage.first[size_t(f) + 1]; i++)
                overlapped[size_t(cage.vertices[size_t(i)])] = 1;
    });
    const size_t before = cage.holes.size();
    for (size_t f = 0; f < cage.sizes.size(); f++)
        if (std::any_of(cage.vertices.begin() + cage.first[f], cage.vertices.begin() + cage.first[f + 1],
                        [&](int v) { return overlapped[size_t(v)]; }))
            cage.holes.push_back(int(f));
    if (cage.holes.size() == before)
        return false;
    journal.warning(where,
                    std::to_string(cage.holes.size() - before) +
                        " subdivision faces were left out: they lie where faces have more than a side in "
                        "common and edges more than two faces. Merge what is there twice");
    return true;
}

FaceVaryingChannel join_face_varying(const Cage& cage, const Primvar& primvar, size_t points) {
    FaceVaryingChannel out;
    const int n = primvar.components;
    std::vector<int> head(points, -1), next;
    out.indices.resize(cage.vertices.size());
    for (size_t f = 0; f < cage.sizes.size(); f++)
        for (int i = 0; i < cage.sizes[f]; i++) {
            const float* value = primvar.values.data() + size_t(cage.corner[f] + i) * n;
            const int v = cage.vertices[cage.first[f] + i];
            int k = head[v];
            while (k >= 0 && std::memcmp(&out.values[size_t(k) * n], value, n * sizeof(float)) != 0)
                k = next[k];
            if (k < 0) {
                k = out.count++;
                out.values.insert(out.values.end(), value, value + n);
                next.push_back(head[v]);
                head[v] = k;
            }
            out.indices[cage.first[f] + i] = k;
        }
    return out;
}

std::unique_ptr<osd::Far::TopologyRefiner> make_refiner(const Cage& cage, size_t points,
                                                        const std::vector<FaceVaryingChannel>& channels) {
    osd::Far::TopologyDescriptor d;
    d.numVertices = int(points);
    d.numFaces = int(cage.sizes.size());
    d.numVertsPerFace = cage.sizes.data();
    d.vertIndicesPerFace = cage.vertices.data();
    d.numCreases = int(cage.crease_weights.size());
    d.creaseVertexIndexPairs = cage.crease_pairs.data();
    d.creaseWeights = cage.crease_weights.data();
    d.numCorners = int(cage.corner_weights.size());
    d.cornerVertexIndices = cage.corner_vertices.data();
    d.cornerWeights = cage.corner_weights.data();
    d.numHoles = int(cage.holes.size());
    d.holeIndices = cage.holes.data();
    std::vector<osd::Far::TopologyDescriptor::FVarChannel> given(channels.size());
    for (size_t k = 0; k < given.size(); k++) {
        given[k].numValues = channels[k].count;
        given[k].valueIndices = channels[k].indices.data();
    }
    d.numFVarChannels = int(given.size());
    d.fvarChannels = given.data();
    using Factory = osd::Far::TopologyRefinerFactory<osd::Far::TopologyDescriptor>;
    return std::unique_ptr<osd::Far::TopologyRefiner>(
        Factory::Create(d, Factory::Options(cage.scheme, cage.options)));
}

} // namespace kanuka::geom
