// Closed surfaces at random: subdivision meshes and rational NURBS, displaced or trimmed, and how a random
// camera has them diced.
#pragma once

#include <cmath>
#include <map>
#include <random>
#include <string>

#include "dice/dice.h"

namespace kanuka::dice::test {

class ClosedShape {
  public:
    // Displaced: every second one of either kind, or none at all.
    explicit ClosedShape(uint32_t seed) : m_random(seed) {
        primitive = pick(int(seed % 4));
        see(seed);
        if (seed % 4 >= 2)
            displace_it();
    }
    // NURBS with a window cut into them, or what is cut out of it: the two of a seed are one closed surface.
    static ClosedShape trimmed(uint32_t seed, bool outside) { return ClosedShape(seed, outside); }

    std::string kind;
    scene::Primitive primitive;
    DiceOptions options;
    DiceTarget target;
    Displace displace;

    Diced diced(Journal& journal) const { return dice::dice(primitive, target, options, displace, journal); }

  private:
    ClosedShape(uint32_t seed, bool outside) : m_random(seed) {
        primitive = pick(1);
        std::get<scene::NuPatch>(primitive.geometry).trim = window(outside);
        kind += ", trimmed";
        see(seed);
    }

    // As a camera outside of it does.
    void see(uint32_t seed) {
        const Vec3f d = direction();
        const float distance = uniform(1.6f, 6);
        Transform turn = Transform::rotate(double(uniform(0, 360)), double(d.x), double(d.y), double(d.z));
        options.camera.page_from_camera = turn * Transform::translate(0, 0, double(-distance));
        options.camera.width = options.camera.height = 160;
        options.camera.pixels_per_tangent = uniform(60, 240);
        options.max_grid_cells = 1 << (2 + seed / 4 % 4);
        options.geometry_tolerance = seed / 16 % 2 ? 0.25f : 0.0f;
        target.shade_uniform = seed / 4 % 3 == 0;
    }

    void displace_it() {
        const float height = uniform(0.01f, 0.06f), frequency = uniform(5, 40);
        displace = [=](grid::Grid& g) {
            for (int i = 0; i < g.vertices(); i++) {
                const Vec3f q = g.position(i), n = g.normal(i);
                const float h = height * std::sin(frequency * q.x) * std::sin(frequency * q.y + 1) *
                                std::sin(frequency * q.z + 2) / std::max(length(n), 1e-20f);
                for (int c = 0; c < 3; c++)
                    g.P[size_t(i) + size_t(c) * size_t(g.stride)] += n[c] * h;
            }
        };
        kind += ", displaced";
    }

    // A crooked polygon about the middle of the surface's parameters.
    std::shared_ptr<const scene::TrimCurves> window(bool outside) {
        auto t = std::make_shared<scene::TrimCurves>();
        constexpr int Corners = 11;
        std::vector<float> u, v, knots{0};
        for (int i = 0; i < Corners; i++) {
            const float a = 2 * Pi * float(i) / Corners, r = uniform(0.4f, 0.9f);
            u.push_back(2 + 1.8f * r * std::cos(a)), v.push_back(1 + 0.9f * r * std::sin(a));
        }
        u.push_back(u[0]), v.push_back(v[0]);
        for (size_t i = 0; i < u.size(); i++)
            knots.push_back(float(i));
        knots.push_back(float(u.size() - 1));
        t->curves_per_loop = std::vector<int32_t>{1}, t->order = std::vector<int32_t>{2};
        t->points = std::vector<int32_t>{int32_t(u.size())};
        t->min = std::vector<float>{0}, t->max = std::vector<float>{knots.back()};
        t->w = std::vector<float>(u.size(), 1.0f), t->knots = knots, t->u = u, t->v = v;
        t->outside = outside;
        return t;
    }

    float uniform(float lo, float hi) { return std::uniform_real_distribution<float>(lo, hi)(m_random); }
    Vec3f direction() {
        const float z = uniform(-1, 1), a = uniform(0, 2 * Pi), r = std::sqrt(std::max(0.0f, 1 - z * z));
        return {r * std::cos(a), r * std::sin(a), z};
    }
    static scene::Value points(const char* name, std::vector<float> p) {
        scene::Value v;
        v.name = name;
        v.type = name[1] == 'w' ? scene::Type::HPoint : scene::Type::Point;
        v.detail = scene::Detail::Vertex;
        v.floats = std::move(p);
        return v;
    }

    scene::Primitive pick(int which) {
        scene::Primitive p;
        auto attributes = std::make_shared<scene::Attributes>();
        attributes->shading_rate = uniform(0.5f, 8);
        p.attributes = attributes;
        if (which % 2 == 0)
            subdivision(p);
        else
            nurbs(p);
        return p;
    }

    // A cube, its sides cut in three, pushed about at random; some faces are cut in triangles, some edges are
    // sharp.
    void subdivision(scene::Primitive& p) {
        constexpr int N = 3;
        kind = "subdivision";
        scene::SubdivisionMesh mesh;
        std::map<std::array<int, 3>, int> number;
        std::vector<float> xyz;
        std::vector<int32_t> counts, vertices;
        const auto vertex = [&](std::array<int, 3> at) {
            const auto [i, fresh] = number.try_emplace(at, int(number.size()));
            if (fresh) {
                Vec3f v{float(at[0]) - N / 2.0f, float(at[1]) - N / 2.0f, float(at[2]) - N / 2.0f};
                v = v * (uniform(0.8f, 1.3f) / length(v));
                xyz.insert(xyz.end(), {v.x, v.y, v.z});
            }
            return i->second;
        };
        for (int axis = 0; axis < 3; axis++)
            for (const int side : {0, N})
                for (int j = 0; j < N; j++)
                    for (int i = 0; i < N; i++) {
                        std::array<int32_t, 4> q;
                        for (int k = 0; k < 4; k++) {
                            std::array<int, 3> at{};
                            at[size_t(axis)] = side;
                            at[size_t(axis + 1) % 3] = i + (k == 1 || k == 2);
                            at[size_t(axis + 2) % 3] = j + (k >= 2);
                            q[size_t(side ? k : 3 - k)] = vertex(at);
                        }
                        if (uniform(0, 1) < 0.3f) {
                            counts.insert(counts.end(), {3, 3});
                            vertices.insert(vertices.end(), {q[0], q[1], q[2], q[0], q[2], q[3]});
                        } else {
                            counts.push_back(4);
                            vertices.insert(vertices.end(), q.begin(), q.end());
                        }
                        if (uniform(0, 1) < 0.1f)
                            mesh.tags.push_back({"crease", {q[0], q[1], q[2]}, {uniform(0.5f, 4)}, {}});
                    }
        mesh.vertices_per_face = counts;
        mesh.vertices = vertices;
        p.geometry = std::move(mesh);
        p.primvars.set(points("P", xyz));
    }

    // A surface of revolution whose control points are pushed about; the seam and the poles stay closed.
    void nurbs(scene::Primitive& p) {
        kind = "NURBS";
        constexpr int NU = 9, NV = 5;
        const float s = std::sqrt(0.5f);
        scene::NuPatch n{};
        n.nu = NU, n.nv = NV, n.u_order = n.v_order = 3;
        n.u_knots = std::vector<float>{0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4};
        n.v_knots = std::vector<float>{0, 0, 0, 1, 1, 2, 2, 2};
        n.u_max = 4, n.v_max = 2;
        constexpr float circle[NU][2] = {{1, 0},   {1, 1},  {0, 1},  {-1, 1}, {-1, 0},
                                         {-1, -1}, {0, -1}, {1, -1}, {1, 0}};
        constexpr float arc[NV][2] = {{0, -1}, {1, -1}, {1, 0}, {1, 1}, {0, 1}};
        std::vector<float> pw;
        for (int j = 0; j < NV; j++) {
            float first = 1;
            for (int i = 0; i < NU; i++) {
                float r = j == 0 || j == NV - 1 ? 1 : uniform(0.85f, 1.25f);
                if (i == 0)
                    first = r;
                if (i == NU - 1)
                    r = first;
                const float w = (i % 2 ? s : 1) * (j % 2 ? s : 1);
                pw.insert(pw.end(), {circle[i][0] * arc[j][0] * r * w, circle[i][1] * arc[j][0] * r * w,
                                     arc[j][1] * r * w, w});
            }
        }
        p.geometry = std::move(n);
        p.primvars.set(points("Pw", pw));
    }

    std::mt19937 m_random;
};

} // namespace kanuka::dice::test
