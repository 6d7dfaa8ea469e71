// What make_tables*.cpp share: where the tables lie that are made, directions, and sums over them.
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "bsdf/lobes_classic.h"
#include "bsdf/lobes_diffuse.h"

namespace kanuka::bsdf::tables {

using F = Float<8>;
using V = Vec3<F>;
using T = LobeTables;

// StretchedFacets looks up Lambda in the table that is being made: `kanuka_lobe_tables` is here the one that
// is filled, and Lambda comes first.
inline LobeTables& made() {
    return kanuka_lobe_tables;
}

inline V view(float cosine, float turn = 0) {
    const float r = std::sqrt(std::max(0.0f, 1 - cosine * cosine)), a = turn * 6.28318531f;
    return {F(r * std::cos(a)), F(r * std::sin(a)), F(cosine)};
}

inline double sum_of(F f) {
    double s = 0;
    for (int k = 0; k < 8; k++)
        s += double(f[k]);
    return s;
}

// N x N stratified normals as `facets` samples them for wo. Strata crowd at u1 = 1, the long tail whose
// reflections go below the horizon: u1 = 1 - (1 - s)^3; where normals regardless of the view come first, both
// parts have strata of their own. visit(m, weight): weight = value of a lobe of Fresnel 1 over density,
// without G's part of wi. halves: of isotropic facets, strata of one side of the plane of wo, which the other
// mirrors, in place of n all round.
template <class Facets, class Visit>
void stratify(const Facets& facets, const V& wo, int n, float all_normals, const Visit& visit,
              int halves = 0) {
    const int turns = halves ? halves : n;
    const float turn = (halves ? 0.5f : 1.0f) / float(turns);
    const F lambda_o = facets.lambda(wo);
    const auto part = [&](float low, float high, float share, bool warp) {
        double total = 0;
        for (int i = 0; i < n; i++) {
            const float t = 1 - (float(i) + 0.5f) / float(n);
            total += warp ? 3 * double(t) * double(t) : 1.0;
        }
        for (int i = 0; i < n; i++) {
            const float t = 1 - (float(i) + 0.5f) / float(n);
            const float s = warp ? 1 - t * t * t : 1 - t;
            const float w = (warp ? 3 * t * t : 1) * share / float(total * turns);
            for (int j = 0; j < turns; j += 8) {
                const F u0 = (F(Int<8>::lane_index()) + F(float(j) + 0.5f)) * F(turn);
                const V m = facets.sample(wo, u0, F(low + (high - low) * s));
                const F D = facets.D(m), density = facets.sampled(wo, m, D, lambda_o);
                visit(m, F(w) * D / max(wo.z * density, F(1e-30f)));
            }
        }
    };
    if (all_normals > 0)
        part(0, all_normals, all_normals, false);
    part(all_normals, 1, 1 - all_normals, true);
}

// Integral over the upper hemisphere of f for directions w, azimuth 0 being where wo lies; symmetric in y.
template <class Function>
double hemisphere(int n, const Function& f) {
    double sum = 0;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j += 8) {
            // Cosines crowd at the horizon.
            const float u = (float(i) + 0.5f) / float(n), z = u * u;
            const F turn = (F(Int<8>::lane_index()) + F(float(j) + 0.5f)) * F(0.5f / float(n));
            F s, c;
            sincos_2pi(turn, s, c);
            const F r(std::sqrt(1 - z * z));
            sum += sum_of(f(V(r * c, r * s, F(z)))) * 2 * double(u);
        }
    return sum * 2 * 3.14159265358979 / (double(n) * n);
}

// ---- what each file fills

void fill_ggx();
void fill_lambda();
void fill_stretched(); // after Lambda and GGX
void fill_glass();     // the same of interfaces
void fill_dielectric_means();
void fill_escape(); // after GGX

} // namespace kanuka::bsdf::tables
