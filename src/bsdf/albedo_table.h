// Directional albedo of GGX reflection lobes, tabulated once by quadrature over visible normals: what a coat
// needs to know of its upper layer, and how lobes share samples. Within 0.5 % of white for cosines above
// 0.02.
//
// Axes: sqrt(cos) and the fourth root of alpha, dense where lobes are narrow and views grazing, and the
// fourth root of the index less 1. What is stored is near constant: for dielectrics the ratio to a smooth
// interface seen at a cosine that the roughness softens; for Schlick's weight the difference from it.
#pragma once

#include <array>

#include "bsdf/microfacet.h"

namespace kanuka::bsdf {

class AlbedoTable {
  public:
    static constexpr int Cosines = 32, Alphas = 32, Indices = 13;
    static constexpr float MinIndex = 1.0001f, MaxIndex = 4;

    AlbedoTable() {
        for (int k = 0; k < Alphas; k++)
            for (int c = 0; c < Cosines; c++)
                fill(k * Cosines + c, cosine_of(c), alpha_of(k));
    }

    // Single-scattering albedo of GGX with Fresnel = 1.
    template <int W>
    Float<W> ggx(Float<W> cosine, Float<W> alpha) const {
        return Cell<W>(cosine, alpha).lookup(m_ggx.data(), Int<W>(0));
    }
    // Of GGX with Fresnel = Schlick's weight (1 - cos)^5: a conductor's edge colour less its face colour.
    template <int W>
    Float<W> schlick(Float<W> cosine, Float<W> alpha) const {
        const Cell<W> cell(cosine, alpha);
        const Float<W> whole = cell.lookup(m_ggx.data(), Int<W>(0));
        return fma(schlick_weight(softened(cosine, alpha)), whole, cell.lookup(m_schlick.data(), Int<W>(0)));
    }
    template <int W>
    Float<W> dielectric(Float<W> cosine, Float<W> alpha, Float<W> eta) const {
        const Float<W> n = clamp(eta, Float<W>(MinIndex), Float<W>(MaxIndex));
        const float first = index_axis(MinIndex);
        const Float<W> axis = sqrt(sqrt((n - Float<W>(1.0f)) * Float<W>(1 / (MaxIndex - 1))));
        const Float<W> x = (axis - Float<W>(first)) * Float<W>((Indices - 1) / (1 - first));
        const Int<W> i = max(min(to_int(x), Int<W>(Indices - 2)), Int<W>(0));
        const Float<W> f = x - Float<W>(i);
        const Int<W> plane(Alphas * Cosines);
        const Cell<W> cell(cosine, alpha);
        const Float<W> a = cell.lookup(m_dielectric.data(), i * plane);
        const Float<W> b = cell.lookup(m_dielectric.data(), (i + Int<W>(1)) * plane);
        Float<W> cos_t;
        return fresnel_dielectric(softened(cosine, alpha), n, cos_t) * fma(f, b - a, a);
    }

  private:
    static float cosine_of(int c) {
        const float x = float(c) / (Cosines - 1);
        return std::max(x * x, 1e-5f);
    }
    static float alpha_of(int k) {
        const float x = float(k) / (Alphas - 1);
        return x * x * x * x;
    }
    static float index_axis(float n) { return std::sqrt(std::sqrt((n - 1) / (MaxIndex - 1))); }
    static float index_of(int n) {
        const float first = index_axis(MinIndex), x = first + (1 - first) * float(n) / (Indices - 1);
        return std::max(1 + x * x * x * x * (MaxIndex - 1), MinIndex);
    }
    template <int W>
    static Float<W> softened(Float<W> cosine, Float<W> alpha) {
        return clamp(fma(Float<W>(0.5f), alpha, cosine), Float<W>(0.0f), Float<W>(1.0f));
    }

    // Means of G2 / G1, alone and times each Fresnel term, over N x N stratified visible normals. The lobe is
    // the same on both sides of the plane of incidence: one half is enough. Strata crowd at u1 = 1, the long
    // tail of GGX whose reflections go below the horizon: u1 = 1 - (1 - s)^3.
    void fill(int at, float cosine, float alpha) {
        using F = Float<8>;
        using V = Vec3<F>;
        constexpr int N = 24, Plane = Alphas * Cosines;
        if (alpha == 0) { // smooth
            m_ggx[size_t(at)] = 1;
            m_schlick[size_t(at)] = 0;
            for (int n = 0; n < Indices; n++)
                m_dielectric[size_t(n * Plane + at)] = 1;
            return;
        }
        const Ggx<8> ggx{F(alpha)};
        const V wo(F(std::sqrt(1 - cosine * cosine)), F(0.0f), F(cosine));
        F whole(0.0f), schlick(0.0f), dielectric[Indices];
        for (F& d : dielectric)
            d = F(0.0f);
        const F one(1.0f), zero(0.0f), lambda_o = ggx.lambda(wo);
        double shares = 0;
        for (int i = 0; i < N; i++) {
            const float t = 1 - (float(i) + 0.5f) / N;
            const F share(3 * t * t);
            shares += double(3 * t * t);
            for (int j = 0; j < N; j += 8) {
                const F u0 = (F(Int<8>::lane_index()) + F(float(j) + 0.5f)) * F(0.5f / N);
                const V m = ggx.sample_visible(wo, u0, F(1 - t * t * t));
                const V wi = reflect(wo, m);
                const F cos_m = max(dot(wo, m), zero);
                const F g =
                    select(wi.z > zero, share * (one + lambda_o) / (one + lambda_o + ggx.lambda(wi)), zero);
                whole += g;
                schlick = fma(schlick_weight(cos_m), g, schlick);
                F cos_t;
                for (int n = 0; n < Indices; n++)
                    dielectric[n] = fma(fresnel_dielectric(cos_m, F(index_of(n)), cos_t), g, dielectric[n]);
            }
        }
        const auto mean = [&](const F& sum) {
            double s = 0;
            for (int k = 0; k < 8; k++)
                s += double(sum[k]);
            return float(s / (N * shares));
        };
        const Float<1> soft = softened(Float<1>(cosine), Float<1>(alpha));
        m_ggx[size_t(at)] = mean(whole);
        m_schlick[size_t(at)] = mean(schlick) - schlick_weight(soft)[0] * mean(whole);
        for (int n = 0; n < Indices; n++) {
            Float<1> cos_t;
            m_dielectric[size_t(n * Plane + at)] =
                mean(dielectric[n]) / fresnel_dielectric(soft, Float<1>(index_of(n)), cos_t)[0];
        }
    }

    // Place in a plane of the tables, and the mix of its four corners.
    template <int W>
    struct Cell {
        Int<W> at;
        Float<W> fx, fy;

        Cell(Float<W> cosine, Float<W> alpha) {
            const Float<W> one(1.0f), zero(0.0f);
            const Float<W> x = sqrt(clamp(cosine, zero, one)) * Float<W>(Cosines - 1);
            const Float<W> y = sqrt(sqrt(clamp(alpha, zero, one))) * Float<W>(Alphas - 1);
            const Int<W> i = min(to_int(x), Int<W>(Cosines - 2)), k = min(to_int(y), Int<W>(Alphas - 2));
            fx = x - Float<W>(i);
            fy = y - Float<W>(k);
            at = k * Int<W>(Cosines) + i;
        }
        Float<W> lookup(const float* table, Int<W> offset) const {
            const Int<W> p = at + offset;
            const Float<W> a = gather(table, p), b = gather(table, p + Int<W>(1));
            const Float<W> c = gather(table, p + Int<W>(Cosines)), d = gather(table, p + Int<W>(Cosines + 1));
            const Float<W> lo = fma(fx, b - a, a), hi = fma(fx, d - c, c);
            return fma(fy, hi - lo, lo);
        }
    };

    std::array<float, Alphas * Cosines> m_ggx, m_schlick;
    std::array<float, Indices * Alphas * Cosines> m_dielectric;
};

inline const AlbedoTable& albedo_table() {
    static const AlbedoTable table;
    return table;
}

} // namespace kanuka::bsdf
