// Light that a surface shows without scattering any: emission, light that its shader baked,
// ambient light. And how light gets from a surface to the pixel: at once, or if a shadow ray gets through.
#pragma once

#include "transport/queues.h"
#include "transport/scattering.h"
#include "transport/tint.h"

namespace kanuka::transport {

template <int W>
class SurfaceLight {
  protected:
    using F = Float<W>;
    using I = Int<W>;
    using V = Vec3<F>;
    using M = Mask<W>;
    using S = Spectrum<W>;

  public:
    SurfaceLight(const Bounce& at, RayQueue& shadow_rays) : m_at(at), m_shadow_rays(shadow_rays) {}

    const Bounce& at() const { return m_at; }

    // White light of radiance 1.
    S white(const SurfaceHit<W>& h) const {
        return emission_spectrum(m_at.scene, F(0.0f), F(0.0f), F(1e4f), F(1.0f), h.l);
    }
    // What contributions found by one technique alone are multiplied by.
    F weight(const SurfaceHit<W>& h) const { return F(1.0f) / sum_of_ratios(m_at.scene, m_at.paths, h.slot); }
    void add(const SurfaceHit<W>& h, const S& radiance, M m) {
        contribute(m_at.batch, Contribution<W>{h.path, h.throughput * radiance * weight(h)}, m);
    }

    // Light that counts if nothing is in its way; to expressions it is reflected diffusely. `passes`: shadow
    // linking, see AnalyticLight.
    void cast_shadow(const SurfaceHit<W>& h, const V& wi, F distance, const S& contribution, I passes, M m) {
        S shown = contribution;
        if (m_at.batch.asks_for_lobes())
            note_rays(m_at.batch, m_shadow_rays, h.path, ScatteringEvent<W>::reflected(), I(LightId::Unnamed),
                      shown, m.bits());
        queue_shadow(m_shadow_rays, h, wi, distance, shown, passes, m, {}, m_at.batch.reversed_progression);
    }
    // `number`: of the sample among all of its pixel, bits reversed.
    void queue_shadow(RayQueue& rays, const SurfaceHit<W>& h, const V& wi, F distance, const S& contribution,
                      I passes, M m, const MisShares<W>& shares, uint32_t number) {
        const uint32_t bits = m.bits();
        if (!bits)
            return;
        // From clear of the surface to where it was meant to go.
        const V o = h.offset(wi), off = o - h.P;
        const F along = dot(off, wi), inv = F(1.0f) / max(distance, F(1e-30f));
        const V aimed = select(abs(along) * F(8.0f) < distance, wi - (off - wi * along) * inv, wi);
        distance = max(distance - along, F(0.0f));
        const MediaStack<W> media =
            m_at.scene.media.tracked
                ? MediaStack<W>::select_of(dot(wi, h.horizon) < F(0.0f), h.crossing.after, h.crossing.before)
                : MediaStack<W>();
        const I pixel = bitcast_int(h.ray[PathQueue::PixelHash]);
        queue_rays(m_at.scene, rays,
                   ShadowRay<W>{o, aimed, distance, contribution, h.path,
                                seed_of(seeds::ShadowRay, pixel, m_at.number, number), passes, media, shares},
                   bits);
    }

    // A sample that comes to NaN is made NaN as a whole, which the film counts, locates and drops.
    void count_broken(const SurfaceHit<W>& h, M m, F number) {
        m &= number != number;
        if (any(m))
            contribute(m_at.batch, Contribution<W>{h.path, S(F(std::numeric_limits<float>::quiet_NaN()))}, m);
    }

  protected:
    // Absorption along the segment, if the path was inside something (Beer and Lambert).
    void absorb(SurfaceHit<W>& h) {
        if (!m_at.scene.media.tracked)
            return;
        const I interior = bitcast_int(h.ray[PathQueue::Interior]);
        if (!any(interior >= I(0)))
            return;
        // Where it scatters too, end_flight() has been there.
        const MediumLanes<W> medium(m_at.scene, interior, h.l);
        const F s = h.t - gather(m_at.paths.start, h.slot);
        for (int i = 0; i < Wavelengths; i++)
            h.throughput[i] =
                select(medium.scatters, h.throughput[i], h.throughput[i] * exp(-(medium.absorption[i] * s)));
    }

    // What is seen of a surface goes with Oi, of which presence is the mean: see tint.h. What it shines with
    // is premultiplied.
    [[gnu::noinline]] void color_by_opacity(SurfaceHit<W>& h) {
        const M tinted = h.shape.has(store::ShapeRecord::Tinted);
        if (!any(tinted))
            return;
        const F inv = F(1.0f) / max(h.fetch.number(h.code.presence), F(1e-3f));
        const V Oi(h.fetch.number(h.code.opacity[0]), h.fetch.number(h.code.opacity[1]),
                   h.fetch.number(h.code.opacity[2]));
        h.throughput = bsdf::select(tinted, h.throughput * tint(m_at.scene, Oi * inv, h.l), h.throughput);
    }

    // What a surface shines with because lights light it that cast shadows: one of them a hit, as likely as
    // all others. As what it shines with anyway, it is seen by the camera and by way of smooth lobes.
    [[gnu::noinline]] void add_own_light(SurfaceHit<W>& h, M m) {
        m &= h.ray[PathQueue::Mis] == F(0.0f);
        m &= h.outside | h.shape.has(store::ShapeRecord::ShinesBoth);
        if (!any(m))
            return;
        const int count = int(h.code.lit_by.size());
        F u, unused;
        Sampler<W>{bitcast_int(h.ray[PathQueue::PixelHash]), m_at.reversed_progression}.sample_2d(
            bounce_net(m_at.number, Net::Light), u, unused);
        const I chosen = min(to_int(u * F(float(count))), I(count - 1));
        const F scale = F(float(count)) * weight(h);
        for (int k = 0; k < count; k++) {
            const M here = m & (chosen == I(k));
            if (!any(here))
                continue;
            const PointLight& light = m_at.scene.lights.point_lights[size_t(h.code.lit_by[size_t(k)].light)];
            const V place(light.place), to = light.far ? place : place - h.P;
            const F distance = sqrt(max(dot(to, to), F(1e-30f)));
            const S shown = h.throughput * h.fetch.amount(h.code.lit_by[size_t(k)].amount) * scale;
            cast_shadow(h, to * (F(1.0f) / distance), light.far ? F(1e30f) : distance, shown, I(light.passes),
                        here & (bsdf::max_component(shown) > F(0.0f)));
        }
    }

    // RISpec's ambient(): the same from everywhere, through everything. It stands for light that was not
    // traced once; it is seen by the camera and by way of smooth lobes, and lights nothing.
    [[gnu::noinline]] void add_ambient(const SurfaceHit<W>& h, M m) {
        m &= h.ray[PathQueue::Mis] == F(0.0f);
        if (m_at.scene.lights.linked)
            m &= (links_of(m_at.scene, bitcast_int(h.hit[HitState::Shape]), &store::Links::lit_sets) &
                  I(m_at.scene.lights.ambient.sets)) != I(0);
        if (!any(m) || (h.code.ambient.word < 0 && h.code.leaves == 0))
            return;
        S shown;
        if (h.code.ambient.word >= 0) {
            const S amount = h.fetch.amount(h.code.ambient), unit = white(h);
            for (int k = 0; k < Wavelengths; k++)
                shown[k] = amount[k] / max(unit[k], F(1e-20f));
        } else
            shown = Scattering<W>(m_at, h).material.albedo();
        const S light = emission_spectrum(m_at.scene, m_at.scene.lights.ambient.c, h.l);
        contribute(
            m_at.batch,
            Contribution<W>{h.path, h.throughput * (shown * light) * weight(h), I(LightId::Ambient), true},
            m);
    }

    void add_emission(const SurfaceHit<W>& h, M m) {
        // Only the outside shines, but for classic surfaces; light sampling finds outsides alone.
        m &= h.outside | h.shape.has(store::ShapeRecord::ShinesBoth);
        if (m_at.scene.lights.linked && m_at.number > 0)
            m &= (gather(m_at.paths.receiver_set, h.slot) &
                  links_of(m_at.scene, bitcast_int(h.hit[HitState::Shape]), &store::Links::shone_sets)) !=
                 I(0);
        if (m_at.scene.geometry.backdrops)
            m &= ((links_of(m_at.scene, bitcast_int(h.hit[HitState::Shape]), &store::Links::seen) &
                   I(store::Links::Backdrop)) == I(0)) |
                 (h.ray[PathQueue::Mis] == F(0.0f));
        if (!any(m))
            return;
        const I e = select(m, h.shape.emitter + h.place.triangle, I(0));
        const auto data = load_rows<sizeof(store::Emitter) / 4>(m_at.scene.geometry.emitters, e << 4);
        const F falloff = emission_falloff(bitcast_int(data[15]), abs(h.raw_cos_outside));
        m &= falloff > F(0.0f);
        const S radiance =
            emission_spectrum(m_at.scene, data[9], data[10], data[11], data[12], h.l) * falloff;
        PathVertex<W> vertex =
            emitter_vertex(m_at.scene, m_at.paths, h.ray, m_at.hits, h.slot, e, h.t, h.raw_cos_outside, m);
        vertex.pdf_solid_angle = select(h.outside, vertex.pdf_solid_angle, F(0.0f));
        const F weight = vertex.weight(h.ray[PathQueue::Mis], sum_of_ratios(m_at.scene, m_at.paths, h.slot));
        // Emitters hold the light of the part that is there; a hit on it is as rare as that part is small.
        const F there = h.code.presence.word < 0 ? F(1.0f) : max(h.fetch.number(h.code.presence), F(1e-3f));
        contribute(
            m_at.batch,
            Contribution<W>{h.path, h.throughput * radiance * (weight / there), LightId::of_emitter(e)}, m);
    }

    const Bounce m_at;
    RayQueue& m_shadow_rays;
};

} // namespace kanuka::transport
