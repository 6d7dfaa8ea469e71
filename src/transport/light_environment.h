// Amounts of light as spectra, and the environment's picture: looking it up, sampling it.
#pragma once

#include "transport/path_state.h"
#include "transport/scene_view.h"

namespace kanuka::transport {

using bsdf::Spectrum;
using bsdf::Wavelengths;

template <int W, size_t N>
Vec3<Float<W>> vector_of(const std::array<Float<W>, N>& row, size_t field) {
    return {row[field], row[field + 1], row[field + 2]};
}
template <int W, size_t N>
Spectrum<W> spectrum_of(const std::array<Float<W>, N>& row, size_t field) {
    Spectrum<W> s;
    for (size_t k = 0; k < Wavelengths; k++)
        s[int(k)] = row[field + k];
    return s;
}

// The radiance of a contribution is the sum of its four parts, which are weighted among each other already.
template <int W>
void add_radiance(BatchState& batch, Int<W> path, const Spectrum<W>& contribution, Mask<W> m) {
    const Int<W> at = path << 2;
    Row<W, 4> sum = load_rows<4>(batch.radiance, at);
    Float<W> scale(1.0f);
    if (batch.limit < Unclamped) {
        const Float<W> whole = (contribution[0] + contribution[1]) + (contribution[2] + contribution[3]);
        const Float<W> limit(batch.limit);
        scale = select(whole > limit, limit / max(whole, Float<W>(1e-30f)), scale);
    }
    for (int k = 0; k < Wavelengths; k++)
        sum[size_t(k)] = fma(contribution[k], scale, sum[size_t(k)]);
    store_rows(batch.radiance[0], at, sum, m);
}

template <int W>
Float<W> sum_of_ratios(const SceneView& scene, const PathState& paths, Int<W> slot) {
    if (!scene.keeps_ratios)
        return Float<W>(float(Wavelengths));
    return (gather(paths.ratio[0], slot) + gather(paths.ratio[1], slot)) +
           (gather(paths.ratio[2], slot) + gather(paths.ratio[3], slot));
}

// Linear lookup in a table at 1 nm.
template <int W>
Float<W> lookup_1nm(const float* table, Float<W> l) {
    const Float<W> x = l * Float<W>(470.0f);
    const Int<W> i = min(to_int(x), Int<W>(469));
    const auto knots = load_rows<4>(table, i);
    return fma(x - Float<W>(i), knots[1] - knots[0], knots[0]);
}

// A measured spectrum stands where c1 is color::Palette::TableMark: c0 is the number of its table.
template <int W>
Spectrum<W> select_measured(const SceneView& scene, Float<W> c0, Float<W> c1, Float<W> scale,
                            const Float<W> l[Wavelengths], const Spectrum<W>& otherwise) {
    const Mask<W> measured = c1 > Float<W>(1e38f);
    if (!any(measured))
        return otherwise;
    // Bounded, for lanes that are off may hold anything.
    const Int<W> last(int(scene.spectra.size() / 480) - 1);
    const Int<W> base = min(max(to_int(select(measured, c0, Float<W>(0.0f))), Int<W>(0)), last) * Int<W>(480);
    Spectrum<W> s;
    for (int k = 0; k < Wavelengths; k++) {
        const Float<W> x = l[k] * Float<W>(470.0f);
        const Int<W> i = min(to_int(x), Int<W>(469));
        const Float<W> a = gather(scene.spectra.data(), base + i),
                       b = gather(scene.spectra.data() + 1, base + i);
        s[k] = select(measured, fma(x - Float<W>(i), b - a, a) * scale, otherwise[k]);
    }
    return s;
}

// scale * S(lambda; c) * white, or a measured spectrum: how all amounts of light become spectra.
template <int W>
Spectrum<W> emission_spectrum(const SceneView& scene, Float<W> c0, Float<W> c1, Float<W> c2, Float<W> scale,
                              const Float<W> l[Wavelengths]) {
    Spectrum<W> s = bsdf::sigmoid_spectrum(c0, c1, c2, l) * scale;
    for (int i = 0; i < Wavelengths; i++)
        s[i] *= lookup_1nm(scene.wavelengths.lookup_white, l[i]);
    return scene.spectra.empty() ? s : select_measured(scene, c0, c1, scale, l, s);
}
template <int W>
Spectrum<W> emission_spectrum(const SceneView& scene, const float c[4], const Float<W> l[Wavelengths]) {
    return emission_spectrum(scene, Float<W>(c[0]), Float<W>(c[1]), Float<W>(c[2]), Float<W>(c[3]), l);
}

template <int W>
struct LightSample {
    Vec3<Float<W>> wi; // unit
    Float<W> distance;
    Spectrum<W> radiance; // delta lights: radiance times the missing density
    Float<W> pdf;         // over solid angle, choice included; delta: the choice alone
    Mask<W> delta, valid;
    Int<W> passes; // shadow linking: AnalyticLight::passes
};

// ---- environment
// ---------------------------------------------------------------------------------------------------

template <int W>
struct MapPlace {
    Float<W> x, y, sin_theta; // texel coordinates
};

template <int W>
MapPlace<W> map_place(const EnvironmentMap& map, const Vec3<Float<W>>& d) {
    const float* m = map.environment_from_render;
    const auto row = [&](int r) {
        return fma(Float<W>(m[3 * r]), d.x, fma(Float<W>(m[3 * r + 1]), d.y, Float<W>(m[3 * r + 2]) * d.z));
    };
    const Vec3<Float<W>> e = normalize(Vec3<Float<W>>(row(0), row(1), row(2)));
    return {turn_of(e.y, e.x) * Float<W>(float(map.width)), acos_over_pi(e.z) * Float<W>(float(map.height)),
            sqrt(max(Float<W>(1.0f) - e.z * e.z, Float<W>(1e-8f)))};
}

template <int W>
Spectrum<W> map_radiance(const SceneView& scene, const MapPlace<W>& p, const Float<W> l[Wavelengths]) {
    const EnvironmentMap& map = scene.map;
    // Bilinear between texel centres; wraps in azimuth, stops at the poles.
    const Float<W> x = p.x - Float<W>(0.5f), y = p.y - Float<W>(0.5f);
    const Float<W> xf = floor(x), yf = floor(y);
    const Int<W> w(map.width), last_row(map.height - 1), zero(0);
    Int<W> i0 = to_int(xf), j0 = to_int(yf);
    i0 = select(i0 < zero, i0 + w, i0);
    i0 = min(max(i0, zero), w - Int<W>(1)); // a direction may be NaN
    Int<W> i1 = i0 + Int<W>(1);
    i1 = select(i1 >= w, i1 - w, i1);
    j0 = min(max(j0, Int<W>(-1)), last_row);
    const Int<W> j1 = min(j0 + Int<W>(1), last_row);
    j0 = max(j0, zero);
    const Float<W> fx = x - xf, fy = y - yf;
    const auto texel = [&](Int<W> i, Int<W> j) {
        const Int<W> at = (j * w + i) * Int<W>(3);
        return Vec3<Float<W>>(gather(map.rgb.data(), at), gather(map.rgb.data() + 1, at),
                              gather(map.rgb.data() + 2, at));
    };
    const Vec3<Float<W>> a = lerp(fx, texel(i0, j0), texel(i1, j0)),
                         b = lerp(fx, texel(i0, j1), texel(i1, j1));
    const Vec3<Float<W>> rgb = lerp(fy, a, b);
    const Float<W> scale = max(max(max(rgb.x, rgb.y), rgb.z) * Float<W>(2.0f), Float<W>(1e-20f));
    Float<W> c0, c1, c2;
    bsdf::uplift(scene.uplift, rgb * (Float<W>(1.0f) / scale), c0, c1, c2);
    return emission_spectrum(scene, c0, c1, c2, scale, l);
}

template <int W>
Float<W> map_pdf(const EnvironmentMap& map, const MapPlace<W>& p) {
    const Int<W> i = min(max(to_int(p.x), Int<W>(0)), Int<W>(map.width - 1));
    const Int<W> j = min(max(to_int(p.y), Int<W>(0)), Int<W>(map.height - 1));
    const Int<W> at = j * Int<W>(map.width + 1) + i;
    const Float<W> row = gather(map.marginal.data() + 1, j) - gather(map.marginal.data(), j);
    const Float<W> texel = gather(map.conditional.data() + 1, at) - gather(map.conditional.data(), at);
    // Chance of the texel over its solid angle, 2 pi^2 sin(theta) / texels.
    return row * texel * Float<W>(float(map.width) * float(map.height) / (2 * Pi * Pi)) / p.sin_theta;
}

// Largest i in [0, count) with table[i] <= u.
template <int W>
Int<W> search(const float* table, Int<W> base, int count, Float<W> u) {
    Int<W> lo(0), size(count);
    for (int span = count; span > 1; span = (span + 1) / 2) {
        const Int<W> half = size >> 1;
        const Int<W> mid = lo + half;
        const Mask<W> right = (gather(table, base + mid) <= u) & (half > Int<W>(0));
        lo = select(right, mid, lo);
        size = select(right, size - half, half);
        size = max(size, Int<W>(1));
    }
    return lo;
}

template <int W>
void sample_map(const SceneView& scene, Float<W> u0, Float<W> u1, LightSample<W>& s,
                const Float<W> l[Wavelengths], Mask<W> m) {
    const EnvironmentMap& map = scene.map;
    const Int<W> j = search(map.marginal.data(), Int<W>(0), map.height, u1);
    const Int<W> row = j * Int<W>(map.width + 1);
    const Int<W> i = search(map.conditional.data(), row, map.width, u0);
    const auto inside = [](const float* table, Int<W> at, Float<W> u) {
        const Float<W> a = gather(table, at), b = gather(table + 1, at);
        return clamp((u - a) / max(b - a, Float<W>(1e-20f)), Float<W>(0.0f), Float<W>(0.9999f));
    };
    MapPlace<W> p;
    p.x = Float<W>(i) + inside(map.conditional.data(), row + i, u0);
    p.y = Float<W>(j) + inside(map.marginal.data(), j, u1);
    Float<W> st, ct, sp, cp;
    sincos_2pi(p.y * Float<W>(0.5f / float(map.height)), st, ct);
    sincos_2pi(p.x * Float<W>(1.0f / float(map.width)), sp, cp);
    p.sin_theta = max(st, Float<W>(1e-4f));
    const Vec3<Float<W>> e(st * cp, st * sp, ct);
    const float* r = map.environment_from_render; // orthogonal: its transpose is its inverse
    const auto column = [&](int c) {
        return fma(Float<W>(r[c]), e.x, fma(Float<W>(r[3 + c]), e.y, Float<W>(r[6 + c]) * e.z));
    };
    s.wi = select(m, normalize(Vec3<Float<W>>(column(0), column(1), column(2))), s.wi);
    s.radiance = bsdf::select(m, map_radiance(scene, p, l), s.radiance);
    s.pdf = select(m, map_pdf(map, p), s.pdf);
}

} // namespace kanuka::transport
