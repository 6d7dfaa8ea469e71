// Ambient occlusion: the share of the sky above a surface, weighted by the cosine, that nothing covers within
// a distance (Zhukov et al. 1998).
#pragma once

#include "transport/tracer.h"

namespace kanuka::transport::ao {

inline constexpr IntegratorInfo info{"how open surfaces lie to a white sky",
                                     {{{"distance", 1e30f, "what lies farther away covers nothing"}}}};

template <int W>
struct Integrator {
    explicit Integrator(const IntegratorValues& values) : m_distance(values[0]) {}

    void trace(Tracer<W>& tracer) const {
        using F = Float<W>;
        tracer.intersect();
        tracer.surfaces(
            [&](SurfaceStage<W>& stage, const bsdf::MaterialCode& code, Int<W> slots, Mask<W> active) {
                SurfaceHit<W> hit(stage.at(), code, slots);
                stage.record_first_hit(hit, active);
                const Scattering<W> s(stage.at(), hit);
                stage.record_albedo(s, active);
                F u0, u1;
                s.sampler.sample_2d(bounce_net(0, Net::Scatter), u0, u1);
                const Vec3<F> wi = hit.to_world(bsdf::sample_cosine(u0, u1));
                active &= dot(wi, hit.Ng) > F(0.0f);
                // Density and cosine cancel.
                stage.cast_shadow(hit, wi, F(m_distance),
                                  hit.throughput * stage.white(hit) * stage.weight(hit), Int<W>(0), active);
            });
    }

  private:
    float m_distance;
};

} // namespace kanuka::transport::ao
