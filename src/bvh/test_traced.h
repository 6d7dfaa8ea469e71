// Primitives that are diced, stored and traced as a picture's geometry is, for tests of what they hide.
#pragma once

#include <gtest/gtest.h>
#include <random>

#include "bvh/bvh.h"
#include "dice/test_scene.h"

namespace kanuka::bvh::testing {

struct Slab {
    std::vector<scene::Primitive> primitives;
    dice::DiceOptions options;
    dice::DiceTarget target;
    dice::Displace displace;
    grid::LayeringProgram program;
    Slab() { program.nodes.resize(1); }
};

// How much of light along a direction goes through.
class Traced {
  public:
    // `told`: what the journal is expected to have.
    explicit Traced(const Slab& slab, bool pages, size_t told = 0) {
        Journal journal;
        for (const scene::Primitive& p : slab.primitives) {
            dice::Diced diced = dice::dice(p, slab.target, slab.options, slab.displace, journal);
            grid::VertexInputs inputs;
            const store::ShadedGrid shaded{&diced.mesh_vertices, nullptr, &diced.mesh, &inputs};
            uint64_t bad = 0;
            m_store.add_page(store::encode(std::span(&shaded, 1), slab.program, bad), slab.program, -1);
            EXPECT_EQ(bad, 0u);
        }
        EXPECT_EQ(journal.entries().size(), told);
        m_groups.resize(1);
        m_groups[0].shapes.push_back({0, int(m_store.shapes().size())});
        m_scene = std::make_unique<bvh::Scene>(m_store, m_groups,
                                               bvh::Scene::Build{.pages_from = pages ? 0 : ~uint64_t(0)});
    }
    bool fibres() const { return m_store.shapes()[0].flags & store::ShapeRecord::Fibre; }
    const bvh::Scene& scene() const { return *m_scene; }
    const store::Store& store() const { return m_store; }
    // Of its one fibre, as it is traced; with its radius.
    std::vector<Vec3f> axis(float& radius) const {
        const store::ShapeRecord& s = m_store.shapes()[0];
        const float* p = m_store.floats(s) + s.positions;
        std::vector<Vec3f> points;
        for (int i = 0; i < s.mu; i++, p += 4)
            points.push_back({p[0], p[1], p[2]}), radius = p[3];
        return points;
    }

    // Parallel rays along d from a square of the given half width about `center`, which is its middle.
    double passed(const Vec3f& center, const Vec3f& d, float half, int rays, int seed = 1,
                  float time = 0) const {
        std::mt19937 random(static_cast<unsigned>(seed));
        std::uniform_real_distribution<float> uniform(-half, half);
        const Vec3f a = normalize(cross(d, abs(d.x) < 0.9f ? Vec3f(1, 0, 0) : Vec3f(0, 1, 0))),
                    b = cross(d, a);
        int through = 0;
        for (int i = 0; i < rays; i += 8) {
            bvh::RayPacket<8> packet;
            for (int k = 0; k < 8; k++) {
                const Vec3f o = center - d * 10 + a * uniform(random) + b * uniform(random);
                for (int c = 0; c < 3; c++)
                    packet.o[c].v[k] = o[c], packet.d[c].v[k] = d[c];
            }
            packet.t_max = Float<8>(1e30f);
            packet.active = Int<8>::lane_index() >= Int<8>(0);
            packet.seed = Int<8>::lane_index() + Int<8>(i);
            packet.time = Float<8>(time);
            const uint32_t hidden = m_scene->occluded(packet).bits();
            bvh::HitPacket<8> hits;
            m_scene->intersect(packet, hits);
            EXPECT_EQ(hits.hit.bits(), hidden);
            through += 8 - __builtin_popcount(hidden);
        }
        return double(through) / rays;
    }

  private:
    store::Store m_store;
    std::vector<bvh::GroupDesc> m_groups;
    std::unique_ptr<bvh::Scene> m_scene;
};

} // namespace kanuka::bvh::testing
