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
        if (scene.geometry.instanced)
            m->hits.keep_instances();
        if (scene.media.thin_walls) {
            m_walls = std::make_unique<WallScratch>();
            if (scene.geometry.instanced)
                m_walls->hits.keep_instances();
        }
        if (scene.media.air)
            m_segments = std::make_unique<grid::AirSegments>();
        m->batch.aovs.assign(scene.settings.aov_is_color.size() * BatchPadded, 0.0f);
        if (scene.settings.expressions)
            m->batch.shares = std::make_unique<PathShares>(*scene.settings.expressions, BatchPadded);
        if (scene.lights.multipliers)
            m->batch.lobes = std::make_unique<LobeShares>(*scene.lights.multipliers, BatchPadded);
    }

    const SceneView& scene;

    // Camera rays for the pixels of a request: bounce 0.
    void generate(const BatchRequest& request, BatchCounts& counts) {
        m_request = &request;
        m_counts = &counts;
        m_bounce = 0;
        transport::generate<W>(scene, request, m->batch, *paths());
        m_reversed = reverse_bits_scalar(request.progression);
        if (m->batch.shares)
            m->batch.shares->begin((request.x1 - request.x0) * (request.y1 - request.y0));
        if (m->batch.lobes)
            m->batch.lobes->begin();
        if (request.pilot) {
            request.pilot->begin();
            if (!m_pilot)
                m_pilot = std::make_unique<PilotMemory>();
        }
        m->batch.sky = request.pilot ? m_pilot->sky : nullptr;
    }
    int bounce() const { return m_bounce; }
    int count() const { return m->paths[m_bounce & 1].count; } // paths that live
    BatchState& batch() { return m->batch; }
    const BatchRequest& request() const { return *m_request; }

    // Closest hits. Paths that miss take the environment's light along, all take that of lights they pass.
    void intersect() {
        m_counts->rays += uint64_t(count());
        if (m_request->pilot) {
            m_request->pilot->count_rays(*paths());
            std::ranges::fill(m_pilot->sky, 0.0f);
        }
        m->batch.limit = limit(m_bounce);
        m->shadow_rays.count = 0;
        transport::intersect<W>(scene, m->batch, *paths(), m_bounce, m->hits, m->runs, m->shadow_rays,
                                m->rays);
        if (m_request->pilot)
            m_request->pilot->find_sky(m_pilot->sky);
        if (m_request->log)
            log_hit();
    }
    // What lies before the hits.
    void apply_air() {
        if (scene.media.air)
            transport::apply_air(scene, m->batch, *paths(), m->hits, m->runs, m_bounce, *m_segments);
    }
    // Calls each(stage, code, slots, active) for up to W hits of one material at a time, and has what
    // scattered inside of media go on; then shadow rays that were cast are traced, and the paths that were
    // continued are those that live: the next bounce.
    template <class Each>
    void surfaces(Each&& each) {
        next()->count = 0;
        SurfaceStage<W> stage({scene, m->batch, *paths(), m->hits, m_bounce, m_reversed}, *next(),
                              m->shadow_rays);
        if (m_request->log)
            stage.log_to(&m_request->log->back());
        if (m_request->pilot) {
            m_pilot->pair_rays.count = 0;
            stage.cast_pairs_to(m_pilot->pair_rays);
        }
        for (size_t program = 0; program < scene.geometry.materials.size(); program++) {
            const int end = m->runs.first[program + 1];
            for (int i = m->runs.first[program]; i < end; i += W) {
                // Lanes beyond the end of a run are idle.
                const Mask<W> active = Int<W>::lane_index() < Int<W>(end - i);
                const int32_t* order = m->runs.order.data() + i;
                each(stage, scene.geometry.materials[program],
                     select(active, Int<W>::load(order), Int<W>(order[0])), active);
            }
        }
        if (scene.media.scatters)
            MediumStage<W>(stage.at(), *next(), m->shadow_rays).run(m->runs);
        m_counts->rays += uint64_t(m->shadow_rays.count);
        if (m_request->log)
            m_request->log->back().emitted = added();
        m->batch.limit = limit(m_bounce + 1);
        occlude<W>(scene, m->batch, m->shadow_rays, m_walls.get(), m->rays);
        if (m_request->log)
            m_request->log->back().light_samples = added();
        if (PilotBatch* pilot = m_request->pilot) {
            pilot->count_rays({m->shadow_rays.path, size_t(m->shadow_rays.count)});
            pilot->depart(*next(), scene.settings.keeps_ratios, m->batch.radiance[0], find_pairs(), m_bounce);
        }
        m_bounce++;
    }
    void finish() {
        const BatchRequest& r = *m_request;
        if (r.pilot)
            return r.pilot->finish(m->batch.radiance[0]);
        transport::finish<W>(scene, m->batch, (r.x1 - r.x0) * (r.y1 - r.y0), r, *m_counts);
    }

  private:
    struct PilotMemory {
        Lane<float> sky;
        float radiance[BatchPadded][4];
        RayQueue pair_rays;
    };
    // Of a pilot: radiance that the other directions of pairs find, four values a path. Null = there are
    // none.
    const float* find_pairs() {
        if (m_pilot->pair_rays.count == 0)
            return nullptr;
        std::memset(m_pilot->radiance, 0, sizeof m_pilot->radiance);
        std::swap(m_pilot->radiance, m->batch.radiance);
        occlude<W>(scene, m->batch, m_pilot->pair_rays, m_walls.get(), m->rays);
        std::swap(m_pilot->radiance, m->batch.radiance);
        return m_pilot->radiance[0];
    }

    struct Memory {
        PathQueue paths[2];
        BatchState batch;
        HitState hits;
        RayQueue shadow_rays;
        ProgramRuns runs;
        RayBatch<W> rays;
    };
    // Of light that comes over so many bounces.
    float limit(int bounces) const {
        return bounces == 0   ? Unclamped
               : bounces == 1 ? scene.settings.clamp_direct
                              : scene.settings.clamp_indirect;
    }
    // Radiance since the last call.
    float added() {
        const float* sum = m->batch.radiance[0];
        const float all = sum[0] + sum[1] + sum[2] + sum[3];
        return all - std::exchange(m_logged, all);
    }
    void log_hit() {
        if (m_bounce == 0)
            m_logged = 0;
        LoggedVertex v;
        v.lights_hit = added();
        v.program = m->runs.program[0];
        if (v.program != ProgramRuns::Missed) {
            const float* hit = m->hits.row[0];
            v.distance = hit[HitState::T];
            v.object =
                scene.geometry.shapes[std::bit_cast<int32_t>(hit[HitState::Shape]) * store::ShapeWords +
                                      int(offsetof(store::ShapeRecord, object_id) / 4)];
        }
        m_request->log->push_back(v);
    }

    PathQueue* paths() { return &m->paths[m_bounce & 1]; }
    PathQueue* next() { return &m->paths[~m_bounce & 1]; }

    std::unique_ptr<Memory> m;
    std::unique_ptr<PilotMemory> m_pilot;          // where requests are of one
    std::unique_ptr<WallScratch> m_walls;          // where MediaView::thin_walls
    std::unique_ptr<grid::AirSegments> m_segments; // where MediaView::air
    const BatchRequest* m_request = nullptr;
    BatchCounts* m_counts = nullptr;
    int m_bounce = 0;
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
