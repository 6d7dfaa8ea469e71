// Light selection and sampling. One light a bounce is asked; what it gives is combined with what the
// material's own directions find by the balance heuristic (Veach 1997), over wavelengths too (Wilkie et al.
// 2014).
#pragma once

#include "transport/scene_view.h"

namespace kanuka::transport {

using bsdf::Spectrum;
using bsdf::Wavelengths;

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

// ---- choosing and sampling
// -------------------------------------------------------------------------------------------

// Does an emitter with these flags shine where the cosine to its normal is so much?
template <int W>
Mask<W> in_emission_cone(Int<W> flags, Float<W> cosine) {
    return cosine * Float<W>(store::Emitter::ConeUnit) >= Float<W>((flags >> 1) & Int<W>(0xffff));
}

template <int W>
void sample_emitters(const SceneView& scene, const Vec3<Float<W>>& P, Float<W> u_part, Float<W> u0,
                     Float<W> u1, LightSample<W>& s, const Float<W> l[Wavelengths], Mask<W> m) {
    // Alias table over emitters by power.
    const int count = int(scene.alias_probability.size());
    const Float<W> x = u_part * Float<W>(float(count));
    Int<W> k = min(to_int(x), Int<W>(count - 1));
    const Float<W> rest = x - Float<W>(k);
    k = select(rest < gather(scene.alias_probability.data(), k), k, gather(scene.alias_other.data(), k));
    k = gather(scene.sampled_emitters.data(), k);
    const auto get = load_rows<sizeof(store::Emitter) / 4>(scene.emitters, k << 4);
    const Vec3<Float<W>> p0(get[0], get[1], get[2]), e1(get[3], get[4], get[5]), e2(get[6], get[7], get[8]);
    // Uniform on the triangle: fold the unit square along its diagonal.
    const Mask<W> fold = u0 + u1 > Float<W>(1.0f);
    const Float<W> b1 = select(fold, Float<W>(1.0f) - u0, u0), b2 = select(fold, Float<W>(1.0f) - u1, u1);
    const Vec3<Float<W>> to = p0 + e1 * b1 + e2 * b2 - P;
    const Float<W> d2 = max(dot(to, to), Float<W>(1e-20f)), d = sqrt(d2);
    const Vec3<Float<W>> wi = to / d;
    const Vec3<Float<W>> n = normalize(cross(e1, e2));
    const Int<W> flags = bitcast_int(get[15]);
    const Float<W> facing = select((flags & Int<W>(1)) != Int<W>(0), dot(n, wi), -dot(n, wi));
    // Closer to its plane than positions are exact, nobody can say on which side of the emitter P lies.
    const Float<W> blur = max(max(abs(P.x), abs(P.y)), abs(P.z)) * Float<W>(1.5e-6f);
    const Mask<W> ok = m & (facing > Float<W>(1e-6f)) & (facing * d > blur) & in_emission_cone(flags, facing);
    s.wi = select(m, wi, s.wi);
    s.distance = select(m, d * Float<W>(0.9999f), s.distance);
    s.radiance = bsdf::select(m, emission_spectrum(scene, get[9], get[10], get[11], get[12], l), s.radiance);
    s.pdf = select(m, gather(scene.emitter_density.data(), k) * d2 / max(facing, Float<W>(1e-6f)), s.pdf);
    s.valid &= ok | !m;
}

// RISpec's spotlight: a smooth edge inside the cone, and a power of the cosine.
template <int W>
Float<W> spot_falloff(const AnalyticLight& light, Float<W> cosine) {
    using F = Float<W>;
    const F t = clamp((cosine - F(light.cos_outer)) / F(std::max(light.cos_inner - light.cos_outer, 1e-6f)),
                      F(0.0f), F(1.0f));
    F beam(1.0f);
    const int n = int(light.exponent);
    for (int i = 0; i < n; i++)
        beam *= cosine;
    return t * t * (F(3.0f) - F(2.0f) * t) * max(beam, F(0.0f));
}

// What the table of a light says, times its amount; `to` leads from the light to the point, `d` is its
// length.
template <int W>
Spectrum<W> table_spectrum(const SceneView& scene, const AnalyticLight& light, const Vec3<Float<W>>& to,
                           Float<W> d, const Float<W> l[Wavelengths]) {
    using F = Float<W>;
    using I = Int<W>;
    const float* m = light.light_from_render;
    const auto row = [&](int r) {
        return fma(F(m[3 * r]), to.x, fma(F(m[3 * r + 1]), to.y, F(m[3 * r + 2]) * to.z));
    };
    const F zero(0.0f), one(1.0f), width(float(light.width)), height(float(light.height));
    const bool distant = scene::Light::Kind(light.kind) == scene::Light::Kind::Distant;
    F x, y, lit(1.0f), layer(0.0f);
    if (distant) {
        const F scale(0.5f / light.extent);
        x = fma(row(0), scale, F(0.5f)) * width;
        y = fma(row(1), scale, F(0.5f)) * height;
    } else {
        const F inv = one / d;
        const F theta = acos_over_pi(row(2) * inv) * F(Pi / light.angle);
        lit = select(theta <= one, one, zero);
        y = theta * height;
        x = turn_of(row(1), row(0)) * width;
        if (light.layers > 1) {
            // Layers are a factor of two apart, so the exponent is the layer, and the mantissa goes between.
            const I bits = bitcast_int(clamp(d * F(1 / light.nearest), one, F(1e9f)));
            const F mantissa = bitcast_float((bits & I(0x7fffff)) | I(0x3f800000));
            layer = F((bits >> 23) - I(127)) + (mantissa - one);
        }
        F falloff(1.0f);
        for (int k = 0; k < light.falloff; k++)
            falloff *= inv;
        lit *= falloff;
    }
    const auto cell = [&](F v, int count, bool wraps, I& a, I& b) { // neighbours of v, between centres
        v -= F(0.5f);
        const F whole = floor(v);
        a = to_int(whole);
        b = a + I(1);
        const I n(count), last(count - 1);
        if (wraps) {
            a = select(a < I(0), a + n, a);
            b = select(b >= n, b - n, b);
        }
        a = min(max(a, I(0)), last), b = min(max(b, I(0)), last); // v may be NaN, too
        return clamp(v - whole, zero, one);
    };
    I i0, i1, j0, j1;
    const F fx = cell(x, light.width, !distant, i0, i1), fy = cell(y, light.height, false, j0, j1);
    const float* table = scene.light_tables.data() + light.table;
    const auto at_layer = [&](I k) {
        const auto texel = [&](I i, I j) {
            const I at = ((k * I(light.height) + j) * I(light.width) + i) * I(3);
            return Vec3<F>(gather(table, at), gather(table + 1, at), gather(table + 2, at));
        };
        return lerp(fy, lerp(fx, texel(i0, j0), texel(i1, j0)), lerp(fx, texel(i0, j1), texel(i1, j1)));
    };
    const F level = clamp(layer, zero, F(float(light.layers - 1)));
    const I k0 = min(max(to_int(level), I(0)), I(light.layers - 1));
    Vec3<F> rgb = at_layer(k0);
    if (light.layers > 1)
        rgb = lerp(level - F(k0), rgb, at_layer(min(k0 + I(1), I(light.layers - 1))));
    // The table's spectrum, bounded as that of a surface, filters the light's own.
    const F most = max(max(max(rgb.x, rgb.y), rgb.z), F(1e-20f));
    F c0, c1, c2;
    bsdf::uplift(scene.uplift, rgb * (one / most), c0, c1, c2);
    return bsdf::sigmoid_spectrum(c0, c1, c2, l) * (most * lit);
}

template <int W>
void sample_analytic(const SceneView& scene, const AnalyticLight& light, const Vec3<Float<W>>& P, Float<W> u0,
                     Float<W> u1, LightSample<W>& s, const Float<W> l[Wavelengths], Mask<W> m) {
    using Kind = scene::Light::Kind;
    using F = Float<W>;
    const Kind kind = Kind(light.kind);
    const Spectrum<W> amount = emission_spectrum(scene, light.c, l);
    const Vec3<F> axis(F(light.axis.x), F(light.axis.y), F(light.axis.z));
    if (kind == Kind::Distant) {
        // A cone of directions about -axis; the irradiance is `amount` for a surface facing it.
        F sp, cp;
        sincos_2pi(u0, sp, cp);
        const F z = fma(u1, F(light.cos_angle) - F(1.0f), F(1.0f)), r = sqrt(max(F(1.0f) - z * z, F(0.0f)));
        Vec3<F> t, b;
        coordinate_frame(axis, t, b);
        s.wi = select(m, normalize(t * (r * cp) + b * (r * sp) - axis * z), s.wi);
        Spectrum<W> tinted = amount;
        if (light.width > 0)
            tinted = tinted * table_spectrum(
                                  scene, light,
                                  P - Vec3<F>(F(light.position.x), F(light.position.y), F(light.position.z)),
                                  F(1.0f), l);
        s.radiance = bsdf::select(m, tinted, s.radiance);
        s.delta |= m;
        return;
    }
    const Vec3<F> to = Vec3<F>(F(light.position.x), F(light.position.y), F(light.position.z)) - P;
    const F d2 = max(dot(to, to), F(1e-20f)), d = sqrt(d2);
    const Vec3<F> wi = to / d;
    Spectrum<W> arrives;
    if (light.width > 0)
        arrives = amount * table_spectrum(scene, light, -to, d, l);
    else
        arrives = amount * (kind == Kind::Spot ? spot_falloff(light, -dot(wi, axis)) / d2 : F(1.0f) / d2);
    s.wi = select(m, wi, s.wi);
    s.distance = select(m, d, s.distance);
    s.radiance = bsdf::select(m, arrives, s.radiance);
    s.delta |= m;
}

// How often each choice of light is asked at a point: by an estimate of the irradiance it brings there
// unshadowed, mixed with equal shares, so that none starves where the estimate is wrong. Exact where lights
// are few; scenes with more fall back on equal shares.
template <int W>
class LightChances {
    using F = Float<W>;

  public:
    static constexpr int Exact = 24;

    LightChances(const SceneView& scene, const Vec3<F>& P, const Vec3<F>& N) : m_count(scene.choices) {
        if (m_count > Exact || m_count < 2)
            return;
        F total(0.0f);
        const auto set = [&](int choice, F brings) {
            m_chance[choice] = brings;
            total += brings;
        };
        if (scene.emitter_choice >= 0) {
            const Vec3f c = scene.emitter_center;
            const Vec3<F> to = Vec3<F>(F(c.x), F(c.y), F(c.z)) - P;
            set(scene.emitter_choice, F(scene.emitter_power) / max(dot(to, to), F(scene.emitter_radius2)));
        }
        if (scene.map_choice >= 0)
            set(scene.map_choice, F(scene.map_brings));
        for (size_t k = 0; k < scene.lights.size(); k++)
            set(scene.first_light_choice + int(k), brings(scene.lights[k], P, N));
        const F scale = F(0.85f) / max(total, F(1e-20f)), share(0.15f / float(m_count));
        for (int k = 0; k < m_count; k++)
            m_chance[k] =
                kanuka::select(total > F(1e-20f), fma(m_chance[k], scale, share), F(1.0f / float(m_count)));
    }
    F of(int choice) const {
        if (choice < 0)
            return F(0.0f);
        return m_count > Exact || m_count < 2 ? F(1.0f / float(m_count)) : m_chance[choice];
    }
    Int<W> choose(F u) const {
        if (m_count > Exact || m_count < 2)
            return min(to_int(u * F(float(m_count))), Int<W>(m_count - 1));
        Int<W> choice(0);
        F from(0.0f);
        for (int k = 0; k + 1 < m_count; k++) {
            from += m_chance[k];
            choice = kanuka::select(u >= from, Int<W>(k + 1), choice);
        }
        return choice;
    }

  private:
    static F brings(const AnalyticLight& light, const Vec3<F>& P, const Vec3<F>& N) {
        using Kind = scene::Light::Kind;
        const F amount(0.5f * light.c[3]);
        const Vec3<F> axis(F(light.axis.x), F(light.axis.y), F(light.axis.z));
        const auto facing = [&](F cosine) { return max(cosine, F(0.02f)); }; // surfaces may transmit, too
        if (Kind(light.kind) == Kind::Distant)
            return amount * facing(-dot(axis, N));
        const Vec3<F> to = Vec3<F>(F(light.position.x), F(light.position.y), F(light.position.z)) - P;
        const F d2 = max(dot(to, to), F(1e-20f)), inv = F(1.0f) / sqrt(d2);
        const F b = amount / d2 * facing(dot(to, N) * inv);
        return Kind(light.kind) == Kind::Spot ? b * spot_falloff(light, -dot(to, axis) * inv) : b;
    }

    int m_count;
    F m_chance[Exact];
};

template <int W>
LightSample<W> sample_light(const SceneView& scene, const LightChances<W>& chances, const Vec3<Float<W>>& P,
                            Float<W> u_choice, Float<W> u_part, Float<W> u0, Float<W> u1,
                            const Float<W> l[Wavelengths], Mask<W> active) {
    using F = Float<W>;
    LightSample<W> s;
    s.wi = {F(0.0f), F(0.0f), F(1.0f)};
    s.distance = F(1e30f);
    s.radiance = Spectrum<W>(F(0.0f));
    s.pdf = F(1.0f);
    s.delta = Mask<W>(false);
    s.valid = active;
    const Int<W> choice = chances.choose(u_choice);
    if (scene.emitter_choice >= 0) {
        const Mask<W> m = active & (choice == Int<W>(scene.emitter_choice));
        if (any(m)) {
            sample_emitters(scene, P, u_part, u0, u1, s, l, m);
            s.pdf = select(m, s.pdf * chances.of(scene.emitter_choice), s.pdf);
        }
    }
    if (scene.map_choice >= 0) {
        const Mask<W> m = active & (choice == Int<W>(scene.map_choice));
        if (any(m)) {
            sample_map(scene, u0, u1, s, l, m);
            s.pdf = select(m, s.pdf * chances.of(scene.map_choice), s.pdf);
        }
    }
    for (size_t k = 0; k < scene.lights.size(); k++) {
        const Mask<W> m = active & (choice == Int<W>(scene.first_light_choice + int(k)));
        if (any(m)) {
            sample_analytic(scene, scene.lights[k], P, u0, u1, s, l, m);
            s.pdf = select(m, chances.of(scene.first_light_choice + int(k)), s.pdf);
        }
    }
    return s;
}

} // namespace kanuka::transport
