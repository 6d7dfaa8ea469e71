// Occlude with media: shadow rays that pass what light passes as it comes, and lose light to what they are
// in.
#pragma once

#include "transport/stage_medium.h"
#include "transport/stage_walls.h"
#include "transport/tint.h"

namespace kanuka::transport {

// A packet of shadow rays. Boundaries without lobes and those within media of higher priority stop no light;
// nor do shapes that the light is linked to shine through. Smooth thin walls let their part through.
template <int W>
class MediaShadows {
    using F = Float<W>;
    using I = Int<W>;
    using M = Mask<W>;

  public:
    static constexpr int MostCrossings = 64; // then they count as blocked

    MediaShadows(const SceneView& scene, BatchState& batch, const RayQueue& queue, int first,
                 WallScratch* walls)
        : m_scene(scene), m_batch(batch), m_walls(walls),
          m_active(I::lane_index() + I(first) < I(queue.count)), m_far(F::load(queue.t_max + first)),
          m_path(select(m_active, I::load(queue.path + first), I(0))),
          m_l(load_rows<4>(batch.l, m_path << 2)) {
        for (int c = 0; c < 3; c++) {
            m_rays.o[c] = F::load(queue.o[c] + first);
            m_rays.d[c] = F::load(queue.d[c] + first);
        }
        m_rays.t_max = m_far;
        m_rays.active = m_active;
        m_rays.seed = I::load(queue.seed + first);
        if (scene.geometry.moving)
            m_rays.time = gather(batch.time, m_path);
        if (scene.geometry.fades)
            m_rays.level = gather(batch.level, m_path);
        m_passes = scene.lights.shadow_linked ? I::load(queue.passes + first) : I(0);
        for (int k = 0; k < MediaStack<W>::Most; k++)
            m_media.at[k] = select(m_active, I::load(queue.media[k] + first), I(-1));
        for (int k = 0; k < Wavelengths; k++)
            m_direction_share[k] = F::load(queue.direction_share[k] + first);
    }

    // Adds the contributions of the rays that get through.
    void trace(const RayQueue& queue, int first) {
        Passages<W> passages(m_rays);
        if (!m_scene.geometry.tinted)
            m_rays.passages = nullptr;
        if (!m_scene.media.clear_boundaries && !m_scene.media.thin_walls && !any(m_media.at[0] >= I(0))) {
            m_rays.passes = m_passes;
            m_lit = m_active & !m_scene.geometry.ray_query.occluded(m_rays);
            if (m_scene.geometry.tinted)
                m_transmittance = m_transmittance * passages.before(m_scene, m_far, m_l.data());
        } else {
            for (int k = 0; k < MostCrossings && any(m_rays.active); k++) {
                passages.forget();
                m_scene.geometry.ray_query.intersect(m_rays, m_hit);
                m_hit.hit &= m_rays.active;
                if (m_scene.geometry.tinted)
                    m_transmittance = bsdf::select(
                        m_rays.active,
                        m_transmittance *
                            passages.before(m_scene, select(m_hit.hit, m_hit.t, m_far), m_l.data()),
                        m_transmittance);
                pass_segment(k);
                m_lit |= m_rays.active & !m_hit.hit;
                m_rays.active = m_hit.hit;
                if (any(m_hit.hit))
                    pass_boundary();
            }
        }
        F denominator = F::load(queue.light_share + first);
        for (int k = 0; k < Wavelengths; k++)
            denominator += m_direction_share[k];
        const F weight = F(1.0f) / max(denominator, F(1e-30f));
        Spectrum<W> contribution;
        for (int k = 0; k < Wavelengths; k++)
            contribution[k] = F::load(queue.contribution[k] + first) * m_transmittance[k] * weight;
        contribute_shadow_rays(m_scene, m_batch, m_path, first, contribution, m_lit);
    }

  private:
    // Up to the hit, through the medium that is there.
    void pass_segment(int number) {
        const F s = max(select(m_hit.hit, m_hit.t, m_far) - m_rays.t_min, F(0.0f));
        if (!any(m_rays.active & (m_media.at[0] >= I(0))))
            return;
        const MediumLanes<W> medium(m_scene, m_media.at[0], m_l.data());
        const M varies = m_rays.active & (medium.field >= I(0));
        Spectrum<W> left(F(1.0f));
        if (any(varies))
            left = ratio_track(
                m_scene, medium, m_rays.o, m_rays.d, m_rays.t_min, m_rays.t_min + s,
                seed_of(seeds::ShadowCollisions, m_rays.seed, number, m_batch.reversed_progression), varies);
        for (int i = 0; i < Wavelengths; i++) {
            const F T = select(varies, left[i], exp(-(medium.extinction(i) * s)));
            m_transmittance[i] = select(m_rays.active, m_transmittance[i] * T, m_transmittance[i]);
            // Directions find the light if there is no collision; where nothing scatters they get there, and
            // are absorbed by weight.
            m_direction_share[i] =
                select(m_rays.active & medium.scatters, m_direction_share[i] * T, m_direction_share[i]);
        }
    }
    // Those that the hit does not stop go on behind it.
    void pass_boundary() {
        using R = store::ShapeRecord;
        const GeometryView& geometry = m_scene.geometry;
        const M outside = hits_outside(m_scene, m_hit, m_rays.d, m_hit.hit);
        const I record = select(m_hit.hit, m_hit.shape, I(0)) * I(store::ShapeWords);
        const Crossing<W> crossing(m_scene, m_media,
                                   gather(geometry.shapes + offsetof(R, interior) / 4, record), outside);
        const I program = gather(geometry.shapes + offsetof(R, program) / 4, record);
        const M clear = gather(m_scene.media.clear.data(), program) != I(0);
        M on = crossing.boundary &
               (crossing.nothing |
                (clear & (gather(geometry.shapes + offsetof(R, emitter) / 4, record) < I(0))));
        const M wall = m_scene.media.thin_walls
                           ? m_hit.hit & !on & (gather(m_scene.media.straight.data(), program) != I(0))
                           : M(false);
        if (any(wall)) {
            const WallPassage<W> passage =
                pass_walls(m_scene, m_batch, *m_walls, m_rays, m_hit, m_media, m_path, program, wall);
            on |= passage.passes;
            for (int i = 0; i < Wavelengths; i++) {
                m_transmittance[i] =
                    select(passage.passes, m_transmittance[i] * passage.part[i], m_transmittance[i]);
                m_direction_share[i] =
                    select(passage.passes, m_direction_share[i] * passage.chance[i], m_direction_share[i]);
            }
        }
        m_media = MediaStack<W>::select_of(m_hit.hit & on, crossing.after, m_media);
        if (m_scene.lights.shadow_linked)
            on |= (links_of(m_scene, select(m_hit.hit, m_hit.shape, I(0)), &store::Links::lets_through) &
                   m_passes) != I(0);
        m_rays.active &= on;
        m_rays.t_min = select(m_rays.active, beyond(m_rays.o, m_rays.d, m_hit.t), m_rays.t_min);
        // What is hit just there has been hit.
        m_lit |= m_rays.active & (m_rays.t_min >= m_far);
        m_rays.active &= m_rays.t_min < m_far;
    }

    const SceneView& m_scene;
    BatchState& m_batch;
    WallScratch* m_walls;
    M m_active;
    F m_far;
    I m_path, m_passes;
    Row<W, 4> m_l;
    bvh::RayPacket<W> m_rays;
    bvh::HitPacket<W> m_hit;
    MediaStack<W> m_media;
    Spectrum<W> m_transmittance{F(1.0f)}, m_direction_share; // of the contribution; see MisShares
    M m_lit{false};
};

template <int W>
void occlude_in_media(const SceneView& scene, BatchState& batch, const RayQueue& shadows,
                      WallScratch* walls) {
    for (int first = 0; first < shadows.count; first += W)
        MediaShadows<W>(scene, batch, shadows, first, walls).trace(shadows, first);
}

} // namespace kanuka::transport
