// Every lobe of grid/lobe_schema.h as published: value times cosine and density at four wavelengths. Light
// that meets more than one facet is left out (lobes_oracle_test.cpp measures it apart), and so are walks.
#pragma once

#include "bsdf/oracles/diffuse.h"
#include "bsdf/oracles/facets.h"
#include "bsdf/oracles/highlights.h"
#include "bsdf/test_lobes.h"

namespace kanuka::bsdf::oracle {

struct Value {
    double f[Wavelengths] = {}, pdf[Wavelengths] = {};
};

// Inputs by name, and where light comes from.
class Given {
  public:
    explicit Given(const testing::LobeCase& c) : m_case(c) {}
    double number(const char* name) const { return double(value(name).x); }
    double color(const char* name, int i) const { // as LobeCase gives colours to wavelengths
        const Vec3f v = value(name);
        return i < 3 ? double(v[i]) : (double(v.x) + double(v.y) + double(v.z)) / 3;
    }
    double nm(int i) const { return 360 + 470 * double(testing::test_wavelengths<1>()[i][0]); }
    // Widths along and across the grooves, and directions in their frame.
    Facets facets(double roughness) const {
        const double alpha = roughness * roughness;
        const double along = alpha * (1 - 0.95 * number("anisotropy"));
        return {std::max(along, 1e-3), std::max(alpha, 1e-3), number("tail")};
    }
    Facets facets() const { return facets(number("roughness")); }
    Dir turned(Dir w) const {
        const double t = Tau * number("rotation");
        return {std::cos(t) * w.x + std::sin(t) * w.y, std::cos(t) * w.y - std::sin(t) * w.x, w.z};
    }
    double film(int i, double cosine, double outer, Complex base) const {
        return layered_reflectance(cosine, outer, number("filmIor"), number("filmThickness") / nm(i), base);
    }

  private:
    Vec3f value(const char* name) const {
        for (const auto& [n, v] : m_case.given)
            if (n == name)
                return v;
        return m_case.decl().inputs[size_t(grid::find_input(m_case.decl(), name))].fallback;
    }
    const testing::LobeCase& m_case;
};

// ---- Fresnel terms at a facet seen at a cosine

inline double conductor_fresnel(const Given& g, double cosine, int i) {
    return tinted_schlick(g.color("reflectance", i), g.color("edgeReflectance", i), g.color("edgeTint", i),
                          cosine);
}
inline double retro_fresnel(const Given& g, double cosine, int i) {
    return tinted_schlick(g.color("reflectance", i), g.color("edgeReflectance", i), 1, cosine);
}
inline double metal_fresnel(const Given& g, double cosine, int i) {
    return g.film(i, cosine, 1, Complex(std::max(g.color("eta", i), 0.01), -g.color("extinction", i)));
}
inline double coat_fresnel(const Given& g, double cosine, int i) {
    return g.color("reflectance", i) * g.film(i, cosine, 1, g.number("ior"));
}
inline double interface_fresnel(const Given& g, double cosine, int i, bool outside) {
    const double n = glass_index(g.number("ior"), g.number("abbe"), g.nm(i));
    return g.film(i, cosine, outside ? 1 : n, outside ? n : 1);
}
inline double sheet_fresnel(const Given& g, double cosine, int i) { // a film of its own, or two sides
    const double thickness = g.number("thickness"), n = g.number("ior");
    return thickness > 0 ? layered_reflectance(cosine, 1, n, thickness / g.nm(i), 1)
                         : sheet_reflectance(cosine, n);
}

// ---- lobes

using Fresnel = double (*)(const Given&, double, int);

inline Value facets_with(Fresnel fresnel, const Given& g, const Facets& facets, Dir wo, Dir wi) {
    Value v;
    if (wi.z <= 0)
        return v;
    const double f = reflected(facets, wo, wi), pdf = reflected_density(facets, wo, wi);
    for (int i = 0; i < Wavelengths; i++) {
        v.f[i] = f * fresnel(g, cosine_of_facet(1, wo, wi), i);
        v.pdf[i] = pdf;
    }
    return v;
}

inline Value interface(const Given& g, bool outside, Dir wo, Dir wi) {
    double roughness = 0; // of a colour its mean
    for (int i = 0; i < Wavelengths; i++)
        roughness += g.color("roughness", i) / Wavelengths;
    const Facets facets = g.facets(roughness);
    const bool passes = wi.z < 0;
    Value v;
    for (int i = 0; i < Wavelengths; i++) {
        const double n = glass_index(g.number("ior"), g.number("abbe"), g.nm(i)), eta = outside ? n : 1 / n;
        const auto R = [&](int k) { return interface_fresnel(g, cosine_of_facet(eta, wo, wi), k, outside); };
        // One direction serves all wavelengths but where they part; then sampling goes by the mean.
        const double mean = (R(0) + R(1) + R(2) + R(3)) / 4, chosen = g.number("abbe") > 0 ? R(i) : mean;
        if (passes) {
            v.f[i] = transmitted(facets, eta, wo, wi) * (1 - R(i)) * g.color("transmittance", i);
            v.pdf[i] = transmitted_density(facets, eta, wo, wi) * (1 - chosen);
        } else {
            v.f[i] = reflected(facets, wo, wi) * R(i) * g.color("reflectance", i);
            v.pdf[i] = reflected_density(facets, wo, wi) * chosen;
        }
    }
    return v;
}

// Reflection, and the same through the sheet's plane.
inline Value thin_wall(const Given& g, Dir wo, Dir wi) {
    const double alpha = std::max(std::pow(g.number("roughness"), 2), 1e-3);
    const Facets facets{alpha, alpha};
    const Dir up{wi.x, wi.y, std::abs(wi.z)};
    const double f = reflected(facets, wo, up), pdf = reflected_density(facets, wo, up);
    double R[Wavelengths], mean = 0;
    for (int i = 0; i < Wavelengths; i++)
        mean += (R[i] = sheet_fresnel(g, cosine_of_facet(1, wo, up), i)) / Wavelengths;
    Value v;
    for (int i = 0; i < Wavelengths; i++) {
        v.f[i] = f * (wi.z < 0 ? (1 - R[i]) * g.color("transmittance", i) : R[i] * g.color("reflectance", i));
        v.pdf[i] = pdf * (wi.z < 0 ? 1 - mean : mean);
    }
    return v;
}

inline Value value_of(const testing::LobeCase& c, Dir wo, Dir wi) {
    const Given g(c);
    const auto colored = [&](const char* name, double f, double pdf) {
        Value v;
        for (int i = 0; i < Wavelengths; i++)
            v.f[i] = f * g.color(name, i), v.pdf[i] = pdf;
        return v;
    };
    const double cosine = std::abs(wi.z) / HalfTau;
    switch (c.id) {
    case LobeId::MicrosurfaceDielectricBsdfRgb_v1:
        return interface(g, c.outside, g.turned(wo), g.turned(wi));
    case LobeId::ThinWalledDielectricBsdf:
        return thin_wall(g, wo, wi);
    case LobeId::LambertBtdf:
        return wi.z < 0 ? colored("diffuseTransmittance", cosine, cosine) : Value();
    default:
        break;
    }
    if (wi.z <= 0)
        return {};
    const auto shaped = [&](const char* name, Shape s) { return colored(name, s.f, s.pdf); };
    Value v;
    switch (c.id) {
    case LobeId::LambertBrdf:
        return colored("diffuseReflectance", cosine, cosine);
    case LobeId::OrenNayarBrdf:
        for (int i = 0; i < Wavelengths; i++) {
            v.f[i] = eon(g.color("diffuseReflectance", i), g.number("roughness"), wo, wi);
            v.pdf[i] = eon_density(g.number("roughness"), wo, wi);
        }
        return v;
    case LobeId::BurleyBrdf:
        return colored("diffuseReflectance", burley(1, g.number("roughness"), wo, wi), cosine);
    case LobeId::SheenBrdf:
        return colored("reflectance", sheen(1, g.number("roughness"), wo, wi), 1 / Tau);
    case LobeId::MicrofacetConductorBrdf:
        return facets_with(conductor_fresnel, g, g.facets(), g.turned(wo), g.turned(wi));
    case LobeId::MetalBrdf:
        return facets_with(metal_fresnel, g, g.facets(), g.turned(wo), g.turned(wi));
    case LobeId::MicrofacetDielectricBrdf:
        return facets_with(coat_fresnel, g, g.facets(), g.turned(wo), g.turned(wi));
    case LobeId::RetroBrdf: {
        const double alpha = std::max(std::pow(g.number("roughness"), 2), 1e-3);
        return facets_with(retro_fresnel, g, {alpha, alpha}, {-wo.x, -wo.y, wo.z}, wi);
    }
    case LobeId::GratingBrdf:
        for (int i = 0; i < Wavelengths; i++) {
            v.pdf[i] = grating(g.number("roughness"), g.number("period"), g.number("depth"),
                               g.number("rotation"), g.nm(i), wo, wi);
            v.f[i] = v.pdf[i] * g.color("reflectance", i);
        }
        return v;
    case LobeId::PhongBrdf:
        return shaped("reflectance", phong(g.number("exponent"), wo, wi));
    case LobeId::BlinnBrdf:
        return shaped("reflectance", blinn(g.number("exponent"), wo, wi));
    case LobeId::HighlightBrdf:
        for (int i = 0; i < Wavelengths; i++) {
            const Shape s =
                highlight(g.color("height", i), g.number("exponent"), g.number("about") > 0.5, wo, wi);
            v.f[i] = s.f, v.pdf[i] = s.pdf;
        }
        return v;
    default:
        return v;
    }
}

} // namespace kanuka::bsdf::oracle
