// The order of the stages. Included once per lane count.
#pragma once

#include "transport/stage_film.h"
#include "transport/stage_generate.h"
#include "transport/stage_surface.h"

namespace kanuka::transport {

template <int W>
class KernelOf final : public Kernel {
  public:
    explicit KernelOf(const SceneView& scene) : m_scene(scene), m(std::make_unique<Memory>()) {
        if (scene.instanced) {
            for (auto& a : m->hits.world_from_shape)
                a.assign(BatchPadded, 0.0f);
            m->hits.slot_shift.assign(BatchPadded, 0);
        }
        m->batch.aovs.assign(scene.aov_is_color.size() * BatchPadded, 0.0f);
    }

    void trace(const BatchRequest& request, BatchCounts& counts) override {
        PathState *paths = &m->paths[0], *next = &m->paths[1];
        const int pixels = (request.x1 - request.x0) * (request.y1 - request.y0);
        int count = generate<W>(m_scene, request, m->batch, *paths);
        const uint32_t reversed = reverse_bits_scalar(request.progression);
        for (int bounce = 0; count > 0 && bounce <= m_scene.last_step(); bounce++) {
            counts.rays += uint64_t(count);
            intersect<W>(m_scene, m->batch, *paths, count, bounce, m->hits, m->runs);
            SurfaceStage<W> surface(m_scene, m->batch, *paths, m->hits, *next, m->shadows, bounce, reversed);
            for (size_t program = 0; program < m_scene.materials.size(); program++) {
                const int end = m->runs.first[program + 1];
                for (int i = m->runs.first[program]; i < end; i += W)
                    surface.run(m_scene.materials[program], m->runs.order.data() + i, std::min(W, end - i));
            }
            int next_count = surface.next_count(), shadow_count = surface.shadow_count();
            if (m_scene.scatters) {
                MediumStage<W> medium(m_scene, m->batch, *paths, m->hits, *next, m->shadows, bounce,
                                      next_count, shadow_count);
                medium.run(m->runs, count);
                next_count = medium.next_count(), shadow_count = medium.shadow_count();
            }
            counts.rays += uint64_t(shadow_count);
            occlude<W>(m_scene, m->batch, m->shadows, shadow_count);
            count = next_count;
            std::swap(paths, next);
        }
        finish<W>(m_scene, m->batch, pixels, request, counts);
    }

  private:
    struct Memory {
        PathState paths[2];
        BatchState batch;
        HitState hits;
        ShadowState shadows;
        ProgramRuns runs;
    };
    const SceneView& m_scene;
    std::unique_ptr<Memory> m;
};

} // namespace kanuka::transport
