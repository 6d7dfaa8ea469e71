// Small scenes and checks that the tests of this folder share.
#pragma once

#include <map>

#include "dice/dice.h"

namespace kanuka::dice::test {

inline scene::Value floats(std::string name, scene::Type type, scene::Detail detail,
                           std::vector<float> values, int array_size = 1) {
    scene::Value v;
    v.name = std::move(name);
    v.type = type;
    v.detail = detail;
    v.array_size = array_size;
    v.floats = std::move(values);
    return v;
}

inline scene::Primitive primitive(scene::Geometry geometry, std::vector<float> points = {},
                                  float shading_rate = 1) {
    scene::Primitive p;
    p.geometry = std::move(geometry);
    if (!points.empty())
        p.primvars.set(floats("P", scene::Type::Point, scene::Detail::Vertex, std::move(points)));
    auto a = std::make_shared<scene::Attributes>();
    a->shading_rate = shading_rate;
    p.attributes = a;
    p.where = {"test.rib", 1, 1};
    return p;
}

// A camera on the z axis at -distance, looking along +z, `pixels` wide with a field of view of 90 degrees.
inline DiceOptions looking(float distance, int pixels = 256) {
    DiceOptions o;
    o.camera.page_from_camera = Transform::translate(0, 0, -distance);
    o.camera.width = o.camera.height = pixels;
    o.camera.pixels_per_tangent = float(pixels) / 2;
    return o;
}

using Key = std::array<float, 3>;

// Directed edges of a surface's triangles that no neighbour walks in the other direction.
class EdgeCount {
  public:
    void triangle(const Key& a, const Key& b, const Key& c) {
        if (a == b || b == c || c == a)
            return;
        edge(a, b), edge(b, c), edge(c, a);
    }
    size_t open() const {
        return open_if([](const Key&, const Key&) { return true; });
    }
    template <class Counts> // counts(a, b): an edge's ends
    size_t open_if(Counts counts) const {
        size_t n = 0;
        for (const auto& [key, count] : m_edges)
            n += count != 0 && counts(key.first, key.second);
        return n;
    }
    size_t all() const { return m_edges.size(); }

  private:
    void edge(const Key& a, const Key& b) {
        if (a < b)
            m_edges[{a, b}]++;
        else
            m_edges[{b, a}]--;
    }
    std::map<std::pair<Key, Key>, int> m_edges;
};

inline Key positive_zero(Key k) {
    for (float& f : k)
        f += 0.0f; // -0 becomes 0
    return k;
}

inline EdgeCount shading_edges(const Diced& d) {
    EdgeCount count;
    for (const grid::Grid& g : d.grids) {
        const auto at = [&](int i, int j) {
            const Vec3f p = g.position(j * (g.nu + 1) + i);
            return positive_zero({p.x, p.y, p.z});
        };
        for (int j = 0; j < g.nv; j++)
            for (int i = 0; i < g.nu; i++) {
                count.triangle(at(i, j), at(i + 1, j), at(i, j + 1));
                count.triangle(at(i + 1, j + 1), at(i, j + 1), at(i + 1, j));
            }
    }
    return count;
}

inline EdgeCount traced_edges(const Diced& d) {
    EdgeCount count;
    for (const grid::TracedGrid& t : d.traced) {
        const auto at = [&](int i, int j) {
            const float* p = &t.P[3 * size_t(j * (t.mu + 1) + i)];
            return positive_zero({p[0], p[1], p[2]});
        };
        for (int j = 0; j < t.mv; j++)
            for (int i = 0; i < t.mu; i++) {
                count.triangle(at(i, j), at(i + 1, j), at(i, j + 1));
                count.triangle(at(i + 1, j + 1), at(i, j + 1), at(i + 1, j));
            }
    }
    return count;
}

inline double traced_area(const Diced& d) {
    double sum = 0;
    for (const grid::TracedGrid& t : d.traced)
        for (int j = 0; j < t.mv; j++)
            for (int i = 0; i < t.mu; i++) {
                const auto at = [&](int a, int b) {
                    const float* p = &t.P[3 * size_t((j + b) * (t.mu + 1) + i + a)];
                    return Vec3f{p[0], p[1], p[2]};
                };
                sum += 0.5 * length(cross(at(1, 0) - at(0, 0), at(0, 1) - at(0, 0)));
                sum += 0.5 * length(cross(at(1, 0) - at(1, 1), at(0, 1) - at(1, 1)));
            }
    return sum;
}

inline double grid_area(const Diced& d) {
    double sum = 0;
    for (const grid::Grid& g : d.grids)
        for (int j = 0; j < g.nv; j++)
            for (int i = 0; i < g.nu; i++) {
                const int k = j * (g.nu + 1) + i;
                const Vec3f a = g.position(k), b = g.position(k + 1), c = g.position(k + g.nu + 2),
                            e = g.position(k + g.nu + 1);
                sum += 0.5 * length(cross(b - a, e - a)) + 0.5 * length(cross(b - c, e - c));
            }
    return sum;
}

inline size_t cell_count(const Diced& d) {
    size_t n = 0;
    for (const grid::Grid& g : d.grids)
        n += size_t(g.nu) * g.nv;
    return n;
}
inline size_t traced_count(const Diced& d) {
    size_t n = 0;
    for (const grid::TracedGrid& t : d.traced)
        n += size_t(t.mu) * t.mv;
    return n;
}

// A bumpy displacement along the normal that depends on the undisplaced position alone.
inline Displace bumps(float height, float frequency) {
    return [=](grid::Grid& g) {
        for (int i = 0; i < g.vertices(); i++) {
            const Vec3f p = g.position(i), n = g.normal(i);
            const float d = height * std::sin(frequency * p.x) * std::sin(frequency * p.y + 1) *
                            std::sin(frequency * p.z + 2) / std::max(length(n), 1e-20f);
            for (int c = 0; c < 3; c++)
                g.P[i + size_t(c) * g.stride] += n[c] * d;
        }
    };
}

} // namespace kanuka::dice::test
