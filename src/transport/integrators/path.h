// Unidirectional path tracing with next-event estimation: at each vertex one light and one direction are
// sampled, and both are balanced (docs/transport.md).
#pragma once

#include "transport/tracer.h"

namespace kanuka::transport::path {

inline constexpr IntegratorInfo info{
    "light over any number of bounces; for pictures that count",
    {{{"roulette", 1,
       "1: where paths end, and search the sky along two directions, is what a "
       "pilot has found to pay; 0: they end by their throughput alone"}}}};

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
                    stage.next_event(hit, active);
                });
        }
    }
};

} // namespace kanuka::transport::path
