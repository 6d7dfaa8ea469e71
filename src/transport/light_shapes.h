// Analytic lights in lanes, each lane a light of its own: what one sends to a point, places on it, and where
// a ray hits it.
#pragma once

#include "transport/light_environment.h"

namespace kanuka::transport {

// The record of each lane's light, field by field.
template <int W>
struct LightLanes {
    using F = Float<W>;
    using I = Int<W>;
    const AnalyticLight* lights;
    I at;

    LightLanes(std::span<const AnalyticLight> lights, I light)
        : lights(lights.data()), at(light * I(AnalyticWords)) {}
    LightLanes(const SceneView& scene, I light) : LightLanes(scene.lights.analytic, light) {}
    F get(float AnalyticLight::* field) const { return gather(&(lights->*field), at); }
    I get(int32_t AnalyticLight::* field) const { return gather(&(lights->*field), at); }
    Vec3<F> get(Vec3f AnalyticLight::* field) const {
        const float* v = &(lights->*field).x;
        return {gather(v, at), gather(v + 1, at), gather(v + 2, at)};
    }
    Spectrum<W> amount(const SceneView& scene, const F l[Wavelengths]) const {
        const float* c = lights->c;
        return emission_spectrum(scene, gather(c, at), gather(c + 1, at), gather(c + 2, at),
                                 gather(c + 3, at), l);
    }
    // In the light's space.
    Vec3<F> to_light(const Vec3<F>& v) const {
        return {dot(get(&AnalyticLight::x), v), dot(get(&AnalyticLight::y), v),
                dot(get(&AnalyticLight::axis), v)};
    }
    Vec3<F> to_render(const Vec3<F>& v) const {
        return get(&AnalyticLight::x) * v.x + get(&AnalyticLight::y) * v.y + get(&AnalyticLight::axis) * v.z;
    }
};

// A small power, lane by lane.
template <int W>
Float<W> power_of(Float<W> base, Int<W> exponent) {
    Float<W> result(1.0f);
    for (int bit = 0; bit < 10 && any(exponent >= Int<W>(1 << bit)); bit++) {
        result = select((exponent & Int<W>(1 << bit)) != Int<W>(0), result * base, result);
        base *= base;
    }
    return result;
}

// RISpec's spotlight: a smooth edge inside the cone, and a power of the cosine.
template <int W>
Float<W> spot_falloff(Float<W> cos_outer, Float<W> cos_inner, Int<W> exponent, Float<W> cosine) {
    using F = Float<W>;
    const F t = clamp((cosine - cos_outer) / max(cos_inner - cos_outer, F(1e-6f)), F(0.0f), F(1.0f));
    return t * t * (F(3.0f) - F(2.0f) * t) * max(power_of(cosine, exponent), F(0.0f));
}

// What the table of a light says; no falloff with distance. `v`, in the light's space, leads from the light
// to the point; on a quad it is the place, from -1 to 1.
template <int W>
Spectrum<W> table_spectrum(const SceneView& scene, const LightLanes<W>& light, const Vec3<Float<W>>& v,
                           Float<W>& falloff, const Float<W> l[Wavelengths]) {
    using F = Float<W>;
    using I = Int<W>;
    using A = AnalyticLight;
    const F zero(0.0f), one(1.0f);
    const I columns = light.get(&A::width), rows = light.get(&A::height), layers = light.get(&A::layers);
    const F width(columns), height(rows);
    const I shape = light.get(&A::shape);
    const Mask<W> quad = shape == I(A::Quad), flat = quad | (shape == I(A::Distant));
    const F d = sqrt(max(dot(v, v), F(1e-20f))), inv = one / d;
    const F scale = F(0.5f) / select(quad, one, light.get(&A::extent));
    const F theta = acos_over_pi(v.z * inv) * (F(Pi) / light.get(&A::angle));
    const F lit = select(flat | (theta <= one), one, zero);
    const F x = select(flat, fma(v.x, scale, F(0.5f)), turn_of(v.y, v.x)) * width;
    const F y = select(flat, fma(select(quad, -v.y, v.y), scale, F(0.5f)), theta) * height;
    // Layers are a factor of two apart, so the exponent is the layer, and the mantissa goes between.
    const I bits = bitcast_int(clamp(d / light.get(&A::nearest), one, F(1e9f)));
    const F mantissa = bitcast_float((bits & I(0x7fffff)) | I(0x3f800000));
    const F layer = select(layers > I(1), F((bits >> 23) - I(127)) + (mantissa - one), zero);
    falloff = select(flat, one, power_of(inv, light.get(&A::falloff)));
    const auto cell = [&](F at, I count, Mask<W> wraps, I& a, I& b) { // neighbours, between centres
        at -= F(0.5f);
        const F whole = floor(at);
        a = to_int(whole);
        b = a + I(1);
        const I last = count - I(1);
        a = select(wraps & (a < I(0)), a + count, a);
        b = select(wraps & (b >= count), b - count, b);
        a = min(max(a, I(0)), last), b = min(max(b, I(0)), last); // `at` may be NaN, too
        return clamp(at - whole, zero, one);
    };
    I i0, i1, j0, j1;
    const F fx = cell(x, columns, !flat, i0, i1), fy = cell(y, rows, Mask<W>(false), j0, j1);
    const I table = light.get(&A::table);
    const auto at_layer = [&](I k) {
        const auto texel = [&](I i, I j) {
            const I at = table + ((k * rows + j) * columns + i) * I(3);
            const float* rgb = scene.lights.tables.data();
            return Vec3<F>(gather(rgb, at), gather(rgb + 1, at), gather(rgb + 2, at));
        };
        return lerp(fy, lerp(fx, texel(i0, j0), texel(i1, j0)), lerp(fx, texel(i0, j1), texel(i1, j1)));
    };
    const F level = clamp(layer, zero, F(layers - I(1)));
    const I k0 = min(max(to_int(level), I(0)), layers - I(1));
    Vec3<F> rgb = at_layer(k0);
    if (any(layers > I(1)))
        rgb = lerp(level - F(k0), rgb, at_layer(min(k0 + I(1), layers - I(1))));
    // The table's spectrum, bounded as that of a surface, filters the light's own.
    const F most = max(max(max(rgb.x, rgb.y), rgb.z), F(1e-20f));
    F c0, c1, c2;
    bsdf::uplift(scene.spectra.uplift, rgb * (one / most), c0, c1, c2);
    return bsdf::sigmoid_spectrum(c0, c1, c2, l) * (most * lit);
}

// Of directions, even over a cone; see AnalyticLight::cone.
template <int W>
Float<W> density_in_cone(Float<W> cone) {
    return select(cone > Float<W>(0.0f), Float<W>(0.5f * InvPi) / max(cone, Float<W>(1e-20f)),
                  Float<W>(1.0f));
}

// What arrives at P from a light: radiance of those with an area or a cone, irradiance on a surface that
// faces others. The radiance of a cone of angular radius a is its irradiance over pi sin^2 a. `place`: of a
// quad, from -1 to 1.
template <int W>
Spectrum<W> light_arriving(const SceneView& scene, const LightLanes<W>& light, const Vec3<Float<W>>& P,
                           const Vec3<Float<W>>& place, const Float<W> l[Wavelengths], Mask<W> m) {
    using F = Float<W>;
    using I = Int<W>;
    using A = AnalyticLight;
    Spectrum<W> s = light.amount(scene, l);
    const I shape = light.get(&A::shape);
    const Vec3<F> from = P - light.get(&A::position);
    const F d2 = max(dot(from, from), F(1e-20f));
    F falloff = F(1.0f) / d2;
    const F cos_outer = light.get(&A::cos_outer);
    const Mask<W> cone = m & (cos_outer > F(-2.0f));
    if (any(cone)) {
        const F cosine = dot(from, light.get(&A::axis)) / sqrt(d2);
        const F spot = spot_falloff(cos_outer, light.get(&A::cos_inner), light.get(&A::exponent), cosine);
        s = s * select(cone, spot, F(1.0f));
    }
    if (scene.lights.has_tables) {
        const Mask<W> tabulated = m & (light.get(&A::width) > I(0));
        if (any(tabulated)) {
            F table_falloff;
            const Vec3<F> v = select(shape == I(A::Quad), place, light.to_light(from));
            const Spectrum<W> t = table_spectrum(scene, light, v, table_falloff, l);
            s = bsdf::select(tabulated, s * t, s);
            falloff = select(tabulated, table_falloff, falloff);
        }
    }
    const F width = light.get(&A::cone);
    const F spread = select((shape == I(A::Distant)) & (width > F(0.0f)),
                            F(InvPi) / max(width * (F(2.0f) - width), F(1e-20f)), F(1.0f));
    return s * select(shape == I(A::Delta), falloff, spread);
}

// Angles of a rectangle as seen from the origin: Urena, Fajardo and King 2013, An Area-Preserving
// Parametrization for Spherical Rectangles, section 3. Seen under a small angle, a rectangle is sampled by
// area instead: what is lost to rounding is larger there than what is won.
template <int W>
struct QuadView {
    using F = Float<W>;
    F x0, x1, y0, y1, z0; // corners; z0 < 0 where it shines to the point
    F b0, b1, k, solid_angle;
    Mask<W> wide, faces;

    QuadView(const LightLanes<W>& light, const Vec3<F>& P, Mask<W> m) {
        using A = AnalyticLight;
        const Vec3<F> c = light.to_light(light.get(&A::position) - P);
        const F half_x = light.get(&A::half_x), half_y = light.get(&A::half_y);
        x0 = c.x - half_x, x1 = c.x + half_x, y0 = c.y - half_y, y1 = c.y + half_y, z0 = c.z;
        faces = z0 < F(0.0f);
        const F nx = max(max(x0, -x1), F(0.0f)), ny = max(max(y0, -y1), F(0.0f));
        const F d2 = fma(nx, nx, fma(ny, ny, z0 * z0)); // of the nearest point
        wide = m & faces & (light.get(&A::area) * F(16.0f) > d2);
        b0 = b1 = k = F(0.0f);
        solid_angle = F(1.0f);
        if (!any(wide))
            return;
        const auto inv_length = [&](F y) { return F(1.0f) / sqrt(max(fma(z0, z0, y * y), F(1e-30f))); };
        // Normals of the planes through the edges: (0, z0, -y0), (-z0, 0, x1), (0, -z0, y1), (z0, 0, -x0).
        const F l0 = inv_length(y0), l1 = inv_length(x1), l2 = inv_length(y1), l3 = inv_length(x0);
        b0 = -y0 * l0, b1 = y1 * l2;
        const F n1 = x1 * l1, n3 = -x0 * l3;
        const auto angle = [&](F a, F b) { return acos_over_pi(-a * b) * F(Pi); };
        const F g0 = angle(b0, n1), g1 = angle(n1, b1), g2 = angle(b1, n3), g3 = angle(n3, b0);
        k = F(2 * Pi) - g2 - g3;
        const F all = g0 + g1 - k;
        wide &= all > F(0.03f);
        solid_angle = select(wide, all, F(1.0f));
    }
    Vec3<F> sample(F u0, F u1) const { // on the rectangle, from the origin
        F sine, cosine;
        const F angle = fma(u0, solid_angle, k) * F(0.5f * InvPi);
        sincos_2pi(angle - floor(angle), sine, cosine);
        sine = copysign(max(abs(sine), F(1e-7f)), sine);
        const F f = (cosine * b0 - b1) / sine;
        const F cu = clamp(copysign(F(1.0f) / sqrt(fma(f, f, b0 * b0)), f), F(-1.0f), F(1.0f));
        const F xu = clamp(-(cu * z0) / max(sqrt(max(F(1.0f) - cu * cu, F(0.0f))), F(1e-7f)), x0, x1);
        const F d2 = fma(xu, xu, z0 * z0), d = sqrt(d2);
        const F h0 = y0 / sqrt(fma(y0, y0, d2)), h1 = y1 / sqrt(fma(y1, y1, d2));
        const F h = fma(u1, h1 - h0, h0), h2 = h * h;
        const F yv = select(h2 < F(1 - 1e-6f), h * d / sqrt(max(F(1.0f) - h2, F(1e-7f))), y1);
        return {select(wide, xu, fma(u0, x1 - x0, x0)), select(wide, clamp(yv, y0, y1), fma(u1, y1 - y0, y0)),
                z0};
    }
    // Density over solid angle of a point at squared distance d2 in direction w (in the light's space).
    F pdf(F d2, F w_z, F area) const {
        return select(wide, F(1.0f) / solid_angle, d2 / max(-w_z * area, F(1e-20f)));
    }
};

// A point of a light as seen from P. `place`: of a quad, from -1 to 1.
template <int W>
struct LightPoint {
    Vec3<Float<W>> wi, place;
    Float<W> distance, pdf_solid_angle; // the choice left out
    Float<W> cosine; // to the normal of flat lights, 1 of others; what is sampled alone has it
    Mask<W> valid;
};

// Half the angle that a circle fills at a distance from its centre.
template <int W>
Float<W> half_width(Float<W> radius, Float<W> distance) {
    const Float<W> sine = min(radius / distance, Float<W>(1.0f));
    const Float<W> cosine = sqrt(max(Float<W>(1.0f) - sine * sine, Float<W>(0.0f)));
    return max(turn_of(sine, cosine) * Float<W>(2 * Pi), Float<W>(1e-12f));
}

template <int W>
LightPoint<W> sample_shape(int shape, const LightLanes<W>& light, const Vec3<Float<W>>& P, Float<W> u0,
                           Float<W> u1, Mask<W> m) {
    using F = Float<W>;
    using V = Vec3<F>;
    using A = AnalyticLight;
    LightPoint<W> s;
    const F zero(0.0f), one(1.0f);
    s.place = {zero, zero, zero};
    const V to = light.get(&A::position) - P;
    const F radius = light.get(&A::half_x);
    if (shape == A::Sphere) {
        // Uniform in the cone that the sphere fills, written for small ones.
        const F d2 = max(dot(to, to), F(1e-30f)), d = sqrt(d2), sin2 = radius * radius / d2;
        s.valid = m & (sin2 < one);
        const F most = sin2 / (one + sqrt(max(one - sin2, zero))); // 1 - cos
        const F drop = u0 * most, sine2 = drop * (F(2.0f) - drop);
        F sp, cp;
        sincos_2pi(u1, sp, cp);
        V t, b;
        const V axis = to / d;
        coordinate_frame(axis, t, b);
        const F sine = sqrt(max(sine2, zero));
        s.wi = normalize(t * (sine * cp) + b * (sine * sp) + axis * (one - drop));
        s.distance = d * (one - drop) - sqrt(max(radius * radius - d2 * sine2, zero));
        s.cosine = one;
        s.pdf_solid_angle = one / max(F(2 * Pi) * most, F(1e-30f));
        return s;
    }
    V v; // in the light's space, from P
    F cosine, d2;
    if (shape == A::Quad) {
        const QuadView<W> view(light, P, m);
        v = view.sample(u0, u1);
        d2 = max(dot(v, v), F(1e-30f));
        cosine = -v.z / sqrt(d2);
        s.pdf_solid_angle = view.pdf(d2, -cosine, light.get(&A::area));
        s.place = {(v.x - view.x0) / max(light.get(&A::half_x), F(1e-30f)) - one,
                   (v.y - view.y0) / max(light.get(&A::half_y), F(1e-30f)) - one, zero};
    } else if (shape == A::Disk) {
        const V c = light.to_light(to);
        F sp, cp;
        sincos_2pi(u1, sp, cp);
        const F r = radius * sqrt(u0);
        v = {fma(r, cp, c.x), fma(r, sp, c.y), c.z};
        d2 = max(dot(v, v), F(1e-30f));
        cosine = -v.z / sqrt(d2);
        s.pdf_solid_angle = d2 / max(cosine * light.get(&A::area), F(1e-20f));
    } else {
        // Cylinder: across, uniform in the angle that its circle fills; along, uniform in length. With h the
        // distance across the axis and d that to the point, d omega = h^2 / d^3 d psi d z.
        const V c = light.to_light(to);
        const F half_y = light.get(&A::half_y);
        const F rho2 = max(fma(c.x, c.x, c.y * c.y), F(1e-30f)), rho = sqrt(rho2),
                psi = half_width(radius, rho);
        F sp, cp;
        const F turn = (u0 + u0 - one) * psi * F(0.5f * InvPi);
        sincos_2pi(turn - floor(turn), sp, cp);
        const F inside = max(radius * radius - rho2 * sp * sp, zero);
        const F h = max(rho * cp - sqrt(inside), F(1e-20f));
        const F ex = c.x / rho, ey = c.y / rho;
        v = {h * (ex * cp - ey * sp), h * fma(ex, sp, ey * cp), fma(u1 + u1 - one, half_y, c.z)};
        d2 = max(dot(v, v), F(1e-30f));
        cosine = select(rho > radius, one, zero);
        s.pdf_solid_angle = d2 * sqrt(d2) / (F(4.0f) * psi * half_y * h * h);
    }
    s.distance = sqrt(d2);
    s.cosine = cosine; // of what is valid
    s.wi = normalize(light.to_render(v));
    s.valid = m & (cosine > F(1e-6f));
    return s;
}

// Where a ray from P hits a light's outside; its density among sample_shape()'s.
template <int W>
LightPoint<W> intersect_shape(int shape, const LightLanes<W>& light, const Vec3<Float<W>>& P,
                              const Vec3<Float<W>>& wi, Mask<W> m) {
    using F = Float<W>;
    using V = Vec3<F>;
    using A = AnalyticLight;
    LightPoint<W> s;
    const F zero(0.0f), one(1.0f);
    s.wi = wi;
    s.place = {zero, zero, zero};
    const V to = light.get(&A::position) - P;
    const F radius = light.get(&A::half_x);
    if (shape == A::Sphere) {
        const F d2 = max(dot(to, to), F(1e-30f)), sin2 = radius * radius / d2, along = dot(to, wi);
        const V off = to - wi * along;
        const F inside = radius * radius - dot(off, off);
        s.valid = m & (sin2 < one) & (along > zero) & (inside >= zero);
        s.distance = along - sqrt(max(inside, zero));
        s.pdf_solid_angle = one / max(F(2 * Pi) * (sin2 / (one + sqrt(max(one - sin2, zero)))), F(1e-30f));
        return s;
    }
    const V c = light.to_light(to), w = light.to_light(wi);
    if (shape == A::Cylinder) {
        const F half_y = light.get(&A::half_y);
        const F rho2 = fma(c.x, c.x, c.y * c.y), rho = sqrt(max(rho2, F(1e-30f)));
        const F a = max(fma(w.x, w.x, w.y * w.y), F(1e-20f)), b = fma(c.x, w.x, c.y * w.y);
        const F inside = b * b - a * (rho2 - radius * radius);
        const F t = (b - sqrt(max(inside, zero))) / a;
        const F z = fma(w.z, t, -c.z);
        s.valid = m & (rho > radius) & (inside > zero) & (t > zero) & (abs(z) <= half_y);
        s.distance = t;
        s.pdf_solid_angle = t / (F(4.0f) * half_width(radius, rho) * half_y * a);
        return s;
    }
    const F t = c.z / select(w.z < zero, w.z, one);
    const F x = fma(w.x, t, -c.x), y = fma(w.y, t, -c.y);
    s.distance = t;
    s.valid = m & (c.z < zero) & (w.z < zero);
    if (shape == A::Quad) {
        const F half_x = light.get(&A::half_x), half_y = light.get(&A::half_y);
        s.valid &= (abs(x) <= half_x) & (abs(y) <= half_y);
        s.pdf_solid_angle = one;
        if (any(s.valid))
            s.pdf_solid_angle = QuadView<W>(light, P, s.valid).pdf(t * t, w.z, light.get(&A::area));
        s.place = {x / max(half_x, F(1e-30f)), y / max(half_y, F(1e-30f)), zero};
    } else {
        s.valid &= fma(x, x, y * y) <= radius * radius;
        s.pdf_solid_angle = t * t / max(-w.z * light.get(&A::area), F(1e-20f));
    }
    return s;
}

} // namespace kanuka::transport
