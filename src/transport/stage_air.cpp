#include "transport/stage_air.h"

namespace kanuka::transport {

namespace {

constexpr int W = 8;
using F = Float<W>;
using I = Int<W>;

// One batch's, through one air.
class AirStage {
  public:
    AirStage(const SceneView& scene, BatchState& batch, PathState& paths, const HitState& hits, int bounce,
             grid::Ways& ways)
        : m_scene(scene), m_batch(batch), m_paths(paths), m_hits(hits), m_bounce(bounce), m_ways(ways) {}

    void begin(int air) {
        m_air = air;
        m_ways.count = 0;
    }
    void add(int slot) {
        const float* ray = m_paths.row[slot];
        if (ray[PathState::Mis] != 0)
            return;
        const float start = m_scene.media ? m_paths.start[slot] : 0, end = m_hits.row[slot][HitState::T];
        const int k = m_ways.count++, path = integer(ray[PathState::Path]);
        for (int c = 0; c < 3; c++) {
            const float o = ray[PathState::Origin + c], d = ray[PathState::Direction + c];
            m_ways.from[c][k] = o + d * start;
            m_ways.to[c][k] = o + d * end;
        }
        m_ways.seed[k] =
            way_seed(I(integer(ray[PathState::PixelHash]) ^ int(uint32_t(m_bounce) * 0x2545f491u)),
                     m_batch.reversed_progression)[0];
        m_ways.time[k] = m_scene.moving ? m_batch.time[path] : 0;
        m_ways.level[k] = m_scene.fades ? m_batch.level[path] : 0.5f;
        m_slots[k] = slot;
        if (m_ways.count == grid::Ways::Most)
            finish();
    }
    void finish() {
        if (m_ways.count == 0)
            return;
        for (int k = m_ways.count; k % W != 0; k++) // lanes beyond the end: nobody reads them
            m_slots[k] = m_slots[0];
        m_scene.air->look(m_air, m_ways);
        for (int first = 0; first < m_ways.count; first += W)
            apply(first);
        m_ways.count = 0;
    }

  private:
    static int integer(float f) {
        int i;
        std::memcpy(&i, &f, sizeof i);
        return i;
    }
    Vec3<F> triple(const float (&a)[3][grid::Ways::Most], int first) const {
        return {F::load(a[0] + first), F::load(a[1] + first), F::load(a[2] + first)};
    }
    void apply(int first) {
        const Mask<W> m = I::lane_index() + I(first) < I(m_ways.count);
        const I slot = I::load(m_slots + first);
        const auto ray = load_rows<PathState::Fields>(m_paths.row, slot << 4);
        const I path = bitcast_int(ray[PathState::Path]);
        const auto l = load_rows<4>(m_batch.l, path << 2);
        Spectrum<W> beta = spectrum_of(ray, PathState::Beta);
        const F weight = F(1.0f) / sum_of_ratios(m_scene, m_paths, slot);
        F c0, c1, c2;
        const Vec3<F> glow = triple(m_ways.glow, first);
        // Twice the largest component, to stay where spectra are smooth, as encode.cpp has it.
        const F scale = max(max(max(glow.x, glow.y), glow.z) * F(2.0f), F(1e-20f));
        bsdf::uplift(m_scene.uplift, glow * (F(1.0f) / scale), c0, c1, c2);
        add_radiance(m_batch, path, beta * emission_spectrum(m_scene, c0, c1, c2, scale, l.data()) * weight,
                     m);
        bsdf::uplift(m_scene.uplift, triple(m_ways.filter, first), c0, c1, c2);
        beta = beta * bsdf::sigmoid_spectrum(c0, c1, c2, l.data());
        for (int k = 0; k < Wavelengths; k++)
            scatter(m_paths.row[0] + PathState::Beta + k, slot << 4, beta[k], m);
    }

    const SceneView& m_scene;
    BatchState& m_batch;
    PathState& m_paths;
    const HitState& m_hits;
    int m_bounce, m_air = 0;
    grid::Ways& m_ways;
    int32_t m_slots[grid::Ways::Most];
};

} // namespace

void look_through_air(const SceneView& scene, BatchState& batch, PathState& paths, const HitState& hits,
                      const ProgramRuns& runs, int bounce, grid::Ways& ways) {
    AirStage stage(scene, batch, paths, hits, bounce, ways);
    for (const int air : scene.airs) {
        stage.begin(air);
        for (size_t p = 0; p < scene.materials.size(); p++)
            if (scene.materials[p].air == air)
                for (int i = runs.first[p]; i < runs.first[p + 1]; i++)
                    stage.add(runs.order[size_t(i)]);
        stage.finish();
    }
}

} // namespace kanuka::transport
