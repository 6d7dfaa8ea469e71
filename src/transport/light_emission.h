// Rays that start at lights (Veach 1997, section 8.3.2; Pharr, Jakob and Humphreys 2023, section 16.1.2): for
// light tracing, caustics and guiding. A place on the light and a direction are drawn, neither of which
// depends on the wavelength. What such a ray carries is
//
//     emitted() * cosine / (chance of the light * pdf_area * pdf_solid_angle)
//
// Lights that are infinitely far start rays on a disk across them that is as large as the scene's bounding
// sphere.
#pragma once

#include "transport/lights.h"

namespace kanuka::transport {

// The lights that rays can start at, by number: analytic ones as LightsView has them, the environment's
// picture, the constant environment, then emitting triangles by slot. Each is chosen by its power.
class EmissionLights {
  public:
    // bounds: of what light is to fall on; must not be empty.
    EmissionLights(const SceneView& scene, const Bounds3f& bounds);

    int picture() const { return m_analytic; }
    int constant() const { return m_analytic + 1; }
    int first_slot() const { return m_analytic + 2; }
    bool empty() const { return m_cumulative.empty(); }
    const Vec3f& center() const { return m_center; }
    float radius() const { return m_radius; }

    // Estimates: powers in units of luminance, of spots and profiles bounds.
    template <int W>
    Int<W> choose(Float<W> u) const {
        return search(m_cumulative.data(), Int<W>(0), Int<W>(int(m_cumulative.size()) - 1), u);
    }
    template <int W>
    Float<W> chance(Int<W> light) const {
        return gather(m_cumulative.data() + 1, light) - gather(m_cumulative.data(), light);
    }

  private:
    int m_analytic;
    Vec3f m_center;
    float m_radius;
    std::vector<float> m_cumulative; // one more than there are lights; empty = none shines
};

template <int W>
struct EmissionDensity {
    // Over the light's area; 1 for lights that are points. Over solid angle; 1 for lights of one direction.
    Float<W> pdf_area{0.0f}, pdf_solid_angle{0.0f};
};

// A ray from a light, a lane each.
template <int W>
struct EmissionSample : EmissionDensity<W> {
    Vec3<Float<W>> P, N, d; // N: of the surface of the light; of points and far lights that is d
    Float<W> cosine;        // between N and d
    Mask<W> valid;
    Int<W> light;
};

// ---- triangles

// Slots of triangles, as light sampling has them: see sample_light().
template <int W>
EmitterLanes<W> emitter_of_slot(const SceneView& scene, Int<W> slot, Mask<W> m) {
    using I = Int<W>;
    const EmitterSlots& slots = scene.lights.slots;
    const I at = select(m, slot, I(0));
    I emitter = at + I(slots.first_emitter), placement(-1);
    const Mask<W> placed = m & (at >= I(slots.in_world));
    if (any(placed)) {
        const I k = select(placed, at - I(slots.in_world), I(0));
        emitter = select(placed, gather(slots.emitter.data(), k), emitter);
        placement = select(placed, gather(slots.placement.data(), k), placement);
    }
    return EmitterLanes<W>(scene, emitter, placement);
}

// ---- densities

template <int W>
Float<W> even_over_sphere() {
    return Float<W>(0.25f * InvPi);
}

// Of the environment's picture: half by its light, half even, since what is no brighter than the mean is not
// sampled (see map_pdf()). d: away from the sky.
template <int W>
Float<W> picture_emission_pdf(const EnvironmentMap& map, const Vec3<Float<W>>& d) {
    if (map.cells.rows == 0)
        return even_over_sphere<W>();
    const MapPlace<W> p = map_place(map, -d);
    const MapCell<W> c(map, p);
    const MapTexels<W> texels(map, c);
    const Float<W> by_light = map_pdf(map, texels.weights(map, c), c, p.sin_theta);
    return (by_light + even_over_sphere<W>()) * Float<W>(0.5f);
}

// The densities with which sample_emission() draws a place with normal N, and a direction. Lights of one
// direction have none; it answers 0.
template <int W>
EmissionDensity<W> pdf_emission(const SceneView& scene, const EmissionLights& lights, Int<W> light,
                                const Vec3<Float<W>>& N, const Vec3<Float<W>>& d, Mask<W> m) {
    using F = Float<W>;
    using I = Int<W>;
    using A = AnalyticLight;
    EmissionDensity<W> pdf;
    const F zero(0.0f), one(1.0f), by_cosine = max(dot(N, d), zero) * F(InvPi);
    const F across(InvPi / (lights.radius() * lights.radius()));
    const auto set = [&](Mask<W> here, F area, F solid_angle) {
        pdf.pdf_area = select(here, area, pdf.pdf_area);
        pdf.pdf_solid_angle = select(here, solid_angle, pdf.pdf_solid_angle);
    };
    if (const Mask<W> here = m & (light < I(lights.picture())); any(here)) {
        const LightLanes<W> of(scene, select(here, light, I(0)));
        const I shape = of.get(&A::shape);
        const F cosine = dot(of.get(&A::axis), d);
        set(here & (shape >= I(A::Quad)), one / max(of.get(&A::area), F(1e-37f)), by_cosine);
        const F low = max(of.get(&A::cos_outer), F(-1.0f));
        set(here & (shape == I(A::Delta)), one,
            select(cosine >= low - F(1e-6f), F(0.5f * InvPi) / max(one - low, F(1e-7f)), zero));
        const F cone = of.get(&A::cone);
        const Vec3<F> off = d - of.get(&A::axis); // |off|^2 = 2 (1 - cos)
        set(here & (shape == I(A::Distant)), across,
            select((cone > zero) & (dot(off, off) <= F(2.0002f) * cone), density_in_cone(cone), zero));
    }
    if (const Mask<W> here = m & (light == I(lights.picture())); any(here))
        set(here, across, picture_emission_pdf(scene.lights.map, d));
    set(m & (light == I(lights.constant())), across, even_over_sphere<W>());
    if (const Mask<W> here = m & (light >= I(lights.first_slot())); any(here)) {
        const EmitterLanes<W> e = emitter_of_slot(scene, light - I(lights.first_slot()), here);
        set(here, F(2.0f) / sqrt(max(dot(e.n, e.n), F(1e-37f))), by_cosine);
    }
    return pdf;
}

// ---- sampling

// Of the directions whose cosine to an axis is from 1 - height to 1, all alike.
template <int W>
Vec3<Float<W>> sample_cap(const Vec3<Float<W>>& axis, Float<W> height, Float<W> u0, Float<W> u1) {
    using F = Float<W>;
    const F drop = u1 * height, r = sqrt(max(drop * (F(2.0f) - drop), F(0.0f)));
    F s, c;
    sincos_2pi(u0, s, c);
    Vec3<F> t, b;
    coordinate_frame(axis, t, b);
    return normalize(t * (r * c) + b * (r * s) + axis * (F(1.0f) - drop));
}

// A place on an analytic light that has a shape, and its normal.
template <int W>
void sample_place(int shape, const LightLanes<W>& light, Float<W> u0, Float<W> u1, Vec3<Float<W>>& P,
                  Vec3<Float<W>>& N) {
    using F = Float<W>;
    using V = Vec3<F>;
    using A = AnalyticLight;
    const F zero(0.0f), one(1.0f), radius = light.get(&A::half_x);
    V place(zero, zero, zero), normal(zero, zero, one); // in the light's space
    F s, c;
    sincos_2pi(u0, s, c);
    if (shape == A::Quad) {
        place = {fma(u0, F(2.0f), -one) * radius, fma(u1, F(2.0f), -one) * light.get(&A::half_y), zero};
    } else if (shape == A::Disk) {
        const F r = radius * sqrt(u1);
        place = {r * c, r * s, zero};
    } else if (shape == A::Sphere) {
        const F z = fma(u1, F(2.0f), -one), r = sqrt(max(one - z * z, zero));
        normal = {r * c, r * s, z};
        place = normal * radius;
    } else {
        normal = {c, s, zero};
        place = {radius * c, radius * s, fma(u1, F(2.0f), -one) * light.get(&A::half_y)};
    }
    P = light.get(&A::position) + light.to_render(place);
    N = light.to_render(normal);
}

template <int W>
class EmissionSampler {
    using F = Float<W>;
    using I = Int<W>;
    using V = Vec3<F>;
    using A = AnalyticLight;

  public:
    EmissionSampler(const SceneView& scene, const EmissionLights& lights, F place0, F place1, F direction0,
                    F direction1)
        : m_scene(scene), m_lights(lights), m_u0(place0), m_u1(place1), m_v0(direction0), m_v1(direction1) {}

    EmissionSample<W> sample(I light, Mask<W> m) {
        const F zero(0.0f), one(1.0f);
        m_s.P = V(zero, zero, zero);
        m_s.N = m_s.d = V(zero, zero, one);
        m_s.light = light;
        Mask<W> one_direction(false);
        if (const Mask<W> here = m & (light < I(m_lights.picture())); any(here))
            from_analytic(light, here, one_direction);
        if (const Mask<W> here = m & (light == I(m_lights.picture())); any(here))
            from_picture(here);
        if (const Mask<W> here = m & (light == I(m_lights.constant())); any(here))
            from_far(sample_cap(m_s.N, F(2.0f), m_v0, m_v1), here);
        if (const Mask<W> here = m & (light >= I(m_lights.first_slot())); any(here))
            from_triangle(light - I(m_lights.first_slot()), here);
        m_s.cosine = dot(m_s.N, m_s.d);
        static_cast<EmissionDensity<W>&>(m_s) = pdf_emission(m_scene, m_lights, light, m_s.N, m_s.d, m);
        m_s.pdf_solid_angle = select(one_direction, one, m_s.pdf_solid_angle);
        m_s.valid = m & (m_s.pdf_area > zero) & (m_s.pdf_solid_angle > zero) & (m_s.cosine > zero);
        return m_s;
    }

  private:
    void put(const V& P, const V& N, const V& d, Mask<W> here) {
        m_s.P = select(here, P, m_s.P);
        m_s.N = select(here, N, m_s.N);
        m_s.d = select(here, d, m_s.d);
    }
    // From a surface, by the cosine.
    void from_surface(const V& P, const V& N, Mask<W> here) {
        V t, b;
        coordinate_frame(N, t, b);
        const V local = bsdf::sample_cosine(m_v0, m_v1);
        put(P, N, normalize(t * local.x + b * local.y + N * local.z), here);
    }
    // From the disk across d, clear of the scene.
    void from_far(const V& d, Mask<W> here) {
        const Vec3f& c = m_lights.center();
        const F R(m_lights.radius()), r = R * sqrt(m_u1);
        F sine, cosine;
        sincos_2pi(m_u0, sine, cosine);
        V t, b;
        coordinate_frame(d, t, b);
        put(V(F(c.x), F(c.y), F(c.z)) + t * (r * cosine) + b * (r * sine) - d * R, d, d, here);
    }
    void from_analytic(I index, Mask<W> m, Mask<W>& one_direction) {
        const LightLanes<W> light(m_scene, select(m, index, I(0)));
        const I shapes = light.get(&A::shape);
        const V axis = light.get(&A::axis);
        for (int shape = A::Delta; shape <= A::Cylinder; shape++) {
            const Mask<W> here = m & (shapes == I(shape));
            if (!any(here))
                continue;
            if (shape == A::Delta) {
                const F low = max(light.get(&A::cos_outer), F(-1.0f));
                const V d = sample_cap(axis, F(1.0f) - low, m_v0, m_v1);
                put(light.get(&A::position), d, d, here);
            } else if (shape == A::Distant) {
                const F cone = light.get(&A::cone);
                one_direction |= here & (cone <= F(0.0f));
                from_far(sample_cap(axis, cone, m_v0, m_v1), here);
            } else {
                V P, N;
                sample_place(shape, light, m_u0, m_u1, P, N);
                from_surface(P, N, here);
            }
        }
    }
    void from_picture(Mask<W> here) {
        const F half(0.5f);
        const Mask<W> by_light = m_scene.lights.map.cells.rows > 0 ? m_v0 < half : Mask<W>(false);
        F u = m_v0;
        if (m_scene.lights.map.cells.rows > 0)
            u = min(select(by_light, m_v0, m_v0 - half) * F(2.0f), F(0.99999994f));
        V d = sample_cap(V(F(0.0f), F(0.0f), F(1.0f)), F(2.0f), u, m_v1);
        if (any(by_light)) {
            LightSample<W> sky;
            sky.wi = d;
            sky.radiance = Spectrum<W>(F(0.0f));
            sky.pdf_solid_angle = F(0.0f);
            sky.valid = here;
            sky.light = I(0);
            const F l[Wavelengths] = {half, half, half, half}; // its radiance is not looked at
            sample_map(m_scene, u, m_v1, sky, l, by_light);
            d = select(by_light, -sky.wi, d);
        }
        from_far(d, here);
    }
    void from_triangle(I slot, Mask<W> here) {
        const EmitterLanes<W> e = emitter_of_slot(m_scene, slot, here);
        F b1, b2;
        place_on_triangle(m_u0, m_u1, b1, b2);
        const V N = e.n * (F(1.0f) / sqrt(max(dot(e.n, e.n), F(1e-37f))));
        from_surface(e.p0 + e.e1 * b1 + e.e2 * b2, N, here);
    }

    const SceneView& m_scene;
    const EmissionLights& m_lights;
    const F m_u0, m_u1, m_v0, m_v1;
    EmissionSample<W> m_s;
};

template <int W>
EmissionSample<W> sample_emission(const SceneView& scene, const EmissionLights& lights, Int<W> light,
                                  Float<W> place0, Float<W> place1, Float<W> direction0, Float<W> direction1,
                                  Mask<W> m) {
    return EmissionSampler<W>(scene, lights, place0, place1, direction0, direction1).sample(light, m);
}

// ---- what rays carry

// Radiance of lights with an area or a cone and of the environment; intensity of points; irradiance, on what
// faces it, of a light of one direction. Of lights whose table or spot depends on where the receiver is and
// not on the direction alone: as seen from afar, but for points, which are seen from a distance of 1.
template <int W>
Spectrum<W> emitted(const SceneView& scene, const EmissionLights& lights, const EmissionSample<W>& s,
                    const Float<W> l[Wavelengths]) {
    using F = Float<W>;
    using I = Int<W>;
    using V = Vec3<F>;
    using A = AnalyticLight;
    const F zero(0.0f);
    Spectrum<W> radiance(zero);
    if (const Mask<W> here = s.valid & (s.light < I(lights.picture())); any(here)) {
        const LightLanes<W> light(scene, select(here, s.light, I(0)));
        const I shape = light.get(&A::shape);
        const V center = light.get(&A::position), local = light.to_light(s.P - center);
        const F half_x = max(light.get(&A::half_x), F(1e-30f)),
                half_y = max(light.get(&A::half_y), F(1e-30f));
        const V place(local.x / half_x, local.y / half_y, zero);
        const V afar = center + s.d * (half_x * F(1e4f));
        V from = select(shape == I(A::Sphere), afar, s.P + s.d);
        from = select(shape == I(A::Distant), s.P, from);
        radiance = bsdf::select(here, light_arriving(scene, light, from, place, l, here), radiance);
    }
    if (const Mask<W> here = s.valid & (s.light == I(lights.picture())); any(here)) {
        const MapCell<W> c(scene.lights.map, map_place(scene.lights.map, -s.d));
        radiance = bsdf::select(here, map_radiance(scene, MapTexels<W>(scene.lights.map, c), c, l), radiance);
    }
    if (const Mask<W> here = s.valid & (s.light == I(lights.constant())); any(here))
        radiance = bsdf::select(here, emission_spectrum(scene, scene.lights.constant.c, l), radiance);
    if (const Mask<W> here = s.valid & (s.light >= I(lights.first_slot())); any(here)) {
        const EmitterLanes<W> e = emitter_of_slot(scene, s.light - I(lights.first_slot()), here);
        radiance = bsdf::select(here,
                                emission_spectrum(scene, e.c0, e.c1, e.c2, e.scale, l) *
                                    emission_falloff(e.flags, s.cosine),
                                radiance);
    }
    return radiance;
}

} // namespace kanuka::transport
