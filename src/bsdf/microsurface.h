// Light between the facets of a rough surface, by random walks (Heitz, Hanika, d'Eon and Dachsbacher 2016,
// *Multiple-Scattering Microfacet BSDFs with the Smith Model*): a ray enters, meets facets at heights that
// Smith's model draws, is reflected or refracted by visible normals, and at each facet looks for the way out
// along wi. What eval() adds to light scattered once is one such walk: its mean is the light of two facets
// and more.
//
// How we differ: heights are kept as their distribution's value c = C1(h), so no distribution of heights need
// be chosen; within the material, everything is seen upside down (w -> -w, c -> 1 - c), so one set of
// formulas serves both sides. Random numbers are hashes of the two directions: equal for any number of lanes.
#pragma once

#include "base/sampling.h"
#include "bsdf/microfacet.h"
#include "bsdf/spectral.h"

namespace kanuka::bsdf {

// GGX of widths ax and ay, for directions of the whole sphere.
template <int W>
struct Microsurface {
    using F = Float<W>;
    using V = Vec3<F>;
    static constexpr int MostFacets = 32;
    F ax, ay;

    F slope(const V& w) const {
        const F x = ax * w.x, y = ay * w.y;
        return fma(x, x, y * y);
    }
    // Smith's Lambda: of w from below, -1 less that of -w.
    F lambda(const V& w) const {
        const F z2 = max(w.z * w.z, F(1e-12f));
        return F(0.5f) * (copysign(sqrt(F(1.0f) + slope(w) / z2), w.z) - F(1.0f));
    }
    // Area of the facets as seen from w.
    F seen(const V& w) const { return max(F(0.5f) * (w.z + sqrt(fma(w.z, w.z, slope(w)))), F(1e-7f)); }
    F D(const V& m) const {
        const F x = m.x / ax, y = m.y / ay, s = fma(x, x, fma(y, y, m.z * m.z));
        const F d = F(InvPi) / (ax * ay * s * s);
        return kanuka::select(m.z > F(0.0f), d, F(0.0f));
    }
    // The part of light along w (upwards) that leaves from height c.
    F leaves(const V& w, F c) const { return exp2(log2(max(c, F(1e-20f))) * max(lambda(w), F(0.0f))); }
    // The height at which a ray along w meets its next facet; false in `inside`: it leaves.
    F next_height(const V& w, F c, F u, Mask<W>& inside) const {
        const F one(1.0f), L = lambda(w);
        const F rest = max(one - u, F(1e-9f));
        inside &= (w.z < F(0.0f)) | (rest > leaves(w, c));
        const F sure = copysign(max(abs(L), F(1e-5f)), L);
        return clamp(c * exp2(-(log2(rest) / sure)), F(0.0f), one);
    }
};

// Independent numbers for a pair of directions.
template <int W>
struct DirectionHash {
    Int<W> state;
    DirectionHash(const Vec3<Float<W>>& a, const Vec3<Float<W>>& b) : state(0) {
        for (const Float<W>& f : {a.x, a.y, b.x, b.y, b.z})
            state = hash_bits(state ^ bitcast_int(f));
    }
    Float<W> next() {
        state = state + Int<W>(int(0x9e3779b9u));
        return to_unit(hash_bits(state));
    }
};

// Light from wi to wo (both above) over two facets and more, times |cos wi|, of reflection alone.
// fresnel(cosine) -> Spectrum.
template <int W, class Fresnel>
[[gnu::noinline]] Spectrum<W> walk_between_mirrors(const Microsurface<W>& s, const Vec3<Float<W>>& wo,
                                                   const Vec3<Float<W>>& wi, Mask<W> active,
                                                   const Fresnel& fresnel) {
    using F = Float<W>;
    const F zero(0.0f);
    DirectionHash<W> random(wo, wi);
    Vec3<F> v = wo; // back along the ray
    F c(1.0f);
    Spectrum<W> energy(F(1.0f)), sum(zero);
    active &= (wo.z > zero) & (wi.z > zero);
    for (int k = 0; k < Microsurface<W>::MostFacets && any(active); k++) {
        c = s.next_height(-v, c, random.next(), active);
        if (k > 0) {
            const Vec3<F> h = normalize(v + wi);
            const F value = F(0.25f) * s.D(h) / s.seen(v) * s.leaves(wi, c), cosine = max(dot(v, h), zero);
            sum += select(active & (value >= zero), energy * fresnel(cosine) * value, Spectrum<W>(zero));
        }
        const F u0 = random.next(), u1 = random.next();
        const Vec3<F> h = sample_visible_ggx(s.ax, s.ay, v, u0, u1);
        energy *= fresnel(max(dot(v, h), zero));
        v = -reflect(v, h);
    }
    return sum;
}

// The same of an interface, above and below; and light that passes over one facet. eta: index behind, over
// that on wo's side. fresnel(cosine, eta, cos_t) -> what is reflected.
template <int W>
[[gnu::noinline]] Float<W> walk_through_interface(const Microsurface<W>& s, const Vec3<Float<W>>& wo,
                                                  const Vec3<Float<W>>& wi, Float<W> eta, Mask<W> active) {
    using F = Float<W>;
    const F zero(0.0f), one(1.0f);
    DirectionHash<W> random(wo, wi);
    Vec3<F> v = wo, to = wi; // upside down within the material
    F c(1.0f), sum(0.0f), index = eta;
    active &= wo.z > zero;
    for (int k = 0; k < Microsurface<W>::MostFacets && any(active); k++) {
        c = s.next_height(-v, c, random.next(), active);
        // The way out.
        const Mask<W> passes = to.z < zero;
        Vec3<F> h = normalize(kanuka::select(passes, v + to * index, v + to));
        h = h * copysign(one, h.z);
        const F om = dot(v, h), im = dot(to, h);
        F cos_t;
        const F reflected = fresnel_dielectric(max(om, zero), index, cos_t);
        const F q = fma(im, index, om);
        const F through = (one - reflected) * om * abs(im) * index * index / max(q * q, F(1e-12f));
        const F value =
            kanuka::select(passes, through * s.leaves(-to, one - c), F(0.25f) * reflected * s.leaves(to, c)) *
            s.D(h) / s.seen(v);
        const Mask<W> looks = active & (om > zero) & ((passes & (im < zero)) | ((!passes) & (im > zero))) &
                              (value >= zero) & (passes | Mask<W>(k > 0));
        sum += kanuka::select(looks, value, zero);
        // On.
        const F u0 = random.next(), u1 = random.next(), choice = random.next();
        const Vec3<F> m = sample_visible_ggx(s.ax, s.ay, v, u0, u1);
        const F cosine = max(dot(v, m), zero), F_m = fresnel_dielectric(cosine, index, cos_t);
        const Mask<W> turns = choice < F_m;
        const Vec3<F> on = kanuka::select(turns, -reflect(v, m), refract(v, m, index, cos_t));
        v = on; // refracted: along the ray, which is back along it upside down
        to = kanuka::select(turns, to, -to);
        c = kanuka::select(turns, c, one - c);
        index = kanuka::select(turns, index, one / index);
    }
    return sum;
}

} // namespace kanuka::bsdf
