// Surface: what integrators do where paths have hit something: take emission along, ask a light and queue its
// shadow ray, sample a direction and continue the path.
#pragma once

#include "base/sampling.h"
#include "transport/kernel.h"
#include "transport/stage_medium.h"
#include "transport/surface_hit.h"

namespace kanuka::transport {

template <int W>
struct DirectionSample : bsdf::LobeSample<W> {
    Mask<W> through{false}; // the lobe transmits
};

// A hit's material, and what it takes to sample light and directions there.
template <int W>
struct Scattering {
    const Bounce& at;
    const SurfaceHit<W>& h;
    Vec3<Float<W>> wo, ng; // in the frame of the hit: the view, and the normal of the horizon
    bsdf::Material<W> material;
    Sampler<W> sampler;
    Receiver<W> receiver;
    LightChances<W> chances;

    Scattering(const Bounce& at, const SurfaceHit<W>& h)
        : at(at), h(h), wo(local_view(h)), ng(h.to_local(h.horizon)),
          material(h.code, h.fetch, h.outside, wo, h.l, at.scene.media ? &h.crossing.outer : nullptr),
          sampler{bitcast_int(h.ray[PathState::PixelHash]), at.reversed_progression},
          receiver(receiver_at(at, h)), chances(at.scene, receiver) {}

    // Is there a lobe for light from wi? `above`: its cosine to the horizon's normal as SurfaceHit::offset()
    // has it, so that rounding does not put a ray's start on one side and its value on the other.
    Mask<W> reaches(const Vec3<Float<W>>& wi, Float<W> above) const {
        return max(wi.z * above, mirrored(wi, above).z * above) > Float<W>(0.0f);
    }
    // What the material makes of light from wi, a direction in the frame of the hit, on whatever side of the
    // surface it lies. A lobe that leans with its shading normal has a part on the wrong side; a mirror that
    // lies in the surface brings it back. So nothing is lost, whatever the lobes, and the density is that of
    // sample(). It is the perfect mirror for a tangent facet of Schüssler, Heitz, Hanika and Dachsbacher 2017
    // (Microfacet-based Normal Mapping for Robust Monte Carlo Path Tracing, section 4), put into the surface,
    // which serves transmission and layers, too. Without a lean there is no such part.
    bsdf::LobeValue<W> eval(const Vec3<Float<W>>& wi, Float<W> above, Mask<W> m) const {
        using F = Float<W>;
        const Vec3<F> image = mirrored(wi, above);
        bsdf::LobeValue<W> value = material.eval(wo, wi);
        const Mask<W> own = wi.z * above > F(0.0f), folded = m & (image.z * above > F(0.0f));
        mask(value, own);
        if (any(folded))
            add(value, image, folded);
        return value;
    }
    // A direction of the material, brought to the side of the surface that its lobe means.
    DirectionSample<W> sample(Float<W> u_lobe, Float<W> u0, Float<W> u1, Mask<W> m) const {
        using F = Float<W>;
        DirectionSample<W> s{material.sample(wo, u_lobe, u0, u1)};
        Mask<W> aimed(false);
        if (h.code.aimed != 0) {
            aimed = s.valid & s.delta & ((Int<W>(int(h.code.aimed)) & (Int<W>(1) << s.leaf)) != Int<W>(0));
            s.wi = select(aimed, h.aim(at, s.leaf), s.wi);
        }
        const F above = dot(s.wi, ng);
        const Vec3<F> image = mirrored(s.wi, above);
        const Mask<W> folded = !aimed & (s.wi.z * above < F(0.0f)), both = image.z * s.wi.z > F(0.0f);
        if (const Mask<W> more = m & s.valid & both & !s.delta; any(more))
            add(s.value, image, more);
        s.through = select(aimed, above, s.wi.z) < F(0.0f);
        s.wi = select(folded, image, s.wi);
        s.valid &= abs(above) > F(1e-6f); // else rounding decides where it starts
        return s;
    }

  private:
    Vec3<Float<W>> mirrored(const Vec3<Float<W>>& w, Float<W> above) const {
        return w - ng * (above + above);
    }
    static void mask(bsdf::LobeValue<W>& value, Mask<W> m) {
        value.f = bsdf::select(m, value.f, Spectrum<W>(Float<W>(0.0f)));
        value.pdf = bsdf::select(m, value.pdf, Spectrum<W>(Float<W>(0.0f)));
    }
    [[gnu::noinline]] void add(bsdf::LobeValue<W>& value, const Vec3<Float<W>>& wi, Mask<W> m) const {
        bsdf::LobeValue<W> more = material.eval(wo, wi);
        mask(more, m);
        value.f += more.f;
        value.pdf += more.pdf;
    }
    static Vec3<Float<W>> local_view(const SurfaceHit<W>& h) {
        Vec3<Float<W>> wo = h.to_local(-h.d);
        wo.z = h.cos_o;
        return wo;
    }
    static Receiver<W> receiver_at(const Bounce& at, const SurfaceHit<W>& h) {
        Receiver<W> r{h.P, h.N, Mask<W>(true)};
        // What leans with its normal has light from beyond that normal's horizon, too.
        const Mask<W> leans = Mask<W>(at.scene.points_in_tree) & (dot(h.N, h.horizon) < Float<W>(0.9995f));
        if (any(leans)) {
            r.N = select(leans, Vec3<Float<W>>(Float<W>(0.0f), Float<W>(0.0f), Float<W>(0.0f)), r.N);
            r.oriented = !leans;
        }
        if (h.code.transmits)
            r.N = {Float<W>(0.0f), Float<W>(0.0f), Float<W>(0.0f)}, r.oriented = Mask<W>(false);
        if (at.scene.linked)
            r.set = links_of(at.scene, bitcast_int(h.hit[HitState::Shape]), &store::Links::lit_sets);
        return r;
    }
};

template <int W>
class SurfaceStage {
    using F = Float<W>;
    using I = Int<W>;
    using V = Vec3<F>;
    using M = Mask<W>;
    using S = Spectrum<W>;

  public:
    SurfaceStage(const Bounce& at, PathState& next, ShadowState& shadows, int shadow_count)
        : m_at(at), m_next(next), m_shadows(shadows), m_shadow_count(shadow_count) {}

    const Bounce& at() const { return m_at; }
    void log_to(PathVertex* vertex) { m_log = vertex; } // of the one path there is
    int next_count() const { return m_next_count; }
    int shadow_count() const { return m_shadow_count; }

    // What a path finds by coming here: what lies on its way, emission, and at first hits what AOVs want.
    // Paths that end here, or go on as they came, leave `active`.
    void arrive(SurfaceHit<W>& h, M& active) {
        absorb(h);
        if (m_at.scene.media)
            pass_on(h, active);
        m_arrived = active;
        if (any(h.shape.emitter >= I(0)))
            add_emission(h, active & (h.shape.emitter >= I(0)));
        if (!h.code.lit_by.empty())
            add_own_light(h, active);
        if (m_at.scene.tinted && h.code.opacity[0].word >= 0)
            color_by_opacity(h);
        if (m_at.scene.ambient.present)
            add_ambient(h, active);
        if (any(h.camera))
            record_first_hit(h, active & h.camera);
        if (!m_at.scene.interreflection)
            active &= h.ray[PathState::Mis] == F(0.0f);
        if (m_at.scene.media)
            active &= Events::surfaces(gather(m_at.paths.events, h.slot)) < I(m_at.scene.max_depth);
    }
    // Does light that scatters here count? Paths end at the greatest depth, and where nothing scatters.
    bool scatters(const bsdf::MaterialCode& code) const {
        return (m_at.scene.media || m_at.number < m_at.scene.max_depth) && code.leaves > 0;
    }

    // Paths that end here, but for what goes straight through a thin wall: shadow rays pass it, whatever the
    // depth, so that directions must, too.
    M goes_through(const SurfaceHit<W>& h, M active) const {
        if (!h.code.straight)
            return M(false);
        return m_arrived & !active &
               (Events::inside(gather(m_at.paths.events, h.slot)) < I(m_at.scene.volume_depth));
    }

    // Next event estimation: lights asked, one direction sampled, each weighted against the other.
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
        if (m_at.scene.choices == 0)
            return;
        const LightNumbers<W> u(m_at.scene, s.sampler, m_at.number);
        for (int ask = 0; ask < m_at.scene.asks; ask++)
            add_light(s, sample_light(m_at.scene, s.chances, s.receiver, ask, u, h.l, active), active);
    }
    void add_light(const Scattering<W>& s, const LightSample<W>& light, M active) {
        const SurfaceHit<W>& h = s.h;
        count_broken(h, active & light.valid, dot(light.wi, h.Ng) * light.pdf);
        const V wi = h.to_local(light.wi);
        const F above = dot(light.wi, h.horizon);
        M m = active & light.valid & s.reaches(wi, above);
        if (!any(m))
            return;
        const bsdf::LobeValue<W> value = s.eval(wi, above, m);
        // Balance over both techniques and all wavelengths: sum_j r_j (p_light + p_j).
        F denominator(0.0f);
        for (int k = 0; k < Wavelengths; k++) {
            const F ratio = m_at.scene.keeps_ratios ? gather(m_at.paths.ratio[k], h.slot) : F(1.0f);
            denominator += ratio * (light.pdf + select(light.delta, F(0.0f), value.pdf[k]));
        }
        const F weight = F(1.0f) / max(denominator, F(1e-30f));
        const S contribution = h.beta * value.f * light.radiance * weight;
        m &= !(bsdf::mean(contribution) <= F(0.0f)); // NaN goes on, and is counted
        ShadowBalance<W> balance;
        if (m_at.scene.media) {
            balance.asked = light.pdf * sum_of_ratios(m_at.scene, m_at.paths, h.slot) * weight;
            balance.found = bsdf::select(light.delta, S(F(0.0f)),
                                         ratios_of(m_at.scene, m_at.paths, h.slot) * value.pdf * weight);
        }
        cast_shadow(h, light.wi, light.distance, contribution, light.passes, m, balance);
    }

    // Light that counts if nothing is in its way. `passes`: shadow linking, see ShadowState.
    void cast_shadow(const SurfaceHit<W>& h, const V& wi, F distance, const S& contribution, I passes, M m,
                     const ShadowBalance<W>& balance = {}) {
        const uint32_t bits = m.bits();
        if (!bits)
            return;
        // From clear of the surface to where it was meant to go.
        const V o = h.offset(wi), off = o - h.P;
        const F along = dot(off, wi), inv = F(1.0f) / max(distance, F(1e-30f));
        const V aimed = select(abs(along) * F(8.0f) < distance, wi - (off - wi * along) * inv, wi);
        distance = max(distance - along, F(0.0f));
        const int at = m_shadow_count;
        for (int c = 0; c < 3; c++) {
            compress_store(m_shadows.o[c] + at, o[c], bits);
            compress_store(m_shadows.d[c] + at, aimed[c], bits);
        }
        for (int k = 0; k < Wavelengths; k++)
            compress_store(m_shadows.contribution[k] + at, contribution[k], bits);
        compress_store(m_shadows.t_max + at, distance, bits);
        if (m_at.scene.media)
            balance.store(
                m_shadows, at,
                MediaStack<W>::select_of(dot(wi, h.horizon) < F(0.0f), h.crossing.after, h.crossing.before),
                bits);
        if (m_at.scene.shadow_linked)
            compress_store(reinterpret_cast<float*>(m_shadows.passes) + at, bitcast_float(passes), bits);
        compress_store(reinterpret_cast<float*>(m_shadows.path) + at, bitcast_float(h.path), bits);
        const I seed = way_seed(bitcast_int(h.ray[PathState::PixelHash]) ^
                                    I(int(uint32_t(m_at.number) * 0x3c6ef372u + 0x1b873593u)),
                                m_at.batch.reversed_progression);
        m_shadow_count +=
            compress_store(reinterpret_cast<float*>(m_shadows.seed) + at, bitcast_float(seed), bits);
    }

    // through: only what goes straight on counts.
    void sample_direction(const Scattering<W>& at, M active, M through) {
        const SurfaceHit<W>& h = at.h;
        F u_lobe, u_roulette(0.0f), u0, u1;
        at.sampler.sample_3d(bounce_net(m_at.number, Net::Scatter), u0, u1, u_lobe);
        if (m_at.number >= m_at.scene.roulette_depth)
            u_roulette = at.sampler.sample_1d(bounce_net(m_at.number, Net::Roulette));
        const DirectionSample<W> s = at.sample(u_lobe, u0, u1, active | through);
        if (h.code.straight) {
            const M straight = (active | through) & at.material.goes_straight(s);
            go_straight(at, &u_roulette, F(1.0f), straight);
            active &= !straight;
        }
        const V wi = normalize(h.to_world(s.wi));
        count_broken(h, active & s.valid, wi.x + s.value.pdf[0]);
        M m = active & s.valid & (s.value.pdf[0] > F(0.0f));
        if (m_log && m[0])
            m_log->leaf = s.leaf[0], m_log->smooth = s.delta[0], m_log->through = s.through[0];
        const F inv_pdf = F(1.0f) / max(s.value.pdf[0], F(1e-30f));
        S beta = h.beta * s.value.f * inv_pdf;
        F ratios{float(Wavelengths)}, next_ratios{float(Wavelengths)};
        S ratio(F(1.0f));
        if (m_at.scene.keeps_ratios) {
            ratios = sum_of_ratios(m_at.scene, m_at.paths, h.slot);
            next_ratios = F(0.0f);
            for (int k = 0; k < Wavelengths; k++) {
                ratio[k] = gather(m_at.paths.ratio[k], h.slot) * (s.value.pdf[k] * inv_pdf);
                next_ratios += ratio[k];
            }
        }
        const F mis = select(s.delta, F(0.0f), ratios * inv_pdf);
        // Roulette on what the path can still bring, relative to its start.
        if (m_at.number >= m_at.scene.roulette_depth) {
            const F keep = min(bsdf::max_component(beta) * F(float(Wavelengths)) / next_ratios, F(0.95f));
            m &= u_roulette < keep;
            beta = beta * (F(1.0f) / max(keep, F(1e-6f)));
        }
        m &= !(bsdf::mean(beta) <= F(0.0f));
        leave(at, wi, s.through, beta, ratio, mis, m);
    }

    // Through a thin wall. `chance`: that it is gone at all, beside that of the material's choice;
    // `u_roulette`: null = there is none.
    void go_straight(const Scattering<W>& at, const F* u_roulette, F chance, M m) {
        const SurfaceHit<W>& h = at.h;
        if (!any(m))
            return;
        const bsdf::LobeValue<W> v = at.material.straight(at.wo);
        m &= v.pdf[0] > F(0.0f);
        const F inv_pdf = F(1.0f) / max(v.pdf[0], F(1e-30f));
        S beta = h.beta * v.f * (inv_pdf / chance), ratio = ratios_of(m_at.scene, m_at.paths, h.slot);
        F ratios(0.0f);
        for (int k = 0; k < Wavelengths; k++) {
            ratio[k] *= v.pdf[k] * inv_pdf;
            ratios += ratio[k];
        }
        if (u_roulette && m_at.number >= m_at.scene.roulette_depth) {
            const F keep = min(bsdf::max_component(beta) * F(float(Wavelengths)) / ratios, F(0.95f));
            m &= *u_roulette < keep;
            beta = beta * (F(1.0f) / max(keep, F(1e-6f)));
        }
        m &= !(bsdf::mean(beta) <= F(0.0f));
        // Who looks through sees what lies behind as in a mirror, not as the camera does.
        const I events = gather(m_at.paths.events, h.slot) & I(Events::Camera - 1);
        const F mis = h.ray[PathState::Mis];
        I set(0);
        if (m_at.scene.linked)
            set = select(mis == F(0.0f), at.receiver.set, set_left(h));
        if (const uint32_t bits = m.bits())
            continue_ray(h, beta, ratio, mis * inv_pdf, set, events, bits);
    }

    // The paths of m go on along wi. `mis`: PathState::Mis.
    void leave(const Scattering<W>& s, const V& wi, M through, const S& beta, const S& ratio, F mis, M m) {
        const uint32_t bits = m.bits();
        if (!bits)
            return;
        const SurfaceHit<W>& h = s.h;
        const V o = h.offset(wi);
        I interior = select(through, select(h.outside, h.shape.interior, I(-1)),
                            bitcast_int(h.ray[PathState::Interior]));
        if (m_at.scene.media) {
            const auto media = MediaStack<W>::select_of(through, h.crossing.after, h.crossing.before);
            interior = media.at[0];
            const I events = gather(m_at.paths.events, h.slot) & I(Events::Camera - 1);
            store_media(m_next, m_next_count, media, F(0.0f), events + I(Events::Surface), bits);
        }
        const Row<W, PathState::Fields> row{o.x,
                                            o.y,
                                            o.z,
                                            h.ray[PathState::PixelHash],
                                            wi.x,
                                            wi.y,
                                            wi.z,
                                            h.ray[PathState::Path],
                                            beta[0],
                                            beta[1],
                                            beta[2],
                                            beta[3],
                                            mis,
                                            s.chances.of(m_at.scene.emitter_choice),
                                            s.chances.of(m_at.scene.map_choice),
                                            bitcast_float(interior)};
        const int at = m_next_count;
        if (m_at.scene.keeps_ratios)
            for (int k = 0; k < Wavelengths; k++)
                compress_store(m_next.ratio[k] + at, ratio[k], bits);
        if (m_at.scene.keeps_normals)
            for (int c = 0; c < 3; c++)
                compress_store(m_next.ask_n[c] + at, s.receiver.N[c], bits);
        if (m_at.scene.linked)
            compress_store(reinterpret_cast<float*>(m_next.ask_set) + at, bitcast_float(s.receiver.set),
                           bits);
        m_next_count += compress_rows(m_next.row[at], row, bits);
    }

    // A sample that comes to NaN is made NaN as a whole, which the film counts, locates and drops.
    void count_broken(const SurfaceHit<W>& h, M m, F number) {
        m &= number != number;
        if (any(m))
            add_radiance(m_at.batch, h.path, S(F(std::numeric_limits<float>::quiet_NaN())), m);
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
    // White light of radiance 1.
    S white(const SurfaceHit<W>& h) const {
        return emission_spectrum(m_at.scene, F(0.0f), F(0.0f), F(1e4f), F(1.0f), h.l);
    }
    // What contributions found by one technique alone are multiplied by.
    F weight(const SurfaceHit<W>& h) const { return F(1.0f) / sum_of_ratios(m_at.scene, m_at.paths, h.slot); }
    void add(const SurfaceHit<W>& h, const S& radiance, M m) {
        add_radiance(m_at.batch, h.path, h.beta * radiance * weight(h), m);
    }

  private:
    // Absorption on the way here, if the path was inside something (Beer and Lambert).
    void absorb(SurfaceHit<W>& h) {
        if (!m_at.scene.media)
            return;
        const I interior = bitcast_int(h.ray[PathState::Interior]);
        if (!any(interior >= I(0)))
            return;
        // Where it scatters too, end_flight() has been there.
        const MediumLanes<W> medium(m_at.scene, interior, h.l);
        const F s = h.t - gather(m_at.paths.start, h.slot);
        for (int i = 0; i < Wavelengths; i++)
            h.beta[i] = select(medium.scatters, h.beta[i], h.beta[i] * exp(-(medium.absorption[i] * s)));
    }

    // Paths that a boundary does not turn go on as they came, in what is behind it: where it lies within a
    // medium of higher priority, or has no lobes.
    [[gnu::noinline]] void pass_on(const SurfaceHit<W>& h, M& active) {
        const M clear = h.code.leaves == 0 ? h.shape.emitter < I(0) : M(false);
        const M passes = active & h.crossing.boundary & (h.crossing.nothing | clear);
        active &= !passes;
        const I events = gather(m_at.paths.events, h.slot);
        const uint32_t bits = (passes & (Events::inside(events) < I(m_at.scene.volume_depth))).bits();
        if (!bits)
            return;
        const S ratio = ratios_of(m_at.scene, m_at.paths, h.slot);
        const I set = m_at.scene.linked ? set_left(h) : I(0);
        continue_ray(h, h.beta, ratio, h.ray[PathState::Mis], set, events, bits);
    }

    // Of receivers, in linked scenes: of the surface that the ray left.
    I set_left(const SurfaceHit<W>& h) const {
        return m_at.number > 0 ? gather(m_at.paths.ask_set, h.slot) : I(-1);
    }

    // Goes on as it came, in what is behind: to lights and to those who ask for them it is one ray.
    void continue_ray(const SurfaceHit<W>& h, const S& beta, const S& ratio, F mis, I set, I events,
                      uint32_t bits) {
        auto row = h.ray;
        for (size_t k = 0; k < Wavelengths; k++)
            row[PathState::Beta + k] = beta[int(k)];
        row[PathState::Mis] = mis;
        row[PathState::Interior] = bitcast_float(h.crossing.after.at[0]);
        const int at = m_next_count;
        if (m_at.scene.keeps_ratios)
            for (int k = 0; k < Wavelengths; k++)
                compress_store(m_next.ratio[k] + at, ratio[k], bits);
        if (m_at.scene.keeps_normals)
            for (int c = 0; c < 3; c++)
                compress_store(m_next.ask_n[c] + at,
                               m_at.number > 0 ? gather(m_at.paths.ask_n[c], h.slot) : F(0.0f), bits);
        if (m_at.scene.linked)
            compress_store(reinterpret_cast<float*>(m_next.ask_set) + at, bitcast_float(set), bits);
        const F behind = h.t + h.clearance / max(abs(dot(h.d, h.Ng)), F(1e-2f));
        store_media(m_next, at, h.crossing.after,
                    max(beyond(vector_of(h.ray, PathState::Origin), h.d, h.t), behind),
                    events + I(Events::Inside), bits);
        m_next_count += compress_rows(m_next.row[at], row, bits);
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
        h.beta = bsdf::select(tinted, h.beta * tint(m_at.scene, Oi * inv, h.l), h.beta);
    }

    // What a surface shines with because lights light it that cast shadows: one of them a hit, as likely as
    // all others. As what it shines with anyway, it is seen by the camera and by way of smooth lobes.
    [[gnu::noinline]] void add_own_light(SurfaceHit<W>& h, M m) {
        m &= h.ray[PathState::Mis] == F(0.0f);
        m &= h.outside | h.shape.has(store::ShapeRecord::ShinesBoth);
        if (!any(m))
            return;
        const int count = int(h.code.lit_by.size());
        F u, unused;
        Sampler<W>{bitcast_int(h.ray[PathState::PixelHash]), m_at.reversed_progression}.sample_2d(
            bounce_net(m_at.number, Net::Light), u, unused);
        const I chosen = min(to_int(u * F(float(count))), I(count - 1));
        const F scale = F(float(count)) * weight(h);
        for (int k = 0; k < count; k++) {
            const M here = m & (chosen == I(k));
            if (!any(here))
                continue;
            const PointLight& light = m_at.scene.point_lights[size_t(h.code.lit_by[size_t(k)].light)];
            const V place(light.place), to = light.far ? place : place - h.P;
            const F distance = sqrt(max(dot(to, to), F(1e-30f)));
            const S shown = h.beta * h.fetch.amount(h.code.lit_by[size_t(k)].amount) * scale;
            cast_shadow(h, to * (F(1.0f) / distance), light.far ? F(1e30f) : distance, shown, I(light.passes),
                        here & (bsdf::max_component(shown) > F(0.0f)));
        }
    }

    // RISpec's ambient(): the same from everywhere, through everything. It stands for light that was not
    // traced once; what it brings is seen by the camera and by way of smooth lobes, and lights nothing.
    [[gnu::noinline]] void add_ambient(const SurfaceHit<W>& h, M m) {
        m &= h.ray[PathState::Mis] == F(0.0f);
        if (m_at.scene.linked)
            m &= (links_of(m_at.scene, bitcast_int(h.hit[HitState::Shape]), &store::Links::lit_sets) &
                  I(m_at.scene.ambient.sets)) != I(0);
        if (!any(m) || (h.code.ambient.word < 0 && h.code.leaves == 0))
            return;
        S shown;
        if (h.code.ambient.word >= 0) {
            const S amount = h.fetch.amount(h.code.ambient), unit = white(h);
            for (int k = 0; k < Wavelengths; k++)
                shown[k] = amount[k] / max(unit[k], F(1e-20f));
        } else
            shown = Scattering<W>(m_at, h).material.albedo();
        add(h, shown * emission_spectrum(m_at.scene, m_at.scene.ambient.c, h.l), m);
    }

    void add_emission(const SurfaceHit<W>& h, M m) {
        // Only the outside shines, but for classic surfaces; light sampling asks for outsides alone.
        m &= h.outside | h.shape.has(store::ShapeRecord::ShinesBoth);
        if (m_at.scene.linked && m_at.number > 0)
            m &= (gather(m_at.paths.ask_set, h.slot) &
                  links_of(m_at.scene, bitcast_int(h.hit[HitState::Shape]), &store::Links::shone_sets)) !=
                 I(0);
        if (m_at.scene.backdrops)
            m &= ((links_of(m_at.scene, bitcast_int(h.hit[HitState::Shape]), &store::Links::seen) &
                   I(store::Links::Backdrop)) == I(0)) |
                 (h.ray[PathState::Mis] == F(0.0f));
        if (!any(m))
            return;
        const I e = select(m, h.shape.emitter + h.place.triangle, I(0));
        const auto data = load_rows<sizeof(store::Emitter) / 4>(m_at.scene.emitters, e << 4);
        const F falloff = emission_falloff(bitcast_int(data[15]), abs(h.raw_cos_outside));
        m &= falloff > F(0.0f);
        const S radiance =
            emission_spectrum(m_at.scene, data[9], data[10], data[11], data[12], h.l) * falloff;
        const F density = h.ray[PathState::AskEmitters] *
                          met_emitter_density(m_at.scene, m_at.paths, h.ray, m_at.hits, h.slot, e, m) * h.t *
                          h.t / max(h.raw_cos_outside, F(1e-6f));
        const F weight = F(1.0f) / fma(h.ray[PathState::Mis], select(h.outside, density, F(0.0f)),
                                       sum_of_ratios(m_at.scene, m_at.paths, h.slot));
        // Emitters hold the light of the part that is there; a hit on it is as rare as that part is small.
        const F there = h.code.presence.word < 0 ? F(1.0f) : max(h.fetch.number(h.code.presence), F(1e-3f));
        add_radiance(m_at.batch, h.path, h.beta * radiance * (weight / there), m);
    }

    const Bounce m_at;
    PathState& m_next;
    ShadowState& m_shadows;
    int m_next_count = 0, m_shadow_count;
    M m_arrived{false}; // of the hits at hand
    PathVertex* m_log = nullptr;
};

} // namespace kanuka::transport
