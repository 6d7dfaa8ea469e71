// Medium: where paths met a particle before any surface, a light is asked and the phase function says where
// they go on. Occlude with media: shadow rays that pass what light passes as it comes, and lose light to what
// they are in.
#pragma once

#include <algorithm>
#include <optional>

#include "transport/fetch.h"
#include "transport/stage_intersect.h"
#include "transport/stage_walls.h"

namespace kanuka::transport {

// The part of a path's state that only scenes with media have, for a path that goes on.
template <int W>
void store_media(PathState& next, int at, const MediaStack<W>& media, Float<W> start, Int<W> events,
                 uint32_t bits) {
    media.store(next, at, bits);
    compress_store(next.start + at, start, bits);
    compress_store(reinterpret_cast<float*>(next.events) + at, bitcast_float(events), bits);
}

// Does a ray along d meet its shape from outside? As SurfaceStage has it, for lanes of any program.
template <int W>
Mask<W> meets_outside(const SceneView& scene, const bvh::HitPacket<W>& hit, const Vec3<Float<W>>& d,
                      Mask<W> m) {
    using F = Float<W>;
    using I = Int<W>;
    using V = Vec3<F>;
    using R = store::ShapeRecord;
    const I index = select(m, hit.shape, I(0));
    const ShapeLanes<W> shape(scene.shapes, index);
    const I program = gather(scene.shapes + offsetof(R, program) / 4, index * I(store::ShapeWords));
    const Mask<W> has_normal = m & shape.has(R::HasNormals);
    V out = select(shape.has(R::Flips), -hit.Ng, hit.Ng);
    for (Mask<W> left = has_normal; any(left);) {
        const int first = __builtin_ctz(left.bits()), one = program[first];
        const Mask<W> here = left & (program == I(one));
        // Records of other programs are laid out otherwise: their lanes read the first one's.
        const ShapeLanes<W> alike(scene.shapes, select(here, index, I(index[first])));
        const HitPlace<W> place(scene, alike, select(here, hit.prim, I(hit.prim[first])), hit.u, hit.v);
        const InputFetch<W> fetch(scene, scene.materials[size_t(one)], alike, place, nullptr);
        const Mask<W> against = dot(hit.Ng, fetch.normal(alike)) < F(0.0f);
        out = select(here, select(against, -hit.Ng, hit.Ng), out);
        left &= !here;
    }
    const Mask<W> inside = m & (hit.instanced != I(0));
    if (scene.instanced && any(inside)) {
        F t[12];
        for (int k = 0; k < 12; k++)
            t[k] = F::load(hit.world_from_shape[k]);
        out = select(inside, turn_normal(t, out), out);
    }
    return dot(d, out) < F(0.0f);
}

// ---- scattering

template <int W>
class MediumStage {
    using F = Float<W>;
    using I = Int<W>;
    using V = Vec3<F>;
    using M = Mask<W>;
    using S = Spectrum<W>;

  public:
    MediumStage(const Bounce& at, PathState& next, ShadowState& shadows, int next_count, int shadow_count)
        : m_scene(at.scene), m_batch(at.batch), m_paths(at.paths), m_hits(at.hits), m_next(next),
          m_shadows(shadows), m_bounce(at.number), m_next_count(next_count), m_shadow_count(shadow_count) {}

    int next_count() const { return m_next_count; }
    int shadow_count() const { return m_shadow_count; }

    // All that scattered, medium by medium, in the order of their slots.
    void run(const ProgramRuns& runs, int count) {
        int32_t order[BatchPadded];
        int scattered = 0;
        for (int i = 0; i < count; i++)
            if (runs.program[size_t(i)] == ProgramRuns::Scattered)
                order[scattered++] = i;
        std::sort(order, order + scattered, [&](int32_t a, int32_t b) {
            const int32_t in_a = interior_of(a), in_b = interior_of(b);
            return in_a != in_b ? in_a < in_b : a < b;
        });
        for (int first = 0, end; first < scattered; first = end) {
            const int32_t interior = interior_of(order[first]);
            for (end = first + 1; end < scattered && end < first + W && interior_of(order[end]) == interior;)
                end++;
            scatter_at(order + first, end - first, interior);
        }
    }

  private:
    struct OnTheWay {
        FogLamps<W> lamps;
        F t, ratios;
        OnTheWay(const FogLamps<W>& lamps, F t, F ratios) : lamps(lamps), t(t), ratios(ratios) {}
    };

    int32_t interior_of(int slot) const {
        int32_t k;
        std::memcpy(&k, m_paths.row[slot] + PathState::Interior, sizeof k);
        return k;
    }

    void scatter_at(const int32_t* order, int count, int interior) {
        const M active = I::lane_index() < I(count);
        I slot;
        for (int i = 0; i < W; i++)
            slot.v[i] = order[i < count ? i : 0];
        const auto ray = load_rows<PathState::Fields>(m_paths.row, slot << 4);
        const I path = bitcast_int(ray[PathState::Path]);
        const auto l = load_rows<4>(m_batch.l, path << 2);
        const I events = gather(m_paths.events, slot);
        const M seen = active & ((events & I(Events::Camera)) != I(0));
        if (any(seen))
            scatter(m_batch.first[0] + BatchState::Alpha, path << 4, F(1.0f), seen);
        Carried<W> carried{spectrum_of(ray, PathState::Beta), ratios_of(m_scene, m_paths, slot), F(0.0f)};
        const MediumLanes<W> medium(m_scene, I(interior), l.data());
        const V d = vector_of(ray, PathState::Direction), o = vector_of(ray, PathState::Origin);
        const F t = gather(m_hits.row[0] + HitState::T, slot << 3);
        std::optional<OnTheWay> fog;
        if (!m_scene.fog_lamps.empty() && any(medium.field < I(0))) {
            // ask_in_fog() might have found the lamp from here: its density over that of the free path.
            const F start = gather(m_paths.start, slot);
            F ratios(0.0f);
            for (int k = 0; k < Wavelengths; k++)
                ratios += carried.ratio[k] * exp(min(medium.extinction(k) * (t - start), F(30.0f)));
            fog.emplace(FogLamps<W>(m_scene, o, d, start, gather(m_paths.sight, slot), I(1)), t,
                        min(ratios / max(medium.extinction(0), F(1e-30f)), F(1e30f)));
        }
        carried.scatter(medium, active);
        const V P = o + d * t;
        const MediaStack<W> media = MediaStack<W>::load(m_paths, I(interior), slot);
        const bsdf::Phase<W> phase = phase_of<W>(m_scene, interior);
        const Sampler<W> sampler{bitcast_int(ray[PathState::PixelHash]), m_batch.reversed_progression};
        Receiver<W> receiver{P, V(F(0.0f), F(0.0f), F(0.0f)), M(false)};
        const LightChances<W> chances(m_scene, receiver);

        const M going = active & (Events::inside(events) < I(m_scene.volume_depth));
        ask_light(ray, l.data(), sampler, receiver, chances, carried, phase, d, media, fog ? &*fog : nullptr,
                  going);

        F u_part, u0, u1;
        sampler.sample_3d(bounce_net(m_bounce, Net::Scatter), u0, u1, u_part);
        const F u_roulette = sampler.sample_1d(bounce_net(m_bounce, Net::Roulette));
        const V wi = normalize(bsdf::sample_phase(phase, d, u_part, u0, u1));
        const F density = max(bsdf::eval_phase(phase, dot(d, wi)), F(1e-20f));
        M m = going;
        S beta = carried.beta;
        if (m_bounce >= m_scene.roulette_depth) { // no upper bound as at surfaces: clouds take long
            const F keep = bsdf::max_component(beta) * F(float(Wavelengths)) / carried.ratios();
            m &= u_roulette < keep;
            beta = beta * (F(1.0f) / clamp(keep, F(1e-6f), F(1.0f)));
        }
        m &= !(bsdf::mean(beta) <= F(0.0f));
        const uint32_t bits = m.bits();
        if (!bits)
            return;
        auto row = ray;
        for (size_t c = 0; c < 3; c++)
            row[PathState::Origin + c] = P[int(c)], row[PathState::Direction + c] = wi[int(c)];
        for (size_t k = 0; k < Wavelengths; k++)
            row[PathState::Beta + k] = beta[int(k)];
        row[PathState::Mis] = carried.ratios() / density;
        row[PathState::AskEmitters] = chances.of(m_scene.emitter_choice);
        row[PathState::AskMap] = chances.of(m_scene.map_choice);
        const int at = m_next_count;
        for (int k = 0; k < Wavelengths; k++)
            compress_store(m_next.ratio[k] + at, carried.ratio[k], bits);
        if (m_scene.keeps_normals)
            for (int c = 0; c < 3; c++)
                compress_store(m_next.ask_n[c] + at, F(0.0f), bits);
        if (m_scene.linked)
            compress_store(reinterpret_cast<float*>(m_next.ask_set) + at, bitcast_float(receiver.set), bits);
        store_media(m_next, at, media, F(0.0f), (events & I(Events::Camera - 1)) + I(Events::Inside), bits);
        m_next_count += compress_rows(m_next.row[at], row, bits);
    }

    void ask_light(const PathRow<W>& ray, const F* l, const Sampler<W>& sampler, const Receiver<W>& receiver,
                   const LightChances<W>& chances, const Carried<W>& carried, const bsdf::Phase<W>& phase,
                   const V& d, const MediaStack<W>& media, const OnTheWay* fog, M active) {
        if (m_scene.choices == 0 || !any(active))
            return;
        const LightNumbers<W> u(m_scene, sampler, m_bounce);
        for (int ask = 0; ask < m_scene.asks; ask++)
            add_light(ray, receiver, sample_light(m_scene, chances, receiver, ask, u, l, active), carried,
                      phase, d, media, fog, active);
    }
    void add_light(const PathRow<W>& ray, const Receiver<W>& receiver, const LightSample<W>& light,
                   const Carried<W>& carried, const bsdf::Phase<W>& phase, const V& d,
                   const MediaStack<W>& media, const OnTheWay* fog, M active) {
        const F density = bsdf::eval_phase(phase, dot(d, light.wi));
        ShadowBalance<W> balance;
        const S by_directions = carried.ratio * select(light.delta, F(0.0f), density);
        F asked = carried.ratios() * light.pdf;
        if (fog)
            asked = fma(fog->lamps.density(light.light, fog->t), fog->ratios, asked);
        F denominator = asked;
        for (int k = 0; k < Wavelengths; k++)
            denominator += by_directions[k];
        const F weight = F(1.0f) / max(denominator, F(1e-30f));
        balance.asked = asked * weight;
        balance.found = by_directions * weight;
        const S contribution = carried.beta * light.radiance * (density * weight);
        const M m = active & light.valid & !(bsdf::mean(contribution) <= F(0.0f));
        const uint32_t bits = m.bits();
        if (!bits)
            return;
        const int at = m_shadow_count;
        for (int c = 0; c < 3; c++) {
            compress_store(m_shadows.o[c] + at, receiver.P[c], bits);
            compress_store(m_shadows.d[c] + at, light.wi[c], bits);
        }
        for (int k = 0; k < Wavelengths; k++)
            compress_store(m_shadows.contribution[k] + at, contribution[k], bits);
        compress_store(m_shadows.t_max + at, light.distance, bits);
        if (m_scene.shadow_linked)
            compress_store(reinterpret_cast<float*>(m_shadows.passes) + at, bitcast_float(light.passes),
                           bits);
        compress_store(reinterpret_cast<float*>(m_shadows.path) + at, ray[PathState::Path], bits);
        const I seed = way_seed(bitcast_int(ray[PathState::PixelHash]) ^
                                    I(int(uint32_t(m_bounce) * 0x3c6ef372u + 0x1b873593u)),
                                m_batch.reversed_progression);
        balance.store(m_shadows, at, media, bits);
        m_shadow_count +=
            compress_store(reinterpret_cast<float*>(m_shadows.seed) + at, bitcast_float(seed), bits);
    }

    const SceneView& m_scene;
    BatchState& m_batch;
    const PathState& m_paths;
    const HitState& m_hits;
    PathState& m_next;
    ShadowState& m_shadows;
    int m_bounce;
    int m_next_count, m_shadow_count;
};

// ---- shadow rays

// Boundaries without lobes and those within media of higher priority stop no light; nor do shapes that the
// light is linked to shine through. Smooth thin walls let their part through.
inline constexpr int MostCrossings = 64;

template <int W>
void occlude_in_media(const SceneView& scene, BatchState& batch, const ShadowState& shadows, int count,
                      WallScratch* walls) {
    using F = Float<W>;
    using I = Int<W>;
    using M = Mask<W>;
    using R = store::ShapeRecord;
    bvh::HitPacket<W> hit;
    for (int first = 0; first < count; first += W) {
        bvh::RayPacket<W> rays;
        for (int c = 0; c < 3; c++) {
            rays.o[c] = F::load(shadows.o[c] + first);
            rays.d[c] = F::load(shadows.d[c] + first);
        }
        const M active = I::lane_index() + I(first) < I(count);
        const F far = F::load(shadows.t_max + first);
        const I path = select(active, I::load(shadows.path + first), I(0));
        rays.t_max = far;
        rays.active = active;
        rays.seed = I::load(shadows.seed + first);
        if (scene.moving)
            rays.time = gather(batch.time, path);
        if (scene.fades)
            rays.level = gather(batch.level, path);
        const I passes = scene.shadow_linked ? I::load(shadows.passes + first) : I(0);
        MediaStack<W> media;
        for (int k = 0; k < MediaStack<W>::Most; k++)
            media.at[k] = select(active, I::load(shadows.media[k] + first), I(-1));
        const auto l = load_rows<4>(batch.l, path << 2);
        Spectrum<W> through(F(1.0f)), found;
        for (int k = 0; k < Wavelengths; k++)
            found[k] = F::load(shadows.found[k] + first);
        M lit(false);
        Passages<W> passages(rays);
        if (!scene.tinted)
            rays.passages = nullptr;
        if (!scene.clear_boundaries && !scene.thin_walls && !any(media.at[0] >= I(0))) {
            rays.passes = passes;
            lit = active & !scene.bvh->occluded(rays);
            if (scene.tinted)
                through = through * passages.before(scene, far, l.data());
        } else {
            for (int k = 0; k < MostCrossings && any(rays.active); k++) {
                passages.forget();
                scene.bvh->intersect(rays, hit);
                hit.hit &= rays.active;
                if (scene.tinted)
                    through = bsdf::select(
                        rays.active, through * passages.before(scene, select(hit.hit, hit.t, far), l.data()),
                        through);
                const F s = max(select(hit.hit, hit.t, far) - rays.t_min, F(0.0f));
                if (any(rays.active & (media.at[0] >= I(0)))) {
                    const MediumLanes<W> medium(scene, media.at[0], l.data());
                    const M varies = rays.active & (medium.field >= I(0));
                    Spectrum<W> left(F(1.0f));
                    if (any(varies))
                        left = through_particles(scene, medium, rays.o, rays.d, rays.t_min, rays.t_min + s,
                                                 way_seed(rays.seed ^ I(int(uint32_t(k) * 0xc2b2ae35u)),
                                                          batch.reversed_progression),
                                                 varies);
                    for (int i = 0; i < Wavelengths; i++) {
                        const F T = select(varies, left[i], exp(-(medium.extinction(i) * s)));
                        through[i] = select(rays.active, through[i] * T, through[i]);
                        // Directions find the light if no particle is met; those that are absorbed by what
                        // does not scatter get there, and bring less.
                        found[i] = select(rays.active & medium.scatters, found[i] * T, found[i]);
                    }
                }
                lit |= rays.active & !hit.hit;
                rays.active = hit.hit;
                if (!any(hit.hit))
                    break;
                const M outside = meets_outside(scene, hit, rays.d, hit.hit);
                const I record = select(hit.hit, hit.shape, I(0)) * I(store::ShapeWords);
                const Crossing<W> crossing(scene, media,
                                           gather(scene.shapes + offsetof(R, interior) / 4, record), outside);
                const I program = gather(scene.shapes + offsetof(R, program) / 4, record);
                const M clear = gather(scene.clear.data(), program) != I(0);
                M on = crossing.boundary &
                       (crossing.nothing |
                        (clear & (gather(scene.shapes + offsetof(R, emitter) / 4, record) < I(0))));
                const M wall = scene.thin_walls
                                   ? hit.hit & !on & (gather(scene.straight.data(), program) != I(0))
                                   : M(false);
                if (any(wall)) {
                    const WallPassage<W> passage =
                        pass_walls(scene, batch, *walls, rays, hit, media, path, program, wall);
                    on |= passage.passes;
                    for (int i = 0; i < Wavelengths; i++) {
                        through[i] = select(passage.passes, through[i] * passage.part[i], through[i]);
                        found[i] = select(passage.passes, found[i] * passage.chance[i], found[i]);
                    }
                }
                media = MediaStack<W>::select_of(hit.hit & on, crossing.after, media);
                if (scene.shadow_linked)
                    on |= (links_of(scene, select(hit.hit, hit.shape, I(0)), &store::Links::lets_through) &
                           passes) != I(0);
                rays.active &= on;
                rays.t_min = select(rays.active, beyond(rays.o, rays.d, hit.t), rays.t_min);
                // What is met just there has been met.
                lit |= rays.active & (rays.t_min >= far);
                rays.active &= rays.t_min < far;
            }
        }
        F denominator = F::load(shadows.asked + first);
        for (int k = 0; k < Wavelengths; k++)
            denominator += found[k];
        const F weight = F(1.0f) / max(denominator, F(1e-30f));
        Spectrum<W> contribution;
        for (int k = 0; k < Wavelengths; k++)
            contribution[k] = F::load(shadows.contribution[k] + first) * through[k] * weight;
        add_asked_radiance(scene, batch, path, contribution, lit);
    }
}

} // namespace kanuka::transport
