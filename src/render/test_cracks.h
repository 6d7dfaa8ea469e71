// Light leaks: closed surfaces, diced as a random camera sees them, are looked at from inside. Every ray must
// hit. Half of the rays go anywhere, half are aimed at the lines where grids meet, where a leak would be; of
// these an eighth at a vertex itself, to the last bit. There the edge functions that the tracer rounds (each
// on its own) may all say no: such rays are counted apart.
#pragma once

#include <cmath>
#include <random>
#include <string>

#include "base/tasks.h"
#include "bvh/bvh.h"
#include "dice/dice.h"
#include "dice/test_scene.h"

namespace kanuka::render::testing {

class CrackScene {
  public:
    std::string kind;

    explicit CrackScene(uint32_t seed) : m_random(seed) {
        const scene::Primitive p = pick(int(seed % 4));
        // Step 1: diced as seen by a camera outside.
        dice::DiceOptions options;
        const Vec3f d = direction();
        const float distance = uniform(1.6f, 6);
        Transform turn = Transform::rotate(double(uniform(0, 360)), double(d.x), double(d.y), double(d.z));
        options.camera.page_from_camera = turn * Transform::translate(0, 0, double(-distance));
        options.camera.width = options.camera.height = 160;
        options.camera.pixels_per_tangent = uniform(60, 240);
        options.max_grid_cells = 1 << (2 + seed / 4 % 4);
        options.geometry_tolerance = seed / 16 % 2 ? 0.25f : 0.0f;
        dice::DiceTarget target;
        target.shade_uniform = seed / 4 % 3 == 0;
        dice::Displace displace;
        if (seed % 4 >= 2) {
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
        dice::Diced diced = dice::dice(p, target, options, displace, m_journal);
        // Step 2: traced as a picture's geometry is.
        grid::LayeringProgram program;
        program.nodes.resize(1);
        grid::VertexInputs inputs;
        std::vector<store::ShadedGrid> shaded;
        if (diced.is_mesh)
            shaded.push_back({&diced.mesh_vertices, nullptr, &diced.mesh, &inputs});
        for (size_t i = 0; i < diced.grids.size(); i++) {
            shaded.push_back({&diced.grids[i], &diced.traced[i], nullptr, &inputs});
            add_seams(diced.traced[i]);
        }
        uint64_t bad = 0;
        m_store.add_page(store::encode(shaded, program, bad), program, -1);
        m_groups.resize(1);
        m_groups[0].shapes.push_back({0, int(m_store.shapes().size())});
        m_scene =
            std::make_unique<bvh::Scene>(m_store, m_groups, bvh::Scene::Build{.compact = seed / 32 % 2 == 1});
        open_edges = diced.is_mesh ? 0 : dice::test::traced_edges(diced).open();
        for (const grid::TracedGrid& t : diced.traced)
            micropolygons += size_t(t.mu) * size_t(t.mv);
    }

    size_t micropolygons = 0, open_edges = 0;
    bool silent() const { return m_journal.entries().empty(); }

    // Rays that leave: of those that went anywhere, were aimed at edges, and at corners. Not `aimed`: all go
    // anywhere.
    std::array<uint64_t, 3> leaks(uint64_t rays, uint32_t seed, bool aimed = true) const {
        constexpr uint64_t Batch = 1 << 14;
        std::array<std::atomic<uint64_t>, 3> leaks{};
        tasks::parallel_for(size_t((rays + Batch - 1) / Batch), [&](size_t b) {
            std::mt19937 random(uint32_t(seed * 7919u + b));
            std::uniform_real_distribution<float> in01(0, 1);
            for (uint64_t i = 0; i < std::min(Batch, rays - b * Batch); i += 8) {
                bvh::RayPacket<8> packet;
                size_t aim[8] = {};
                for (int k = 0; k < 8; k++) {
                    const Vec3f o{0.1f * in01(random) - 0.05f, 0.1f * in01(random) - 0.05f,
                                  0.1f * in01(random) - 0.05f};
                    Vec3f d;
                    if (!aimed || k % 2 == 0 || m_seams.empty()) {
                        const float z = 2 * in01(random) - 1, a = 2 * Pi * in01(random),
                                    r = std::sqrt(std::max(0.0f, 1 - z * z));
                        d = {r * std::cos(a), r * std::sin(a), z};
                    } else {
                        const auto& s = m_seams[size_t(random()) % m_seams.size()];
                        // Ends count more than their share: corners are where most grids meet.
                        aim[k] = random() % 8 == 0 ? 2 : 1;
                        const float t = aim[k] == 2 ? 0.0f : in01(random);
                        d = s[0] + (s[1] - s[0]) * t - o;
                    }
                    for (int c = 0; c < 3; c++)
                        packet.o[c].v[k] = o[c], packet.d[c].v[k] = d[c];
                }
                packet.t_max = Float<8>(1e30f);
                packet.active = Mask<8>(true);
                packet.coherent = i / 8 % 2 == 1;
                packet.seed = Int<8>(0);
                bvh::HitPacket<8> hits;
                m_scene->intersect(packet, hits);
                for (uint32_t missed = ~hits.hit.bits() & 0xff; missed; missed &= missed - 1)
                    leaks[aim[__builtin_ctz(missed)]]++;
            }
        });
        return {leaks[0].load(), leaks[1].load(), leaks[2].load()};
    }

  private:
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

    void add_seam(const Vec3f& a, const Vec3f& b) {
        if (!(a == b)) // vertices moved onto each other
            m_seams.push_back({a, b});
    }
    void add_seams(const grid::TracedGrid& t) {
        const auto at = [&](int i, int j) {
            const float* q = &t.P[3 * size_t(j * (t.mu + 1) + i)];
            return Vec3f{q[0], q[1], q[2]};
        };
        for (int i = 0; i < t.mu; i++)
            for (const int j : {0, t.mv})
                add_seam(at(i, j), at(i + 1, j));
        for (int j = 0; j < t.mv; j++)
            for (const int i : {0, t.mu})
                add_seam(at(i, j), at(i, j + 1));
    }

    std::mt19937 m_random;
    Journal m_journal;
    store::Store m_store;
    std::vector<bvh::GroupDesc> m_groups;
    std::unique_ptr<bvh::Scene> m_scene;
    std::vector<std::array<Vec3f, 2>> m_seams;
};

} // namespace kanuka::render::testing
