// GGX microfacets (Walter et al. 2007) in the local frame, normal = +z, isotropic.
#pragma once

#include "base/lanes_math.h"

namespace kanuka::bsdf {

// Below this width a surface is smooth: its lobe is a direction, not a density.
inline constexpr float SmoothAlpha = 1e-3f;

template <int W>
struct Ggx {
    Float<W> alpha;

    Float<W> D(const Vec3<Float<W>>& m) const {
        const Float<W> inv_a = Float<W>(1.0f) / alpha;
        const Float<W> x = m.x * inv_a, y = m.y * inv_a;
        const Float<W> s = fma(x, x, fma(y, y, m.z * m.z));
        return Float<W>(InvPi) * inv_a * inv_a / (s * s);
    }
    // Smith's Lambda of a direction w.
    Float<W> lambda(const Vec3<Float<W>>& w) const {
        const Float<W> c2 = w.z * w.z;
        const Float<W> t2 = max(Float<W>(1.0f) - c2, Float<W>(0.0f)) / max(c2, Float<W>(1e-12f));
        return Float<W>(0.5f) * (sqrt(fma(alpha * alpha, t2, Float<W>(1.0f))) - Float<W>(1.0f));
    }
    // A visible normal as seen from wo (wo.z > 0), by spherical caps (Dupuy and Benyoub 2023).
    Vec3<Float<W>> sample_visible(const Vec3<Float<W>>& wo, Float<W> u0, Float<W> u1) const {
        const Vec3<Float<W>> h = normalize(Vec3<Float<W>>(alpha * wo.x, alpha * wo.y, wo.z));
        Float<W> s, c;
        sincos_2pi(u0, s, c);
        const Float<W> z = fma(Float<W>(1.0f) - u1, Float<W>(1.0f) + h.z, -h.z);
        const Float<W> r = sqrt(max(Float<W>(1.0f) - z * z, Float<W>(0.0f)));
        const Vec3<Float<W>> m(fma(r, c, h.x), fma(r, s, h.y), z + h.z);
        return normalize(Vec3<Float<W>>(alpha * m.x, alpha * m.y, max(m.z, Float<W>(1e-6f))));
    }
    // Density of visible normals seen from wo, over dm.
    Float<W> pdf_visible(const Vec3<Float<W>>& wo, const Vec3<Float<W>>& m) const {
        return D(m) * max(dot(wo, m), Float<W>(0.0f)) /
               ((Float<W>(1.0f) + lambda(wo)) * max(wo.z, Float<W>(1e-7f)));
    }
};

// Fresnel reflectance of a dielectric; eta = index behind / index on the side of the incident direction. One
// beyond the critical angle. cos_i >= 0.
template <int W>
Float<W> fresnel_dielectric(Float<W> cos_i, Float<W> eta, Float<W>& cos_t) {
    const Float<W> one(1.0f), sin2_t = (one - cos_i * cos_i) / (eta * eta);
    cos_t = sqrt(max(one - sin2_t, Float<W>(0.0f)));
    const Float<W> parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    const Float<W> perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    const Float<W> r = Float<W>(0.5f) * fma(parallel, parallel, perpendicular * perpendicular);
    return kanuka::select(sin2_t >= one, one, r);
}

// Schlick's weight (1 - cos)^5.
template <int W>
Float<W> schlick_weight(Float<W> cosine) {
    const Float<W> m = clamp(Float<W>(1.0f) - cosine, Float<W>(0.0f), Float<W>(1.0f)), m2 = m * m;
    return m2 * m2 * m;
}

template <int W>
Vec3<Float<W>> reflect(const Vec3<Float<W>>& wo, const Vec3<Float<W>>& m) {
    return m * (Float<W>(2.0f) * dot(wo, m)) - wo;
}

// wo and m on the same side; eta as above. Only valid where cos_t came from no total reflection.
template <int W>
Vec3<Float<W>> refract(const Vec3<Float<W>>& wo, const Vec3<Float<W>>& m, Float<W> eta, Float<W> cos_t) {
    const Float<W> inv = Float<W>(1.0f) / eta;
    return m * (dot(wo, m) * inv - cos_t) - wo * inv;
}

} // namespace kanuka::bsdf
