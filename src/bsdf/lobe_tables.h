// What lobes know by quadrature beforehand, made at build time by make_tables.cpp: directional albedos,
// Smith's Lambda where it has no short form, spectra of metals.
//
// **Multiple scattering.** Light that meets a second microfacet is missing from a lobe f that scatters once:
// a white one reflects E(wo) < 1. It is given back by a factor s(wo) s(wi), with s such that the lobe times
// it reflects all light, whichever the direction: the balance of a symmetric matrix (Sinkhorn 1964), so that
// reciprocity stays. The lobe's shape stays too, as Turquin (2019) has it without reciprocity, and close to
// what random walks over microsurfaces show (Heitz et al. 2016); sampling and densities stay as they are.
// Coloured reflection gives back the part c = F E / (1 - F (1 - E)) of it, with the means of Fresnel's term F
// and of E over directions: what is left of light after one facet more and any number after that (Kulla and
// Conty 2017; Hill 2018). The factor is then 1 + c (s s' - 1).
//
// An interface has no such factor to speak of: light that passes multiplies s of one side by s of the other,
// so that c s outside and s / c inside do as well for any c, and reflection, which has s twice on its side,
// comes out anyhow. What one facet does is left as it is there, and what is missing leaves by a cosine lobe
// of its own (Kulla and Conty 2017): see loss_of_glass.
//
// Axes: sqrt(cos) and the fourth root of alpha, dense where lobes are narrow and views grazing, and the
// fourth root of the index less 1. s bends most where facets are rough, and is 1 where they are not: its axis
// is the root of alpha. What is stored is near constant: for dielectrics the ratio to a smooth
// interface seen at a cosine that the roughness softens; for Schlick's weight the difference from it.
#pragma once

#include <algorithm>
#include <cmath>

#include "bsdf/fresnel.h"

namespace kanuka::bsdf {

struct LobeTables {
    static constexpr int Cosines = 32, Alphas = 32, Indices = 13, Plane = Cosines * Alphas;
    static constexpr float MinIndex = 1.0001f, MaxIndex = 4;
    static constexpr int BalanceCosines = 48, BalanceAlphas = 64; // of s, which whole pictures are bright by
    static constexpr int GlassIndices = 33;                       // over the square root of the index less 1
    // Stretched distributions: tail x stretch x alpha x azimuth x cosine.
    static constexpr int Tails = 7, Stretches = 5, WideAlphas = 16, Azimuths = 5, WideCosines = 16;
    static constexpr float MaxTail = 0.6f;
    static constexpr int Metals = 9, MetalKnots = 48; // in the order of the schema; 360 to 830 nm
    static constexpr int LambdaTails = 13, LambdaCotangents = 64;

    // Of GGX that scatters once: with Fresnel = 1, with Schlick's weight, with the dip of metals; the balance
    // s; means over directions of the first.
    float ggx[Plane], schlick[Plane], dip[Plane];
    float balance[BalanceAlphas * BalanceCosines], ggx_mean[BalanceAlphas];
    // Dielectrics: albedo of reflection from outside; what reflection and transmission by one facet lack to
    // all light, from outside (planes of an index each), then from inside; its means over directions.
    float dielectric[Indices * Plane], glass_loss[2 * GlassIndices * Plane],
        glass_mean_loss[2 * GlassIndices * Alphas];
    // Mean of a dielectric's albedo over directions, from outside (rows of an index, the first of a row
    // smooth); below a layer of such an index, the part of what GGX reflects that leaves the layer, over what
    // a smooth interface lets through.
    float dielectric_mean[Indices * Alphas], escape[Indices * Plane];
    float stretched_balance[Tails * Stretches * WideAlphas * Azimuths * WideCosines];
    // Mean of their albedos, and the fourth root of the width of GGX that has the same.
    float stretched_mean[Tails * Stretches * WideAlphas], stretched_round[Tails * Stretches * WideAlphas];
    float metal_n[Metals * MetalKnots], metal_k[Metals * MetalKnots];
    // What stretched facets of an interface, or such of another tail, lose to one: side and index x tail x
    // stretch x alpha x azimuth x cosine; means over directions.
    struct StretchedGlass {
        static constexpr int Indices = 12, Tails = 5, Stretches = 4, Alphas = 8, Azimuths = 5, Cosines = 14;
        static constexpr int Corners = 2 * Indices * Tails * Stretches * Alphas;
        float loss[Corners * Azimuths * Cosines], mean[Corners];

        // 0, 1/4, 1/2 (GGX), the longest and the middle of both: losses rise fast there.
        static float tail_of(int t) {
            return t < 3 ? 0.25f * float(t) : 0.5f + (MaxTail - 0.5f) * 0.5f * float(t - 2);
        }
        static float index_of(int n) {
            const float x = float(n) / (Indices - 1);
            return std::max(1 + x * x * (MaxIndex - 1), MinIndex);
        }
    } stretched_glass;
    // Over cosine and roughness (its fourth power is the alpha that TableCell is given), and of width for
    // Phong, Blinn and highlights: albedos, and what SheenLobe::seen takes. Of highlights about the half
    // vector and the mirror direction, over what they reflect of all directions around their axis.
    float burley[Plane], sheen[Plane], sheen_seen[Plane], phong[Plane], blinn[Plane];
    float highlight[2][Plane];
    float student_lambda[LambdaTails * LambdaCotangents];

    static float cosine_of(int c, int count = Cosines) {
        const float x = float(c) / float(count - 1);
        return std::max(x * x, 1e-5f);
    }
    static float alpha_of(int k, int count = Alphas) {
        const float x = float(k) / float(count - 1);
        return x * x * x * x;
    }
    static float balance_alpha_of(int k) {
        const float x = float(k) / (BalanceAlphas - 1);
        return x * x;
    }
    static float index_axis(float n) { return std::sqrt(std::sqrt((n - 1) / (MaxIndex - 1))); }
    static float glass_index_of(int n) {
        const float x = float(n) / (GlassIndices - 1);
        return std::max(1 + x * x * (MaxIndex - 1), MinIndex);
    }
    static float index_of(int n) {
        const float first = index_axis(MinIndex), x = first + (1 - first) * float(n) / (Indices - 1);
        return std::max(1 + x * x * x * x * (MaxIndex - 1), MinIndex);
    }
};

// Rides in the object file of lobe_tables.cpp; make_tables fills its own.
#ifdef KANUKA_MAKES_LOBE_TABLES
extern "C" LobeTables kanuka_lobe_tables;
#else
extern "C" const LobeTables kanuka_lobe_tables;
#endif
inline const LobeTables& lobe_tables() {
    return kanuka_lobe_tables;
}

// Between two knots of a uniform axis over [0, 1].
template <int W>
struct Knot {
    Int<W> i;
    Float<W> f;
    Knot(Float<W> x, int count) {
        const Float<W> at = clamp(x, Float<W>(0.0f), Float<W>(1.0f)) * Float<W>(float(count - 1));
        i = min(to_int(at), Int<W>(count - 2));
        f = at - Float<W>(i);
    }
};

// A place in a plane of cosine and alpha, and the mix of its four corners.
template <int W, int Cosines = LobeTables::Cosines>
struct TableCell {
    Int<W> at;
    Float<W> fx, fy;

    TableCell(Float<W> cosine, Float<W> alpha)
        : TableCell(cosine, Knot<W>(sqrt(sqrt(max(alpha, Float<W>(0.0f)))), LobeTables::Alphas)) {}
    TableCell(Float<W> cosine, const Knot<W>& y) {
        const Knot<W> x(sqrt(max(cosine, Float<W>(0.0f))), Cosines);
        fx = x.f, fy = y.f;
        at = y.i * Int<W>(Cosines) + x.i;
    }
    Float<W> lookup(const float* table, Int<W> offset = Int<W>(0)) const {
        const Int<W> p = at + offset;
        const Float<W> a = gather(table, p), b = gather(table, p + Int<W>(1));
        const Float<W> c = gather(table, p + Int<W>(Cosines)), d = gather(table, p + Int<W>(Cosines + 1));
        const Float<W> lo = fma(fx, b - a, a), hi = fma(fx, d - c, c);
        return fma(fy, hi - lo, lo);
    }
};

template <int W>
Float<W> softened(Float<W> cosine, Float<W> alpha) {
    return clamp(fma(Float<W>(0.5f), alpha, cosine), Float<W>(0.0f), Float<W>(1.0f));
}

template <int W>
Knot<W> index_knot(Float<W> n) {
    const Float<W> clamped = clamp(n, Float<W>(LobeTables::MinIndex), Float<W>(LobeTables::MaxIndex));
    const float first = LobeTables::index_axis(LobeTables::MinIndex);
    const Float<W> axis = sqrt(sqrt((clamped - Float<W>(1.0f)) * Float<W>(1 / (LobeTables::MaxIndex - 1))));
    return Knot<W>((axis - Float<W>(first)) * Float<W>(1 / (1 - first)), LobeTables::Indices);
}

// ---- albedos of GGX, scattered once

template <int W>
Float<W> ggx_albedo(Float<W> cosine, Float<W> alpha) {
    return TableCell<W>(cosine, alpha).lookup(lobe_tables().ggx);
}
template <int W>
Knot<W> balance_knot(Float<W> alpha) {
    return Knot<W>(sqrt(max(alpha, Float<W>(0.0f))), LobeTables::BalanceAlphas);
}
template <int W>
Float<W> ggx_mean_albedo(Float<W> alpha) {
    const Knot<W> y = balance_knot(alpha);
    const float* t = lobe_tables().ggx_mean;
    const Float<W> a = gather(t, y.i), b = gather(t, y.i + Int<W>(1));
    return fma(y.f, b - a, a);
}
// With Fresnel = Schlick's weight (1 - cos)^5: a conductor's edge colour less its face colour.
template <int W>
Float<W> schlick_albedo(Float<W> cosine, Float<W> alpha) {
    const TableCell<W> cell(cosine, alpha);
    const Float<W> whole = cell.lookup(lobe_tables().ggx);
    return fma(schlick_weight(softened(cosine, alpha)), whole, cell.lookup(lobe_tables().schlick));
}
template <int W>
Float<W> dip_albedo(Float<W> cosine, Float<W> alpha) {
    return TableCell<W>(cosine, alpha).lookup(lobe_tables().dip);
}
template <int W>
Float<W> dielectric_albedo(Float<W> cosine, Float<W> alpha, Float<W> eta) {
    const Knot<W> n = index_knot(eta);
    const Int<W> plane(LobeTables::Plane);
    const TableCell<W> cell(cosine, alpha);
    const Float<W> a = cell.lookup(lobe_tables().dielectric, n.i * plane);
    const Float<W> b = cell.lookup(lobe_tables().dielectric, (n.i + Int<W>(1)) * plane);
    Float<W> cos_t;
    const Float<W> index = clamp(eta, Float<W>(LobeTables::MinIndex), Float<W>(LobeTables::MaxIndex));
    return fresnel_dielectric(softened(cosine, alpha), index, cos_t) * fma(n.f, b - a, a);
}

template <int W>
Float<W> dielectric_mean(Float<W> eta, Float<W> alpha = Float<W>(0.0f)) {
    const Knot<W> n = index_knot(eta), y(sqrt(sqrt(max(alpha, Float<W>(0.0f)))), LobeTables::Alphas);
    const float* t = lobe_tables().dielectric_mean;
    const Int<W> row(LobeTables::Alphas), p = n.i * row + y.i, q = p + row, one(1);
    const Float<W> lo = fma(y.f, gather(t, p + one) - gather(t, p), gather(t, p));
    const Float<W> hi = fma(y.f, gather(t, q + one) - gather(t, q), gather(t, q));
    return fma(n.f, hi - lo, lo);
}
// Of light that GGX reflects below a smooth interface of index eta, what gets out; `cosine`: of the view,
// over the interface.
template <int W>
Float<W> escape_of_ggx(Float<W> cosine, Float<W> alpha, Float<W> eta) {
    const Knot<W> n = index_knot(eta);
    const Int<W> plane(LobeTables::Plane);
    const TableCell<W> cell(cosine, alpha);
    const Float<W> a = cell.lookup(lobe_tables().escape, n.i * plane);
    const Float<W> b = cell.lookup(lobe_tables().escape, (n.i + Int<W>(1)) * plane);
    Float<W> cos_t;
    const Float<W> index = clamp(eta, Float<W>(LobeTables::MinIndex), Float<W>(LobeTables::MaxIndex));
    const Float<W> smooth = Float<W>(1.0f) - fresnel_dielectric(softened(cosine, alpha), index, cos_t);
    return clamp(smooth * fma(n.f, b - a, a), Float<W>(0.0f), Float<W>(1.0f));
}

// ---- balances s: see above

template <int W>
Float<W> ggx_balance(Float<W> cosine, Float<W> alpha) {
    const TableCell<W, LobeTables::BalanceCosines> cell(cosine, balance_knot(alpha));
    return cell.lookup(lobe_tables().balance);
}
// Where an index lies in the tables of interfaces. eta: behind over the side that is looked from.
template <int W>
struct GlassIndex {
    Int<W> at; // of planes
    Float<W> f;

    GlassIndex(Float<W> eta) {
        const Mask<W> outside = eta >= Float<W>(1.0f);
        const Float<W> index = kanuka::select(outside, eta, Float<W>(1.0f) / eta);
        const Knot<W> n(
            sqrt(max(index - Float<W>(1.0f), Float<W>(0.0f)) * Float<W>(1 / (LobeTables::MaxIndex - 1))),
            LobeTables::GlassIndices);
        at = n.i + kanuka::select(outside, Int<W>(0), Int<W>(LobeTables::GlassIndices));
        f = n.f;
    }
};

// Of light that one facet neither reflects nor lets through: it meets several.
template <int W>
Float<W> loss_of_glass(Float<W> cosine, Float<W> alpha, Float<W> eta) {
    const GlassIndex<W> n(eta);
    const Int<W> plane(LobeTables::Plane);
    const TableCell<W> cell(cosine, alpha);
    const Float<W> a = cell.lookup(lobe_tables().glass_loss, n.at * plane);
    const Float<W> b = cell.lookup(lobe_tables().glass_loss, (n.at + Int<W>(1)) * plane);
    return fma(n.f, b - a, a);
}
template <int W>
Float<W> mean_loss_of_glass(Float<W> alpha, Float<W> eta) {
    const GlassIndex<W> n(eta);
    const Knot<W> y(sqrt(sqrt(max(alpha, Float<W>(0.0f)))), LobeTables::Alphas);
    const float* t = lobe_tables().glass_mean_loss;
    const Int<W> row(LobeTables::Alphas), p = n.at * row + y.i, q = p + row;
    const Float<W> lo = fma(y.f, gather(t, p + Int<W>(1)) - gather(t, p), gather(t, p));
    const Float<W> hi = fma(y.f, gather(t, q + Int<W>(1)) - gather(t, q), gather(t, q));
    return fma(n.f, hi - lo, lo);
}

// Smith's Lambda of Student's t; a = cotangent over the width.
template <int W>
Float<W> student_lambda(Float<W> a, Float<W> tail) {
    const Knot<W> x(a / (a + Float<W>(1.0f)), LobeTables::LambdaCotangents);
    const Knot<W> y(tail * Float<W>(1 / LobeTables::MaxTail), LobeTables::LambdaTails);
    const float* t = lobe_tables().student_lambda;
    const Int<W> row(LobeTables::LambdaCotangents), p = y.i * row + x.i;
    const Float<W> lo = fma(x.f, gather(t, p + Int<W>(1)) - gather(t, p), gather(t, p));
    const Int<W> q = p + row;
    const Float<W> hi = fma(x.f, gather(t, q + Int<W>(1)) - gather(t, q), gather(t, q));
    return fma(y.f, hi - lo, lo) / max(a, Float<W>(1e-12f));
}

// Where the shape of a stretched distribution lies in its tables: the same for every direction at a hit.
template <int W>
struct StretchedCell {
    Int<W> at[8]; // corners of tail, stretch, alpha
    Float<W> weight[8];

    StretchedCell() = default;
    StretchedCell(Float<W> tail, Float<W> anisotropy, Float<W> alpha) {
        const Knot<W> t(tail * Float<W>(1 / LobeTables::MaxTail), LobeTables::Tails);
        const Knot<W> s(anisotropy, LobeTables::Stretches);
        const Knot<W> a(sqrt(sqrt(max(alpha, Float<W>(0.0f)))), LobeTables::WideAlphas);
        const Float<W> one(1.0f);
        for (int k = 0; k < 8; k++) {
            const Int<W> x(k & 1), y(k >> 1 & 1), z(k >> 2);
            at[k] = ((t.i + z) * Int<W>(LobeTables::Stretches) + s.i + y) * Int<W>(LobeTables::WideAlphas) +
                    a.i + x;
            weight[k] = (k & 1 ? a.f : one - a.f) * (k & 2 ? s.f : one - s.f) * (k & 4 ? t.f : one - t.f);
        }
    }
    Float<W> mean() const { return mix(lobe_tables().stretched_mean); }
    // Width of the GGX that loses as much.
    Float<W> round_alpha() const {
        const Float<W> x = mix(lobe_tables().stretched_round), x2 = x * x;
        return x2 * x2;
    }
    Float<W> mix(const float* table) const {
        Float<W> sum(0.0f);
        for (int k = 0; k < 8; k++)
            sum = fma(weight[k], gather(table, at[k]), sum);
        return sum;
    }
    Float<W> balance(const Vec3<Float<W>>& w) const {
        const Knot<W> c(sqrt(abs(w.z)), LobeTables::WideCosines);
        const Knot<W> p(Float<W>(4.0f) * turn_of(abs(w.y), abs(w.x)), LobeTables::Azimuths);
        const float* t = lobe_tables().stretched_balance;
        Float<W> sum(0.0f);
        for (int k = 0; k < 8; k++) {
            const Int<W> q =
                (at[k] * Int<W>(LobeTables::Azimuths) + p.i) * Int<W>(LobeTables::WideCosines) + c.i;
            const Int<W> r = q + Int<W>(LobeTables::WideCosines), one(1);
            const Float<W> lo = fma(c.f, gather(t, q + one) - gather(t, q), gather(t, q));
            const Float<W> hi = fma(c.f, gather(t, r + one) - gather(t, r), gather(t, r));
            sum = fma(weight[k], fma(p.f, hi - lo, lo), sum);
        }
        return sum;
    }
};

// Likewise of interfaces that light passes, seen from one side.
template <int W>
struct StretchedGlassCell {
    using T = LobeTables::StretchedGlass;
    Int<W> at[16]; // corners of alpha, stretch, tail, index
    Float<W> weight[16];

    StretchedGlassCell(Float<W> tail, Float<W> anisotropy, Float<W> alpha, Float<W> eta) {
        const Float<W> one(1.0f), zero(0.0f), half(0.5f);
        const Mask<W> outside = eta >= one;
        const Float<W> index = kanuka::select(outside, eta, one / eta);
        const Knot<W> n(sqrt(max(index - one, zero) * Float<W>(1 / (LobeTables::MaxIndex - 1))), T::Indices);
        const Float<W> longer = (tail - half) * Float<W>(2 / (LobeTables::MaxTail - 0.5f));
        const Knot<W> t((kanuka::select(tail < half, Float<W>(4.0f) * tail, Float<W>(2.0f) + longer)) *
                            Float<W>(1.0f / (T::Tails - 1)),
                        T::Tails);
        const Knot<W> s(anisotropy, T::Stretches);
        const Knot<W> a(sqrt(sqrt(max(alpha, zero))), T::Alphas);
        const Int<W> side = kanuka::select(outside, Int<W>(0), Int<W>(T::Indices));
        for (int k = 0; k < 16; k++) {
            const Int<W> plane = side + n.i + Int<W>(k >> 3);
            const Int<W> row = (plane * Int<W>(T::Tails) + t.i + Int<W>(k >> 2 & 1)) * Int<W>(T::Stretches);
            at[k] = (row + s.i + Int<W>(k >> 1 & 1)) * Int<W>(T::Alphas) + a.i + Int<W>(k & 1);
            weight[k] = (k & 1 ? a.f : one - a.f) * (k & 2 ? s.f : one - s.f) * (k & 4 ? t.f : one - t.f) *
                        (k & 8 ? n.f : one - n.f);
        }
    }
    Float<W> mean() const {
        Float<W> sum(0.0f);
        for (int k = 0; k < 16; k++)
            sum = fma(weight[k], gather(lobe_tables().stretched_glass.mean, at[k]), sum);
        return sum;
    }
    // Of light from w, in the frame of the axis.
    Float<W> loss(const Vec3<Float<W>>& w) const {
        const Knot<W> c(sqrt(abs(w.z)), T::Cosines);
        const Knot<W> p(Float<W>(4.0f) * turn_of(abs(w.y), abs(w.x)), T::Azimuths);
        const float* t = lobe_tables().stretched_glass.loss;
        Float<W> sum(0.0f);
        for (int k = 0; k < 16; k++) {
            const Int<W> q = (at[k] * Int<W>(T::Azimuths) + p.i) * Int<W>(T::Cosines) + c.i;
            const Int<W> r = q + Int<W>(T::Cosines), one(1);
            const Float<W> lo = fma(c.f, gather(t, q + one) - gather(t, q), gather(t, q));
            const Float<W> hi = fma(c.f, gather(t, r + one) - gather(t, r), gather(t, r));
            sum = fma(weight[k], fma(p.f, hi - lo, lo), sum);
        }
        return sum;
    }
};

} // namespace kanuka::bsdf
