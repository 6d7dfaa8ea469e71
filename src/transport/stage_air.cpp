#include "transport/stage_air.h"

namespace kanuka::transport {

namespace {

constexpr int W = 8;
using F = Float<W>;
using I = Int<W>;

// One batch's, through one air.
class AirStage {
  public:
    AirStage(const SceneView& scene, BatchState& batch, PathQueue& paths, const HitState& hits, int bounce,
             grid::AirSegments& segments)
        : m_scene(scene), m_batch(batch), m_paths(paths), m_hits(hits), m_bounce(bounce),
          m_segments(segments) {}

    void begin(int air) {
        m_air = air;
        m_segments.count = 0;
    }
    void add(int slot) {
        const float* ray = m_paths.row[slot];
        if (ray[PathQueue::Mis] != 0)
            return;
        const float start = m_scene.media.tracked ? m_paths.start[slot] : 0,
                    end = m_hits.row[slot][HitState::T];
        const int k = m_segments.count++, path = integer(ray[PathQueue::Path]);
        for (int c = 0; c < 3; c++) {
            const float o = ray[PathQueue::Origin + c], d = ray[PathQueue::Direction + c];
            m_segments.from[c][k] = o + d * start;
            m_segments.to[c][k] = o + d * end;
        }
        m_segments.seed[k] = seed_of(seeds::Air, I(integer(ray[PathQueue::PixelHash])), m_bounce,
                                     m_batch.reversed_progression)[0];
        m_segments.time[k] = m_scene.geometry.moving ? m_batch.time[path] : 0;
        m_segments.level[k] = m_scene.geometry.fades ? m_batch.level[path] : 0.5f;
        m_slots[k] = slot;
        if (m_segments.count == grid::AirSegments::Most)
            finish();
    }
    void finish() {
        if (m_segments.count == 0)
            return;
        for (int k = m_segments.count; k % W != 0; k++) // lanes beyond the end: nobody reads them
            m_slots[k] = m_slots[0];
        m_scene.media.air->evaluate(m_air, m_segments);
        for (int first = 0; first < m_segments.count; first += W)
            apply(first);
        m_segments.count = 0;
    }

  private:
    static int integer(float f) {
        int i;
        std::memcpy(&i, &f, sizeof i);
        return i;
    }
    Vec3<F> triple(const float (&a)[3][grid::AirSegments::Most], int first) const {
        return {F::load(a[0] + first), F::load(a[1] + first), F::load(a[2] + first)};
    }
    void apply(int first) {
        const Mask<W> m = I::lane_index() + I(first) < I(m_segments.count);
        const I slot = I::load(m_slots + first);
        const auto ray = load_rows<PathQueue::Fields>(m_paths.row, slot << 4);
        const I path = bitcast_int(ray[PathQueue::Path]);
        const auto l = load_rows<4>(m_batch.l, path << 2);
        Spectrum<W> throughput = spectrum_of(ray, PathQueue::Throughput);
        const F weight = F(1.0f) / sum_of_ratios(m_scene, m_paths, slot);
        F c0, c1, c2;
        const Vec3<F> inscatter = triple(m_segments.inscatter, first);
        // Twice the largest component, to stay where spectra are smooth, as encode.cpp has it.
        const F scale = max(max(max(inscatter.x, inscatter.y), inscatter.z) * F(2.0f), F(1e-20f));
        bsdf::uplift(m_scene.spectra.uplift, inscatter * (F(1.0f) / scale), c0, c1, c2);
        contribute(m_batch,
                   Contribution<W>{
                       path, throughput * emission_spectrum(m_scene, c0, c1, c2, scale, l.data()) * weight},
                   m);
        bsdf::uplift(m_scene.spectra.uplift, triple(m_segments.transmittance, first), c0, c1, c2);
        throughput = throughput * bsdf::sigmoid_spectrum(c0, c1, c2, l.data());
        for (int k = 0; k < Wavelengths; k++)
            scatter(m_paths.row[0] + PathQueue::Throughput + k, slot << 4, throughput[k], m);
    }

    const SceneView& m_scene;
    BatchState& m_batch;
    PathQueue& m_paths;
    const HitState& m_hits;
    int m_bounce, m_air = 0;
    grid::AirSegments& m_segments;
    int32_t m_slots[grid::AirSegments::Most];
};

} // namespace

void apply_air(const SceneView& scene, BatchState& batch, PathQueue& paths, const HitState& hits,
               const ProgramRuns& runs, int bounce, grid::AirSegments& segments) {
    AirStage stage(scene, batch, paths, hits, bounce, segments);
    for (const int air : scene.media.airs) {
        stage.begin(air);
        for (size_t p = 0; p < scene.geometry.materials.size(); p++)
            if (scene.geometry.materials[p].air == air)
                for (int i = runs.first[p]; i < runs.first[p + 1]; i++)
                    stage.add(runs.order[size_t(i)]);
        stage.finish();
    }
}

} // namespace kanuka::transport
