#include "ingest/rib/repair.h"

#include <algorithm>
#include <numeric>

#include "ingest/rib/requests.h"

namespace kanuka::ingest {

using scene::Buffer;
using scene::Detail;
using scene::Value;

namespace {

// Parts (faces or curves) one after another, each with so many values.
struct Parts {
    std::vector<size_t> sizes;
    std::vector<bool> good;

    size_t total() const { return std::accumulate(sizes.begin(), sizes.end(), size_t(0)); }
    size_t bad() const { return size_t(std::count(good.begin(), good.end(), false)); }

    // Keeps the values of good parts: `element` of them for each of a part's `sizes`, or for the part as a
    // whole.
    template <class T>
    Buffer<T> keep(const Buffer<T>& values, size_t element, bool per_part) const {
        const size_t expected = (per_part ? sizes.size() : total()) * element;
        if (values.size() < expected || values.empty())
            return values; // too short: reported later
        std::vector<T> kept;
        kept.reserve(expected);
        size_t at = 0;
        for (size_t i = 0; i < sizes.size(); i++) {
            const size_t n = (per_part ? 1 : sizes[i]) * element;
            if (good[i])
                kept.insert(kept.end(), values.begin() + at, values.begin() + at + n);
            at += n;
        }
        return kept;
    }
    void keep(Value& v, bool per_part) const {
        const size_t element = size_t(components(v.type)) * size_t(v.array_size);
        v.floats = keep(v.floats, element, per_part);
        v.ints = keep(v.ints, element, per_part);
        v.strings = keep(v.strings, element, per_part);
    }
};

// The first bad face in words; "" = all are good. `loops` may be empty: one loop a face.
std::string find_bad_faces(const Buffer<int32_t>& loops, const Buffer<int32_t>& nverts,
                           const Buffer<int32_t>& verts, size_t positions, Parts& faces, bool& out_of_range) {
    const auto wrong_counts = [](const Buffer<int32_t>& counts, size_t sum) {
        int64_t total = 0;
        for (const int32_t n : counts) {
            if (n < 0)
                return true;
            total += n;
        }
        return size_t(total) != sum;
    };
    if ((!loops.empty() && wrong_counts(loops, nverts.size())) || wrong_counts(nverts, verts.size()))
        return "";
    std::string first;
    const size_t count = loops.empty() ? nverts.size() : loops.size();
    size_t loop = 0, corner = 0;
    for (size_t f = 0; f < count; f++) {
        size_t size = 0;
        bool good = true;
        const int32_t n_loops = loops.empty() ? 1 : loops[f];
        for (int32_t l = 0; l < n_loops; l++, loop++) {
            if (nverts[loop] < 3 && good) {
                good = false;
                if (first.empty())
                    first =
                        "face " + std::to_string(f) + " has " + std::to_string(nverts[loop]) + " vertices";
            }
            for (int32_t k = 0; k < nverts[loop]; k++, corner++, size++)
                if ((verts[corner] < 0 || size_t(verts[corner]) >= positions) && good) {
                    good = false;
                    out_of_range = true;
                    if (first.empty())
                        first = "face " + std::to_string(f) + " names vertex " +
                                std::to_string(verts[corner]) + ", and P has " + std::to_string(positions) +
                                " values";
                }
        }
        faces.sizes.push_back(size);
        faces.good.push_back(good && n_loops > 0);
    }
    return first;
}

void report(Call& call, Reports& reports, const Parts& parts, const char* what, const std::string& first,
            bool severe) {
    reports.at(severe ? Severity::Error : Severity::Warning, "bad faces and curves", call.where,
               std::string(call.spec->name) + ": " + std::to_string(parts.bad()) + " of " +
                   std::to_string(parts.sizes.size()) + " " + what + " were left out: " + first);
}

template <class Mesh>
void drop_faces(Call& call, Mesh& mesh, const Buffer<int32_t>& loops, Buffer<int32_t>& nverts,
                size_t positions, Reports& reports, Parts& faces) {
    bool out_of_range = false;
    const std::string first = find_bad_faces(loops, nverts, mesh.vertices, positions, faces, out_of_range);
    if (first.empty() || faces.bad() == faces.sizes.size()) {
        faces.good.clear();
        return;
    }
    report(call, reports, faces, "faces", first, out_of_range);
    mesh.vertices = faces.keep(mesh.vertices, 1, false);
    Parts by_loop;
    for (size_t f = 0; f < faces.sizes.size(); f++) {
        by_loop.sizes.push_back(loops.empty() ? 1 : size_t(loops[f]));
        by_loop.good.push_back(faces.good[f]);
    }
    nverts = by_loop.keep(nverts, 1, false);
    for (Value& v : call.params.values)
        if (v.detail == Detail::Uniform)
            faces.keep(v, true);
        else if (v.detail == Detail::FaceVarying || v.detail == Detail::FaceVertex)
            faces.keep(v, false);
}

// "hole" names faces, which move up; so do the paths of hierarchical edits, a length and then a face each. A
// path to a face that has gone keeps a number that no face has.
void renumber_faces(scene::SubdivisionMesh& mesh, const Parts& faces) {
    std::vector<int32_t> moved(faces.good.size());
    int32_t next = 0;
    for (size_t f = 0; f < faces.good.size(); f++)
        moved[f] = faces.good[f] ? next++ : -1;
    const auto move = [&](int32_t& face) {
        face = face >= 0 && size_t(face) < moved.size() ? moved[size_t(face)] : -1;
    };
    for (auto& tag : mesh.tags)
        if (tag.name == "hole") {
            std::ranges::for_each(tag.ints, move);
            std::erase(tag.ints, -1);
        } else if (tag.name == "vertexedit" || tag.name == "edgeedit" || tag.name == "faceedit") {
            for (size_t i = 0; i + 1 < tag.ints.size() && tag.ints[i] > 0; i += size_t(tag.ints[i]) + 1)
                move(tag.ints[i + 1]);
        }
}

void drop_curves(Call& call, scene::Curves& curves, Reports& reports) {
    Parts parts;
    std::string first;
    const int step = curves.basis->step;
    for (const int32_t n : curves.vertices_per_curve) {
        if (n < 0)
            return;
        const bool good = !curves.cubic     ? n >= 2
                          : curves.periodic ? n >= 3 && n % step == 0
                                            : n >= 4 && (n - 4) % step == 0;
        if (!good && first.empty())
            first =
                "curve " + std::to_string(parts.sizes.size()) + " has " + std::to_string(n) + " vertices" +
                (curves.cubic ? ", which the basis step of " + std::to_string(step) + " does not divide up"
                              : "");
        parts.sizes.push_back(size_t(n));
        parts.good.push_back(good);
    }
    if (first.empty() || parts.bad() == parts.sizes.size())
        return;
    report(call, reports, parts, "curves", first, false);
    curves.vertices_per_curve = parts.keep(curves.vertices_per_curve, 1, true);
    for (Value& v : call.params.values)
        if (v.detail == Detail::Uniform)
            parts.keep(v, true);
        else if (v.detail != Detail::Constant &&
                 (v.detail == Detail::Vertex || v.name == "P" || v.name == "Pw" || !curves.cubic))
            parts.keep(v, false); // linear curves vary by vertex
}

} // namespace

void drop_bad_parts(Call& call, scene::Geometry& geometry, size_t positions, Reports& reports) {
    Parts faces;
    if (auto* mesh = std::get_if<scene::PolygonMesh>(&geometry)) {
        if (mesh->vertices.empty())
            return;
        const Buffer<int32_t> loops = mesh->loops_per_face;
        drop_faces(call, *mesh, loops, mesh->vertices_per_loop, positions, reports, faces);
        if (!faces.good.empty() && !loops.empty()) {
            faces.sizes.assign(faces.sizes.size(), 1);
            mesh->loops_per_face = faces.keep(loops, 1, true);
        }
    } else if (auto* subdivision = std::get_if<scene::SubdivisionMesh>(&geometry)) {
        drop_faces(call, *subdivision, {}, subdivision->vertices_per_face, positions, reports, faces);
        if (!faces.good.empty())
            renumber_faces(*subdivision, faces);
    } else if (auto* curves = std::get_if<scene::Curves>(&geometry)) {
        drop_curves(call, *curves, reports);
    }
}

} // namespace kanuka::ingest
