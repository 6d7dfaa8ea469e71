// The surface stage that lane_bench times, at one number of lanes.
#pragma once

#include "transport/integrators/path.h"
#include "transport/test_scene.h"

namespace kanuka::transport::testing {

constexpr int RoomSize = 32; // pixels of a side: one batch

struct Times {
    uint64_t ticks = 0, hits = 0;
};

template <int W>
Times surface_stage(const TestScene& room, int progressions) {
    Tracer<W> tracer(room.view);
    std::vector<PixelSums> pixels(size_t(RoomSize * RoomSize), PixelSums{});
    Times times;
    BatchCounts counts;
    for (int p = 0; p < progressions; p++) {
        BatchRequest r;
        r.x0 = r.y0 = 0;
        r.x1 = r.y1 = r.stride = RoomSize;
        r.progression = uint32_t(p);
        r.pixels = pixels.data();
        tracer.generate(r, counts);
        while (tracer.count() > 0 && tracer.bounce() <= tracer.scene.last_step()) {
            tracer.intersect();
            tracer.surfaces(
                [&](SurfaceStage<W>& stage, const bsdf::MaterialCode& code, Int<W> slots, Mask<W> active) {
                    const uint64_t start = __builtin_ia32_rdtsc();
                    SurfaceHit<W> hit(stage.at(), code, slots);
                    stage.arrive(hit, active);
                    stage.next_event(hit, active);
                    times.ticks += __builtin_ia32_rdtsc() - start;
                    times.hits += uint64_t(__builtin_popcount(active.bits()));
                });
        }
        tracer.finish();
    }
    return times;
}

// Sixteen lanes, built for the floor of all machines and for AVX-512.
Times surface_stage_16(const TestScene& room, int progressions);
Times surface_stage_avx512(const TestScene& room, int progressions);

} // namespace kanuka::transport::testing
