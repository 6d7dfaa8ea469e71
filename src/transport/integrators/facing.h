// How far surfaces turn to the eye, times the colour they reflect: geometry at a glance, without noise.
#pragma once

#include "transport/tracer.h"

namespace kanuka::transport::facing {

inline constexpr IntegratorInfo info{"surfaces as if lit from the eye; shows shapes without noise"};

template <int W>
struct Integrator {
    explicit Integrator(const IntegratorValues&) {}

    void trace(Tracer<W>& tracer) const {
        tracer.intersect();
        tracer.apply_air();
        tracer.surfaces(
            [](SurfaceStage<W>& stage, const bsdf::MaterialCode& code, Int<W> slots, Mask<W> active) {
                SurfaceHit<W> hit(stage.at(), code, slots);
                stage.arrive(hit, active);
                if (!stage.scatters(code))
                    return;
                const Scattering<W> s(stage.at(), hit);
                stage.record_albedo(s, active);
                stage.add(hit, s.material.albedo() * stage.white(hit) * hit.cos_o, active);
            });
    }
};

} // namespace kanuka::transport::facing
