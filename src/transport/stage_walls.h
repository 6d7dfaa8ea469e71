// Shadow rays through smooth thin walls: what goes on as it came is known exactly, so light behind a window
// pane can be sampled.
#pragma once

#include "transport/surface_hit.h"

namespace kanuka::transport {

// Where a packet of shadow rays has come to, as SurfaceHit reads it; slots are lanes.
struct WallScratch {
    PathQueue paths;
    HitState hits;
};

template <int W>
struct WallPassage {
    Mask<W> passes{false};
    Spectrum<W> part{Float<W>(1.0f)};   // of the light
    Spectrum<W> chance{Float<W>(1.0f)}; // that a sampled direction goes the same way, a wavelength each
};

// program: of what the lanes of m have hit.
template <int W>
[[gnu::noinline]] WallPassage<W>
pass_walls(const SceneView& scene, BatchState& batch, WallScratch& scratch, const bvh::RayPacket<W>& rays,
           const bvh::HitPacket<W>& hit, const MediaStack<W>& media, Int<W> path, Int<W> program, Mask<W> m) {
    using F = Float<W>;
    using I = Int<W>;
    const uint32_t all = Mask<W>(true).bits();
    const F zero(0.0f);
    const Row<W, PathQueue::Fields> ray{
        rays.o.x, rays.o.y, rays.o.z, zero, rays.d.x, rays.d.y, rays.d.z, bitcast_float(path),
        zero,     zero,     zero,     zero, zero,     zero,     zero,     bitcast_float(media.at[0])};
    compress_rows(scratch.paths.row[0], ray, all);
    media.store(scratch.paths, 0, all);
    I(0).store(scratch.paths.events);
    const Row<W, HitState::Fields> at_hit{hit.t,    hit.u,    hit.v,    bitcast_float(hit.shape),
                                          hit.Ng.x, hit.Ng.y, hit.Ng.z, bitcast_float(hit.prim)};
    compress_rows(scratch.hits.row[0], at_hit, all);
    if (scene.geometry.instanced) {
        hit.instanced.store(scratch.hits.instanced);
        hit.magnitude.store(scratch.hits.magnitude.data());
        hit.variation.store(scratch.hits.variation.data());
        for (int k = 0; k < 12; k++)
            std::memcpy(scratch.hits.world_from_shape[k].data(), hit.world_from_shape[k], sizeof(float) * W);
    }
    const Bounce at{scene, batch, scratch.paths, scratch.hits, 1, batch.reversed_progression};
    WallPassage<W> passage;
    while (any(m)) {
        const int first = __builtin_ctz(m.bits()), one = program[first];
        const Mask<W> here = m & (program == I(one));
        // Records of other programs are laid out otherwise: their lanes read the first one's.
        const SurfaceHit<W> h(at, scene.geometry.materials[size_t(one)],
                              select(here, I::lane_index(), I(first)));
        Vec3<F> wo = h.to_local(-h.d);
        wo.z = h.cos_o;
        const bsdf::Material<W> material(h.code, h.fetch, h.outside, wo, h.l, &h.crossing.outer);
        const bsdf::LobeValue<W> v = material.straight(wo);
        passage.passes |= here & (v.pdf[0] > zero);
        passage.part = bsdf::select(here, v.f, passage.part);
        passage.chance = bsdf::select(here, v.pdf, passage.chance);
        m &= !here;
    }
    return passage;
}

} // namespace kanuka::transport
