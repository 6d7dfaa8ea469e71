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
#include "dice/test_closed_shapes.h"
#include "dice/test_scene.h"

namespace kanuka::render::testing {

class CrackScene {
  public:
    explicit CrackScene(uint32_t seed) : CrackScene(seed, {dice::test::ClosedShape(seed)}, ~uint64_t(0)) {}
    // A window, and what is cut out of it, in pages of our own.
    static CrackScene trimmed(uint32_t seed) {
        using dice::test::ClosedShape;
        return CrackScene(seed, {ClosedShape::trimmed(seed, false), ClosedShape::trimmed(seed, true)}, 0);
    }

    std::string kind;
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
    CrackScene(uint32_t seed, const std::vector<dice::test::ClosedShape>& shapes, uint64_t pages_from) {
        for (const dice::test::ClosedShape& shape : shapes)
            add(shape);
        m_groups.resize(1);
        m_groups[0].shapes.push_back({0, int(m_store.shapes().size())});
        m_scene = std::make_unique<bvh::Scene>(
            m_store, m_groups, bvh::Scene::Build{.compact = seed / 32 % 2 == 1, .pages_from = pages_from});
    }
    // Traced as a picture's geometry is.
    void add(const dice::test::ClosedShape& shape) {
        kind = shape.kind;
        const dice::Diced diced = shape.diced(m_journal);
        grid::LayeringProgram program;
        program.nodes.resize(1);
        grid::VertexInputs inputs;
        std::vector<store::ShadedGrid> shaded;
        if (diced.is_mesh)
            shaded.push_back({&diced.mesh_vertices, nullptr, &diced.mesh, &inputs});
        std::vector<grid::TrimmedPart> parts;
        for (size_t i = 0; i < diced.grids.size(); i++) {
            if (diced.trimmed.empty() || diced.trimmed[i].indices.empty())
                shaded.push_back({&diced.grids[i], &diced.traced[i], nullptr, &inputs});
            else
                parts.push_back({&diced.grids[i], &inputs, &diced.trimmed[i]});
            add_seams(diced.traced[i]);
        }
        grid::Grid cut;
        grid::VertexInputs cut_inputs;
        grid::TracedMesh cut_mesh;
        if (!parts.empty()) {
            grid::merge_trimmed(parts, {}, cut, cut_inputs, cut_mesh);
            shaded.push_back({&cut, nullptr, &cut_mesh, &cut_inputs});
        }
        uint64_t bad = 0;
        m_store.add_page(store::encode(shaded, program, bad), program, -1);
        open_edges += diced.is_mesh || !parts.empty() ? 0 : dice::test::traced_edges(diced).open();
        for (const grid::TracedGrid& t : diced.traced)
            micropolygons += size_t(t.mu) * size_t(t.mv);
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

    Journal m_journal;
    store::Store m_store;
    std::vector<bvh::GroupDesc> m_groups;
    std::unique_ptr<bvh::Scene> m_scene;
    std::vector<std::array<Vec3f, 2>> m_seams;
};

} // namespace kanuka::render::testing
