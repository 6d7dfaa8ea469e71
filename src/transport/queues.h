// What stages hand on: paths that go on, and shadow rays.
#pragma once

#include "transport/media.h"

namespace kanuka::transport {

// A path from one vertex to the next, a lane each.
template <int W>
struct PathSegment {
    PathRow<W> row;
    Spectrum<W> ratio;         // PathQueue::ratio
    Vec3<Float<W>> receiver_n; // where scene.lights.keeps_normals
    Int<W> receiver_set;       // where scene.lights.linked
    MediaStack<W> media;       // where scene.media.tracked, as all that follows
    Float<W> start;
    Int<W> events;
};

// The paths of `bits` go on.
template <int W>
[[gnu::always_inline]] inline void continue_paths(const SceneView& scene, PathQueue& queue,
                                                  const PathSegment<W>& s, uint32_t bits) {
    const int at = queue.count;
    if (scene.settings.keeps_ratios)
        for (int k = 0; k < Wavelengths; k++)
            compress_store(queue.ratio[k] + at, s.ratio[k], bits);
    if (scene.lights.keeps_normals)
        for (int c = 0; c < 3; c++)
            compress_store(queue.receiver_n[c] + at, s.receiver_n[c], bits);
    if (scene.lights.linked)
        compress_store(queue.receiver_set + at, s.receiver_set, bits);
    if (scene.media.tracked) {
        s.media.store(queue, at, bits);
        compress_store(queue.start + at, s.start, bits);
        compress_store(queue.events + at, s.events, bits);
    }
    queue.count += compress_rows(queue.row[at], s.row, bits);
}

// Those that ask for lobes are told how the paths of `bits` go on.
template <int W>
[[gnu::noinline]] void note_scattering(BatchState& batch, Int<W> path, const ScatteringEvent<W>& event,
                                       uint32_t bits) {
    for (; bits; bits &= bits - 1) {
        const int i = __builtin_ctz(bits);
        const PathShares::Event one(event, i);
        if (batch.shares)
            batch.shares->scatter(path[i], one);
        if (batch.lobes)
            batch.lobes->scatter(path[i], one);
    }
}

// A ray to a light, and what counts if nothing is in its way, a lane each.
template <int W>
struct ShadowRay {
    Vec3<Float<W>> o, d;
    Float<W> t_max;
    Spectrum<W> contribution;
    Int<W> path, seed, passes; // passes: shadow linking, AnalyticLight::passes
    MediaStack<W> media;       // where scene.media.tracked, as all that follows
    MisShares<W> shares;
};

// And of the rays of `bits`, which are queued next: `contribution` becomes what the lobes of the event show.
template <int W>
[[gnu::noinline]] void note_rays(BatchState& batch, const RayQueue& queue, Int<W> path,
                                 const ScatteringEvent<W>& event, Int<W> light, Spectrum<W>& contribution,
                                 uint32_t bits) {
    if (batch.lobes)
        change_lanes(contribution, bits, [&](int i, LobeShares::Spectrum4& radiance) {
            batch.lobes->multiply(radiance, PathShares::Event(event, i), light[i]);
        });
    for (int at = queue.count; batch.shares && bits; bits &= bits - 1, at++) {
        const int i = __builtin_ctz(bits);
        batch.shares->cast(at, path[i], PathShares::Event(event, i), light[i]);
    }
}

template <int W>
[[gnu::always_inline]] inline void queue_rays(const SceneView& scene, RayQueue& queue,
                                              const ShadowRay<W>& ray, uint32_t bits) {
    queue.make_room(W);
    const int at = queue.count;
    for (int c = 0; c < 3; c++) {
        compress_store(queue.o[c] + at, ray.o[c], bits);
        compress_store(queue.d[c] + at, ray.d[c], bits);
    }
    for (int k = 0; k < Wavelengths; k++)
        compress_store(queue.contribution[k] + at, ray.contribution[k], bits);
    compress_store(queue.t_max + at, ray.t_max, bits);
    if (scene.media.tracked) {
        for (int k = 0; k < MediaStack<W>::Most; k++)
            compress_store(queue.media[k] + at, ray.media.at[k], bits);
        compress_store(queue.light_share + at, ray.shares.light, bits);
        for (int k = 0; k < Wavelengths; k++)
            compress_store(queue.direction_share[k] + at, ray.shares.direction[k], bits);
    }
    if (scene.lights.shadow_linked)
        compress_store(queue.passes + at, ray.passes, bits);
    compress_store(queue.path + at, ray.path, bits);
    queue.count += compress_store(queue.seed + at, ray.seed, bits);
}

} // namespace kanuka::transport
