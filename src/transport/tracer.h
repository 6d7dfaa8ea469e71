// The memory of a batch of paths and the steps that integrators are made of.
#pragma once

#include <bit>
#include <utility>

#include "transport/integrator.h"
#include "transport/kernel.h"
#include "transport/stage_air.h"
#include "transport/stage_film.h"
#include "transport/stage_generate.h"
#include "transport/stage_surface.h"

namespace kanuka::transport {

template <int W>
class Tracer {
  public:
    explicit Tracer(const SceneView& scene) : scene(scene), m(std::make_unique<Memory>()) {
        if (scene.instanced)
            m->hits.keep_instances();
        if (scene.thin_walls) {
            m_walls = std::make_unique<WallScratch>();
            if (scene.instanced)
                m_walls->hits.keep_instances();
        }
        if (scene.air)
            m_segments = std::make_unique<grid::AirSegments>();
        m->batch.aovs.assign(scene.aov_is_color.size() * BatchPadded, 0.0f);
    }

    const SceneView& scene;

    // Camera rays for the pixels of a request: bounce 0.
    void generate(const BatchRequest& request, BatchCounts& counts) {
        m_request = &request;
        m_counts = &counts;
        m_bounce = 0;
        m_count = transport::generate<W>(scene, request, m->batch, *paths());
        m_reversed = reverse_bits_scalar(request.progression);
    }
    int bounce() const { return m_bounce; }
    int count() const { return m_count; } // paths that live
    BatchState& batch() { return m->batch; }
    const BatchRequest& request() const { return *m_request; }

    // Closest hits. Paths that miss take the environment's light along, all take that of lights they pass.
    void intersect() {
        m_counts->rays += uint64_t(m_count);
        m->batch.limit = limit(m_bounce);
        m_shadow_count = 0;
        transport::intersect<W>(scene, m->batch, *paths(), m_count, m_bounce, m->hits, m->runs, m->shadows,
                                m_shadow_count);
        if (m_request->log)
            log_hit();
    }
    // What lies before the hits.
    void apply_air() {
        if (scene.air)
            transport::apply_air(scene, m->batch, *paths(), m->hits, m->runs, m_bounce, *m_segments);
    }
    // Calls each(stage, code, slots, active) for up to W hits of one material at a time, and has what
    // scattered inside of media go on; then shadow rays that were cast are traced, and the paths that were
    // continued are those that live: the next bounce.
    template <class Each>
    void surfaces(Each&& each) {
        SurfaceStage<W> stage({scene, m->batch, *paths(), m->hits, m_bounce, m_reversed}, *next(), m->shadows,
                              m_shadow_count);
        if (m_request->log)
            stage.log_to(&m_request->log->back());
        for (size_t program = 0; program < scene.materials.size(); program++) {
            const int end = m->runs.first[program + 1];
            for (int i = m->runs.first[program]; i < end; i += W) {
                // Lanes beyond the end of a run are idle.
                const Mask<W> active = Int<W>::lane_index() < Int<W>(end - i);
                const int32_t* order = m->runs.order.data() + i;
                each(stage, scene.materials[program], select(active, Int<W>::load(order), Int<W>(order[0])),
                     active);
            }
        }
        int next_count = stage.next_count(), shadow_count = stage.shadow_count();
        if (scene.scatters) {
            MediumStage<W> medium(stage.at(), *next(), m->shadows, next_count, shadow_count);
            medium.run(m->runs, m_count);
            next_count = medium.next_count(), shadow_count = medium.shadow_count();
        }
        m_counts->rays += uint64_t(shadow_count);
        if (m_request->log)
            m_request->log->back().emitted = brought();
        m->batch.limit = limit(m_bounce + 1);
        occlude<W>(scene, m->batch, m->shadows, shadow_count, m_walls.get());
        if (m_request->log)
            m_request->log->back().asked = brought();
        m_count = next_count;
        m_bounce++;
    }
    void finish() {
        const BatchRequest& r = *m_request;
        transport::finish<W>(scene, m->batch, (r.x1 - r.x0) * (r.y1 - r.y0), r, *m_counts);
    }

  private:
    struct Memory {
        PathState paths[2];
        BatchState batch;
        HitState hits;
        ShadowState shadows;
        ProgramRuns runs;
    };
    // Of light that comes over so many bounces.
    float limit(int bounces) const {
        return bounces == 0 ? Unclamped : bounces == 1 ? scene.clamp_direct : scene.clamp_indirect;
    }
    // Radiance since the last call.
    float brought() {
        const float* sum = m->batch.radiance[0];
        const float all = sum[0] + sum[1] + sum[2] + sum[3];
        return all - std::exchange(m_logged, all);
    }
    void log_hit() {
        if (m_bounce == 0)
            m_logged = 0;
        PathVertex v;
        v.met = brought();
        v.program = m->runs.program[0];
        if (v.program != ProgramRuns::Missed) {
            const float* hit = m->hits.row[0];
            v.distance = hit[HitState::T];
            v.object = scene.shapes[std::bit_cast<int32_t>(hit[HitState::Shape]) * store::ShapeWords +
                                    int(offsetof(store::ShapeRecord, object_id) / 4)];
        }
        m_request->log->push_back(v);
    }

    PathState* paths() { return &m->paths[m_bounce & 1]; }
    PathState* next() { return &m->paths[~m_bounce & 1]; }

    std::unique_ptr<Memory> m;
    std::unique_ptr<WallScratch> m_walls;          // where SceneView::thin_walls
    std::unique_ptr<grid::AirSegments> m_segments; // where SceneView::air
    const BatchRequest* m_request = nullptr;
    BatchCounts* m_counts = nullptr;
    int m_bounce = 0, m_count = 0, m_shadow_count = 0;
    uint32_t m_reversed = 0;
    float m_logged = 0;
};

// One integrator at one number of lanes.
template <int W, class Integrator>
class KernelOf final : public Kernel {
  public:
    KernelOf(const SceneView& scene, const IntegratorValues& values)
        : m_tracer(scene), m_integrator(values) {}

    void trace(const BatchRequest& request, BatchCounts& counts) override {
        m_tracer.generate(request, counts);
        m_integrator.trace(m_tracer);
        m_tracer.finish();
    }

  private:
    Tracer<W> m_tracer;
    Integrator m_integrator;
};

} // namespace kanuka::transport
