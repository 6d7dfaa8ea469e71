// Lobes at given parameters, and integrals over directions: what the tests of this folder share.
#pragma once

#include <functional>
#include <random>
#include <string>
#include <vector>

#include "bsdf/lobes.h"

namespace kanuka::bsdf::testing {

using F8 = Float<8>;
using V8 = Vec3<F8>;

struct LobeCase {
    LobeId id;
    float alpha = 0;  // GGX width
    float eta = 1.5f; // behind over front
    float cosine = 1; // of wo
    bool dispersive = false;

    template <int W>
    LobeInputs<W> inputs() const {
        LobeInputs<W> in;
        in.a = in.b = Spectrum<W>(Float<W>(1.0f));
        in.alpha = Float<W>(alpha);
        in.dispersive = dispersive;
        for (int i = 0; i < Wavelengths; i++) // as glass: more for shorter waves, less when seen from inside
            in.eta[i] = Float<W>(dispersive ? eta * (1 + 0.02f * float(i) * (eta > 1 ? 1 : -1)) : eta);
        return in;
    }
    template <int W>
    Vec3<Float<W>> wo() const {
        const float s = std::sqrt(1 - cosine * cosine);
        return {Float<W>(0.8f * s), Float<W>(-0.6f * s), Float<W>(cosine)};
    }
    bool transmits() const {
        return id == LobeId::LambertBtdf || id == LobeId::MicrosurfaceDielectricBsdfRgb_v1;
    }
    std::string str() const {
        return std::string(grid::lobe(id).name) + " alpha " + std::to_string(alpha) + " eta " +
               std::to_string(eta) + " cos " + std::to_string(cosine) + (dispersive ? " dispersive" : "");
    }
};

// Every lobe, at widths from nearly smooth to the roughest, seen from above to grazing.
inline std::vector<LobeCase> rough_cases() {
    std::vector<LobeCase> all;
    for (float cosine : {0.999f, 0.6f, 0.1f}) {
        all.push_back({LobeId::LambertBrdf, 0, 1.5f, cosine});
        all.push_back({LobeId::LambertBtdf, 0, 1.5f, cosine});
        for (float alpha : {0.02f, 0.15f, 0.5f, 1.0f}) {
            all.push_back({LobeId::MicrofacetConductorBrdf, alpha, 1.5f, cosine});
            for (float eta : {1.5f, 1 / 1.5f, 1.05f})
                all.push_back({LobeId::MicrosurfaceDielectricBsdfRgb_v1, alpha, eta, cosine});
        }
        all.push_back({LobeId::MicrofacetDielectricBrdf, 0.3f, 1.5f, cosine});
        all.push_back({LobeId::MicrofacetDielectricBrdf, 0.05f, 2.5f, cosine});
        all.push_back({LobeId::MicrosurfaceDielectricBsdfRgb_v1, 0.2f, 1.5f, cosine, true});
        all.push_back({LobeId::MicrosurfaceDielectricBsdfRgb_v1, 0.2f, 1 / 1.5f, cosine, true});
    }
    return all;
}

class Uniform {
  public:
    explicit Uniform(uint32_t seed) : m_engine(seed) {}
    float one() { return float(m_engine() >> 8) * 0x1p-24f; }
    template <int W>
    Float<W> lanes() {
        Float<W> f;
        for (int i = 0; i < W; i++)
            f.v[i] = one();
        return f;
    }

  private:
    std::mt19937 m_engine;
};

// Directions of cosine z and azimuth phi, eight at once.
inline V8 direction(F8 z, F8 turn) {
    F8 s, c;
    sincos_2pi(turn, s, c);
    const F8 r = sqrt(max(F8(1.0f) - z * z, F8(0.0f)));
    return {r * c, r * s, z};
}

// Integral over [z0, z1] x [t0, t1] (cosine, azimuth in turns) of f over solid angle, halved until parts
// agree.
inline double integrate(const std::function<F8(const V8&)>& f, double z0, double z1, double t0, double t1,
                        double tolerance, int depth = 0) {
    const auto gauss = [&](double za, double zb, double ta, double tb) {
        constexpr float Node[4] = {-0.861136312f, -0.339981044f, 0.339981044f, 0.861136312f};
        constexpr double Weight[4] = {0.347854845, 0.652145155, 0.652145155, 0.347854845};
        double sum = 0;
        for (int half = 0; half < 2; half++) {
            F8 z, t;
            for (int k = 0; k < 8; k++) {
                z.v[k] = float(0.5 * (za + zb) + 0.5 * (zb - za) * Node[2 * half + k / 4]);
                t.v[k] = float(0.5 * (ta + tb) + 0.5 * (tb - ta) * Node[k % 4]);
            }
            const F8 v = f(direction(z, t));
            for (int k = 0; k < 8; k++)
                sum += Weight[2 * half + k / 4] * Weight[k % 4] * double(v[k]);
        }
        return sum * 0.25 * (zb - za) * (tb - ta) * 6.283185307179586;
    };
    const double zm = 0.5 * (z0 + z1), tm = 0.5 * (t0 + t1), whole = gauss(z0, z1, t0, t1);
    const double parts =
        gauss(z0, zm, t0, tm) + gauss(zm, z1, t0, tm) + gauss(z0, zm, tm, t1) + gauss(zm, z1, tm, t1);
    if (std::abs(whole - parts) <= tolerance || depth >= 14)
        return parts;
    const double t = tolerance * 0.5;
    return integrate(f, z0, zm, t0, tm, t, depth + 1) + integrate(f, zm, z1, t0, tm, t, depth + 1) +
           integrate(f, z0, zm, tm, t1, t, depth + 1) + integrate(f, zm, z1, tm, t1, t, depth + 1);
}

// The same over each cell of a grid of the sphere, rings of equal area from -z up, and sectors.
inline constexpr int Rings = 20, Sectors = 24;
inline std::vector<double> integrate_cells(const std::function<F8(const V8&)>& f) {
    std::vector<double> cells;
    for (int ring = 0; ring < Rings; ring++)
        for (int sector = 0; sector < Sectors; sector++)
            cells.push_back(integrate(f, 2.0 * ring / Rings - 1, 2.0 * (ring + 1) / Rings - 1,
                                      double(sector) / Sectors, double(sector + 1) / Sectors, 1e-6));
    return cells;
}

} // namespace kanuka::bsdf::testing
