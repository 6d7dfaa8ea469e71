#include "geom/polygon_faces.h"

#include "geom/triangulate.h"

namespace kanuka::geom {

PolygonFaces::PolygonFaces(const scene::PolygonMesh& mesh, size_t points) : m_mesh(mesh), m_points(points) {
    const size_t available = mesh.vertices.empty() ? points : mesh.vertices.size();
    if (mesh.vertices_per_loop.empty()) {
        m_sides = 3;
        m_count = available / 3;
        m_corners = m_count * 3;
        return;
    }
    const auto& sizes = mesh.vertices_per_loop;
    const bool single = mesh.loops_per_face.empty();
    if (single && sizes[0] > 0 &&
        std::all_of(sizes.begin(), sizes.end(), [&](int32_t n) { return n == sizes[0]; })) {
        m_sides = sizes[0];
        m_count = std::min(sizes.size(), available / m_sides);
        m_truncated = m_count < sizes.size();
        m_corners = m_count * m_sides;
        return;
    }
    const size_t face_count = single ? sizes.size() : mesh.loops_per_face.size();
    m_first_corner.push_back(0);
    if (!single)
        m_first_loop.push_back(0);
    size_t corner = 0, loop = 0;
    for (size_t f = 0; f < face_count; f++) {
        const size_t loops = single ? 1 : size_t(std::max(0, mesh.loops_per_face[f]));
        size_t n = 0;
        bool fits = loop + loops <= sizes.size();
        for (size_t l = 0; fits && l < loops; l++)
            n += size_t(std::max(0, sizes[loop + l]));
        fits = fits && corner + n <= available;
        if (!fits) {
            m_truncated = true;
            break;
        }
        corner += n;
        loop += loops;
        m_first_corner.push_back(corner);
        if (!single)
            m_first_loop.push_back(loop);
    }
    m_count = m_first_corner.size() - 1;
    m_corners = corner;
}

std::vector<int> PolygonFaces::loops(size_t face) const {
    std::vector<int> out{int(first_corner(face))};
    if (one_loop(face)) {
        out.push_back(int(first_corner(face) + corner_count(face)));
        return out;
    }
    for (size_t l = m_first_loop[face]; l < m_first_loop[face + 1]; l++)
        out.push_back(out.back() + std::max(0, m_mesh.vertices_per_loop[l]));
    return out;
}

namespace {

// One loop, at most this many corners, convex: kept whole.
constexpr int MaxWhole = 8;

class Cutter {
  public:
    Cutter(const PolygonFaces& faces, const ControlPoints& points, bool triangles_only, Dropped& dropped,
           Pieces& out)
        : m_faces(faces), m_points(points), m_triangles_only(triangles_only), m_dropped(dropped), m_out(out) {
    }

    void cut(size_t face) {
        m_corners.clear();
        m_loops.points.clear();
        m_loops.loop_first.assign(1, 0);
        if (!gather(face))
            return;
        const int n = m_loops.loop_first.size() > 1 ? m_loops.loop_first[1] : 0;
        const Vec3f normal = n >= 3 ? newell_normal(m_loops.points.data(), n) : Vec3f(0);
        if (!(length_squared(normal) > 0)) {
            m_dropped.degenerate++;
            return;
        }
        const bool one = m_loops.loop_first.size() == 2;
        if (one &&
            (n == 3 || (!m_triangles_only && n <= MaxWhole && is_convex(m_loops.points.data(), n, normal)))) {
            for (int i = 0; i < n; i++)
                m_out.corner.push_back(m_corners[i]);
            finish(face);
            return;
        }
        const auto triangles = triangulate(m_loops);
        if (triangles.empty())
            m_dropped.degenerate++;
        if (m_triangles_only) {
            for (const auto& t : triangles)
                add(face, t.data(), 3);
            return;
        }
        for (const auto& q : join_quads(triangles, m_loops))
            add(face, q.data(), q[3] < 0 ? 3 : 4);
    }

  private:
    bool gather(size_t face) {
        const std::vector<int> loops = m_faces.loops(face);
        for (size_t l = 0; l + 1 < loops.size(); l++) {
            const size_t begin = m_corners.size();
            for (int c = loops[l]; c < loops[l + 1]; c++) {
                const int v = m_faces.vertex(c);
                if (v < 0) {
                    m_dropped.bad_index++;
                    return false;
                }
                if (!m_points.finite(v)) {
                    m_dropped.non_finite++;
                    return false;
                }
                // A corner that repeats the one before it adds nothing.
                if (m_corners.size() > begin && m_faces.vertex(m_corners.back()) == v)
                    continue;
                m_corners.push_back(c);
                m_loops.points.push_back(m_points[v]);
            }
            while (m_corners.size() > begin + 1 &&
                   m_faces.vertex(m_corners.back()) == m_faces.vertex(m_corners[begin])) {
                m_corners.pop_back();
                m_loops.points.pop_back();
            }
            m_loops.loop_first.push_back(int(m_corners.size()));
        }
        return true;
    }

    void add(size_t face, const int* local, int n) {
        for (int i = 0; i < n; i++)
            m_out.corner.push_back(m_corners[local[i]]);
        finish(face);
    }
    void finish(size_t face) {
        m_out.first.push_back(int(m_out.corner.size()));
        m_out.face.push_back(int(face));
    }

    const PolygonFaces& m_faces;
    const ControlPoints& m_points;
    const bool m_triangles_only;
    Dropped& m_dropped;
    Pieces& m_out;
    std::vector<int> m_corners; // of the face, without repeats
    Loops m_loops;
};

} // namespace

Pieces cut_polygons(const PolygonFaces& faces, const ControlPoints& points, bool triangles_only,
                    Dropped& dropped) {
    Pieces out;
    out.first.push_back(0);
    out.corner.reserve(faces.corners());
    Cutter cutter(faces, points, triangles_only, dropped, out);
    for (size_t f = 0; f < faces.count(); f++)
        cutter.cut(f);
    return out;
}

} // namespace kanuka::geom
