// Amounts of light as spectra, and the environment's picture: looking it up, sampling it.
#pragma once

#include "transport/contribution.h"

namespace kanuka::transport {

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

template <int W>
Float<W> sum_of_ratios(const SceneView& scene, const PathQueue& paths, Int<W> slot) {
    if (!scene.settings.keeps_ratios)
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
    const Int<W> last(int(scene.spectra.tables.size() / 480) - 1);
    const Int<W> base = min(max(to_int(select(measured, c0, Float<W>(0.0f))), Int<W>(0)), last) * Int<W>(480);
    Spectrum<W> s;
    for (int k = 0; k < Wavelengths; k++) {
        const Float<W> x = l[k] * Float<W>(470.0f);
        const Int<W> i = min(to_int(x), Int<W>(469));
        const Float<W> a = gather(scene.spectra.tables.data(), base + i),
                       b = gather(scene.spectra.tables.data() + 1, base + i);
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
        s[i] *= lookup_1nm(scene.spectra.white.data(), l[i]);
    return scene.spectra.tables.empty() ? s : select_measured(scene, c0, c1, scale, l, s);
}
template <int W>
Spectrum<W> emission_spectrum(const SceneView& scene, const float c[4], const Float<W> l[Wavelengths]) {
    return emission_spectrum(scene, Float<W>(c[0]), Float<W>(c[1]), Float<W>(c[2]), Float<W>(c[3]), l);
}

template <int W>
struct LightSample {
    Vec3<Float<W>> wi; // unit
    Float<W> distance;
    Spectrum<W> radiance;     // delta lights: radiance times the missing density
    Float<W> pdf_solid_angle; // the choice included; delta: the choice alone
    Mask<W> delta, valid;
    Int<W> passes; // shadow linking: AnalyticLight::passes
    Int<W> light;  // place in LightsView::analytic, or a LightId; of_emitter()
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
    // Not by the cosine alone, which says little near the poles.
    const Float<W> across = sqrt(fma(e.x, e.x, e.y * e.y));
    return {turn_of(e.y, e.x) * Float<W>(float(map.width)),
            turn_of(across, e.z) * Float<W>(2.0f * float(map.height)), max(across, Float<W>(1e-7f))};
}

// Where a place lies between texel centres. Columns wrap, rows end at the poles: the first and the last are
// half as high, and their texels border on themselves there.
template <int W>
struct MapCell {
    Int<W> column, row; // column 0: from the centre of texel 0 to that of texel 1; row 0: from the pole
    Float<W> x, y;      // in it

    MapCell(Int<W> column, Int<W> row, Float<W> x, Float<W> y) : column(column), row(row), x(x), y(y) {}
    MapCell(const EnvironmentMap& map, const MapPlace<W>& p) {
        const Int<W> w(map.width), h(map.height), zero(0);
        const Float<W> px = p.x - Float<W>(0.5f), py = p.y - Float<W>(0.5f), xf = floor(px), yf = floor(py);
        column = to_int(xf);
        column = select(column < zero, column + w, column);
        column = min(max(column, zero), w - Int<W>(1)); // a direction may be NaN
        row = min(max(to_int(yf) + Int<W>(1), zero), h);
        x = px - xf;
        y = select(row == zero, p.y + p.y, select(row == h, (py - yf) * Float<W>(2.0f), py - yf));
    }
    MapPlace<W> place(const EnvironmentMap& map) const {
        const Float<W> w(float(map.width)), half(0.5f);
        const Float<W> size = select((row == Int<W>(0)) | (row == Int<W>(map.height)), half, Float<W>(1.0f));
        MapPlace<W> p;
        p.x = Float<W>(column) + x + half;
        p.x = select(p.x >= w, p.x - w, p.x);
        p.y = max(Float<W>(row) - half, Float<W>(0.0f)) + y * size;
        return p;
    }
};

template <int W>
struct MapTexels {
    Vec3<Float<W>> rgb[2][2]; // [row][column]

    MapTexels(const EnvironmentMap& map, const MapCell<W>& c) {
        const Int<W> row(map.width + 1), last(map.height - 1), zero(0);
        const Int<W> j[2] = {max(c.row - Int<W>(1), zero), min(c.row, last)};
        for (size_t b = 0; b < 2; b++) {
            const auto both = load_rows<8>(map.rgb.data(), (j[b] * row + c.column) * Int<W>(3));
            rgb[b][0] = {both[0], both[1], both[2]};
            rgb[b][1] = {both[3], both[4], both[5]};
        }
    }
    // What sampling weighs a place by: its light, as far as it is above the mean, and the sine of the
    // latitude.
    BilinearCell<W> weights(const EnvironmentMap& map, const MapCell<W>& c) const {
        const Float<W> mean(map.mean), zero(0.0f), half(0.5f);
        const Float<W> unit(0.5f / float(map.height)), row(c.row);
        Float<W> sine[2], unused;
        sincos_2pi(max(row - half, zero) * unit, sine[0], unused);
        sincos_2pi(min(row + half, Float<W>(float(map.height))) * unit, sine[1], unused);
        BilinearCell<W> cell;
        for (int b = 0; b < 2; b++)
            for (int a = 0; a < 2; a++) {
                const Vec3<Float<W>>& t = rgb[b][a];
                cell.w[b][a] = above_mean(texel_weight(t.x, t.y, t.z), mean) * max(sine[b], zero);
            }
        return cell;
    }
};

template <int W>
Spectrum<W> map_radiance(const SceneView& scene, const MapTexels<W>& t, const MapCell<W>& c,
                         const Float<W> l[Wavelengths]) {
    const Vec3<Float<W>> rgb =
        lerp(c.y, lerp(c.x, t.rgb[0][0], t.rgb[0][1]), lerp(c.x, t.rgb[1][0], t.rgb[1][1]));
    const Float<W> scale = max(max(max(rgb.x, rgb.y), rgb.z) * Float<W>(2.0f), Float<W>(1e-20f));
    Float<W> c0, c1, c2;
    bsdf::uplift(scene.spectra.uplift, rgb * (Float<W>(1.0f) / scale), c0, c1, c2);
    return emission_spectrum(scene, c0, c1, c2, scale, l);
}

// Over solid angle: a texel fills 2 pi^2 sin(theta) / texels.
template <int W>
Float<W> map_pdf(const EnvironmentMap& map, const BilinearCell<W>& weights, const MapCell<W>& c,
                 Float<W> sin_theta) {
    return weights.at(c.x, c.y) * Float<W>(map.density) / sin_theta;
}

template <int W>
void sample_map(const SceneView& scene, Float<W> u0, Float<W> u1, LightSample<W>& s,
                const Float<W> l[Wavelengths], Mask<W> m) {
    const EnvironmentMap& map = scene.lights.map;
    const float *marginal = map.cells.marginal.data(), *conditional = map.cells.conditional.data();
    const Int<W> j = search(map.cells.marginal_guide, marginal, Int<W>(0), Int<W>(0), u1);
    const Int<W> row = j * Int<W>(map.cells.columns + 1);
    const Int<W> i = search(map.cells.conditional_guide, conditional, j, row, u0);
    MapCell<W> c(i, j, Float<W>(0.0f), Float<W>(0.0f));
    const MapTexels<W> texels(map, c);
    const BilinearCell<W> weights = texels.weights(map, c);
    weights.sample(within_step(conditional, row + i, u0), within_step(marginal, j, u1), c.x, c.y);
    const MapPlace<W> p = c.place(map);
    Float<W> st, ct, sp, cp;
    sincos_2pi(p.y * Float<W>(0.5f / float(map.height)), st, ct);
    sincos_2pi(p.x * Float<W>(1.0f / float(map.width)), sp, cp);
    const Vec3<Float<W>> e(st * cp, st * sp, ct);
    const float* r = map.environment_from_render; // orthogonal: its transpose is its inverse
    const auto column = [&](int k) {
        return fma(Float<W>(r[k]), e.x, fma(Float<W>(r[3 + k]), e.y, Float<W>(r[6 + k]) * e.z));
    };
    const Float<W> pdf = map_pdf(map, weights, c, max(st, Float<W>(1e-7f)));
    s.wi = select(m, normalize(Vec3<Float<W>>(column(0), column(1), column(2))), s.wi);
    s.radiance = bsdf::select(m, map_radiance(scene, texels, c, l), s.radiance);
    s.pdf_solid_angle = select(m, pdf, s.pdf_solid_angle);
    s.valid &= (pdf > Float<W>(0.0f)) | !m;
    s.light = select(m, Int<W>(LightId::Picture), s.light);
}

} // namespace kanuka::transport
