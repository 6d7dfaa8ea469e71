// Surface: at every hit, emission; a light sampled, its shadow ray queued; a direction sampled, the path
// continued.
#pragma once

#include "base/sampling.h"
#include "transport/fetch.h"
#include "transport/stage_medium.h"

namespace kanuka::transport {

template <int W>
class SurfaceStage {
    using F = Float<W>;
    using I = Int<W>;
    using V = Vec3<F>;
    using M = Mask<W>;
    using S = Spectrum<W>;

  public:
    SurfaceStage(const SceneView& scene, BatchState& batch, const PathState& paths, const HitState& hits,
                 PathState& next, ShadowState& shadows, int bounce, uint32_t reversed_progression)
        : m_scene(scene), m_batch(batch), m_paths(paths), m_hits(hits), m_next(next), m_shadows(shadows),
          m_bounce(bounce), m_reversed(reversed_progression) {}

    int next_count() const { return m_next_count; }
    int shadow_count() const { return m_shadow_count; }

    // W hits of program `code`; lanes beyond `count` are idle.
    void run(const bsdf::MaterialCode& code, const int32_t* order, int count) {
        M active = I::lane_index() < I(count);
        const I slot = select(active, I::load(order), I(order[0]));
        Hit h(*this, code, slot);
        shade_interior(h);
        M camera(m_bounce == 0);
        Crossing<W> crossing; // where the scene has media
        if (m_scene.media) {
            camera = camera_paths(m_scene, m_paths, slot, m_bounce);
            crossing = cross_boundary(h);
            pass_on(h, crossing, code, active);
            if (!any(active))
                return;
        }
        if (any(camera) && code.filter.word >= 0)
            look_through_atmosphere(h, active & camera, code);
        if (any(h.shape.emitter >= I(0)))
            add_emission(h, active & (h.shape.emitter >= I(0)), code);
        if (any(camera))
            record_first_hit(h, active & camera, code);
        if (code.leaves == 0)
            return;
        if (m_scene.media)
            active &= Events::surfaces(gather(m_paths.events, slot)) < I(m_scene.max_depth);
        else if (m_bounce >= m_scene.max_depth)
            return;
        const V wo_world = -h.d;
        V wo = h.to_local(wo_world);
        wo.z = h.cos_o;
        const bsdf::Material<W> material(code, h.fetch, h.outside, wo, h.l,
                                         m_scene.media ? &crossing.outer : nullptr);
        if (any(camera))
            record_albedo(h, active & camera, material.albedo());
        active &= !material.black();
        const Sampler<W> sampler{bitcast_int(h.ray[PathState::PixelHash]), m_reversed};
        Receiver<W> receiver{h.P, h.N, M(true)};
        if (code.transmits)
            receiver.N = V(F(0.0f), F(0.0f), F(0.0f)), receiver.oriented = M(false);
        if (m_scene.linked)
            receiver.set = links_of(m_scene, bitcast_int(h.hit[HitState::Shape]), &store::Links::lit_sets);
        const LightChances<W> chances(m_scene, receiver);
        sample_lights(h, material, wo, sampler, receiver, chances, crossing, active);
        sample_direction(h, material, wo, sampler, receiver, chances, crossing, active);
    }

  private:
    struct Hit {
        I slot;
        Row<W, PathState::Fields> ray; // as it came here
        Row<W, HitState::Fields> hit;
        I path;
        F l[Wavelengths];
        S beta;
        V d, P, Ng, N; // Ng and N: unit, on the side of the viewer; N may lean from Ng
        V T, B;
        M outside; // the viewer is on the outside
        F cos_o, t;
        F raw_cos_outside;
        ShapeLanes<W> shape;
        HitPlace<W> place;
        InputFetch<W> fetch;

        Hit(SurfaceStage& stage, const bsdf::MaterialCode& code, I slot)
            : slot(slot), ray(load_rows<PathState::Fields>(stage.m_paths.row, slot << 4)),
              hit(load_rows<HitState::Fields>(stage.m_hits.row, slot << 3)),
              path(bitcast_int(ray[PathState::Path])), beta(spectrum_of(ray, PathState::Beta)),
              d(vector_of(ray, PathState::Direction)), Ng(vector_of(hit, HitState::Ng)), t(hit[HitState::T]),
              shape(stage.m_scene.shapes, bitcast_int(hit[HitState::Shape])),
              place(stage.m_scene, shape, bitcast_int(hit[HitState::Prim]), hit[HitState::U],
                    hit[HitState::V]),
              fetch(stage.m_scene, code, shape, place, l) {
            const auto waves = load_rows<4>(stage.m_batch.l, path << 2);
            for (size_t k = 0; k < Wavelengths; k++)
                l[k] = waves[k];
            const V o = vector_of(ray, PathState::Origin);
            V anchor = stage.traced_vertex(shape.positions, place.anchor);
            if (stage.m_scene.moving)
                follow_motion(stage, anchor);
            else
                N = fetch.normal(shape);
            if (stage.m_scene.instanced)
                stage.leave_instance(slot, anchor, Ng, N);
            // Cast the hit onto the plane of its triangle: the ray parameter loses digits far from the
            // origin.
            P = o + d * t;
            const F n2 = max(dot(Ng, Ng), F(1e-37f));
            P += Ng * (dot(anchor - P, Ng) / n2);
            Ng = Ng * (F(1.0f) / sqrt(n2));
            orient();
            if (code.has_tangent)
                along_tangent(stage.leave_instance(slot, fetch.tangent()));
            else
                coordinate_frame(N, T, B);
        }

        void follow_motion(const SurfaceStage& stage, V& anchor) {
            const MotionLanes<W> motion(stage.m_scene.shapes, bitcast_int(hit[HitState::Shape]),
                                        gather(stage.m_batch.time, path));
            if (!any(motion.moving)) {
                N = fetch.normal(shape);
                return;
            }
            const I at = shape.positions + motion.segment * motion.stride;
            const V a = stage.traced_vertex(select(motion.moving, at, shape.positions), place.anchor);
            const V b =
                stage.traced_vertex(select(motion.moving, at + motion.stride, shape.positions), place.anchor);
            anchor = select(motion.moving, a + (b - a) * motion.f, anchor);
            N = fetch.normal(shape, motion);
        }

        // The outside is where the shading normals point; where there are none, where the winding says.
        void orient() {
            using R = store::ShapeRecord;
            const M has_normal = shape.has(R::HasNormals);
            const V winding = select(shape.has(R::Flips), -Ng, Ng);
            V out = select(has_normal & (dot(Ng, N) < F(0.0f)), -Ng, select(has_normal, Ng, winding));
            N = select(has_normal, N, out);
            N = N * (F(1.0f) / sqrt(max(dot(N, N), F(1e-37f))));
            const F c = -dot(d, out);
            outside = c > F(0.0f);
            raw_cos_outside = c;
            Ng = select(outside, out, -out);
            N = select(outside, N, -N);
            // A shading normal that faces away from the viewer is bent back to the horizon.
            const F facing = -dot(d, N);
            const F low(0.01f);
            const V bent = N + (-d) * (low - facing);
            N = select(facing < low, bent * (F(1.0f) / sqrt(dot(bent, bent))), N);
            cos_o = max(-dot(d, N), F(1e-4f));
        }
        // x along a tangent, as far as the normal lets it.
        void along_tangent(const V& t) {
            const V flat = t - N * dot(t, N);
            const F size = dot(flat, flat);
            coordinate_frame(N, T, B);
            T = select(size > F(1e-12f), flat * (F(1.0f) / sqrt(max(size, F(1e-12f)))), T);
            const V side = cross(N, T); // the same way from outside and inside: turns of T agree
            B = select(outside, side, -side);
        }
        V to_local(const V& w) const { return {dot(w, T), dot(w, B), dot(w, N)}; }
        V to_world(const V& w) const { return T * w.x + B * w.y + N * w.z; }
        // A start for rays on the side of w, clear of the surface by a few units in the last place of the
        // position.
        V offset(const V& w) const {
            const F size = max(max(abs(P.x), abs(P.y)), abs(P.z));
            const F e = fma(size, F(1.5e-6f), F(1e-12f));
            return P + Ng * copysign(e, dot(w, Ng));
        }
    };

    V traced_vertex(I positions, I vertex) const {
        return vector_of(load_rows<4>(m_scene.floats, positions + vertex * I(3)), 0);
    }

    void leave_instance(I slot, V& anchor, V& Ng, V& N) const {
        const M inside = gather(m_hits.instanced, slot) != I(0);
        if (!any(inside))
            return;
        F m[12];
        for (int k = 0; k < 12; k++)
            m[k] = gather(m_hits.world_from_shape[k].data(), slot);
        const V row0(m[0], m[1], m[2]), row1(m[4], m[5], m[6]), row2(m[8], m[9], m[10]);
        const V world(dot(row0, anchor) + m[3], dot(row1, anchor) + m[7], dot(row2, anchor) + m[11]);
        anchor = select(inside, world, anchor);
        Ng = select(inside, turn_normal(m, Ng), Ng);
        N = select(inside, turn_normal(m, N), N);
    }

    // A tangent goes with the transform itself.
    V leave_instance(I slot, const V& t) const {
        if (!m_scene.instanced)
            return t;
        const M inside = gather(m_hits.instanced, slot) != I(0);
        if (!any(inside))
            return t;
        F m[12];
        for (int k = 0; k < 12; k++)
            m[k] = gather(m_hits.world_from_shape[k].data(), slot);
        const V world(dot(V(m[0], m[1], m[2]), t), dot(V(m[4], m[5], m[6]), t), dot(V(m[8], m[9], m[10]), t));
        return select(inside, world * (F(1.0f) / sqrt(max(dot(world, world), F(1e-37f)))), t);
    }

    // Absorption on the way here, if the path was inside something (Beer and Lambert).
    void shade_interior(Hit& h) {
        const I interior = bitcast_int(h.ray[PathState::Interior]);
        if (!any(interior >= I(0)))
            return;
        if (m_scene.media) { // where it scatters too, end_flight() has been there
            const MediumLanes<W> medium(m_scene, interior, h.l);
            const F s = h.t - gather(m_paths.start, h.slot);
            for (int i = 0; i < Wavelengths; i++)
                h.beta[i] = select(medium.scatters, h.beta[i], h.beta[i] * exp(-(medium.absorption[i] * s)));
            return;
        }
        for (size_t k = 0; k < m_scene.interiors.size(); k++) {
            const auto& medium = m_scene.interiors[k];
            const M m = interior == I(int(k));
            if (!medium.absorbs || !any(m))
                continue;
            const S sigma =
                bsdf::sigmoid_spectrum(F(medium.c[0]), F(medium.c[1]), F(medium.c[2]), h.l) * F(medium.c[3]);
            for (int i = 0; i < Wavelengths; i++)
                h.beta[i] = select(m, h.beta[i] * exp(-sigma[i] * h.t), h.beta[i]);
        }
    }

    [[gnu::noinline]] Crossing<W> cross_boundary(const Hit& h) const {
        const I dominant = bitcast_int(h.ray[PathState::Interior]);
        return {m_scene, MediaStack<W>::load(m_paths, dominant, h.slot), h.shape.interior, h.outside};
    }
    // Paths that a boundary does not turn go on as they came, in what is behind it, and leave `active`: where
    // it lies within a medium of higher priority, or has no lobes.
    [[gnu::noinline]] void pass_on(const Hit& h, const Crossing<W>& crossing, const bsdf::MaterialCode& code,
                                   M& active) {
        const M clear = code.leaves == 0 ? h.shape.emitter < I(0) : M(false);
        const M passes = active & crossing.boundary & (crossing.nothing | clear);
        active &= !passes;
        const I events = gather(m_paths.events, h.slot);
        const uint32_t bits = (passes & (Events::inside(events) < I(m_scene.volume_depth))).bits();
        if (!bits)
            return;
        auto row = h.ray;
        for (size_t k = 0; k < Wavelengths; k++)
            row[PathState::Beta + k] = h.beta[int(k)];
        row[PathState::Interior] = bitcast_float(crossing.after.at[0]);
        const int at = m_next_count;
        if (m_scene.keeps_ratios) {
            const S ratio = ratios_of(m_scene, m_paths, h.slot);
            for (int k = 0; k < Wavelengths; k++)
                compress_store(m_next.ratio[k] + at, ratio[k], bits);
        }
        if (m_scene.keeps_normals)
            for (int c = 0; c < 3; c++)
                compress_store(m_next.ask_n[c] + at,
                               m_bounce > 0 ? gather(m_paths.ask_n[c], h.slot) : F(0.0f), bits);
        if (m_scene.linked)
            compress_store(reinterpret_cast<float*>(m_next.ask_set) + at,
                           bitcast_float(m_bounce > 0 ? gather(m_paths.ask_set, h.slot) : I(-1)), bits);
        store_media(m_next, at, crossing.after, beyond(vector_of(h.ray, PathState::Origin), h.d, h.t),
                    events + I(Events::Inside), bits);
        m_next_count += compress_rows(m_next.row[at], row, bits);
    }

    // What lies between the camera and what it sees first: affine in the surface's radiance, as the shading
    // system found it at the vertices.
    void look_through_atmosphere(Hit& h, M m, const bsdf::MaterialCode& code) {
        const F weight = F(1.0f) / sum_of_ratios(m_scene, m_paths, h.slot);
        add_radiance(m_batch, h.path, h.beta * h.fetch.amount(code.glow) * weight, m);
        h.beta = h.beta * h.fetch.color(code.filter);
    }

    void add_emission(const Hit& h, M m, const bsdf::MaterialCode& code) {
        // Only the outside shines, but for classic surfaces; light sampling asks for outsides alone.
        m &= h.outside | h.shape.has(store::ShapeRecord::ShinesBoth);
        if (m_scene.linked && m_bounce > 0)
            m &= (gather(m_paths.ask_set, h.slot) &
                  links_of(m_scene, bitcast_int(h.hit[HitState::Shape]), &store::Links::shone_sets)) != I(0);
        if (!any(m))
            return;
        const I e = select(m, h.shape.emitter + h.place.triangle, I(0));
        const auto data = load_rows<sizeof(store::Emitter) / 4>(m_scene.emitters, e << 4);
        m &= !h.outside | in_emission_cone(bitcast_int(data[15]), h.raw_cos_outside);
        const S radiance = emission_spectrum(m_scene, data[9], data[10], data[11], data[12], h.l);
        const F density = h.ray[PathState::AskEmitters] *
                          met_emitter_density(m_scene, m_paths, h.ray, m_hits, h.slot, e, m) * h.t * h.t /
                          max(h.raw_cos_outside, F(1e-6f));
        const F weight = F(1.0f) / fma(h.ray[PathState::Mis], select(h.outside, density, F(0.0f)),
                                       sum_of_ratios(m_scene, m_paths, h.slot));
        // Emitters hold the light of the part that is there; a hit on it is as rare as that part is small.
        const F there = code.presence.word < 0 ? F(1.0f) : max(h.fetch.number(code.presence), F(1e-3f));
        add_radiance(m_batch, h.path, h.beta * radiance * (weight / there), m);
    }

    void sample_lights(const Hit& h, const bsdf::Material<W>& material, const V& wo,
                       const Sampler<W>& sampler, const Receiver<W>& receiver, const LightChances<W>& chances,
                       const Crossing<W>& crossing, M active) {
        if (m_scene.choices == 0)
            return;
        F u_choice, u_part, u0, u1;
        sampler.sample_2d(bounce_dimension(m_bounce, Dimension::LightChoice), u_choice, u_part);
        sampler.sample_2d(bounce_dimension(m_bounce, Dimension::LightPosition), u0, u1);
        const LightSample<W> light =
            sample_light(m_scene, chances, receiver, u_choice, u_part, u0, u1, h.l, active);
        const V wi = h.to_local(light.wi);
        // Geometric and shading normal must agree on which side the light is.
        const F side = dot(light.wi, h.Ng) * wi.z;
        count_broken(h, active & light.valid, side * light.pdf);
        M m = active & light.valid & (side > F(0.0f));
        if (!any(m))
            return;
        const bsdf::LobeValue<W> value = material.eval(wo, wi);
        // Balance over both techniques and all wavelengths: sum_j r_j (p_light + p_j).
        F denominator(0.0f);
        for (int k = 0; k < Wavelengths; k++) {
            const F ratio = m_scene.keeps_ratios ? gather(m_paths.ratio[k], h.slot) : F(1.0f);
            denominator += ratio * (light.pdf + select(light.delta, F(0.0f), value.pdf[k]));
        }
        const F weight = m_scene.media ? F(1.0f) : F(1.0f) / max(denominator, F(1e-30f));
        const S contribution = h.beta * value.f * light.radiance * weight;
        m &= !(bsdf::mean(contribution) <= F(0.0f)); // NaN goes on, and is counted
        const uint32_t bits = m.bits();
        if (!bits)
            return;
        const V o = h.offset(light.wi);
        const int at = m_shadow_count;
        for (int c = 0; c < 3; c++) {
            compress_store(m_shadows.o[c] + at, o[c], bits);
            compress_store(m_shadows.d[c] + at, light.wi[c], bits);
        }
        for (int k = 0; k < Wavelengths; k++)
            compress_store(m_shadows.contribution[k] + at, contribution[k], bits);
        compress_store(m_shadows.t_max + at, light.distance, bits);
        if (m_scene.media) {
            const S ratio = ratios_of(m_scene, m_paths, h.slot);
            store_shadow_media(m_shadows, at,
                               MediaStack<W>::select_of(wi.z < F(0.0f), crossing.after, crossing.before),
                               sum_of_ratios(m_scene, m_paths, h.slot) * light.pdf,
                               bsdf::select(light.delta, S(F(0.0f)), ratio * value.pdf), bits);
        }
        if (m_scene.shadow_linked)
            compress_store(reinterpret_cast<float*>(m_shadows.passes) + at, bitcast_float(light.passes),
                           bits);
        compress_store(reinterpret_cast<float*>(m_shadows.path) + at, bitcast_float(h.path), bits);
        const I seed =
            bitcast_int(h.ray[PathState::PixelHash]) ^ I(int(uint32_t(m_bounce) * 0x3c6ef372u + 0x1b873593u));
        m_shadow_count +=
            compress_store(reinterpret_cast<float*>(m_shadows.seed) + at, bitcast_float(seed), bits);
    }

    void sample_direction(const Hit& h, const bsdf::Material<W>& material, const V& wo,
                          const Sampler<W>& sampler, const Receiver<W>& receiver,
                          const LightChances<W>& chances, const Crossing<W>& crossing, M active) {
        F u_lobe, u_roulette, u0, u1;
        sampler.sample_2d(bounce_dimension(m_bounce, Dimension::LobeRoulette), u_lobe, u_roulette);
        sampler.sample_2d(bounce_dimension(m_bounce, Dimension::Direction), u0, u1);
        const bsdf::LobeSample<W> s = material.sample(wo, u_lobe, u0, u1);
        const V wi = normalize(h.to_world(s.wi));
        const F side = dot(wi, h.Ng) * s.wi.z;
        count_broken(h, active & s.valid, side + s.value.pdf[0]);
        M m = active & s.valid & (side > F(0.0f)) & (s.value.pdf[0] > F(0.0f));
        const F inv_pdf = F(1.0f) / max(s.value.pdf[0], F(1e-30f));
        S beta = h.beta * s.value.f * inv_pdf;
        F ratios{float(Wavelengths)}, next_ratios{float(Wavelengths)};
        S ratio(F(1.0f));
        if (m_scene.keeps_ratios) {
            ratios = sum_of_ratios(m_scene, m_paths, h.slot);
            next_ratios = F(0.0f);
            for (int k = 0; k < Wavelengths; k++) {
                ratio[k] = gather(m_paths.ratio[k], h.slot) * (s.value.pdf[k] * inv_pdf);
                next_ratios += ratio[k];
            }
        }
        const F mis = select(s.delta, F(0.0f), ratios * inv_pdf);
        // Roulette on what the path can still bring, relative to its start.
        if (m_bounce >= m_scene.roulette_depth) {
            const F keep = min(bsdf::max_component(beta) * F(float(Wavelengths)) / next_ratios, F(0.95f));
            m &= u_roulette < keep;
            beta = beta * (F(1.0f) / max(keep, F(1e-6f)));
        }
        m &= !(bsdf::mean(beta) <= F(0.0f));
        const uint32_t bits = m.bits();
        if (!bits)
            return;
        const V o = h.offset(wi);
        const M through = s.wi.z < F(0.0f);
        I interior = select(through, select(h.outside, h.shape.interior, I(-1)),
                            bitcast_int(h.ray[PathState::Interior]));
        if (m_scene.media) {
            const auto media = MediaStack<W>::select_of(through, crossing.after, crossing.before);
            interior = media.at[0];
            const I events = gather(m_paths.events, h.slot) & I(Events::Camera - 1);
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
                                            chances.of(m_scene.emitter_choice),
                                            chances.of(m_scene.map_choice),
                                            bitcast_float(interior)};
        const int at = m_next_count;
        if (m_scene.keeps_ratios)
            for (int k = 0; k < Wavelengths; k++)
                compress_store(m_next.ratio[k] + at, ratio[k], bits);
        if (m_scene.keeps_normals)
            for (int c = 0; c < 3; c++)
                compress_store(m_next.ask_n[c] + at, receiver.N[c], bits);
        if (m_scene.linked)
            compress_store(reinterpret_cast<float*>(m_next.ask_set) + at, bitcast_float(receiver.set), bits);
        m_next_count += compress_rows(m_next.row[at], row, bits);
    }

    // A sample that comes to NaN is made NaN as a whole, which the film counts, locates and drops.
    void count_broken(const Hit& h, M m, F number) {
        m &= number != number;
        if (any(m))
            add_radiance(m_batch, h.path, S(F(std::numeric_limits<float>::quiet_NaN())), m);
    }

    void record_first_hit(const Hit& h, M m, const bsdf::MaterialCode& code) {
        const V n = select(h.outside, h.N, -h.N);
        const F zero(0.0f), one(1.0f);
        const Row<W, 12> row{n.x, n.y, n.z,  h.t, h.P.x, h.P.y, h.P.z, bitcast_float(h.shape.object_id),
                             one, one, zero, zero}; // from BatchState::Normal on
        store_rows(m_batch.first[0] + BatchState::Normal, h.path << 4, row, m);
        for (const bsdf::MaterialCode::Aov& aov : code.aovs)
            for (int c = 0; c < aov.components; c++)
                scatter(m_batch.aovs.data() + size_t(aov.channel + c) * BatchPadded, h.path,
                        h.fetch.exact(aov.places[c]), m);
    }
    void record_albedo(const Hit& h, M m, const S& albedo) {
        store_rows(m_batch.first[0] + BatchState::Albedo, h.path << 4,
                   Row<W, 4>{albedo[0], albedo[1], albedo[2], albedo[3]}, m);
    }

    const SceneView& m_scene;
    BatchState& m_batch;
    const PathState& m_paths;
    const HitState& m_hits;
    PathState& m_next;
    ShadowState& m_shadows;
    int m_bounce;
    uint32_t m_reversed;
    int m_next_count = 0, m_shadow_count = 0;
};

} // namespace kanuka::transport
