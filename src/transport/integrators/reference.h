// The plain estimator that others are tested against: one wavelength a path, independent random numbers,
// directions spread evenly over the sphere, no choice of lights, no balance of techniques, no roulette. What
// no such direction finds, smooth lobes and lights without extent, is taken one by one. Correct and very
// noisy.
#pragma once

#include "transport/tracer.h"

namespace kanuka::transport::reference {

inline constexpr IntegratorInfo info{"what path must agree with: plain, unbiased, noisy; runs on one lane"};

// A counter, hashed.
class Random {
  public:
    Random(int32_t pixel, uint32_t progression, int stream)
        : m_key(hash_bits(uint32_t(pixel) ^
                          hash_bits(progression ^ hash_bits(uint32_t(stream) + 0x51ed270bu)))) {}
    Float<1> operator()() {
        m_count += 0x9e3779b9u;
        return Float<1>(float(hash_bits(m_key ^ hash_bits(m_count)) >> 8) * 0x1p-24f);
    }

  private:
    static uint32_t hash_bits(uint32_t x) { return uint32_t(kanuka::hash_bits(Int<1>(int(x)))[0]); }
    uint32_t m_key, m_count = 0;
};

template <int W>
struct Integrator {
    static_assert(W == 1);
    using F = Float<1>;
    using S = Spectrum<1>;
    using V = Vec3<F>;

    explicit Integrator(const IntegratorValues&) {}

    void trace(Tracer<1>& tracer) const {
        one_wavelength_each(tracer);
        while (tracer.count() > 0 && tracer.bounce() <= tracer.scene.last_step()) {
            tracer.intersect();
            tracer.apply_air();
            tracer.surfaces(
                [&](SurfaceStage<1>& stage, const bsdf::MaterialCode& code, Int<1> slot, Mask<1> active) {
                    SurfaceHit<1> hit(stage.at(), code, slot);
                    stage.arrive(hit, active);
                    const Mask<1> through = stage.goes_through(hit, active);
                    if (!stage.scatters(code) || !any(active | through))
                        return;
                    const Scattering<1> s(stage.at(), hit);
                    stage.record_albedo(s, active);
                    Random random(bitcast_int(hit.ray[PathQueue::PixelHash])[0], tracer.request().progression,
                                  tracer.bounce());
                    for (size_t k = 0; k < stage.at().scene.lights.analytic.size() && any(active); k++)
                        add_light(stage, s, int(k), random);
                    go_on(stage, s, random, active, through);
                });
        }
    }

  private:
    // Wavelengths even over their range, in place of those that were generated; all four of a path the same.
    static void one_wavelength_each(Tracer<1>& tracer) {
        const BatchRequest& r = tracer.request();
        const int width = r.x1 - r.x0;
        for (int i = 0; i < width * (r.y1 - r.y0); i++) {
            const Int<1> pixel =
                pixel_seed(Int<1>(r.x0 + i % width), Int<1>(r.y0 + i / width), tracer.scene.settings.seed);
            Random random(pixel[0], r.progression, -1);
            const float l = random()[0];
            for (int k = 0; k < Wavelengths; k++) {
                tracer.batch().l[i][k] = l;
                tracer.batch().inv_pdf[k][i] = 1;
            }
        }
    }

    // Lights that rays do not hit.
    static void add_light(SurfaceStage<1>& stage, const Scattering<1>& s, int index, Random& random) {
        using A = AnalyticLight;
        const SceneView& scene = stage.at().scene;
        const A& light = scene.lights.analytic[size_t(index)];
        const bool hittable = light.shape >= A::Quad || (light.shape == A::Distant && light.cone > 0);
        if (hittable && light.passes == 0)
            return;
        LightSample<1> sample{{F(0.0f), F(0.0f), F(1.0f)},
                              F(1e30f),
                              S(F(0.0f)),
                              F(1.0f),
                              Mask<1>(false),
                              Mask<1>(true),
                              Int<1>(0),
                              Int<1>(index)};
        const F u0 = random(), u1 = random();
        sample_analytic(scene, light.shape, Int<1>(index), s.receiver.P, s.receiver.set, u0, u1, sample,
                        s.h.l, Mask<1>(true), F(1.0f));
        const S value = s.eval(s.h.to_local(sample.wi), dot(sample.wi, s.h.horizon), sample.valid).f;
        const S contribution = s.h.throughput * value * sample.radiance *
                               (stage.weight(s.h) / max(sample.pdf_solid_angle, F(1e-30f)));
        stage.cast_to_light(s, sample, value, contribution, sample.valid);
    }

    // Half of the paths take a smooth lobe, if the material's own choice is one, and else end; half go
    // anywhere.
    static void go_on(SurfaceStage<1>& stage, const Scattering<1>& s, Random& random, Mask<1> active,
                      Mask<1> through) {
        const SurfaceHit<1>& h = s.h;
        const F u_lobe = random(), u0 = random(), u1 = random();
        S ratio(F(1.0f));
        if (stage.at().scene.settings.keeps_ratios)
            for (int k = 0; k < Wavelengths; k++)
                ratio[k] = gather(stage.at().paths.ratio[k], h.slot);
        if (random()[0] < 0.5f) {
            const DirectionSample<1> sample = s.sample(u_lobe, u0, u1, Mask<1>(true));
            const Mask<1> straight = s.material.goes_straight(sample);
            stage.go_straight(s, nullptr, F(0.5f), straight & (active | through));
            const V wi = normalize(h.to_world(sample.wi));
            const F pdf = max(sample.value.pdf[0], F(1e-30f));
            for (int k = 0; k < Wavelengths; k++)
                ratio[k] *= sample.value.pdf[k] / pdf;
            stage.leave(s, wi, sample.through, h.throughput * sample.value.f * (F(2.0f) / pdf), ratio,
                        F(0.0f),
                        active & sample.valid & sample.delta & !straight & (sample.value.pdf[0] > F(0.0f)));
            return;
        }
        F sine, cosine;
        sincos_2pi(u0, sine, cosine);
        const F z = fma(F(-2.0f), u1, F(1.0f)), r = sqrt(max(F(1.0f) - z * z, F(0.0f)));
        const V local(r * cosine, r * sine, z), wi = normalize(h.to_world(local));
        const F above = dot(wi, h.horizon);
        const S throughput = h.throughput * s.eval(local, above, Mask<1>(true)).f * F(2 * 4 * Pi);
        // Nothing else finds what this direction finds; but it is no smooth lobe, and lights that are only
        // sampled, by add_light(), must not be hit as well.
        const F alone(1e-30f);
        stage.leave(s, wi, above < F(0.0f), throughput, ratio, alone,
                    active & (bsdf::max_component(throughput) > F(0.0f)));
    }
};

} // namespace kanuka::transport::reference
