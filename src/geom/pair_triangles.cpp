#include "geom/pair_triangles.h"

#include <array>
#include <cmath>

namespace kanuka::geom {
namespace {

// Relative to the size of what is compared: the rounding of single precision, not a tolerance of shape.
constexpr double Rounding = 4e-6;
// The sine of the flattest corner that a quadrilateral may have, as in join_quads.
constexpr float Flattest = 0.1f;

class Pairing {
  public:
    Pairing(const PolygonFaces& faces, const ControlPoints& points, const Primvars& primvars,
            const Pieces& pieces)
        : m_faces(faces), m_points(points), m_primvars(primvars), m_pieces(pieces),
          m_first(points.size() + 1) {
        // Corners of triangles by their vertex, so that an edge's other side is found among a few.
        for (size_t p = 0; p < pieces.face.size(); p++)
            if (is_triangle(p))
                for (int k = 0; k < 3; k++)
                    m_first[size_t(vertex(p, k)) + 1]++;
        for (size_t v = 0; v < points.size(); v++)
            m_first[v + 1] += m_first[v];
        m_at.resize(size_t(m_first.back()));
        std::vector<int> next(m_first.begin(), m_first.end() - 1);
        for (size_t p = 0; p < pieces.face.size(); p++)
            if (is_triangle(p))
                for (int k = 0; k < 3; k++)
                    m_at[size_t(next[size_t(vertex(p, k))]++)] = {int(p), k};
    }

    Pieces run() const {
        Pieces out;
        out.first.push_back(0);
        out.corner.reserve(m_pieces.corner.size());
        std::vector<bool> used(m_pieces.face.size(), false);
        for (size_t p = 0; p < m_pieces.face.size(); p++) {
            if (used[p])
                continue;
            Quad quad;
            if (is_triangle(p) && best_partner(p, used, quad)) {
                used[size_t(quad.partner)] = true;
                out.corner.insert(out.corner.end(), quad.corner.begin(), quad.corner.end());
            } else {
                const auto corners = m_pieces.corner.begin();
                out.corner.insert(out.corner.end(), corners + m_pieces.first[p],
                                  corners + m_pieces.first[p + 1]);
            }
            out.first.push_back(int(out.corner.size()));
            out.face.push_back(m_pieces.face[p]);
        }
        return out;
    }

  private:
    struct Corner {
        int piece, k;
    };
    struct Quad {
        std::array<int, 4> corner;
        int partner = -1;
        float shape = Flattest;
    };

    bool is_triangle(size_t piece) const { return m_pieces.first[piece + 1] - m_pieces.first[piece] == 3; }
    int corner(size_t piece, int k) const { return m_pieces.corner[size_t(m_pieces.first[piece] + k % 3)]; }
    int vertex(size_t piece, int k) const { return m_faces.vertex(corner(piece, k)); }

    bool best_partner(size_t p, const std::vector<bool>& used, Quad& best) const {
        for (int k = 0; k < 3; k++) {
            const int a = vertex(p, k), b = vertex(p, k + 1);
            for (int i = m_first[size_t(b)]; i < m_first[size_t(b) + 1]; i++) {
                const Corner other = m_at[size_t(i)];
                const size_t q = size_t(other.piece);
                if (q <= p || used[q] || vertex(q, other.k + 1) != a)
                    continue;
                // p is (a, b, c), q is (b, a, d): together (a, d, b, c).
                const std::array<int, 4> quad{corner(p, k), corner(q, other.k + 2), corner(p, k + 1),
                                              corner(p, k + 2)};
                const float shape = flattest_corner(quad);
                if (shape > best.shape && joins(quad, corner(q, other.k + 1), corner(q, other.k)))
                    best = {quad, int(q), shape};
            }
        }
        return best.partner >= 0;
    }

    float flattest_corner(const std::array<int, 4>& quad) const {
        Vec3f at[4];
        for (size_t i = 0; i < 4; i++)
            at[i] = m_points[size_t(m_faces.vertex(quad[i]))];
        const Vec3f n = cross(at[2] - at[0], at[3] - at[1]);
        float flattest = 1;
        for (int i = 0; i < 4; i++) {
            const Vec3f e = at[(i + 1) % 4] - at[i], f = at[(i + 2) % 4] - at[(i + 1) % 4];
            flattest = min(flattest, dot(cross(e, f), n) / (length(e) * length(f) * length(n) + 1e-30f));
        }
        return flattest;
    }

    // `a` and `b` are the partner's corners at the shared edge, in the order of quad[0] and quad[2].
    bool joins(const std::array<int, 4>& quad, int a, int b) const {
        double w[3]; // of quad[3], quad[0], quad[2] in quad[1]
        if (!barycentric(quad, w))
            return false;
        for (const Primvar& p : m_primvars.list)
            for (int c = 0; c < p.components; c++) {
                const auto value = [&](int corner) { return double(p(item(p, corner), c)); };
                const double v0 = value(quad[3]), v1 = value(quad[0]), v2 = value(quad[2]),
                             d = value(quad[1]);
                const double size = std::abs(v0) + std::abs(v1) + std::abs(v2) + std::abs(d);
                // Negated, so that NaN does not join.
                if (!(std::abs(w[0] * v0 + w[1] * v1 + w[2] * v2 - d) <= Rounding * size) || value(a) != v1 ||
                    value(b) != v2)
                    return false;
            }
        return true;
    }

    size_t item(const Primvar& p, int corner) const {
        return p.detail == scene::Detail::FaceVarying || p.detail == scene::Detail::FaceVertex
                   ? size_t(corner)
                   : size_t(m_faces.vertex(corner));
    }

    bool barycentric(const std::array<int, 4>& quad, double w[3]) const {
        double p[4][3], size = 0;
        for (size_t i = 0; i < 4; i++)
            for (int c = 0; c < 3; c++) {
                p[i][c] = m_points[size_t(m_faces.vertex(quad[i]))][c];
                size = std::max(size, std::abs(p[i][c]));
            }
        const auto edge = [&](int to, double out[3]) {
            for (int c = 0; c < 3; c++)
                out[c] = p[to][c] - p[3][c];
        };
        const auto dot3 = [](const double* x, const double* y) {
            return x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
        };
        double e1[3], e2[3], d[3];
        edge(0, e1), edge(2, e2), edge(1, d);
        const double a = dot3(e1, e1), b = dot3(e1, e2), c = dot3(e2, e2), x = dot3(d, e1), y = dot3(d, e2);
        const double det = a * c - b * b;
        if (!(det > 0))
            return false;
        w[1] = (c * x - b * y) / det, w[2] = (a * y - b * x) / det, w[0] = 1 - w[1] - w[2];
        double off = 0;
        for (int k = 0; k < 3; k++) {
            const double gap = d[k] - w[1] * e1[k] - w[2] * e2[k];
            off += gap * gap;
        }
        return std::sqrt(off) <= Rounding * size;
    }

    const PolygonFaces& m_faces;
    const ControlPoints& m_points;
    const Primvars& m_primvars;
    const Pieces& m_pieces;
    std::vector<int> m_first; // per vertex, into m_at
    std::vector<Corner> m_at;
};

} // namespace

void pair_triangles(const PolygonFaces& faces, const ControlPoints& points, const Primvars& primvars,
                    Pieces& pieces) {
    for (const Primvar& p : primvars.list)
        if (p.detail == scene::Detail::Uniform)
            return; // faces differ
    if (pieces.face.size() > 1)
        pieces = Pairing(faces, points, primvars, pieces).run();
}

} // namespace kanuka::geom
