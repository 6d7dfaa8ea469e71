// Occlude with media: shadow rays that pass what light passes as it comes, and lose light to what they are
// in.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

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

    // The rays are on their way, up to what they cross next.
    bool any_left() const { return any(m_rays.active); }
    const bvh::RayPacket<W>& rays() const { return m_rays; }
    // Nothing on the way but what stops them changes their light: whether there is any tells all.
    bool are_straight() const {
        return !m_scene.media.clear_boundaries && !m_scene.media.thin_walls && !any(m_media.at[0] >= I(0));
    }
    bvh::RayPacket<W> straight_rays() const {
        bvh::RayPacket<W> rays = m_rays;
        rays.passes = m_passes;
        return rays;
    }
    // `passages`: of what such rays have passed; null = nothing is tinted.
    void end(const Mask<W>& hidden, const Passages<W>* passages) {
        m_lit = m_active & !hidden;
        m_rays.active = M(false);
        if (passages)
            m_transmittance = m_transmittance * passages->before(m_scene, m_far, m_l.data());
    }
    // Past the closest hit, the `number`th from the start.
    void cross(const bvh::HitPacket<W>& hit, const Passages<W>* passages, int number) {
        const M crosses = hit.hit & m_rays.active;
        const F end = select(crosses, hit.t, m_far);
        if (passages)
            m_transmittance = bsdf::select(
                m_rays.active, m_transmittance * passages->before(m_scene, end, m_l.data()), m_transmittance);
        pass_segment(end, number);
        m_lit |= m_rays.active & !crosses;
        m_rays.active = crosses;
        if (any(crosses))
            pass_boundary(hit, crosses);
    }
    // Adds the contributions of the rays that got through.
    void contribute(const RayQueue& queue, int first) const {
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
    void pass_segment(F end, int number) {
        const F s = max(end - m_rays.t_min, F(0.0f));
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
    void pass_boundary(const bvh::HitPacket<W>& hit, M crosses) {
        using R = store::ShapeRecord;
        const GeometryView& geometry = m_scene.geometry;
        const M outside = hits_outside(m_scene, hit, m_rays.d, crosses);
        const I record = select(crosses, hit.shape, I(0)) * I(store::ShapeWords);
        const Crossing<W> crossing(m_scene, m_media,
                                   gather(geometry.shapes + offsetof(R, interior) / 4, record), outside);
        const I program = gather(geometry.shapes + offsetof(R, program) / 4, record);
        const M clear = gather(m_scene.media.clear.data(), program) != I(0);
        M on = crossing.boundary &
               (crossing.nothing |
                (clear & (gather(geometry.shapes + offsetof(R, emitter) / 4, record) < I(0))));
        const M wall = m_scene.media.thin_walls
                           ? crosses & !on & (gather(m_scene.media.straight.data(), program) != I(0))
                           : M(false);
        if (any(wall)) {
            const WallPassage<W> passage =
                pass_walls(m_scene, m_batch, *m_walls, m_rays, hit, m_media, m_path, program, wall);
            on |= passage.passes;
            for (int i = 0; i < Wavelengths; i++) {
                m_transmittance[i] =
                    select(passage.passes, m_transmittance[i] * passage.part[i], m_transmittance[i]);
                m_direction_share[i] =
                    select(passage.passes, m_direction_share[i] * passage.chance[i], m_direction_share[i]);
            }
        }
        m_media = MediaStack<W>::select_of(crosses & on, crossing.after, m_media);
        if (m_scene.lights.shadow_linked)
            on |= (links_of(m_scene, select(crosses, hit.shape, I(0)), &store::Links::lets_through) &
                   m_passes) != I(0);
        m_rays.active &= on;
        m_rays.t_min = select(m_rays.active, beyond(m_rays.o, m_rays.d, hit.t), m_rays.t_min);
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
    MediaStack<W> m_media;
    Spectrum<W> m_transmittance{F(1.0f)}, m_direction_share; // of the contribution; see MisShares
    M m_lit{false};
};

// All packets of a batch cross their first boundary, then those that are left their second: rays are traced
// many at once, as pages are traced best.
template <int W>
void occlude_in_media(const SceneView& scene, BatchState& batch, const RayQueue& shadows, WallScratch* walls,
                      RayBatch<W>& all) {
    constexpr int ChunkRays = 256; // caches hold their packets
    std::vector<MediaShadows<W>> packets;
    std::vector<size_t> left; // packets that rays are on their way of
    packets.reserve(size_t(std::min(shadows.count, ChunkRays) + W - 1) / W);
    // Never smaller: what comes again would be made anew.
    all.resize(std::max(int(all.rays.size()) * W, std::min(shadows.count, ChunkRays)), scene.geometry.tinted);
    const RayQuery& query = scene.geometry.ray_query;
    const auto passages = [&](size_t k) { return scene.geometry.tinted ? &all.passages[k] : nullptr; };
    // The rays of those that are left, one behind the other, and what to note of them.
    const auto gather = [&](const auto& rays_of) {
        for (size_t k = 0; k < left.size(); k++) {
            all.rays[k] = rays_of(packets[left[k]]);
            if (scene.geometry.tinted)
                all.passages[k].note(all.rays[k]);
        }
        return std::span<const bvh::RayPacket<W>>(all.rays).first(left.size());
    };
    for (int begin = 0; begin < shadows.count; begin += ChunkRays) {
        packets.clear();
        for (int first = begin; first < std::min(begin + ChunkRays, shadows.count); first += W)
            packets.emplace_back(scene, batch, shadows, first, walls);
        const auto keep = [&](const auto& is_left) {
            left.clear();
            for (size_t p = 0; p < packets.size(); p++)
                if (packets[p].any_left() && is_left(packets[p]))
                    left.push_back(p);
            return !left.empty();
        };
        if (keep([](const MediaShadows<W>& packet) { return packet.are_straight(); })) {
            const auto rays = gather([](const MediaShadows<W>& packet) { return packet.straight_rays(); });
            query.find_occluded<W>(rays, std::span(all.hidden).first(rays.size()));
            for (size_t k = 0; k < left.size(); k++)
                packets[left[k]].end(all.hidden[k], passages(k));
        }
        for (int number = 0;
             number < MediaShadows<W>::MostCrossings && keep([](const auto&) { return true; }); number++) {
            const auto rays = gather([](const MediaShadows<W>& packet) { return packet.rays(); });
            query.intersect<W>(rays, std::span(all.hits).first(rays.size()));
            for (size_t k = 0; k < left.size(); k++)
                packets[left[k]].cross(all.hits[k], passages(k), number);
        }
        for (size_t p = 0; p < packets.size(); p++)
            packets[p].contribute(shadows, begin + int(p) * W);
    }
}

} // namespace kanuka::transport
