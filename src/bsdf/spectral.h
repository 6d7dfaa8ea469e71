// Spectra in lanes: four hero wavelengths a path, and the uplift of RGB inputs at a hit.
#pragma once

#include "base/rows.h"

namespace kanuka::bsdf {

inline constexpr int Wavelengths = 4;

template <int W>
struct Spectrum {
    Float<W> c[Wavelengths];

    Spectrum() = default;
    explicit Spectrum(Float<W> s) {
        for (auto& x : c)
            x = s;
    }
    Float<W>& operator[](int i) { return c[i]; }
    const Float<W>& operator[](int i) const { return c[i]; }
    friend Spectrum operator+(const Spectrum& a, const Spectrum& b) {
        Spectrum r;
        for (int i = 0; i < Wavelengths; i++)
            r.c[i] = a.c[i] + b.c[i];
        return r;
    }
    friend Spectrum operator*(const Spectrum& a, const Spectrum& b) {
        Spectrum r;
        for (int i = 0; i < Wavelengths; i++)
            r.c[i] = a.c[i] * b.c[i];
        return r;
    }
    friend Spectrum operator*(const Spectrum& a, Float<W> s) {
        Spectrum r;
        for (int i = 0; i < Wavelengths; i++)
            r.c[i] = a.c[i] * s;
        return r;
    }
    Spectrum& operator+=(const Spectrum& o) { return *this = *this + o; }
    Spectrum& operator*=(const Spectrum& o) { return *this = *this * o; }
};

template <int W>
Spectrum<W> select(Mask<W> m, const Spectrum<W>& a, const Spectrum<W>& b) {
    Spectrum<W> r;
    for (int i = 0; i < Wavelengths; i++)
        r.c[i] = kanuka::select(m, a.c[i], b.c[i]);
    return r;
}
template <int W>
Float<W> mean(const Spectrum<W>& s) {
    return ((s.c[0] + s.c[1]) + (s.c[2] + s.c[3])) * Float<W>(0.25f);
}
template <int W>
Float<W> max_component(const Spectrum<W>& s) {
    return max(max(s.c[0], s.c[1]), max(s.c[2], s.c[3]));
}

// The smooth bounded spectrum of Jakob and Hanika (2019) at four wavelengths; l = (lambda - 360) / 470.
// Written without cancellation in the dark, as color::uplift_eval.
template <int W>
Spectrum<W> sigmoid_spectrum(Float<W> c0, Float<W> c1, Float<W> c2, const Float<W> l[Wavelengths]) {
    Spectrum<W> r;
    for (int i = 0; i < Wavelengths; i++) {
        const Float<W> x = fma(fma(c0, l[i], c1), l[i], c2);
        const Float<W> s = sqrt(fma(x, x, Float<W>(1.0f)));
        const Float<W> h = Float<W>(0.5f) / (s * (s + abs(x)));
        r.c[i] = kanuka::select(x < Float<W>(0.0f), h, Float<W>(1.0f) - h);
    }
    return r;
}

// Where the uplift table of color/ lies; see color.h for its layout and the steps below.
struct UpliftView {
    const float* coefficients;
    int resolution;
    float z_factor, z_offset;
};

template <int W>
void uplift(const UpliftView& table, Vec3<Float<W>> rgb, Float<W>& c0, Float<W>& c1, Float<W>& c2) {
    using F = Float<W>;
    using I = Int<W>;
    const F zero(0.0f), one(1.0f), third(1.0f / 3), last(float(table.resolution - 1));
    rgb = {clamp(rgb.x, zero, one), clamp(rgb.y, zero, one), clamp(rgb.z, zero, one)}; // NaN is 0
    F average = (rgb.x + rgb.y + rgb.z) * third;
    const Mask<W> bright = average > F(0.5f);
    rgb = kanuka::select(bright, Vec3<F>(one, one, one) - rgb, rgb);
    average = (rgb.x + rgb.y + rgb.z) * third;
    const Mask<W> x_largest = (rgb.x >= rgb.y) & (rgb.x >= rgb.z),
                  y_largest = (!x_largest) & (rgb.y >= rgb.z);
    const I m = kanuka::select(x_largest, I(0), kanuka::select(y_largest, I(1), I(2)));
    const F v = kanuka::select(x_largest, rgb.x, kanuka::select(y_largest, rgb.y, rgb.z));
    const F a = kanuka::select(x_largest, rgb.y, kanuka::select(y_largest, rgb.z, rgb.x));
    const F b = kanuka::select(x_largest, rgb.z, kanuka::select(y_largest, rgb.x, rgb.y));
    const F divisor = kanuka::select(v > zero, v, one); // divided, not times 1 / v: x / x must be 1
    const F z = fma(F(table.z_factor), sqrt(sqrt(v)) - sqrt(one - v), F(table.z_offset));
    const F at[3] = {sqrt(a / divisor) * last, sqrt(b / divisor) * last, max(z, zero)};
    I cell[3];
    F weight[3][2];
    for (int k = 0; k < 3; k++) {
        cell[k] = min(to_int(at[k]), I(table.resolution - 2));
        weight[k][1] = min(at[k] - F(cell[k]), one);
        weight[k][0] = one - weight[k][1];
    }
    const I n(table.resolution);
    const I base = (((m * n + cell[2]) * n + cell[1]) * n + cell[0]) * I(3);
    F q[3] = {zero, zero, average - F(0.5f)};
#pragma GCC unroll 8
    for (int corner = 0; corner < 8; corner++) {
        const int dx = corner & 1, dy = corner >> 1 & 1, dz = corner >> 2;
        const F w = weight[0][dx] * weight[1][dy] * weight[2][dz];
        // Knots along x are neighbours of three floats: read with the one before, the second stays within.
        const auto knot = load_rows<4>(
            table.coefficients, base + I(((dz * table.resolution + dy) * table.resolution) * 3 + 2 * dx));
#pragma GCC unroll 3
        for (size_t k = 0; k < 3; k++)
            q[k] = fma(w, knot[k + size_t(dx)], q[k]);
    }
    const F s = one / sqrt(max(average * (one - average), F(1e-30f)));
    const F scale = kanuka::select(bright, -s, s);
    c0 = q[0] * scale, c1 = q[1] * scale, c2 = q[2] * scale;
}

} // namespace kanuka::bsdf
