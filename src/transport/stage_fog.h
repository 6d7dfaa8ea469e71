// Lamps without size in fog that is the same everywhere: beside the free path, whose collisions sample light
// where the medium has them, a place on the segment is drawn by how much light falls there (Kulla and Fajardo
// 2012, Importance Sampling Techniques for Path Tracing in Participating Media, section 4.1). Both are
// balanced, over wavelengths too.
#pragma once

#include "transport/lights.h"
#include "transport/queues.h"

namespace kanuka::transport {

// A segment through fog, as lamps see it: from each, places are even in the angle they are seen under.
template <int W>
class FogLamps {
    using F = Float<W>;
    using I = Int<W>;
    using V = Vec3<F>;

  public:
    FogLamps(const SceneView& scene, const V& o, const V& d, F from, F to, I set)
        : m_scene(scene), m_from(from) {
        for (size_t k = 0; k < scene.lights.fog_lamps.size(); k++) {
            const AnalyticLight& light = scene.lights.analytic[size_t(scene.lights.fog_lamps[k])];
            const V at = V(F(light.position.x), F(light.position.y), F(light.position.z)) - o;
            Lamp& lamp = m_lamps[k];
            lamp.along = dot(at, d);
            const V off = at - d * lamp.along;
            // A lamp on the ray is seen under all angles at once: as if it lay beside it by what floats tell
            // apart.
            lamp.off = max(sqrt(dot(off, off)), max(abs(lamp.along), F(1e-6f)) * F(1e-6f));
            lamp.first = turn(from - lamp.along, lamp.off);
            lamp.angle = max(turn(to - lamp.along, lamp.off) - lamp.first, F(0.0f));
            lamp.share =
                lamp.angle / lamp.off * F(scene.lights.bounds[size_t(scene.lights.fog_lamps[k])].power);
            if (scene.lights.linked)
                lamp.share = select((set & I(light.sets)) != I(0), lamp.share, F(0.0f));
            m_total += lamp.share;
        }
    }
    Mask<W> some() const { return (m_total > F(0.0f)) & is_finite(m_total); }

    // A lamp, and a distance along the ray; u is used for both.
    void sample(F u, I& lamp, F& t) const {
        F target = u * m_total, before(0.0f), within(0.0f);
        lamp = I(0);
        t = m_from;
        Mask<W> open(true);
        for (size_t k = 0; k < m_scene.lights.fog_lamps.size(); k++) {
            const Lamp& l = m_lamps[k];
            const F up_to = before + l.share;
            const Mask<W> here = open & (l.share > F(0.0f)) & ((target < up_to) | (up_to >= m_total));
            if (any(here)) {
                within = clamp((target - before) / max(l.share, F(1e-37f)), F(0.0f), F(0.9999999f));
                F s, c;
                const F at = fma(within, l.angle, l.first);
                sincos_2pi(at - floor(at), s, c);
                lamp = select(here, I(int(k)), lamp);
                t = select(here, max(fma(l.off, s / max(c, F(1e-7f)), l.along), m_from), t);
            }
            open &= !here;
            before = up_to;
        }
    }
    // Density over distance with which a lamp's share of samples falls to t; 0 for lights that are no such
    // lamps.
    F density(I light, F t) const {
        F density(0.0f);
        for (size_t k = 0; k < m_scene.lights.fog_lamps.size(); k++) {
            const Lamp& l = m_lamps[k];
            const F x = t - l.along;
            const F of_angle = l.off / max(fma(x, x, l.off * l.off) * l.angle * F(2 * Pi), F(1e-37f));
            density = select((light == I(m_scene.lights.fog_lamps[k])) & (l.angle > F(0.0f)),
                             of_angle * l.share / max(m_total, F(1e-37f)), density);
        }
        return density;
    }

  private:
    struct Lamp {
        F along, off, first, angle, share; // angles in turns
    };
    static F turn(F along, F off) {
        const F a = turn_of(along, off);
        return select(a > F(0.5f), a - F(1.0f), a);
    }

    const SceneView& m_scene;
    F m_from, m_total{0.0f};
    Lamp m_lamps[LightsView::MostFogLamps];
};

// In fog, paths sample a lamp from somewhere before the next surface, far or not.
template <int W>
[[gnu::noinline]] void sample_fog_lamps(const SceneView& scene, BatchState& batch, const PathQueue& paths,
                                        Int<W> slot, Float<W> surface, int bounce, RayQueue& rays,
                                        Mask<W> m) {
    using F = Float<W>;
    using I = Int<W>;
    using V = Vec3<F>;
    const auto ray = load_rows<PathQueue::Fields>(paths.row, slot << 4);
    const I interior = bitcast_int(ray[PathQueue::Interior]), path = bitcast_int(ray[PathQueue::Path]);
    const auto l = load_rows<4>(batch.l, path << 2);
    const MediumLanes<W> medium(scene, interior, l.data());
    const F start = gather(paths.start, slot);
    m &= medium.scatters & (medium.field < I(0)) & (start < surface);
    m &= Events::inside(gather(paths.events, slot)) < I(scene.settings.volume_depth);
    if (!any(m))
        return;
    const V o = vector_of(ray, PathQueue::Origin), d = vector_of(ray, PathQueue::Direction);
    const Receiver<W> nowhere{o, V(F(0.0f), F(0.0f), F(0.0f)), Mask<W>(false)};
    const FogLamps<W> lamps(scene, o, d, start, surface, nowhere.set);
    m &= lamps.some();
    const Sampler<W> sampler{bitcast_int(ray[PathQueue::PixelHash]), batch.reversed_progression};
    F unused, u, t;
    sampler.sample_2d(medium_net(bounce), unused, u);
    I lamp;
    lamps.sample(u, lamp, t);
    t = min(t, surface);
    const I light = gather(scene.lights.fog_lamps.data(), lamp);
    Receiver<W> receiver = nowhere;
    receiver.P = o + d * t;
    LightSample<W> s;
    s.wi = {F(0.0f), F(0.0f), F(1.0f)};
    s.distance = F(1e30f);
    s.radiance = Spectrum<W>(F(0.0f));
    s.pdf_solid_angle = F(1.0f);
    s.delta = Mask<W>(false);
    s.valid = m;
    s.passes = I(0);
    s.light = light;
    const F zero(0.0f);
    sample_analytic(scene, AnalyticLight::Delta, light, receiver.P, receiver.set, zero, zero, s, l.data(), m,
                    F(1.0f));
    const F by_collisions = LightChooser<W>(scene, receiver).pdf(light + I(scene.lights.first_light_choice));
    const F by_angle = lamps.density(light, t), distance = t - start;
    const Spectrum<W> ratio = ratios_of(scene, paths, slot);
    F denominator(0.0f);
    Spectrum<W> left;
    for (int k = 0; k < Wavelengths; k++) {
        const F sigma = medium.extinction(k);
        left[k] = exp(-(sigma * distance));
        denominator += ratio[k] * fma(sigma * left[k], by_collisions, by_angle);
    }
    const F scattered = phase_between(scene, interior, dot(d, s.wi), m);
    Spectrum<W> contribution = spectrum_of(ray, PathQueue::Throughput) * left * medium.scattering *
                               s.radiance * (scattered / max(denominator, F(1e-30f)));
    m &= s.valid & !(bsdf::mean(contribution) <= zero);
    const uint32_t bits = m.bits();
    if (!bits)
        return;
    const I seed = seed_of(seeds::FogShadowRay, bitcast_int(ray[PathQueue::PixelHash]), bounce,
                           batch.reversed_progression);
    if (batch.asks_for_lobes())
        note_rays(batch, rays, path, ScatteringEvent<W>::of_volume(), light, contribution, bits);
    queue_rays(scene, rays,
               ShadowRay<W>{receiver.P,
                            s.wi,
                            s.distance,
                            contribution,
                            path,
                            seed,
                            s.passes,
                            MediaStack<W>::load(paths, interior, slot),
                            {}},
               bits);
}

} // namespace kanuka::transport
