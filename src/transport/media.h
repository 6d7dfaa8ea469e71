// Media: what a path is in, and what that does to its light along a segment. Where interiors overlap, the one
// of the highest priority is there, and boundaries of the others are not (Schmidt and Budge 2002, Simple
// Nested Dielectrics in Ray Traced Images). Used in scenes where MediaView::tracked is set, alone.
#pragma once

#include "transport/fields.h"
#include "transport/seeds.h"

namespace kanuka::transport {

// The media around a place, the one that is there first: by priority; of equals, the one entered last. The
// same one may be there several times: objects of one medium that overlap are one body.
template <int W>
struct MediaStack {
    static constexpr int Most = 4; // more that overlap at one place: the lowest are forgotten
    Int<W> at[Most];               // -1 = none, behind all others

    static MediaStack load(const PathQueue& paths, Int<W> dominant, Int<W> slot) {
        MediaStack s;
        s.at[0] = dominant;
        for (int k = 1; k < Most; k++)
            s.at[k] = gather(paths.under[k - 1], slot);
        return s;
    }
    void store(PathQueue& paths, int at, uint32_t bits) const { // but for the dominant one
        for (int k = 1; k < Most; k++)
            compress_store(paths.under[k - 1] + at, this->at[k], bits);
    }
    Mask<W> holds(Int<W> medium) const {
        return (at[0] == medium) | (at[1] == medium) | (at[2] == medium) | (at[3] == medium);
    }
    void enter(const SceneView& scene, Int<W> medium, Mask<W> m) {
        const Float<W> priority = priority_of(scene, medium);
        Int<W> carry = medium;
        Mask<W> placed(false);
        for (Int<W>& here : at) {
            placed |= m & (priority >= priority_of(scene, here));
            const Int<W> old = here;
            here = select(placed, carry, old);
            carry = select(placed, old, carry);
        }
    }
    void leave(Int<W> medium, Mask<W> m) {
        Mask<W> found(false);
        for (int k = 0; k < Most; k++) {
            found |= m & (at[k] == medium);
            at[k] = select(found, k + 1 < Most ? at[k + 1] : Int<W>(-1), at[k]);
        }
    }
    static MediaStack select_of(Mask<W> m, const MediaStack& a, const MediaStack& b) {
        MediaStack s;
        for (int k = 0; k < Most; k++)
            s.at[k] = select(m, a.at[k], b.at[k]);
        return s;
    }

  private:
    static Float<W> priority_of(const SceneView& scene, Int<W> medium) {
        return gather(scene.media.rows.data() + MediumRow::Priority, (medium + Int<W>(1))
                                                                         << MediumRow::Shift);
    }
};

// What changes at a surface with an inside. Nothing does where the boundary lies within a medium of higher
// priority: such a surface is not there.
template <int W>
struct Crossing {
    MediaStack<W> before, after;
    Mask<W> boundary; // the shape has an interior
    Mask<W> nothing;  // but what is there stays the same
    Float<W> outer;   // index of refraction on the outer side

    Crossing() = default;
    Crossing(const SceneView& scene, const MediaStack<W>& around, Int<W> interior, Mask<W> outside)
        : before(around), boundary(interior >= Int<W>(0)) {
        const Mask<W> enters = boundary & outside, leaves = boundary & !outside;
        // A medium that is left and was never entered (an open surface): we have been in it.
        const Mask<W> unknown = leaves & !before.holds(interior);
        if (any(unknown))
            before.enter(scene, interior, unknown);
        after = before;
        after.enter(scene, interior, enters);
        after.leave(interior, leaves);
        nothing = boundary & (before.at[0] == after.at[0]);
        const Int<W> outer_medium = select(outside, before.at[0], after.at[0]);
        outer = select(
            boundary,
            gather(scene.media.rows.data() + MediumRow::Ior, (outer_medium + Int<W>(1)) << MediumRow::Shift),
            Float<W>(1.0f));
    }
};

// PathQueue::events: how many of each kind a path has had.
struct Events {
    static constexpr int Surface = 1, Inside = 1 << 12, Camera = 1 << 30; // Camera: none that anyone sees
    template <int W>
    static Int<W> surfaces(Int<W> e) {
        return e & Int<W>(Inside - 1);
    }
    template <int W>
    static Int<W> inside(Int<W> e) {
        return (e >> 12) & Int<W>(0xffff);
    }
};

// Paths that come straight from the camera; what they have passed so far, nobody sees.
template <int W>
Mask<W> camera_paths(const SceneView& scene, const PathQueue& paths, Int<W> slot, int bounce) {
    if (bounce == 0 || !scene.media.tracked)
        return Mask<W>(bounce == 0);
    return (gather(paths.events, slot) & Int<W>(Events::Camera)) != Int<W>(0);
}

// Begins a ray again behind what it hit at distance t: farther than distances are exact.
template <int W>
Float<W> beyond(const Vec3<Float<W>>& o, const Vec3<Float<W>>& d, Float<W> t) {
    const Vec3<Float<W>> P = o + d * t;
    return t + max(max(max(abs(P.x), abs(P.y)), abs(P.z)), t) * Float<W>(2e-6f);
}

// What a path's contributions are multiplied by and weighed with: see "Wavelengths and weights" in
// docs/transport.md.
template <int W>
struct PathWeights {
    Spectrum<W> throughput, ratio;
    Float<W> mis;

    Float<W> ratios() const { return (ratio[0] + ratio[1]) + (ratio[2] + ratio[3]); }
    // Went on by s without an event. Where media scatter, the chance of that is exp(-sigma_t s), another one
    // for each wavelength; where they only absorb, it is one.
    void survive(const MediumLanes<W>& medium, Float<W> s, Mask<W> m) {
        using F = Float<W>;
        const Mask<W> drawn = m & medium.scatters, plain = m & !medium.scatters;
        const F hero = medium.extinction(0);
        for (int i = 0; i < Wavelengths; i++) {
            const F change = exp(min((hero - medium.extinction(i)) * s, F(80.0f)));
            throughput[i] = select(drawn, throughput[i] * change, throughput[i]);
            ratio[i] = select(drawn, ratio[i] * change, ratio[i]);
            throughput[i] = select(plain, throughput[i] * exp(-(medium.absorption[i] * s)), throughput[i]);
        }
        mis = select(drawn, mis * exp(min(hero * s, F(80.0f))), mis);
    }
    // The same where it is thicker here than there.
    void survive(const NullCollisions<W>& nulls, Mask<W> m) {
        for (int i = 0; i < Wavelengths; i++) {
            throughput[i] = select(m, throughput[i] * nulls.change[i], throughput[i]);
            ratio[i] = select(m, ratio[i] * nulls.change[i], ratio[i]);
        }
        mis = select(m, mis * nulls.mis, mis);
    }
    // And collided there, the density of which is sigma_t more; absorption is a weight.
    void scatter(const MediumLanes<W>& medium, Mask<W> m) {
        const Float<W> inv = Float<W>(1.0f) / max(medium.extinction(0), Float<W>(1e-30f));
        for (int i = 0; i < Wavelengths; i++) {
            throughput[i] = select(m, throughput[i] * (medium.scattering[i] * inv), throughput[i]);
            ratio[i] = select(m, ratio[i] * (medium.extinction(i) * inv), ratio[i]);
        }
    }
};

template <int W>
Spectrum<W> ratios_of(const SceneView& scene, const PathQueue& paths, Int<W> slot) {
    Spectrum<W> ratio(Float<W>(1.0f));
    if (scene.settings.keeps_ratios)
        for (int k = 0; k < Wavelengths; k++)
            ratio[k] = gather(paths.ratio[k], slot);
    return ratio;
}

// How a shadow ray's contribution has been weighted, as shares of one: by light sampling, and by directions
// at each wavelength. What lies on the segment changes the latter; see docs/transport.md, "Interiors".
template <int W>
struct MisShares {
    Float<W> light{1.0f};
    Spectrum<W> direction{Float<W>(0.0f)};
};

// ---- segments, before and after the closest hit is known

// How far each path may go: up to a collision in the medium it is in, by the hero's extinction.
template <int W>
[[gnu::noinline]] Float<W> free_path(const SceneView& scene, const BatchState& batch, const PathRow<W>& ray,
                                     Float<W> start, int bounce) {
    using F = Float<W>;
    const F far(1e30f);
    const Int<W> at = bitcast_int(ray[PathQueue::Interior]);
    if (!any(at >= Int<W>(0)))
        return far;
    const auto l = load_rows<4>(batch.l, bitcast_int(ray[PathQueue::Path]) << 2);
    const MediumLanes<W> medium(scene, at, l.data());
    const Mask<W> drawn = medium.scatters & (medium.field < Int<W>(0));
    if (!any(drawn))
        return far;
    const Sampler<W> sampler{bitcast_int(ray[PathQueue::PixelHash]), batch.reversed_progression};
    F u, unused;
    sampler.sample_2d(medium_net(bounce), u, unused);
    const F depth = log2(F(1.0f) - u) * F(-0.693147181f);
    const F hero = medium.extinction(0);
    return select(drawn & (hero > F(0.0f)), min(start + depth / max(hero, F(1e-30f)), far), far);
}

// Null collisions along the segment, in the medium with a field that a path is in.
template <int W>
NullCollisions<W> pass_field(const SceneView& scene, const BatchState& batch, const PathRow<W>& ray,
                             const MediumLanes<W>& medium, Float<W> start, Float<W> T, int bounce,
                             Mask<W> m) {
    const Int<W> seed = seed_of(seeds::Collisions, bitcast_int(ray[PathQueue::PixelHash]), bounce,
                                batch.reversed_progression);
    return delta_track(scene, medium, vector_of(ray, PathQueue::Origin), vector_of(ray, PathQueue::Direction),
                       start, T, seed, m);
}

// The distance of each path's first real collision before T, in a medium with a field; far = there is none.
template <int W>
[[gnu::noinline]] Float<W> field_path(const SceneView& scene, const BatchState& batch, const PathQueue& paths,
                                      Int<W> slot, Float<W> T, int bounce, Mask<W> m) {
    const auto ray = load_rows<PathQueue::Fields>(paths.row, slot << 4);
    const Int<W> at = bitcast_int(ray[PathQueue::Interior]);
    const auto l = load_rows<4>(batch.l, bitcast_int(ray[PathQueue::Path]) << 2);
    const MediumLanes<W> medium(scene, at, l.data());
    m &= (at >= Int<W>(0)) & (medium.field >= Int<W>(0));
    if (!any(m))
        return Float<W>(1e30f);
    return pass_field(scene, batch, ray, medium, gather(paths.start, slot), T, bounce, m).reach;
}

// What the segment from its start to t did to a path that had no collision there.
template <int W>
void survive(const SceneView& scene, const BatchState& batch, const PathRow<W>& ray,
             const MediumLanes<W>& medium, Float<W> start, Float<W> t, int bounce, PathWeights<W>& weights,
             Mask<W> m) {
    const Mask<W> thickness_varies = m & (medium.field >= Int<W>(0));
    weights.survive(medium, max(t - start, Float<W>(0.0f)), m & !thickness_varies);
    if (any(thickness_varies))
        weights.survive(pass_field(scene, batch, ray, medium, start, t, bounce, thickness_varies),
                        thickness_varies);
}

// Paths in media that scatter have gone to T, to a surface, a collision, or nothing.
template <int W>
[[gnu::noinline]] void end_flight(const SceneView& scene, const BatchState& batch, PathQueue& paths,
                                  Int<W> slot, Float<W> T, int bounce, Mask<W> m) {
    auto ray = load_rows<PathQueue::Fields>(paths.row, slot << 4);
    const auto l = load_rows<4>(batch.l, bitcast_int(ray[PathQueue::Path]) << 2);
    const MediumLanes<W> medium(scene, bitcast_int(ray[PathQueue::Interior]), l.data());
    m &= medium.scatters;
    if (!any(m))
        return;
    PathWeights<W> weights{spectrum_of(ray, PathQueue::Throughput), ratios_of(scene, paths, slot),
                           ray[PathQueue::Mis]};
    survive(scene, batch, ray, medium, gather(paths.start, slot), T, bounce, weights, m);
    for (size_t k = 0; k < Wavelengths; k++) {
        ray[PathQueue::Throughput + k] = weights.throughput[int(k)];
        scatter(paths.ratio[k], slot, weights.ratio[int(k)], m);
    }
    ray[PathQueue::Mis] = weights.mis;
    store_rows(paths.row[0], slot << 4, ray, m);
}

} // namespace kanuka::transport
