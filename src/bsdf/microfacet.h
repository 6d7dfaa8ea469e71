// Distributions of microfacets in the local frame, normal = +z: GGX (Walter et al. 2007), and GGX, Beckmann
// and Student's t stretched along an axis. Masking and shadowing are Smith's, correlated by height (Heitz
// 2014).
#pragma once

#include "bsdf/fresnel.h"
#include "bsdf/lobe_tables.h"

namespace kanuka::bsdf {

// Below this width a surface is smooth: its lobe is a direction, not a density.
inline constexpr float SmoothAlpha = 1e-3f;

// A normal of GGX of widths ax, ay as seen from wo (wo.z > 0), by spherical caps (Dupuy and Benyoub 2023).
template <int W>
Vec3<Float<W>> sample_visible_ggx(Float<W> ax, Float<W> ay, const Vec3<Float<W>>& wo, Float<W> u0,
                                  Float<W> u1) {
    const Vec3<Float<W>> h = normalize(Vec3<Float<W>>(ax * wo.x, ay * wo.y, wo.z));
    Float<W> s, c;
    sincos_2pi(u0, s, c);
    const Float<W> z = fma(Float<W>(1.0f) - u1, Float<W>(1.0f) + h.z, -h.z);
    const Float<W> r = sqrt(max(Float<W>(1.0f) - z * z, Float<W>(0.0f)));
    const Vec3<Float<W>> m(fma(r, c, h.x), fma(r, s, h.y), z + h.z);
    return normalize(Vec3<Float<W>>(ax * m.x, ay * m.y, max(m.z, Float<W>(1e-6f))));
}

// Isotropic GGX: what most lobes have, and the fastest.
template <int W>
struct Ggx {
    using V = Vec3<Float<W>>;
    Float<W> alpha;

    Float<W> D(const V& m) const {
        const Float<W> inv_a = Float<W>(1.0f) / alpha;
        const Float<W> x = m.x * inv_a, y = m.y * inv_a;
        const Float<W> s = fma(x, x, fma(y, y, m.z * m.z));
        return Float<W>(InvPi) * inv_a * inv_a / (s * s);
    }
    // Smith's Lambda of a direction w.
    Float<W> lambda(const V& w) const {
        const Float<W> c2 = w.z * w.z;
        const Float<W> t2 = max(Float<W>(1.0f) - c2, Float<W>(0.0f)) / max(c2, Float<W>(1e-12f));
        return Float<W>(0.5f) * (sqrt(fma(alpha * alpha, t2, Float<W>(1.0f))) - Float<W>(1.0f));
    }
    V sample(const V& wo, Float<W> u0, Float<W> u1) const {
        return sample_visible_ggx(alpha, alpha, wo, u0, u1);
    }
    // Density of sampled normals, over dm, divided by wo . m; D and Lambda of wo are known.
    Float<W> sampled(const V& wo, const V&, Float<W> D, Float<W> lambda_o) const {
        return D / (max(wo.z, Float<W>(1e-7f)) * (Float<W>(1.0f) + lambda_o));
    }
};

// Width along the grooves of a surface whose width across them is alpha.
template <int W>
Float<W> stretched_width(Float<W> alpha, Float<W> anisotropy) {
    return max(alpha * fma(Float<W>(-0.95f), anisotropy, Float<W>(1.0f)), Float<W>(SmoothAlpha));
}

// Slopes distributed by Student's t (Ribardière et al. 2017): P(s) = 1 / (pi (1 + s^2 / (g - 1))^g) with g =
// 1 / tail, s scaled by ax and ay. tail = 1/2 is GGX, 0 is Beckmann, more has longer tails. Lambda is a table
// of g and of the scaled cotangent. Normals are sampled as GGX of the same widths is seen, which covers all
// shorter tails; for longer ones, half of them regardless of the view.
template <int W>
struct StretchedFacets {
    using V = Vec3<Float<W>>;
    Float<W> ax, ay, tail;

    Float<W> scaled_slope2(const V& m) const {
        const Float<W> x = m.x / ax, y = m.y / ay;
        return fma(x, x, y * y) / max(m.z * m.z, Float<W>(1e-12f));
    }
    // (1 + s2 / (g - 1))^-g, and its limit exp(-s2).
    Float<W> shape(Float<W> s2) const {
        const Float<W> t = max(tail, Float<W>(1e-3f));
        const Float<W> base = fma(s2, t / (Float<W>(1.0f) - t), Float<W>(1.0f));
        return exp2(-kanuka::select(tail < Float<W>(1e-3f), s2 * Float<W>(1.44269504f), log2(base) / t));
    }
    Float<W> D(const V& m) const {
        const Float<W> c2 = m.z * m.z;
        const Float<W> d =
            shape(scaled_slope2(m)) * Float<W>(InvPi) / (ax * ay * max(c2 * c2, Float<W>(1e-24f)));
        return kanuka::select(m.z > Float<W>(0.0f), d, Float<W>(0.0f));
    }
    Float<W> lambda(const V& w) const {
        const Float<W> x = ax * w.x, y = ay * w.y;
        const Float<W> a = abs(w.z) / sqrt(max(fma(x, x, y * y), Float<W>(1e-20f)));
        return student_lambda(a, tail);
    }
    // Half of the samples are of all normals where tails are longer than GGX's.
    Float<W> share_of_all() const {
        return kanuka::select(tail > Float<W>(0.505f), Float<W>(0.5f), Float<W>(0.0f));
    }
    V sample(const V& wo, Float<W> u0, Float<W> u1) const {
        const Float<W> q = share_of_all(), one(1.0f);
        const Mask<W> of_all = u1 < q;
        const Float<W> again =
            kanuka::select(of_all, u1 * Float<W>(2.0f), (u1 - q) / (one - q)); // q is 0 or 1/2
        const V visible = sample_visible_ggx(ax, ay, wo, u0, again);
        if (!any(of_all))
            return visible;
        Float<W> s, c;
        sincos_2pi(u0, s, c);
        // The distribution of s^2 turned over: (1 + s^2 / (g - 1))^(1 - g) = 1 - u.
        const Float<W> t = max(tail, Float<W>(1e-3f)), g1 = (one - t) / t;
        const Float<W> r =
            sqrt(g1 * max(exp2(-log2(max(one - again, Float<W>(1e-7f))) / g1) - one, Float<W>(0.0f)));
        return kanuka::select(of_all, normalize(V(ax * r * c, ay * r * s, one)), visible);
    }
    Float<W> sampled(const V& wo, const V& m, Float<W> D, Float<W>) const {
        const Float<W> one(1.0f), q = share_of_all();
        const Float<W> x = ax * wo.x, y = ay * wo.y, z = max(wo.z, Float<W>(1e-7f));
        const Float<W> twice = z + sqrt(fma(x, x, fma(y, y, z * z))); // 2 z (1 + Lambda) of GGX
        const Float<W> s = fma(m.x / ax, m.x / ax, fma(m.y / ay, m.y / ay, m.z * m.z));
        const Float<W> ggx = Float<W>(InvPi) / (ax * ay * max(s * s, Float<W>(1e-30f)));
        const Float<W> visible =
            kanuka::select(m.z > Float<W>(0.0f), Float<W>(2.0f) * ggx / twice, Float<W>(0.0f));
        return fma(one - q, visible, q * D * max(m.z, Float<W>(0.0f)) / max(dot(wo, m), Float<W>(1e-7f)));
    }
};

template <int W>
Vec3<Float<W>> reflect(const Vec3<Float<W>>& wo, const Vec3<Float<W>>& m) {
    return m * (Float<W>(2.0f) * dot(wo, m)) - wo;
}

// wo and m on the same side; eta = index behind / index in front. Only valid where cos_t came from no total
// reflection.
template <int W>
Vec3<Float<W>> refract(const Vec3<Float<W>>& wo, const Vec3<Float<W>>& m, Float<W> eta, Float<W> cos_t) {
    const Float<W> inv = Float<W>(1.0f) / eta;
    return m * (dot(wo, m) * inv - cos_t) - wo * inv;
}

} // namespace kanuka::bsdf
