#include "geom/traced_mesh.h"

#include <atomic>
#include <cstring>

#include "base/large_arrays.h"
#include "base/tasks.h"
#include "geom/bend.h"
#include "grid/mesh_patches.h"

namespace kanuka::geom {
namespace {

constexpr size_t Grain = 1 << 15;

// Faces as corner numbers, `sides` (3 or 4) each.
struct CornerFaces {
    int sides = 3;
    bool all_corners = false; // the corners are 0, 1, 2, …
    std::vector<uint32_t> corners;
};

// Convex polygons to quads and triangles by fans; a triangle among quads repeats its last corner.
CornerFaces fan(const Pieces& pieces) {
    CornerFaces out;
    for (size_t i = 0; i + 1 < pieces.first.size(); i++)
        if (pieces.first[i + 1] - pieces.first[i] > 3)
            out.sides = 4;
    for (size_t i = 0; i + 1 < pieces.first.size(); i++) {
        const int* c = &pieces.corner[pieces.first[i]];
        const int n = pieces.first[i + 1] - pieces.first[i];
        for (int k = 1; k + 1 < n; k += 2) {
            out.corners.insert(out.corners.end(), {uint32_t(c[0]), uint32_t(c[k]), uint32_t(c[k + 1])});
            if (out.sides == 4)
                out.corners.push_back(uint32_t(k + 2 < n ? c[k + 2] : c[k + 1]));
        }
    }
    return out;
}

// Every face has usable corners: then they need not be gone through one by one again.
bool all_usable(const PolygonFaces& faces, const std::vector<float>& p) {
    std::atomic<bool> good{true};
    tasks::parallel_chunks(faces.corners(), Grain, [&](size_t begin, size_t end) {
        bool ok = true;
        for (size_t c = begin; c < end; c++)
            ok &= faces.vertex(c) >= 0;
        if (!ok)
            good = false;
    });
    tasks::parallel_chunks(p.size(), Grain, [&](size_t begin, size_t end) {
        bool ok = true;
        for (size_t i = begin; i < end; i++)
            ok &= ControlPoints::in_reach(p[i]);
        if (!ok)
            good = false;
    });
    return good;
}

// Output vertices: which point, corner and face each one takes its data from.
struct Sources {
    bool split = false; // otherwise vertex i is point i
    std::vector<uint32_t> point, corner, face;
    std::vector<uint32_t> of_corner; // output vertex of a corner
    size_t count = 0;
};

// One output vertex for every distinct set of face-varying and uniform values that a point has.
class VertexSplitter {
  public:
    VertexSplitter(const PolygonFaces& faces, const Primvars& primvars, bool parameters, size_t points)
        : m_faces(faces), m_points(points), m_parameters(parameters) {
        for (const Primvar& p : primvars.list)
            if (p.detail == scene::Detail::Uniform || is_corner(p))
                m_primvars.push_back(&p);
    }
    bool needed() const { return m_parameters || !m_primvars.empty(); }

    Sources split(const CornerFaces& used) {
        Sources out;
        out.split = true;
        face_of_corner();
        const size_t n = used.all_corners ? m_faces.corners() : used.corners.size();
        const auto corner = [&](size_t i) { return used.all_corners ? uint32_t(i) : used.corners[i]; };
        // Corners by point.
        std::vector<uint32_t> first(m_points + 1, 0), list(n);
        for (size_t i = 0; i < n; i++)
            first[m_faces.vertex(corner(i)) + 1]++;
        for (size_t i = 1; i <= m_points; i++)
            first[i] += first[i - 1];
        std::vector<uint32_t> at(first.begin(), first.end() - 1);
        for (size_t i = 0; i < n; i++)
            list[at[m_faces.vertex(corner(i))]++] = corner(i);
        // Variants of every point; then their numbers.
        std::vector<uint32_t> variant(m_faces.corners()), count(m_points + 1, 0);
        tasks::parallel_chunks(m_points, Grain, [&](size_t begin, size_t end) {
            std::vector<uint32_t> heads;
            for (size_t p = begin; p < end; p++) {
                heads.clear();
                for (uint32_t i = first[p]; i < first[p + 1]; i++) {
                    uint32_t k = 0;
                    while (k < heads.size() && !same(heads[k], list[i]))
                        k++;
                    if (k == heads.size())
                        heads.push_back(list[i]);
                    variant[list[i]] = k;
                }
                count[p + 1] = uint32_t(heads.size());
            }
        });
        for (size_t p = 1; p <= m_points; p++)
            count[p] += count[p - 1];
        out.count = count[m_points];
        out.point.resize(out.count), out.corner.resize(out.count), out.face.resize(out.count);
        out.of_corner.resize(m_faces.corners());
        tasks::parallel_chunks(m_points, Grain, [&](size_t begin, size_t end) {
            for (size_t p = begin; p < end; p++)
                for (uint32_t i = first[p + 1]; i-- > first[p];) { // backwards: the first corner stays
                    const uint32_t c = list[i], v = count[p] + variant[c];
                    out.of_corner[c] = v;
                    out.point[v] = uint32_t(p);
                    out.corner[v] = c;
                    out.face[v] = face(c);
                }
        });
        return out;
    }

  private:
    static bool is_corner(const Primvar& p) {
        return p.detail == scene::Detail::FaceVarying || p.detail == scene::Detail::FaceVertex;
    }
    void face_of_corner() {
        if (m_faces.sides())
            return;
        m_face.resize(m_faces.corners());
        for (size_t f = 0; f < m_faces.count(); f++)
            std::fill_n(m_face.begin() + m_faces.first_corner(f), m_faces.corner_count(f), uint32_t(f));
    }
    uint32_t face(uint32_t corner) const {
        return m_faces.sides() ? corner / m_faces.sides() : m_face[corner];
    }
    bool same(uint32_t a, uint32_t b) const {
        if (m_parameters)
            return false;
        for (const Primvar* p : m_primvars) {
            const size_t n = p->components, i = is_corner(*p) ? a : face(a), j = is_corner(*p) ? b : face(b);
            if (std::memcmp(p->values.data() + i * n, p->values.data() + j * n, n * sizeof(float)) != 0)
                return false;
        }
        return true;
    }

    const PolygonFaces& m_faces;
    const size_t m_points;
    const bool m_parameters; // each face's own
    std::vector<const Primvar*> m_primvars;
    std::vector<uint32_t> m_face;
};

// Two triangles in a row that share an edge, (a, b, c) and (a, c, d) in some rotation, as the quad (b, c, d,
// a), which is traced as the triangles (b, c, a) and (d, a, c).
bool pair(const uint32_t* s, const uint32_t* t, uint32_t quad[4]) {
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            const uint32_t a = s[(i + 1) % 3], c = s[i]; // s walks c -> a
            if (t[k] != a || t[(k + 1) % 3] != c)
                continue;
            quad[0] = s[(i + 2) % 3], quad[1] = c, quad[2] = t[(k + 2) % 3], quad[3] = a;
            return quad[0] != quad[2];
        }
    return false;
}

void pair_triangles(grid::TracedMesh& mesh) {
    constexpr size_t Chunk = 1 << 16; // triangles; pairs do not cross chunks, so threads do not matter
    const size_t triangles = mesh.indices.size() / 3, chunks = (triangles + Chunk - 1) / Chunk;
    std::vector<size_t> quads(chunks + 1, 0);
    const auto walk = [&](size_t chunk, auto&& emit) {
        const size_t end = std::min(triangles, (chunk + 1) * Chunk);
        uint32_t quad[4];
        for (size_t t = chunk * Chunk; t < end; t++) {
            const uint32_t* s = &mesh.indices[3 * t];
            if (t + 1 < end && pair(s, s + 3, quad)) {
                emit(quad);
                t++;
            } else {
                const uint32_t alone[4] = {s[0], s[1], s[2], s[2]};
                emit(alone);
            }
        }
    };
    tasks::parallel_for(chunks, [&](size_t c) {
        size_t n = 0;
        walk(c, [&](const uint32_t*) { n++; });
        quads[c + 1] = n;
    });
    for (size_t c = 1; c <= chunks; c++)
        quads[c] += quads[c - 1];
    // n faces of T triangles: T - n pairs, of T / 2 that there could be.
    if (double(triangles - quads[chunks]) < 0.9 * 0.5 * double(triangles))
        return;
    std::vector<uint32_t> out(4 * quads[chunks]);
    tasks::parallel_for(chunks, [&](size_t c) {
        uint32_t* to = &out[4 * quads[c]];
        walk(c, [&](const uint32_t* q) { to = std::copy_n(q, 4, to); });
    });
    mesh.indices = std::move(out);
    mesh.vertices_per_face = 4;
}

// A quad that is traced as the triangles (0, 1, 3) and (2, 3, 1) is turned where those would overlap: concave
// ones.
void turn_concave_quads(const grid::Grid& g, grid::TracedMesh& mesh) {
    tasks::parallel_chunks(mesh.indices.size() / 4, Grain, [&](size_t begin, size_t end) {
        for (size_t f = begin; f < end; f++) {
            uint32_t* q = &mesh.indices[4 * f];
            if (q[2] == q[3])
                continue;
            const Vec3f a = g.position(q[0]), b = g.position(q[1]), c = g.position(q[2]),
                        d = g.position(q[3]);
            if (dot(cross(b - a, d - a), cross(d - c, b - c)) < 0)
                std::rotate(q, q + 1, q + 4);
        }
    });
}

// Each face's own, at vertices that no two faces share.
void set_parameters(MeshParts& parts) {
    const grid::TracedMesh& mesh = parts.mesh;
    const size_t per = size_t(mesh.vertices_per_face);
    tasks::parallel_chunks(mesh.indices.size() / per, Grain, [&](size_t begin, size_t end) {
        for (size_t f = begin; f < end; f++) {
            const uint32_t* q = &mesh.indices[f * per];
            const bool triangle = per == 3 || q[2] == q[3];
            for (int k = 0; k < (triangle ? 3 : 4); k++) {
                const auto [u, v] = grid::corner_parameters(triangle, k);
                parts.vertices.u[q[k]] = u, parts.vertices.v[q[k]] = v;
            }
        }
    });
}

} // namespace

static void allocate_arrays(MeshParts& parts, size_t vertices) {
    grid::Grid& g = parts.vertices;
    g.nu = int(vertices) - 1;
    g.nv = 0;
    g.stride = int((vertices + grid::LanePadding - 1) / grid::LanePadding * grid::LanePadding);
    std::vector<float>* arrays[] = {&g.P, &g.N, &g.Ng, &g.dPdu, &g.dPdv, &g.u, &g.v, &g.s, &g.t};
    tasks::parallel_for(std::size(arrays), [&](size_t i) {
        const size_t size = size_t(g.stride) * (i < 5 ? 3 : 1);
        reserve_large(*arrays[i], size);
        arrays[i]->assign(size, 0.0f);
    });
}

void allocate_mesh(MeshParts& parts, size_t vertices, const Primvars& primvars) {
    allocate_arrays(parts, vertices);
    primvars.allocate_channels(parts.vertices);
}

void allocate_mesh(MeshParts& parts, size_t vertices, const Surface& surface) {
    allocate_arrays(parts, vertices);
    surface.allocate_channels(parts.vertices);
}

bool mesh_from_polygons(const scene::Primitive& primitive, const scene::PolygonMesh& mesh, const Transform& m,
                        bool parameters, Journal& journal, MeshParts& out, const scene::Primitive* first) {
    const ControlPoints points = control_points(primitive, m);
    const ControlPoints first_points = first ? control_points(*first, m) : ControlPoints{};
    const ControlPoints& shape = first ? first_points : points; // what faces are made from
    const PolygonFaces faces(mesh, points.size());
    CornerFaces used;
    if ((faces.sides() == 3 || faces.sides() == 4) && !faces.truncated() && all_usable(faces, shape.xyz)) {
        used.sides = faces.sides();
        used.all_corners = true;
    } else {
        Dropped dropped;
        if (faces.truncated())
            dropped.bad_index++;
        used = fan(cut_polygons(faces, shape, false, dropped));
        dropped.report(faces.count(), "polygons", primitive.where, journal);
    }
    const size_t corners = used.all_corners ? faces.corners() : used.corners.size();
    if (corners == 0)
        return false;
    const Primvars primvars = collect_primvars(primitive, m, faces.item_counts(), journal);

    // Vertices and their data.
    VertexSplitter splitter(faces, primvars, parameters, points.size());
    Sources sources;
    sources.count = points.size();
    if (splitter.needed())
        sources = splitter.split(used);
    allocate_mesh(out, sources.count, primvars);
    grid::Grid& g = out.vertices;
    const scene::Attributes* attributes = primitive.attributes.get();
    g.flips = (m.determinant3() < 0) != (attributes && attributes->reverse_orientation);
    const scene::Value* object = primitive.primvars.find("P");
    tasks::parallel_chunks(sources.count, Grain, [&](size_t begin, size_t end) {
        const auto point = [&](size_t i) { return sources.split ? sources.point[i] : uint32_t(i); };
        for (size_t i = begin; i < end; i++) {
            const size_t p = point(i);
            const bool finite = points.finite(p);
            for (int c = 0; c < 3; c++)
                g.P[i + size_t(c) * g.stride] = finite ? points.xyz[3 * p + c] : 0; // no face uses the others
            g.s[i] =
                object->floats[3 * p]; // RISpec: a polygon's texture coordinates are its object-space x and y
            g.t[i] = object->floats[3 * p + 1];
        }
        for (const Primvar& v : primvars.list)
            for (int c = 0; c < v.components; c++) {
                float* to = v.destination(g, c);
                for (size_t i = begin; i < end; i++) {
                    const size_t item =
                        v.detail == scene::Detail::Uniform ? sources.face[i]
                        : v.detail == scene::Detail::FaceVarying || v.detail == scene::Detail::FaceVertex
                            ? sources.corner[i]
                            : point(i);
                    to[i] = v(item, c);
                }
            }
    });

    // Faces.
    out.mesh.vertices_per_face = used.sides;
    out.mesh.indices.resize(corners);
    tasks::parallel_chunks(corners, Grain, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) {
            const uint32_t c = used.all_corners ? uint32_t(i) : used.corners[i];
            out.mesh.indices[i] = sources.split ? sources.of_corner[c] : uint32_t(faces.vertex(c));
        }
    });
    if (used.sides == 3)
        pair_triangles(out.mesh);
    else
        turn_concave_quads(g, out.mesh);
    if (parameters)
        set_parameters(out);
    g.facets = !primvars.normals;
    return true;
}

void vertex_normals(const grid::Grid& g, const grid::TracedMesh& mesh, bool flips, std::vector<float>& to) {
    // Two halves of the faces sum on their own, whatever the number of threads, so that the sums are always
    // the same.
    const size_t n = size_t(g.stride), per = mesh.vertices_per_face, faces = mesh.indices.size() / per;
    std::vector<float> other(3 * n);
    to.assign(3 * n, 0.0f);
    tasks::parallel_for(2, [&](size_t half) {
        float* sum = half == 0 ? to.data() : other.data();
        for (size_t f = half * (faces / 2); f < (half == 0 ? faces / 2 : faces); f++) {
            const uint32_t* q = &mesh.indices[f * per];
            const Vec3f a = g.position(q[0]), b = g.position(q[1]), c = g.position(q[2]);
            const Vec3f normal = per == 4 ? cross(c - a, g.position(q[3]) - b) : cross(b - a, c - a);
            for (size_t k = 0; k < per; k++) {
                if (per == 4 && k == 3 && q[3] == q[2])
                    break;
                sum[q[k]] += normal.x, sum[q[k] + n] += normal.y, sum[q[k] + 2 * n] += normal.z;
            }
        }
    });
    const float sign = flips ? -1.0f : 1.0f;
    tasks::parallel_chunks(size_t(g.vertices()), Grain, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) {
            const Vec3f s{to[i] + other[i], to[i + n] + other[i + n], to[i + 2 * n] + other[i + 2 * n]};
            const float l = length(s), scale = l > 0 ? sign / l : 0;
            to[i] = s.x * scale, to[i + n] = s.y * scale, to[i + 2 * n] = s.z * scale;
        }
    });
}

std::vector<float> standing_off(const grid::Grid& g, const grid::TracedMesh& mesh) {
    const size_t n = size_t(g.stride), vertices = size_t(g.vertices()), per = size_t(mesh.vertices_per_face);
    std::vector<Vec3f> normals(vertices);
    for (size_t i = 0; i < vertices; i++) {
        const Vec3f v{g.Ng[i], g.Ng[i + n], g.Ng[i + 2 * n]};
        const float l = length(v);
        normals[i] = l > 0 && std::isfinite(l) ? v * (1 / l) : Vec3f(0.0f);
    }
    std::vector<float> bends(vertices, 0.0f), edges(vertices, 0.0f);
    for (size_t f = 0; f + per <= mesh.indices.size(); f += per)
        for (size_t k = 0; k < per; k++) {
            const uint32_t a = mesh.indices[f + k], b = mesh.indices[f + (k + 1) % per];
            const Vec3f edge = g.position(int(b)) - g.position(int(a));
            if (!(length_squared(edge) > 0))
                continue;
            const float bend = bend_of(normals[a], normals[b], edge);
            bends[a] += bend, bends[b] += bend;
            edges[a]++, edges[b]++;
        }
    std::vector<float> out = g.P;
    for (size_t i = 0; i < vertices; i++)
        for (size_t c = 0; c < 3 && bends[i] != 0; c++)
            out[i + c * n] += normals[i][int(c)] * (4 * BendOfAnEdge * bends[i] / edges[i]);
    return out;
}

Widths::Widths(const scene::Primitive& primitive, const Transform& m) {
    m_scale = float(std::cbrt(std::abs(m.determinant3())));
    const scene::Value* w = primitive.primvars.find("width");
    if (!w)
        w = primitive.primvars.find("constantwidth");
    if (w && !w->floats.empty()) {
        m_constant = w->floats[0];
        if (w->name == "width" && w->detail != scene::Detail::Constant && w->floats.size() > 1)
            m_varying = w;
    }
}

} // namespace kanuka::geom
