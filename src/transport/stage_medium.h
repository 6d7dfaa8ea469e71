// Medium: where paths collide before any surface, a light is sampled and the phase function says where
// they go on.
#pragma once

#include <algorithm>
#include <optional>

#include "transport/play_roulette.h"
#include "transport/stage_intersect.h"
#include "transport/surface_hit.h"

namespace kanuka::transport {

// Does a ray along d hit its shape from outside? As SurfaceStage has it, for lanes of any program.
template <int W>
Mask<W> hits_outside(const SceneView& scene, const bvh::HitPacket<W>& hit, const Vec3<Float<W>>& d,
                     Mask<W> m) {
    using F = Float<W>;
    using I = Int<W>;
    using V = Vec3<F>;
    using R = store::ShapeRecord;
    const I index = select(m, hit.shape, I(0));
    const ShapeLanes<W> shape(scene.geometry.shapes, index);
    const I program = gather(scene.geometry.shapes + offsetof(R, program) / 4, index * I(store::ShapeWords));
    const Mask<W> has_normal = m & shape.has(R::HasNormals);
    V out = select(shape.has(R::Flips), -hit.Ng, hit.Ng);
    for (Mask<W> left = has_normal; any(left);) {
        const int first = __builtin_ctz(left.bits()), one = program[first];
        const Mask<W> here = left & (program == I(one));
        // Records of other programs are laid out otherwise: their lanes read the first one's.
        const ShapeLanes<W> alike(scene.geometry.shapes, select(here, index, I(index[first])));
        const bsdf::MaterialCode& code = scene.geometry.materials[size_t(one)];
        const HitPlace<W> place(code.page_words, alike, select(here, hit.prim, I(hit.prim[first])), hit.u,
                                hit.v);
        const InputFetch<W> fetch(scene, code, alike, place, nullptr);
        const Mask<W> against = dot(hit.Ng, fetch.normal(alike)) < F(0.0f);
        out = select(here, select(against, -hit.Ng, hit.Ng), out);
        left &= !here;
    }
    const Mask<W> inside = m & (hit.instanced != I(0));
    if (scene.geometry.instanced && any(inside)) {
        F t[12];
        for (int k = 0; k < 12; k++)
            t[k] = F::load(hit.world_from_shape[k]);
        out = select(inside, turn_normal(t, out), out);
    }
    return dot(d, out) < F(0.0f);
}

template <int W>
class MediumStage {
    using F = Float<W>;
    using I = Int<W>;
    using V = Vec3<F>;
    using M = Mask<W>;
    using S = Spectrum<W>;

  public:
    MediumStage(const Bounce& at, PathQueue& next, RayQueue& shadow_rays)
        : m_scene(at.scene), m_batch(at.batch), m_paths(at.paths), m_hits(at.hits), m_next(next),
          m_shadow_rays(shadow_rays), m_bounce(at.number) {}

    // All that scattered, medium by medium, in the order of their slots.
    void run(const ProgramRuns& runs) {
        int32_t order[BatchPadded];
        int scattered = 0;
        for (int i = 0; i < m_paths.count; i++)
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
    struct FogSample {
        FogLamps<W> lamps;
        F t, ratios;
        FogSample(const FogLamps<W>& lamps, F t, F ratios) : lamps(lamps), t(t), ratios(ratios) {}
    };

    int32_t interior_of(int slot) const {
        int32_t k;
        std::memcpy(&k, m_paths.row[slot] + PathQueue::Interior, sizeof k);
        return k;
    }

    void scatter_at(const int32_t* order, int count, int interior) {
        const M active = I::lane_index() < I(count);
        I slot;
        for (int i = 0; i < W; i++)
            slot.v[i] = order[i < count ? i : 0];
        const auto ray = load_rows<PathQueue::Fields>(m_paths.row, slot << 4);
        const I path = bitcast_int(ray[PathQueue::Path]);
        const auto l = load_rows<4>(m_batch.l, path << 2);
        const I events = gather(m_paths.events, slot);
        const M seen = active & ((events & I(Events::Camera)) != I(0));
        if (any(seen))
            scatter(m_batch.first[0] + BatchState::Alpha, path << 4, F(1.0f), seen);
        PathWeights<W> weights{spectrum_of(ray, PathQueue::Throughput), ratios_of(m_scene, m_paths, slot),
                               F(0.0f)};
        const MediumLanes<W> medium(m_scene, I(interior), l.data());
        const V d = vector_of(ray, PathQueue::Direction), o = vector_of(ray, PathQueue::Origin);
        const F t = gather(m_hits.row[0] + HitState::T, slot << 3);
        std::optional<FogSample> fog;
        if (!m_scene.lights.fog_lamps.empty() && any(medium.field < I(0))) {
            // sample_fog_lamps() might have found the lamp from here: its density over that of the free path.
            const F start = gather(m_paths.start, slot);
            F ratios(0.0f);
            for (int k = 0; k < Wavelengths; k++)
                ratios += weights.ratio[k] * exp(min(medium.extinction(k) * (t - start), F(30.0f)));
            fog.emplace(FogLamps<W>(m_scene, o, d, start, gather(m_paths.surface, slot), I(1)), t,
                        min(ratios / max(medium.extinction(0), F(1e-30f)), F(1e30f)));
        }
        weights.scatter(medium, active);
        const V P = o + d * t;
        const MediaStack<W> media = MediaStack<W>::load(m_paths, I(interior), slot);
        const bsdf::Phase<W> phase = phase_of<W>(m_scene, interior);
        const Sampler<W> sampler{bitcast_int(ray[PathQueue::PixelHash]), m_batch.reversed_progression};
        Receiver<W> receiver{P, V(F(0.0f), F(0.0f), F(0.0f)), M(false)};
        const LightChooser<W> chooser(m_scene, receiver);

        const M going = active & (Events::inside(events) < I(m_scene.settings.volume_depth));
        sample_lights(ray, l.data(), sampler, receiver, chooser, weights, phase, d, media,
                      fog ? &*fog : nullptr, going);

        F u_part, u0, u1;
        sampler.sample_3d(bounce_net(m_bounce, Net::Scatter), u0, u1, u_part);
        const V wi = normalize(bsdf::sample_phase(phase, d, u_part, u0, u1));
        const F density = max(bsdf::eval_phase(phase, dot(d, wi)), F(1e-20f));
        M m = going;
        S throughput = weights.throughput;
        Roulette<W>(m_scene.settings, sampler, m_bounce, true).play(throughput, weights.ratios(), m);
        m &= !(bsdf::mean(throughput) <= F(0.0f));
        const uint32_t bits = m.bits();
        if (!bits)
            return;
        auto row = ray;
        for (size_t c = 0; c < 3; c++)
            row[PathQueue::Origin + c] = P[int(c)], row[PathQueue::Direction + c] = wi[int(c)];
        for (size_t k = 0; k < Wavelengths; k++)
            row[PathQueue::Throughput + k] = throughput[int(k)];
        row[PathQueue::Mis] = weights.ratios() / density;
        row[PathQueue::PdfEmitterChoice] = chooser.pdf(m_scene.lights.emitter_choice);
        row[PathQueue::PdfMapChoice] = chooser.pdf(m_scene.lights.map_choice);
        const V nowhere(F(0.0f), F(0.0f), F(0.0f));
        if (m_batch.asks_for_lobes())
            note_scattering(m_batch, path, ScatteringEvent<W>::of_volume(), bits);
        continue_paths(m_scene, m_next,
                       PathSegment<W>{row, weights.ratio, nowhere, receiver.set, media, F(0.0f),
                                      (events & I(Events::Camera - 1)) + I(Events::Inside)},
                       bits);
    }

    void sample_lights(const PathRow<W>& ray, const F* l, const Sampler<W>& sampler,
                       const Receiver<W>& receiver, const LightChooser<W>& chooser,
                       const PathWeights<W>& weights, const bsdf::Phase<W>& phase, const V& d,
                       const MediaStack<W>& media, const FogSample* fog, M active) {
        if (m_scene.lights.choices == 0 || !any(active))
            return;
        const LightNumbers<W> u(m_scene, sampler, m_bounce);
        for (int sample = 0; sample < m_scene.lights.samples; sample++)
            add_light(ray, receiver, sample_light(m_scene, chooser, receiver, sample, u, l, active), weights,
                      phase, d, media, fog, active);
    }
    void add_light(const PathRow<W>& ray, const Receiver<W>& receiver, const LightSample<W>& light,
                   const PathWeights<W>& weights, const bsdf::Phase<W>& phase, const V& d,
                   const MediaStack<W>& media, const FogSample* fog, M active) {
        const F density = bsdf::eval_phase(phase, dot(d, light.wi));
        MisShares<W> shares;
        const S by_directions = weights.ratio * select(light.delta, F(0.0f), density);
        F by_light = weights.ratios() * light.pdf_solid_angle;
        if (fog)
            by_light = fma(fog->lamps.density(light.light, fog->t), fog->ratios, by_light);
        F denominator = by_light;
        for (int k = 0; k < Wavelengths; k++)
            denominator += by_directions[k];
        const F weight = F(1.0f) / max(denominator, F(1e-30f));
        shares.light = by_light * weight;
        shares.direction = by_directions * weight;
        S contribution = weights.throughput * light.radiance * (density * weight);
        const M m = active & light.valid & !(bsdf::mean(contribution) <= F(0.0f));
        const uint32_t bits = m.bits();
        if (!bits)
            return;
        const I pixel = bitcast_int(ray[PathQueue::PixelHash]), path = bitcast_int(ray[PathQueue::Path]);
        if (m_batch.asks_for_lobes())
            note_rays(m_batch, m_shadow_rays, path, ScatteringEvent<W>::of_volume(), light.light,
                      contribution, bits);
        queue_rays(m_scene, m_shadow_rays,
                   ShadowRay<W>{receiver.P, light.wi, light.distance, contribution, path,
                                seed_of(seeds::ShadowRay, pixel, m_bounce, m_batch.reversed_progression),
                                light.passes, media, shares},
                   bits);
    }

    const SceneView& m_scene;
    BatchState& m_batch;
    const PathQueue& m_paths;
    const HitState& m_hits;
    PathQueue& m_next;
    RayQueue& m_shadow_rays;
    int m_bounce;
};

} // namespace kanuka::transport
