// Shapes made by hand and a ray tracer in doubles that looks at every triangle: what the tests of this folder
// share.
#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "bvh/bvh.h"

namespace kanuka::bvh::testing {

struct Point {
    double x, y, z;
    Point() = default;
    Point(double x, double y, double z) : x(x), y(y), z(z) {}
    explicit Point(const Vec3f& v) : x(v.x), y(v.y), z(v.z) {}
    friend Point operator-(const Point& a, const Point& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    friend Point operator+(const Point& a, const Point& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    friend Point operator*(const Point& a, double s) { return {a.x * s, a.y * s, a.z * s}; }
};
inline double dot(const Point& a, const Point& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Point cross(const Point& a, const Point& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

struct Triangle {
    Point a, b, c;
    int shape;
};

struct Ray {
    Vec3f o, d;
    float time = 0;
};

struct Reference {
    double t = INFINITY;
    const Triangle* triangle = nullptr;
    double margin = INFINITY; // how far, in barycentrics, the nearest decision was from going the other way
};

// Closest hit of all triangles (Moeller and Trumbore).
inline Reference trace(const std::vector<Triangle>& triangles, const Ray& ray) {
    Reference best;
    const Point o(ray.o), d(ray.d);
    for (const Triangle& t : triangles) {
        const Point e1 = t.b - t.a, e2 = t.c - t.a, p = cross(d, e2);
        const double det = dot(e1, p);
        if (det == 0)
            continue;
        const Point s = o - t.a, q = cross(s, e1);
        const double u = dot(s, p) / det, v = dot(d, q) / det, distance = dot(e2, q) / det;
        const double inside = std::min({u, v, 1 - u - v});
        if (distance > 0)
            best.margin = std::min(best.margin, std::abs(inside));
        if (inside >= 0 && distance > 0 && distance < best.t) {
            best.t = distance;
            best.triangle = &t;
        }
    }
    return best;
}

inline constexpr uint64_t AllInEmbree = ~uint64_t(0);

// Of a lattice of 2n x n cells.
inline std::vector<Vec3f> sphere_points(const Vec3f& center, float radius, int n) {
    std::vector<Vec3f> points;
    for (int j = 0; j <= n; j++)
        for (int i = 0; i <= 2 * n; i++) {
            const float a = Pi * float(i % (2 * n)) / float(n), b = Pi * float(j) / float(n);
            const bool pole = j == 0 || j == n; // one point, bit for bit
            const Vec3f d = pole ? Vec3f(0, 0, j == 0 ? 1 : -1)
                                 : Vec3f(std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b));
            points.push_back(center + d * radius);
        }
    return points;
}

// A store to which grids and meshes are added by their points, with presence as the one input that varies.
class Shapes {
  public:
    store::Store store;
    std::vector<Triangle> triangles; // of every shape, in its own space

    store::Links links; // of shapes to come
    bool flips = false; // their winding

    Shapes() {
        m_program.nodes.resize(1);
        m_program.slots = {{grid::InputType::Float, grid::Storage::Half, 0, 1, false, "presence"}};
    }
    // Shapes that change: the points at every step. They are not among `triangles`; `moved` makes those.
    int add_moving_grid(int mu, int mv, const std::vector<std::vector<Vec3f>>& steps, float presence = -1) {
        grid::Grid g = vertices(mu, mv, steps[0]);
        grid::TracedGrid t;
        t.mu = mu, t.mv = mv;
        for (size_t k = 0; k < steps.size(); k++) {
            std::vector<float> packed;
            for (const Vec3f& p : steps[k])
                for (int c = 0; c < 3; c++)
                    packed.push_back(p[c]);
            if (k > 0)
                add_step(g, mu, mv, steps[k]);
            (k == 0 ? t.P : t.later.emplace_back()) = std::move(packed);
        }
        return add({&g, &t, nullptr, nullptr}, presence);
    }
    int add_moving_mesh(int vertices_per_face, const std::vector<std::vector<Vec3f>>& steps,
                        const std::vector<uint32_t>& indices) {
        grid::Grid g = vertices(int(steps[0].size()) - 1, 0, steps[0]);
        for (size_t k = 1; k < steps.size(); k++)
            add_step(g, int(steps[0].size()) - 1, 0, steps[k]);
        grid::TracedMesh mesh{vertices_per_face, indices};
        return add({&g, nullptr, &mesh, nullptr}, -1);
    }
    // presence < 0: opaque.
    int add_grid(int mu, int mv, const std::vector<Vec3f>& points, float presence = -1) {
        grid::Grid g = vertices(mu, mv, points);
        grid::TracedGrid t;
        t.mu = mu, t.mv = mv;
        for (const Vec3f& p : points)
            for (int c = 0; c < 3; c++)
                t.P.push_back(p[c]);
        const int shape = add({&g, &t, nullptr, nullptr}, presence);
        for (int j = 0; j < mv; j++)
            for (int i = 0; i < mu; i++) {
                const auto at = [&](int a, int b) {
                    return Point(points[size_t((j + b) * (mu + 1) + i + a)]);
                };
                triangles.push_back({at(0, 0), at(1, 0), at(0, 1), shape});
                triangles.push_back({at(1, 1), at(0, 1), at(1, 0), shape});
            }
        return shape;
    }
    int add_mesh(int vertices_per_face, const std::vector<Vec3f>& points,
                 const std::vector<uint32_t>& indices, float presence = -1) {
        grid::Grid g = vertices(int(points.size()) - 1, 0, points);
        grid::TracedMesh mesh{vertices_per_face, indices};
        const int shape = add({&g, nullptr, &mesh, nullptr}, presence);
        const auto at = [&](uint32_t i) { return Point(points[i]); };
        for (size_t f = 0; f < indices.size(); f += size_t(vertices_per_face)) {
            const uint32_t* v = &indices[f];
            if (vertices_per_face == 3)
                triangles.push_back({at(v[0]), at(v[1]), at(v[2]), shape});
            else {
                triangles.push_back({at(v[0]), at(v[1]), at(v[3]), shape});
                triangles.push_back({at(v[2]), at(v[3]), at(v[1]), shape});
            }
        }
        return shape;
    }
    int add_sphere(const Vec3f& center, float radius, int n, float presence = -1) {
        return add_grid(2 * n, n, sphere_points(center, radius, n), presence);
    }
    std::unique_ptr<Scene> flat_scene(Scene::Build build = {.pages_from = 0}) {
        GroupDesc world;
        world.shapes.push_back({0, int(store.shapes().size())});
        auto scene = std::make_unique<Scene>(store, std::span(&world, 1), build);
        read_back();
        return scene;
    }
    // Vertices are where they are traced once there is a scene.
    void read_back() {
        auto triangle = triangles.begin();
        for (int shape = 0; shape < int(store.shapes().size()); shape++) {
            const store::ShapeRecord& s = store.shapes()[size_t(shape)];
            const auto next = [&](size_t a, size_t b, size_t c) {
                if (triangle != triangles.end() && triangle->shape == shape)
                    *triangle++ = {vertex(shape, a), vertex(shape, b), vertex(shape, c), shape};
            };
            if (s.flags & store::ShapeRecord::Mesh) {
                const bool quads = s.flags & store::ShapeRecord::Quads;
                const uint32_t* v = store.words(s) + s.indices;
                for (int f = 0; f < s.mv; f++, v += quads ? 4 : 3) {
                    next(v[0], v[1], v[quads ? 3 : 2]);
                    if (quads)
                        next(v[2], v[3], v[1]);
                }
                continue;
            }
            const size_t row = size_t(s.mu) + 1;
            for (size_t j = 0; j < size_t(s.mv); j++)
                for (size_t k = j * row; k < j * row + size_t(s.mu); k++) {
                    next(k, k + 1, k + row);
                    next(k + row + 1, k + row, k + 1);
                }
        }
    }
    Point vertex(int shape, size_t number) const { return Point(traced_vertex(shape, number)); }
    Vec3f traced_vertex(int shape, size_t number, int step = 0) const {
        const store::ShapeRecord& s = store.shapes()[size_t(shape)];
        const float* p = store.floats(s) + s.positions + ptrdiff_t(step) * s.motion_stride + 3 * number;
        return {p[0], p[1], p[2]};
    }
    // Of a shape that changes, by steps.
    std::vector<std::vector<Vec3f>> traced_steps(int shape) const {
        const store::ShapeRecord& s = store.shapes()[size_t(shape)];
        const bool mesh = s.flags & store::ShapeRecord::Mesh;
        std::vector<std::vector<Vec3f>> steps(size_t(s.motion_segments) + 1);
        for (size_t k = 0; k < steps.size(); k++)
            for (size_t v = 0; v < (mesh ? size_t(s.mu) : size_t(s.mu + 1) * size_t(s.mv + 1)); v++)
                steps[k].push_back(traced_vertex(shape, v, int(k)));
        return steps;
    }

  private:
    void add_step(grid::Grid& g, int nu, int nv, const std::vector<Vec3f>& points) {
        grid::Grid later = vertices(nu, nv, points);
        g.later.push_back({std::move(later.P), std::move(later.N)});
    }
    grid::Grid vertices(int nu, int nv, const std::vector<Vec3f>& points) const {
        grid::Grid g;
        g.allocate(nu, nv);
        g.flips = flips;
        for (size_t i = 0; i < points.size(); i++)
            for (int c = 0; c < 3; c++)
                g.P[size_t(c * g.stride) + i] = points[i][c];
        return g;
    }
    int add(store::ShadedGrid shaded, float presence) {
        m_program.presence = presence < 0 ? -1 : 0;
        grid::VertexInputs inputs;
        inputs.stride = shaded.grid->stride;
        inputs.slots.push_back({true, Vec3f(std::max(presence, 0.0f)), {}});
        shaded.inputs = &inputs;
        uint64_t bad = 0;
        const auto page = store::encode(std::span(&shaded, 1), m_program, bad);
        return store.add_page(page, m_program, -1, links);
    }
    grid::LayeringProgram m_program;
};

struct Hit {
    bool hit;
    float t, u, v;
    Vec3f Ng;
    int shape, prim;
    bool instanced;
    std::array<float, 12> world_from_shape;
    float magnitude = 0;
    int slot_shift = 0;
    int variation = 0;
};

template <int W>
RayPacket<W> packet(const Ray* rays, int count, int seed = 0, float t_max = 1e30f) {
    RayPacket<W> p;
    for (int i = 0; i < W; i++)
        p.time.v[i] = rays[std::min(i, count - 1)].time;
    for (int i = 0; i < W; i++) {
        const Ray& r = rays[std::min(i, count - 1)];
        for (int c = 0; c < 3; c++)
            p.o[c].v[i] = r.o[c], p.d[c].v[i] = r.d[c];
        p.seed.v[i] = seed + i;
    }
    p.t_max = Float<W>(t_max);
    p.active = Int<W>::lane_index() < Int<W>(count);
    return p;
}

template <int W>
std::vector<Hit> intersect(const Scene& scene, const std::vector<Ray>& rays, int seed = 0) {
    std::vector<Hit> out;
    for (size_t i = 0; i < rays.size(); i += W) {
        const int count = int(std::min(size_t(W), rays.size() - i));
        HitPacket<W> h;
        scene.intersect(packet<W>(&rays[i], count, seed + int(i)), h);
        for (int k = 0; k < count; k++) {
            Hit one{h.hit[k],
                    h.t[k],
                    h.u[k],
                    h.v[k],
                    {h.Ng.x[k], h.Ng.y[k], h.Ng.z[k]},
                    h.shape[k],
                    h.prim[k],
                    h.instanced[k] != 0,
                    {},
                    h.magnitude[k],
                    h.slot_shift[k],
                    h.variation[k]};
            for (size_t m = 0; m < 12; m++)
                one.world_from_shape[m] = h.world_from_shape[m][k];
            out.push_back(one);
        }
    }
    return out;
}

template <int W>
std::vector<bool> occluded(const Scene& scene, const std::vector<Ray>& rays, int seed = 0,
                           float t_max = 1e30f) {
    std::vector<bool> out;
    for (size_t i = 0; i < rays.size(); i += W) {
        const int count = int(std::min(size_t(W), rays.size() - i));
        const Mask<W> m = scene.occluded(packet<W>(&rays[i], count, seed + int(i), t_max));
        for (int k = 0; k < count; k++)
            out.push_back(m[k]);
    }
    return out;
}

// From random points of a box to random points of a box.
inline std::vector<Ray> random_rays(int count, float size, uint32_t seed) {
    std::mt19937 g(seed);
    std::uniform_real_distribution<float> u(-size, size);
    std::vector<Ray> rays;
    while (int(rays.size()) < count) {
        const Vec3f o(u(g), u(g), u(g)), to(u(g), u(g), u(g));
        rays.push_back({o, to - o});
    }
    return rays;
}

} // namespace kanuka::bvh::testing
