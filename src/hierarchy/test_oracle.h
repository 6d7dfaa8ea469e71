// What the tests of this folder compare with: a tracer of pages without vectors, queue or tables, which finds
// the same bits, and one in doubles that looks at every triangle and knows nothing of pages.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <random>
#include <vector>

#include "hierarchy/build.h"
#include "hierarchy/fields.h"
#include "hierarchy/page.h"
#include "hierarchy/ray.h"

namespace kanuka::hierarchy::testing {

// ---- a tracer of pages, one ray and one child at a time
class Oracle {
  public:
    explicit Oracle(const Page& page) : m_page(page) {}

    // What refuses a hit; null = nothing does.
    std::function<bool(const Hit&)> accepts;
    // Boxes are passed over, and every leaf is looked at: right for rays in the planes of boxes too.
    bool looks_everywhere = false;

    Hit closest(const Ray& r) {
        m_ray = r, m_hit = {}, m_hit.t = r.t_max;
        const float largest = std::max({std::abs(r.d.x), std::abs(r.d.y), std::abs(r.d.z)});
        const bool somewhere = std::abs(r.o.x) < 1e18f && std::abs(r.o.y) < 1e18f &&
                               std::abs(r.o.z) < 1e18f && largest < 1e18f && largest > 1 / 1e18f;
        if (!somewhere || !(r.t_min >= 0 && r.t_min <= r.t_max) || m_page.header().root == NoRef)
            return m_hit;
        m_z = 0;
        for (int a = 1; a < 3; a++)
            if (std::abs(r.d[a]) > std::abs(r.d[m_z]))
                m_z = a;
        m_x = (m_z + 1) % 3, m_y = (m_z + 2) % 3;
        visit(m_page.header().root);
        return m_hit;
    }

  private:
    struct Child {
        float enter;
        Ref ref;
    };
    void visit(Ref ref) {
        if (kind_of(ref) != Kind::Nodes)
            return leaf(ref);
        const Node& node = m_page.at<Node>(ref);
        const Children c = Children::of(node.children);
        std::vector<Child> met;
        for (int place = 0; place < c.count; place++) {
            float enter = 0, leave;
            if (looks_everywhere || crosses(node, place, enter, leave))
                met.push_back({enter, uint32_t(c.kind) << KindShift |
                                          (c.offset + uint32_t(place) * UnitsOf[int(c.kind)])});
        }
        std::ranges::sort(met, {}, &Child::enter);
        for (const Child& child : met)
            if (looks_everywhere || child.enter <= m_hit.t)
                visit(child.ref);
    }
    bool crosses(const Node& node, int place, float& enter, float& leave) const {
        enter = m_ray.t_min, leave = m_hit.t;
        const float largest = std::max({std::abs(m_ray.d.x), std::abs(m_ray.d.y), std::abs(m_ray.d.z)});
        for (int a = 0; a < 3; a++) {
            float d = m_ray.d[a];
            if (std::abs(d) < largest * std::ldexp(1.0f, -60))
                d = std::copysign(largest * std::ldexp(1.0f, -60), d);
            const double step = std::ldexp(1.0, (node.frame[a] & 255) - 127);
            const double origin = double(node.frame[a] >> 8);
            float plane[2];
            for (int side = 0; side < 2; side++)
                plane[side] = float((origin + node.plane[a][side][place]) * step) - m_ray.o[a];
            const float per_d = 1 / d;
            enter = std::max(enter, plane[d < 0] * (per_d * (1 - std::ldexp(1.0f, -20))));
            leave = std::min(leave, plane[d >= 0] * (per_d * (1 + std::ldexp(1.0f, -20))));
        }
        return enter <= leave;
    }

    struct Corner {
        float x, y, z; // seen along the ray
    };
    Corner see(const Vec3f& p) const {
        const Vec3f q = p - m_ray.o;
        const float sx = m_ray.d[m_x] / m_ray.d[m_z], sy = m_ray.d[m_y] / m_ray.d[m_z];
        return {std::fma(-sx, q[m_z], q[m_x]), std::fma(-sy, q[m_z], q[m_y]), q[m_z]};
    }
    // Weights of the second and third corner.
    bool crosses(const Corner& a, const Corner& b, const Corner& c, float& t, float& u, float& v) const {
        const auto edge = [](const Corner& p, const Corner& q) {
            const float left = p.x * q.y, right = p.y * q.x;
            return left - right;
        };
        const float U = edge(b, c), V = edge(c, a), W = edge(a, b);
        if (!(U >= 0 && V >= 0 && W >= 0) && !(U <= 0 && V <= 0 && W <= 0))
            return false;
        const float sum = U + V + W, per_z = 1 / m_ray.d[m_z], first = U * a.z,
                    depth = std::fma(W, c.z, std::fma(V, b.z, first));
        t = depth * per_z / sum, u = V / sum, v = W / sum;
        // What the largest product may be, if it is more than twice the sum of the weights, and the size of
        // the triangle: squares of both.
        const float x0 = a.x * a.x, x = std::fma(b.x, b.x, x0), y1 = b.y * b.y, y = std::fma(c.y, c.y, y1),
                    near = a.z - b.z, far = b.z - c.z, size = std::fma(far, far, std::fma(near, near, x + y)),
                    products = x * y, product = std::fma(-4 * sum, sum, products), rounding = product * size;
        if (!(rounding < depth * depth) && !crosses_exactly({&a, &b, &c}, per_z, t, u, v))
            return false;
        return t >= m_ray.t_min && t <= m_hit.t;
    }
    // The same in doubles, which hold products of floats: true signs, and weights that are right.
    static bool crosses_exactly(const std::array<const Corner*, 3>& corners, float per_z, float& t, float& u,
                                float& v) {
        const auto turn = [&](size_t i, size_t k) {
            return double(corners[i]->x) * double(corners[k]->y) -
                   double(corners[i]->y) * double(corners[k]->x);
        };
        const std::array<double, 3> w{turn(1, 2), turn(2, 0), turn(0, 1)};
        const auto any = [&](auto what) { return std::ranges::any_of(w, what); };
        const bool left = any([](double x) { return x > 0; }), right = any([](double x) { return x < 0; });
        if (left && right)
            return false;
        if (!left && !right)
            return crosses_line(corners, per_z, t, u, v);
        const double sum = w[0] + w[1] + w[2];
        double depth = 0;
        for (size_t k = 0; k < 3; k++)
            depth += w[k] * double(corners[k]->z);
        t = float(depth / sum * double(per_z)), u = float(w[1] / sum), v = float(w[2] / sum);
        return true;
    }
    // A line or a point: of the edges that the ray passes through, the one that is nearest there.
    static bool crosses_line(const std::array<const Corner*, 3>& corners, float per_z, float& t, float& u,
                             float& v) {
        t = INFINITY;
        for (size_t first = 0; first < 3; first++) {
            const size_t second = (first + 1) % 3;
            const Corner &p = *corners[first], &q = *corners[second];
            if (std::min(p.x, q.x) > 0 || std::max(p.x, q.x) < 0 || std::min(p.y, q.y) > 0 ||
                std::max(p.y, q.y) < 0)
                continue;
            float s = 0; // of the way from p to q
            if (std::abs(q.x - p.x) > std::abs(q.y - p.y))
                s = -p.x / (q.x - p.x);
            else if (q.y != p.y)
                s = -p.y / (q.y - p.y);
            const float there = (p.z * (1 - s) + q.z * s) * per_z;
            if (there < t) {
                float weights[3] = {};
                weights[first] = 1 - s, weights[second] = s;
                t = there, u = weights[1], v = weights[2];
            }
        }
        return t < INFINITY;
    }
    void offer(Ref ref, uint32_t primitive, float t, float u, float v) {
        if (t == m_hit.t && m_hit.found() &&
            (ref > m_hit.leaf || (ref == m_hit.leaf && primitive > m_hit.primitive)))
            return;
        const Hit h{t, u, v, ref, primitive};
        if (!accepts || accepts(h))
            m_hit = h;
    }

    float number(int32_t frame, int32_t exponent, double field) const {
        return float((double(frame >> 8) + field) * std::ldexp(1.0, (exponent & 255) - 127));
    }
    Vec3f packed(const int32_t (&frame)[3], uint32_t word) const {
        const Fields& f = field_table[uint8_t(frame[0])];
        const int x = f.bits[0], y = f.bits[1];
        const double field[3] = {double(word & ((1u << x) - 1)), double(word >> x & ((1u << y) - 1)),
                                 double(int32_t(word) >> (x + y))};
        return {number(frame[0], frame[1], field[0]), number(frame[1], frame[1], field[1]),
                number(frame[2], frame[1], field[2])};
    }

  public:
    // Vertex k of a leaf of grids.
    Vec3f vertex(Ref ref, int k) const {
        if (kind_of(ref) == Kind::Grid32) {
            const Grid32& g = m_page.at<Grid32>(ref);
            return packed(g.frame, g.vertex[k]);
        }
        if (kind_of(ref) == Kind::Grid48) {
            const Grid48& g = m_page.at<Grid48>(ref);
            Vec3f p;
            for (int a = 0; a < 3; a++)
                p[a] = number(g.frame[a], g.frame[1], g.coordinate[a][k]);
            return p;
        }
        const GridFloat& g = m_page.at<GridFloat>(ref);
        return {g.coordinate[0][k], g.coordinate[1][k], g.coordinate[2][k]};
    }
    uint32_t shape(Ref ref) const {
        return kind_of(ref) == Kind::Grid32   ? m_page.at<Grid32>(ref).frame[2] & 255
               : kind_of(ref) == Kind::Grid48 ? m_page.at<Grid48>(ref).frame[2] & 255
                                              : m_page.at<GridFloat>(ref).shape;
    }

  private:
    // Of triangle i of a leaf.
    Vec3f corner(Ref ref, int c, uint32_t i) const {
        if (kind_of(ref) == Kind::Triangle32) {
            const Triangle32& t = m_page.at<Triangle32>(ref);
            return packed(t.frame, t.corner[c][i]);
        }
        Vec3f p;
        for (int a = 0; a < 3; a++) {
            const Triangle48& t = m_page.at<Triangle48>(ref);
            p[a] = kind_of(ref) == Kind::Triangle48 ? number(t.frame[a], t.frame[1], t.coordinate[a][c][i])
                                                    : m_page.at<TriangleFloat>(ref).coordinate[a][c][i];
        }
        return p;
    }
    void triangles(Ref ref) {
        const uint32_t count =
            kind_of(ref) == Kind::Triangle32   ? uint32_t(m_page.at<Triangle32>(ref).frame[2] & 255)
            : kind_of(ref) == Kind::Triangle48 ? uint32_t(m_page.at<Triangle48>(ref).frame[2] & 255)
                                               : m_page.at<TriangleFloat>(ref).count;
        for (uint32_t i = 0; i < count; i++) {
            const Corner a = see(corner(ref, 0, i)), b = see(corner(ref, 1, i)), c = see(corner(ref, 2, i));
            float t, u, v;
            if (crosses(a, b, c, t, u, v))
                offer(ref, i, t, u, v);
        }
    }
    void leaf(Ref ref) {
        if (is_of_triangles(kind_of(ref)))
            return triangles(ref);
        const int columns = int(shape(ref) & 3) + 1, rows = int(shape(ref) >> 2 & 3) + 1;
        for (int y = 0; y < rows; y++)
            for (int x = 0; x < columns; x++) {
                const auto corner = [&](int i, int j) { return see(vertex(ref, (y + j) * LeafRow + x + i)); };
                float t, u, v;
                const uint32_t cell = uint32_t(y * 4 + x);
                if (crosses(corner(0, 0), corner(1, 0), corner(0, 1), t, u, v))
                    offer(ref, cell * 2, t, u, v);
                if (crosses(corner(1, 1), corner(0, 1), corner(1, 0), t, u, v))
                    offer(ref, cell * 2 + 1, t, 1 - u, 1 - v);
            }
    }

    Page m_page;
    Ray m_ray;
    Hit m_hit;
    int m_x = 0, m_y = 0, m_z = 0;
};

// ---- a tracer of triangles, in doubles
struct Point {
    double x, y, z;
    explicit Point(const Vec3f& v) : x(v.x), y(v.y), z(v.z) {}
    Point(double x, double y, double z) : x(x), y(y), z(z) {}
    friend Point operator-(const Point& a, const Point& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
};
inline double dot(const Point& a, const Point& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Point cross(const Point& a, const Point& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
struct Face {
    Vec3f a, b, c;
    uint32_t name;
};
struct Reference {
    double t = INFINITY;
    uint32_t name = 0;
    double margin = INFINITY; // how far, in weights, the nearest decision was from going the other way
};
// Moeller and Trumbore.
inline Reference brute_force(const std::vector<Face>& faces, const Ray& r) {
    Reference best;
    const Point o(r.o), d(r.d);
    for (const Face& f : faces) {
        const Point a(f.a), e1 = Point(f.b) - a, e2 = Point(f.c) - a, p = cross(d, e2);
        const double det = dot(e1, p);
        if (!(det != 0))
            continue;
        const Point s = o - a, q = cross(s, e1);
        const double u = dot(s, p) / det, v = dot(d, q) / det, t = dot(e2, q) / det;
        if (!(t >= r.t_min && t <= r.t_max))
            continue;
        const double inside = std::min({u, v, 1 - u - v});
        best.margin = std::min(best.margin, std::abs(inside));
        if (inside >= 0 && t < best.t)
            best.t = t, best.name = f.name;
    }
    return best;
}

inline PageMemory copy_of(const PageMemory& page) {
    PageMemory copy(page.size());
    std::memcpy(copy.data(), page.data(), page.size());
    return copy;
}

// ---- content
struct TestGrid {
    int columns, rows;
    std::vector<float> positions;
    GridView view() const { return {positions.data(), columns, rows}; }
    Vec3f at(int x, int y) const {
        const float* p = &positions[3 * (size_t(y) * size_t(columns + 1) + size_t(x))];
        return {p[0], p[1], p[2]};
    }
};
inline TestGrid make_grid(int columns, int rows, const std::function<Vec3f(float, float)>& at) {
    TestGrid g{columns, rows, {}};
    for (int y = 0; y <= rows; y++)
        for (int x = 0; x <= columns; x++) {
            const Vec3f p = at(float(x) / float(columns), float(y) / float(rows));
            g.positions.insert(g.positions.end(), {p.x, p.y, p.z});
        }
    return g;
}
// Both triangles of all cells, as the lattice has their corners; named by number.
inline std::vector<Face> faces_of(const std::vector<TestGrid>& grids, const Lattice& lattice) {
    std::vector<Face> faces;
    for (const TestGrid& g : grids)
        for (int y = 0; y < g.rows; y++)
            for (int x = 0; x < g.columns; x++) {
                const auto at = [&](int i, int j) { return lattice.snap(g.at(x + i, y + j)); };
                const uint32_t n = uint32_t(faces.size());
                faces.push_back({at(0, 0), at(1, 0), at(0, 1), n});
                faces.push_back({at(1, 1), at(0, 1), at(1, 0), n + 1});
            }
    return faces;
}
// The quads of grids as the triangles of a mesh; neighbours share no vertices.
struct MeshOfGrids {
    std::vector<float> positions;
    std::vector<uint32_t> corners;

    explicit MeshOfGrids(const std::vector<TestGrid>& grids) {
        for (const TestGrid& g : grids) {
            const uint32_t first = uint32_t(positions.size() / 3), row = uint32_t(g.columns + 1);
            positions.insert(positions.end(), g.positions.begin(), g.positions.end());
            for (uint32_t y = 0; y < uint32_t(g.rows); y++)
                for (uint32_t x = 0; x < uint32_t(g.columns); x++) {
                    const uint32_t a = first + y * row + x, b = a + 1, c = a + row, d = c + 1;
                    corners.insert(corners.end(), {a, b, c, d, c, b});
                }
        }
    }
    MeshView view() const {
        return {positions.data(), positions.size() / 3, corners.data(), corners.size() / 3};
    }
};

inline std::vector<GridView> views(const std::vector<TestGrid>& grids) {
    std::vector<GridView> all;
    for (const TestGrid& g : grids)
        all.push_back(g.view());
    return all;
}

// Smooth waves that look random: displacement without cracks, a function of the place alone.
inline float waves(const Vec3f& p, float frequency) {
    float sum = 0, amplitude = 1;
    for (int octave = 0; octave < 4; octave++) {
        const float f = frequency * float(1 << octave);
        sum += amplitude * std::sin(f * p.x + 1.3f * float(octave)) * std::sin(f * p.y + 2.1f) *
               std::sin(f * p.z + 0.7f * float(octave));
        amplitude *= 0.55f;
    }
    return sum;
}
// A closed ball of 6 n^2 grids, displaced along its normals.
inline std::vector<TestGrid> ball(int n, int cells, float radius, float height, float frequency,
                                  Vec3f centre = Vec3f(0.0f)) {
    std::vector<TestGrid> grids;
    for (int face = 0; face < 6; face++)
        for (int j = 0; j < n; j++)
            for (int i = 0; i < n; i++) {
                TestGrid g{cells, cells, {}};
                for (int y = 0; y <= cells; y++)
                    for (int x = 0; x <= cells; x++) {
                        const float a = 2 * float(i * cells + x) / float(n * cells) - 1,
                                    b = 2 * float(j * cells + y) / float(n * cells) - 1,
                                    c = face & 1 ? -1.0f : 1.0f;
                        const Vec3f cube = face < 2   ? Vec3f(c, a, b)
                                           : face < 4 ? Vec3f(a, c, b)
                                                      : Vec3f(a, b, c);
                        // One order of sums for all faces: shared edges are the same to the bit.
                        double sorted[3] = {std::abs(cube.x), std::abs(cube.y), std::abs(cube.z)};
                        std::sort(sorted, sorted + 3);
                        const double norm =
                            std::sqrt(sorted[0] * sorted[0] + sorted[1] * sorted[1] + sorted[2] * sorted[2]);
                        const Vec3f d(float(cube.x / norm), float(cube.y / norm), float(cube.z / norm));
                        const float r = radius + height * waves(d * radius, frequency);
                        g.positions.insert(g.positions.end(),
                                           {centre.x + r * d.x, centre.y + r * d.y, centre.z + r * d.z});
                    }
                grids.push_back(std::move(g));
            }
    return grids;
}

class Random {
  public:
    explicit Random(unsigned seed) : m_g(seed) {}
    float uniform(float lo = 0, float hi = 1) { return lo + (hi - lo) * float(m_g() >> 8) * 0x1p-24f; }
    Vec3f in_box(float side) { return {uniform(-side, side), uniform(-side, side), uniform(-side, side)}; }
    Vec3f direction() {
        for (;;) {
            const Vec3f d = in_box(1);
            if (dot(d, d) > 0.01f && dot(d, d) < 1)
                return normalize(d);
        }
    }
    uint32_t below(uint32_t n) { return uint32_t(m_g() % n); }

  private:
    std::mt19937 m_g;
};

} // namespace kanuka::hierarchy::testing
