// The layer of a thick coat: what lies below is seen, and lit, along directions refracted at its surface
// (Weidlich and Wilkie 2007, *Arbitrarily Layered Micro-Facet Surfaces*). With primes for directions in the
// layer and n for its index, radiance that enters grows by n^2 and that which leaves falls by as much, so
//
//     f(wo, wi) cos i = T(wo) T(wi) A(wo') A(wi') f'(wo', wi') cos i' J
//     J = dwi' / dwi = cos i / (n^2 cos i')
//
// with A what the way through the layer leaves (Beer and Lambert), and density p' J. T is what the interface
// does not reflect, of diffuse light by reciprocity the same on its way in and out. What is reflected back
// from inside meets the base again, and again: a geometric series, 1 / (1 - sum of albedo times the part that
// comes back), so that what a white base sends up all leaves. Every round is taken to be reflected as the
// first one, which keeps colour and amount, and simplifies directions. docs/transport.md has the figures.
#pragma once

#include "bsdf/lobes.h"
#include "bsdf/own_normal.h"

namespace kanuka::bsdf {

inline constexpr int MaxThickCoats = 4;

// Lobes of which a rough interface lets through, on their way out, what it lets in from there. Below the
// others a smooth one is counted: where light leaves has to do with where it came from.
inline bool is_diffuse(LobeId id) {
    return id == LobeId::LambertBrdf || id == LobeId::OrenNayarBrdf || id == LobeId::BurleyBrdf ||
           id == LobeId::SheenBrdf;
}

template <int W>
struct ThickLayer {
    using V = Vec3<Float<W>>;

    // A direction on the other side of the layer's surface, and the cosines of both to its normal.
    struct Refracted {
        V direction;
        Float<W> over, within;
    };

    V wo;                  // towards the viewer, in the layer
    Float<W> over, within; // its cosines
    const Turn<W>* turn;   // to the coat's own normal; null = the material's
    Float<W> n;            // index against what lies over it
    Float<W> index;        // and against vacuum
    Float<W> alpha;        // width of its facets
    Spectrum<W> depth;     // -log2 of what a straight way through leaves

    void enter(const V& from, Float<W> relative, Float<W> width, const Turn<W>* own) {
        turn = own;
        n = relative;
        alpha = width;
        const Refracted r = refracted(turn ? turn->seen(from) : from);
        wo = r.direction, over = r.over, within = r.within;
        if (turn) { // what lies below sees it from its own side
            wo.z = max(wo.z, Float<W>(1e-3f));
            wo = wo * (Float<W>(1.0f) / sqrt(dot(wo, wo)));
        }
    }
    Refracted into(const V& w) const {
        if (!turn)
            return refracted(w);
        V own = turn->to(w);
        own.z = max(own.z, Float<W>(0.0f)); // from below its horizon nothing gets in
        return refracted(own);
    }
    // Where a direction in the layer leaves it; those beyond the critical angle do not.
    Refracted out_of(const V& w, Mask<W>& leaves) const {
        const V in = turn ? turn->to(w) : w;
        const Float<W> one(1.0f), z2 = one - (one - in.z * in.z) * n * n;
        leaves &= z2 > Float<W>(0.0f);
        if (turn)
            leaves &= in.z > Float<W>(0.0f);
        const V out(in.x * n, in.y * n, min(sqrt(max(z2, Float<W>(1e-8f))), one));
        return {turn ? turn->from(out) : out, out.z, in.z};
    }
    // Irradiance by the cone of directions that leave the layer, whose sine is 1 / n, over that along the
    // layer's normal: its cosine, or the form factor of what the horizon leaves of the cone (Snyder 1996,
    // *Area Light Sources for Real-Time Graphics*).
    Float<W> cone_seen_from(const V& receiver) const {
        const Float<W> zero(0.0f), one(1.0f);
        const Float<W> c = dot(receiver, turn ? turn->n : V(zero, zero, one));
        const Float<W> n2 = n * n, m = max(n2 - one, Float<W>(1e-6f)), k = max(one - n2 * c * c, zero);
        const Float<W> cut = c * acos_over_pi(-(c * sqrt(m / max(one - c * c, Float<W>(1e-6f))))) -
                             sqrt(k * m) * Float<W>(InvPi) + n2 * acos_over_pi(one / sqrt(one + k / m));
        return kanuka::select(k > zero, max(cut, zero), max(c, zero));
    }
    // J above, for a direction over the layer and its cosine in it.
    Float<W> jacobian(Float<W> over, Float<W> inside) const { return over / (n * n * inside); }
    // What a smooth interface lets through, and this one; `lets_in`: what the way leaves of it as well.
    Float<W> passes_smooth(Float<W> over) const {
        Float<W> unused;
        return Float<W>(1.0f) - fresnel_dielectric(over, n, unused);
    }
    Float<W> passes(Float<W> over) const { return Float<W>(1.0f) - dielectric_albedo(over, alpha, n); }
    Spectrum<W> lets_in(Float<W> over, Float<W> inside) const { return way(inside) * passes_smooth(over); }
    Spectrum<W> way(Float<W> inside) const {
        const Float<W> inv = Float<W>(1.0f) / max(inside, Float<W>(0.01f));
        Spectrum<W> t;
        for (int k = 0; k < Wavelengths; k++)
            t[k] = exp2(-(depth[k] * inv));
        return t;
    }
    // The part of what a lobe reflects that leaves this layer. `whole`: index of the lobe's layer against
    // what lies over this one, the product of those between; `before`: the part that gets as far as this
    // layer.
    Float<W> escape(LobeId id, const LobeInputs<W>& in, Float<W> whole, Float<W> before) const {
        const Float<W> one(1.0f), below = whole / n;
        const auto passes = [&](Float<W> cosine, Float<W> index) {
            Float<W> unused;
            return one - fresnel_dielectric(cosine, max(index, one), unused);
        };
        switch (id) {
        case LobeId::OrenNayarBrdf:
        case LobeId::LambertBrdf:
        case LobeId::BurleyBrdf:
        case LobeId::SheenBrdf: {
            Float<W> out = (one - dielectric_mean(n, alpha)) / (n * n);
            // Layers below have dimmed directions that would not leave here more than those that do, which
            // lie about the way of diffuse light from above.
            const Float<W> about = sqrt(one - Float<W>(0.5f) / (n * n));
            out = out * kanuka::select(below > Float<W>(1.0001f),
                                       passes(about, below) / (one - dielectric_mean(below)), one);
            if (id == LobeId::OrenNayarBrdf) { // seen from above it sends more upwards; fitted to furnaces
                const Float<W> more = sqrt(one - one / (n * n)) * fma(wo.z - one, Float<W>(1.4f), one);
                out = out * fma(Float<W>(0.081f) * in.number[OrenNayarLobe<W>::Roughness],
                                max(more, Float<W>(0.0f)), one);
            }
            return before * min(out, one);
        }
        case LobeId::GratingBrdf: // what its orders send beyond the critical angle is lost
            return before * passes(over, n);
        default: {
            // One interface of the whole index bends as several do, but reflects more.
            const Float<W> several = passes(over, n) * passes(within, below), once = passes(over, whole);
            return min(escape_of_ggx(over, in.alpha, whole) * max(several / max(once, Float<W>(1e-4f)), one),
                       before);
        }
        }
    }

  private:
    // A direction in the layer's own frame.
    Refracted refracted(const V& w) const {
        const Float<W> one(1.0f), inv = one / n;
        const V in(w.x * inv, w.y * inv, sqrt(max(one - (one - w.z * w.z) * inv * inv, Float<W>(0.0f))));
        return {turn ? turn->from(in) : in, w.z, in.z};
    }
};

// Lobes of which no table says how much leaves a layer: the mean over this many directions does, for each
// hit.
inline constexpr int EscapeDirections = 89, EscapeStep = 55; // of Fibonacci's
template <int W>
bool escapes_by_directions(LobeId id, const LobeInputs<W>& in) {
    return id == LobeId::PhongBrdf || id == LobeId::BlinnBrdf || id == LobeId::HighlightBrdf || in.stretched;
}

// What a lobe reflects of its albedo, the rest being let through.
template <int W>
Spectrum<W> reflected_albedo(LobeId id, const LobeInputs<W>& in, const Vec3<Float<W>>& wo,
                             const Spectrum<W>& albedo) {
    const Float<W> one(1.0f), zero(0.0f);
    Float<W> unused;
    if (grid::lobe(id).kind == grid::LobeKind::Reflection)
        return albedo;
    if (grid::lobe(id).kind == grid::LobeKind::Transmission)
        return Spectrum<W>(zero);
    const Float<W> F = id == LobeId::MicrosurfaceDielectricBsdfRgb_v1
                           ? fresnel_dielectric(wo.z, in.eta[0], unused)
                           : fresnel_dielectric(wo.z, max(in.number[ThinWallLobe<W>::Ior], one), unused);
    const Float<W> all = id == LobeId::MicrosurfaceDielectricBsdfRgb_v1 ? F : F * Float<W>(2.0f) / (one + F);
    Spectrum<W> r;
    for (int k = 0; k < Wavelengths; k++)
        r[k] = min(albedo[k], all);
    return r;
}

// The part of a lobe's samples below a thick coat that are drawn over it, by the cosine: all of diffuse ones;
// of rough facets about those that would not come out. Not of smooth ones.
template <int W>
Float<W> drawn_above(LobeId id, const LobeInputs<W>& in, Float<W> kept) {
    if (is_diffuse(id))
        return Float<W>(1.0f);
    switch (id) {
    case LobeId::MicrofacetConductorBrdf:
    case LobeId::MetalBrdf:
    case LobeId::RetroBrdf:
    case LobeId::MicrofacetDielectricBrdf:
        return kanuka::select(in.alpha < Float<W>(SmoothAlpha), Float<W>(0.0f),
                              clamp(kept, Float<W>(0.0f), Float<W>(0.9f)));
    default:
        return Float<W>(0.0f);
    }
}

} // namespace kanuka::bsdf
