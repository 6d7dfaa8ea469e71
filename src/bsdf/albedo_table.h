// Directional albedo of GGX reflection lobes, tabulated once by quadrature over visible normals: what a coat needs to know
// of its upper layer. Axes: sqrt(cos) (dense at grazing angles), sqrt(alpha), and the index of refraction.
#pragma once

#include <array>

#include "bsdf/microfacet.h"

namespace kanuka::bsdf {

class AlbedoTable {
  public:
    static constexpr int Cosines = 24, Alphas = 16, Indices = 12;
    static constexpr float MaxIndex = 4;

    AlbedoTable() {
        for (int k = 0; k < Alphas; k++)
            for (int c = 0; c < Cosines; c++) {
                m_ggx[k * Cosines + c] = integrate(cosine_of(c), alpha_of(k), 0, 40);
                for (int n = 0; n < Indices; n++)
                    m_dielectric[(n * Alphas + k) * Cosines + c] = integrate(cosine_of(c), alpha_of(k), index_of(n), 16);
            }
    }

    // Single-scattering albedo of GGX with Fresnel = 1.
    template <int W>
    Float<W> ggx(Float<W> cosine, Float<W> alpha) const {
        return bilinear(m_ggx.data(), cosine, alpha, Int<W>(0));
    }
    template <int W>
    Float<W> dielectric(Float<W> cosine, Float<W> alpha, Float<W> eta) const {
        // Dense near 1, where reflection is faint: n - 1 grows as a square.
        const Float<W> x = sqrt(clamp((eta - Float<W>(1.0f)) * Float<W>(1 / (MaxIndex - 1)), Float<W>(0.0f), Float<W>(1.0f))) *
                           Float<W>(Indices - 1);
        const Int<W> i = min(to_int(x), Int<W>(Indices - 2));
        const Float<W> f = x - Float<W>(i);
        const Int<W> plane(Alphas * Cosines);
        const Float<W> a = bilinear(m_dielectric.data(), cosine, alpha, i * plane);
        const Float<W> b = bilinear(m_dielectric.data(), cosine, alpha, (i + Int<W>(1)) * plane);
        return fma(f, b - a, a);
    }

  private:
    static float cosine_of(int c) {
        const float x = std::max(float(c), 0.05f) / (Cosines - 1);
        return x * x;
    }
    static float alpha_of(int k) {
        const float x = float(k) / (Alphas - 1);
        return std::max(x * x, SmoothAlpha);
    }
    static float index_of(int n) {
        const float x = float(n) / (Indices - 1);
        return 1 + x * x * (MaxIndex - 1);
    }
    // Mean of F G2/G1 over N x N stratified visible normals; index 0 = perfect reflection.
    static float integrate(float cosine, float alpha, float index, int N) {
        const Ggx<1> ggx{Float<1>(alpha)};
        const Vec3<Float<1>> wo(Float<1>(std::sqrt(1 - cosine * cosine)), Float<1>(0.0f), Float<1>(cosine));
        double sum = 0;
        for (int i = 0; i < N; i++)
            for (int j = 0; j < N; j++) {
                const Vec3<Float<1>> m =
                    ggx.sample_visible(wo, Float<1>((float(i) + 0.5f) / float(N)), Float<1>((float(j) + 0.5f) / float(N)));
                const Vec3<Float<1>> wi = reflect(wo, m);
                if (wi.z[0] <= 0)
                    continue;
                Float<1> cos_t, F(1.0f);
                if (index > 0)
                    F = fresnel_dielectric(max(dot(wo, m), Float<1>(0.0f)), Float<1>(index), cos_t);
                const Float<1> lo = ggx.lambda(wo), li = ggx.lambda(wi);
                sum += double(F[0] * (1 + lo[0]) / (1 + lo[0] + li[0]));
            }
        return float(sum / (N * N));
    }
    template <int W>
    static Float<W> bilinear(const float* table, Float<W> cosine, Float<W> alpha, Int<W> offset) {
        const Float<W> one(1.0f), zero(0.0f);
        const Float<W> x = sqrt(clamp(cosine, zero, one)) * Float<W>(Cosines - 1);
        const Float<W> y = sqrt(clamp(alpha, zero, one)) * Float<W>(Alphas - 1);
        const Int<W> i = min(to_int(x), Int<W>(Cosines - 2)), k = min(to_int(y), Int<W>(Alphas - 2));
        const Float<W> fx = x - Float<W>(i), fy = y - Float<W>(k);
        const Int<W> at = offset + k * Int<W>(Cosines) + i;
        const Float<W> a = gather(table, at), b = gather(table, at + Int<W>(1));
        const Float<W> c = gather(table, at + Int<W>(Cosines)), d = gather(table, at + Int<W>(Cosines + 1));
        const Float<W> lo = fma(fx, b - a, a), hi = fma(fx, d - c, c);
        return fma(fy, hi - lo, lo);
    }

    std::array<float, Alphas * Cosines> m_ggx;
    std::array<float, Indices * Alphas * Cosines> m_dielectric;
};

inline const AlbedoTable& albedo_table() {
    static const AlbedoTable table;
    return table;
}

} // namespace kanuka::bsdf
