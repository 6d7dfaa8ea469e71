// What is lit by lights themselves: as path, but light that comes by way of another surface counts only if
// that one is smooth, a mirror or a pane.
#pragma once

#include "transport/tracer.h"

namespace kanuka::transport::direct {

inline constexpr IntegratorInfo info{"light that comes straight, or over mirrors and through panes; quick"};

template <int W>
struct Integrator {
    explicit Integrator(const IntegratorValues&) {}

    void trace(Tracer<W>& tracer) const {
        while (tracer.count() > 0 && tracer.bounce() <= tracer.scene.last_step()) {
            tracer.intersect();
            tracer.apply_air();
            tracer.surfaces(
                [](SurfaceStage<W>& stage, const bsdf::MaterialCode& code, Int<W> slots, Mask<W> active) {
                    SurfaceHit<W> hit(stage.at(), code, slots);
                    stage.arrive(hit, active);
                    // Paths that left a rough surface have looked for emission, the other half of its light
                    // sampling.
                    active &= hit.ray[PathQueue::Mis] == Float<W>(0.0f);
                    stage.next_event(hit, active);
                });
        }
    }
};

} // namespace kanuka::transport::direct
