// Surface: what integrators do where paths have hit something: add emission, sample a light and queue its
// shadow ray, sample a direction and continue the path.
#pragma once

#include "transport/kernel.h"
#include "transport/play_roulette.h"
#include "transport/surface_light.h"

namespace kanuka::transport {

template <int W>
class SurfaceStage : public SurfaceLight<W> {
    using Light = SurfaceLight<W>;
    using Light::m_at;
    using typename Light::F, typename Light::I, typename Light::V, typename Light::M, typename Light::S;

  public:
    SurfaceStage(const Bounce& at, PathQueue& next, RayQueue& shadow_rays)
        : Light(at, shadow_rays), m_next(next), m_pair_rays(&shadow_rays) {
        const RouletteFactors* learned = learned_at(at.scene.settings, at.reversed_progression);
        m_pairs_sky =
            (learned ? learned->pairs_sky(at.number)
                     : at.scene.settings.first_pairs && at.reversed_progression == 0 && at.number == 0) &&
            at.scene.lights.pairs_sky();
    }
    // Of a pilot, which has the light of each direction whole.
    void cast_pairs_to(RayQueue& rays) { m_pair_rays = &rays, m_pair_weight = 1; }

    void log_to(LoggedVertex* vertex) { m_log = vertex; } // of the one path there is

    // What a path finds by coming here: absorption on its segment, emission, and at first hits what AOVs
    // want. Paths that end here, or go on as they came, leave `active`.
    void arrive(SurfaceHit<W>& h, M& active) {
        this->absorb(h);
        if (m_at.scene.media.tracked)
            pass_on(h, active);
        m_arrived = active;
        if (any(h.shape.emitter >= I(0)))
            this->add_emission(h, active & (h.shape.emitter >= I(0)));
        if (!h.code.lit_by.empty())
            this->add_own_light(h, active);
        if (m_at.scene.geometry.tinted && h.code.opacity[0].word >= 0)
            this->color_by_opacity(h);
        if (m_at.scene.lights.ambient.present)
            this->add_ambient(h, active);
        if (any(h.camera))
            record_first_hit(h, active & h.camera);
        if (!m_at.scene.settings.interreflection)
            active &= h.ray[PathQueue::Mis] == F(0.0f);
        if (m_at.scene.media.tracked)
            active &= Events::surfaces(gather(m_at.paths.events, h.slot)) < I(m_at.scene.settings.max_depth);
    }
    // Does light that scatters here count? Paths end at the greatest depth, and where nothing scatters.
    bool scatters(const bsdf::MaterialCode& code) const {
        return (m_at.scene.media.tracked || m_at.number < m_at.scene.settings.max_depth) && code.leaves > 0;
    }

    // Paths that end here, but for what goes straight through a thin wall: shadow rays pass it, whatever the
    // depth, so that directions must, too.
    M goes_through(const SurfaceHit<W>& h, M active) const {
        if (!h.code.straight)
            return M(false);
        return m_arrived & !active &
               (Events::inside(gather(m_at.paths.events, h.slot)) < I(m_at.scene.settings.volume_depth));
    }

    // Next-event estimation and a direction of the material, each weighted against the other.
    void next_event(const SurfaceHit<W>& h, M active) {
        const M through = goes_through(h, active);
        if (!scatters(h.code) || !any(active | through))
            return;
        const Scattering<W> s(m_at, h);
        record_albedo(s, active);
        active &= !s.material.black();
        sample_lights(s, active);
        sample_direction(s, active, through);
    }

    void sample_lights(const Scattering<W>& s, M active) {
        const SurfaceHit<W>& h = s.h;
        if (m_at.scene.lights.choices == 0)
            return;
        // n samples of a hit are n points of the net that follow each other, so that they lie well among
        // themselves and among those of other progressions.
        const auto n = uint32_t(m_at.scene.settings.light_samples);
        const uint32_t first = reverse_bits_scalar(m_at.reversed_progression) * n;
        for (uint32_t k = 0; k < n; k++) {
            const uint32_t number = reverse_bits_scalar(first + k);
            const LightNumbers<W> u(m_at.scene, {s.sampler.pixel, number}, m_at.number);
            for (int sample = 0; sample < m_at.scene.lights.samples; sample++)
                add_light(s, sample_light(m_at.scene, s.chooser, s.receiver, sample, u, h.l, active), active,
                          number);
        }
    }
    void add_light(const Scattering<W>& s, const LightSample<W>& light, M active, uint32_t number) {
        const SurfaceHit<W>& h = s.h;
        const F density = light.pdf_solid_angle * light_samples();
        this->count_broken(h, active & light.valid, dot(light.wi, h.Ng) * light.pdf_solid_angle);
        const V wi = h.to_local(light.wi);
        const F above = dot(light.wi, h.horizon);
        M m = active & light.valid & s.reaches(wi, above);
        if (!any(m))
            return;
        const bsdf::LobeValue<W> value = s.eval(wi, above, m);
        // Balance over both techniques and all wavelengths: sum_j r_j (n p_light + p_j), Veach's multi-sample
        // model with n samples of light and one of direction.
        F denominator(0.0f);
        for (int k = 0; k < Wavelengths; k++) {
            const F ratio = m_at.scene.settings.keeps_ratios ? gather(m_at.paths.ratio[k], h.slot) : F(1.0f);
            denominator += ratio * (density + select(light.delta, F(0.0f), value.pdf[k]));
        }
        const F weight = F(1.0f) / max(denominator, F(1e-30f));
        const S contribution = h.throughput * value.f * light.radiance * weight;
        m &= !(bsdf::mean(contribution) <= F(0.0f)); // NaN goes on, and is counted
        MisShares<W> shares;
        if (m_at.scene.media.tracked) {
            shares.light = density * sum_of_ratios(m_at.scene, m_at.paths, h.slot) * weight;
            shares.direction = bsdf::select(light.delta, S(F(0.0f)),
                                            ratios_of(m_at.scene, m_at.paths, h.slot) * value.pdf * weight);
        }
        cast_to_light(s, light, value.f, contribution, m, shares, number, this->m_shadow_rays);
    }
    // The shadow ray of a light sample. f: what the material makes of its light. number: of the sample among
    // all of its pixel, bits reversed.
    void cast_to_light(const Scattering<W>& s, const LightSample<W>& light, const S& f, const S& contribution,
                       M m, const MisShares<W>& shares, uint32_t number, RayQueue& rays) {
        S shown = contribution;
        if (m_at.batch.asks_for_lobes())
            note_rays(m_at.batch, rays, s.h.path,
                      event_of(s, s.h.to_local(light.wi), dot(light.wi, s.h.horizon), f, m), light.light,
                      shown, m.bits());
        this->queue_shadow(rays, s.h, light.wi, light.distance, shown, light.passes, m, shares, number);
    }
    void cast_to_light(const Scattering<W>& s, const LightSample<W>& light, const S& f, const S& contribution,
                       M m) {
        cast_to_light(s, light, f, contribution, m, {}, m_at.batch.reversed_progression, this->m_shadow_rays);
    }

    // through: only what goes straight on counts.
    void sample_direction(const Scattering<W>& at, M active, M through) {
        const SurfaceHit<W>& h = at.h;
        F u_lobe, u0, u1;
        at.sampler.sample_3d(bounce_net(m_at.number, Net::Scatter), u0, u1, u_lobe);
        const Roulette<W> roulette(m_at.scene.settings, at.sampler, m_at.number, false);
        const DirectionSample<W> s = at.sample(u_lobe, u0, u1, active | through);
        if (h.code.straight) {
            const M straight = (active | through) & at.material.goes_straight(s);
            go_straight(at, &roulette, F(1.0f), straight);
            active &= !straight;
        }
        const V wi = normalize(h.to_world(s.wi));
        this->count_broken(h, active & s.valid, wi.x + s.value.pdf[0]);
        M m = active & s.valid & (s.value.pdf[0] > F(0.0f));
        if (m_log && m[0])
            m_log->leaf = s.leaf[0], m_log->smooth = s.delta[0], m_log->through = s.through[0];
        const F inv_pdf = F(1.0f) / max(s.value.pdf[0], F(1e-30f));
        S throughput = h.throughput * s.value.f * inv_pdf;
        F ratios{float(Wavelengths)}, next_ratios{float(Wavelengths)};
        S ratio(F(1.0f));
        if (m_at.scene.settings.keeps_ratios) {
            ratios = sum_of_ratios(m_at.scene, m_at.paths, h.slot);
            next_ratios = F(0.0f);
            for (int k = 0; k < Wavelengths; k++) {
                ratio[k] = gather(m_at.paths.ratio[k], h.slot) * (s.value.pdf[k] * inv_pdf);
                next_ratios += ratio[k];
            }
        }
        const F mis = select(s.delta, F(0.0f), ratios * inv_pdf * light_samples());
        M paired(false);
        if (m_pairs_sky) {
            search_sky(at, u_lobe, u0, u1, active);
            paired = M(m_pair_weight < 1) & !s.delta;
        }
        roulette.play(throughput, next_ratios, m);
        m &= !(bsdf::mean(throughput) <= F(0.0f));
        leave(at, wi, s.through, throughput, ratio, mis, m, paired);
    }

    // The sky along a second direction, antithetic to the one that goes on (Hammersley and Morton 1956): of
    // the same lobe, turned by half around the normal, and low where that one is high. What hides the sky
    // mostly stands on one side, or low. Both find it without bias, so their mean does; a direction of a
    // delta lobe has no other beside it, and counts whole.
    [[gnu::noinline]] void search_sky(const Scattering<W>& at, F u_lobe, F u0, F u1, M m) {
        const SurfaceHit<W>& h = at.h;
        const F half(0.5f), last(0x1.fffffep-1f);
        const DirectionSample<W> s = at.sample(u_lobe, u0 + select(u0 < half, half, -half), last - u1, m);
        m &= s.valid & !s.delta & (s.value.pdf[0] > F(0.0f));
        if (!any(m))
            return;
        const F inv_pdf = F(1.0f) / max(s.value.pdf[0], F(1e-30f));
        F ratios{float(Wavelengths)};
        if (m_at.scene.settings.keeps_ratios) {
            ratios = F(0.0f);
            for (int k = 0; k < Wavelengths; k++)
                ratios += gather(m_at.paths.ratio[k], h.slot) * (s.value.pdf[k] * inv_pdf);
        }
        const ConstantEnvironment& constant = m_at.scene.lights.constant;
        if (m_at.scene.lights.linked)
            m &= (at.receiver.set & I(constant.sets)) != I(0);
        LightSample<W> sky;
        sky.wi = normalize(h.to_world(s.wi));
        sky.distance = F(1e30f);
        sky.passes = I(0);
        sky.light = I(LightId::Constant);
        const F weight = F(m_pair_weight) / max(ratios, F(1e-30f));
        sky.radiance = emission_spectrum(m_at.scene, constant.c, h.l);
        const S contribution = h.throughput * s.value.f * sky.radiance * (inv_pdf * weight);
        m &= !(bsdf::mean(contribution) <= F(0.0f)); // NaN goes on, and is counted
        cast_to_light(at, sky, s.value.f, contribution, m, {}, m_at.reversed_progression, *m_pair_rays);
    }

    // Through a thin wall. `chance`: that it is taken at all, beside that of the material's choice;
    // `roulette`: null = there is none.
    void go_straight(const Scattering<W>& at, const Roulette<W>* roulette, F chance, M m) {
        const SurfaceHit<W>& h = at.h;
        if (!any(m))
            return;
        const bsdf::LobeValue<W> v = at.material.straight(at.wo);
        m &= v.pdf[0] > F(0.0f);
        const F inv_pdf = F(1.0f) / max(v.pdf[0], F(1e-30f));
        S throughput = h.throughput * v.f * (inv_pdf / chance),
          ratio = ratios_of(m_at.scene, m_at.paths, h.slot);
        F ratios(0.0f);
        for (int k = 0; k < Wavelengths; k++) {
            ratio[k] *= v.pdf[k] * inv_pdf;
            ratios += ratio[k];
        }
        if (roulette)
            roulette->play(throughput, ratios, m);
        m &= !(bsdf::mean(throughput) <= F(0.0f));
        // Who looks through sees what lies behind as in a mirror, not as the camera does.
        const I events = gather(m_at.paths.events, h.slot) & I(Events::Camera - 1);
        const F mis = h.ray[PathQueue::Mis];
        I set(0);
        if (m_at.scene.lights.linked)
            set = select(mis == F(0.0f), at.receiver.set, set_left(h));
        if (const uint32_t bits = m.bits())
            continue_ray(h, throughput, ratio, mis * inv_pdf, set, events, bits);
    }

    // The paths of m go on along wi. `mis`: PathQueue::Mis.
    // `paired`: it is one of two that search the sky.
    void leave(const Scattering<W>& s, const V& wi, M through, const S& throughput, const S& ratio, F mis,
               M m, M paired = M(false)) {
        const uint32_t bits = m.bits();
        if (!bits)
            return;
        const SurfaceHit<W>& h = s.h;
        const V o = h.offset(wi);
        I interior = select(through, select(h.outside, h.shape.interior, I(-1)),
                            bitcast_int(h.ray[PathQueue::Interior]));
        MediaStack<W> media;
        I events;
        if (m_at.scene.media.tracked) {
            media = MediaStack<W>::select_of(through, h.crossing.after, h.crossing.before);
            interior = media.at[0];
            events = (gather(m_at.paths.events, h.slot) & I(Events::Camera - 1)) + I(Events::Surface);
        }
        const F map_choice = s.chooser.pdf(m_at.scene.lights.map_choice);
        const PathRow<W> row{o.x,
                             o.y,
                             o.z,
                             h.ray[PathQueue::PixelHash],
                             wi.x,
                             wi.y,
                             wi.z,
                             h.ray[PathQueue::Path],
                             throughput[0],
                             throughput[1],
                             throughput[2],
                             throughput[3],
                             mis,
                             s.chooser.pdf(m_at.scene.lights.emitter_choice),
                             select(paired, -map_choice, map_choice),
                             bitcast_float(interior)};
        if (m_at.batch.asks_for_lobes())
            note_scattering(m_at.batch, h.path, event_of(s, wi, through, mis, m), bits);
        continue_paths(m_at.scene, m_next,
                       PathSegment<W>{row, ratio, s.receiver.N, s.receiver.set, media, F(0.0f), events},
                       bits);
    }

    // For AOVs; camera rays alone.
    void record_albedo(const Scattering<W>& s, M m) {
        m &= s.h.camera;
        if (!any(m))
            return;
        const S albedo = s.material.albedo();
        store_rows(m_at.batch.first[0] + BatchState::Albedo, s.h.path << 4,
                   Row<W, 4>{albedo[0], albedo[1], albedo[2], albedo[3]}, m);
    }
    void record_first_hit(const SurfaceHit<W>& h, M m) {
        const V n = select(h.outside, h.N, -h.N);
        const F zero(0.0f), one(1.0f);
        const Row<W, 12> row{n.x, n.y, n.z,  h.t, h.P.x, h.P.y, h.P.z, bitcast_float(h.shape.object_id),
                             one, one, zero, zero}; // from BatchState::Normal on
        store_rows(m_at.batch.first[0] + BatchState::Normal, h.path << 4, row, m);
        for (const bsdf::MaterialCode::Aov& aov : h.code.aovs)
            for (int c = 0; c < aov.components; c++)
                scatter(m_at.batch.aovs.data() + size_t(aov.channel + c) * BatchPadded, h.path,
                        h.fetch.exact(aov.places[c]), m);
    }

  private:
    F light_samples() const { return F(float(m_at.scene.settings.light_samples)); }

    // For expressions: how light from wi, in the frame of the hit, is scattered. f: all that eval() has of
    // it.
    [[gnu::noinline]] static ScatteringEvent<W> event_of(const Scattering<W>& s, const V& wi, F above,
                                                         const S& f, M m) {
        ScatteringEvent<W> event = ScatteringEvent<W>::reflected();
        event.transmits = above < F(0.0f);
        const S part = s.diffuse_part(wi, above, m);
        for (int k = 0; k < Wavelengths; k++)
            event.diffuse[k] = clamp(part[k] / max(f[k], F(1e-30f)), F(0.0f), F(1.0f));
        return event;
    }
    // And of paths that go on along wi. mis: 0 after lobes of one direction.
    [[gnu::noinline]] static ScatteringEvent<W> event_of(const Scattering<W>& s, const V& wi, M through,
                                                         F mis, M m) {
        const V local = s.h.to_local(wi);
        const F above = dot(wi, s.h.horizon);
        const M singular = mis == F(0.0f);
        ScatteringEvent<W> event = ScatteringEvent<W>::reflected();
        if (any(m & !singular))
            event = event_of(s, local, above, s.eval(local, above, m).f, m);
        event.singular = singular;
        event.transmits = through;
        return event;
    }

    // Paths that a boundary does not turn go on as they came, in what is behind it: where it lies within a
    // medium of higher priority, or has no lobes.
    [[gnu::noinline]] void pass_on(const SurfaceHit<W>& h, M& active) {
        const M clear = h.code.leaves == 0 ? h.shape.emitter < I(0) : M(false);
        const M passes = active & h.crossing.boundary & (h.crossing.nothing | clear);
        active &= !passes;
        const I events = gather(m_at.paths.events, h.slot);
        const uint32_t bits =
            (passes & (Events::inside(events) < I(m_at.scene.settings.volume_depth))).bits();
        if (!bits)
            return;
        const S ratio = ratios_of(m_at.scene, m_at.paths, h.slot);
        const I set = m_at.scene.lights.linked ? set_left(h) : I(0);
        continue_ray(h, h.throughput, ratio, h.ray[PathQueue::Mis], set, events, bits);
    }

    // Of receivers, in linked scenes: of the surface that the ray left.
    I set_left(const SurfaceHit<W>& h) const {
        return m_at.number > 0 ? gather(m_at.paths.receiver_set, h.slot) : I(-1);
    }

    // Goes on as it came, in what is behind: to lights and to those who sample them it is one ray.
    void continue_ray(const SurfaceHit<W>& h, const S& throughput, const S& ratio, F mis, I set, I events,
                      uint32_t bits) {
        PathRow<W> row = h.ray;
        for (size_t k = 0; k < Wavelengths; k++)
            row[PathQueue::Throughput + k] = throughput[int(k)];
        row[PathQueue::Mis] = mis;
        row[PathQueue::Interior] = bitcast_float(h.crossing.after.at[0]);
        V receiver_n(F(0.0f), F(0.0f), F(0.0f));
        if (m_at.scene.lights.keeps_normals && m_at.number > 0)
            for (int c = 0; c < 3; c++)
                receiver_n[c] = gather(m_at.paths.receiver_n[c], h.slot);
        const F behind = h.t + h.clearance / max(abs(dot(h.d, h.Ng)), F(1e-2f));
        const F start = max(beyond(vector_of(h.ray, PathQueue::Origin), h.d, h.t), behind);
        continue_paths(
            m_at.scene, m_next,
            PathSegment<W>{row, ratio, receiver_n, set, h.crossing.after, start, events + I(Events::Inside)},
            bits);
    }

    PathQueue& m_next;
    RayQueue* m_pair_rays;
    bool m_pairs_sky = false;
    float m_pair_weight = 0.5f; // of either direction
    M m_arrived{false};         // of the hits at hand
    LoggedVertex* m_log = nullptr;
};

} // namespace kanuka::transport
