// Next-event estimation. One light a bounce is sampled; its contribution is combined with what the material's
// own directions find by the balance heuristic (Veach 1997), over wavelengths too (Wilkie et al. 2014).
#pragma once

#include "transport/light_choice.h"
#include "transport/light_portals.h"

namespace kanuka::transport {

// ---- where shadow rays end
// They end before their light: emitting triangles must not cover themselves, nor a ceiling the panel in it.
// By as much as both may be off by rounding, and no more, since what lies close before a light shades it
// (Pharr, Jakob and Humphreys 2023, section 6.8).

template <int W>
Float<W> size_of(const Vec3<Float<W>>& v) {
    return max(max(abs(v.x), abs(v.y)), abs(v.z));
}

// How far off its surface a place on a light may be found: gamma(n) = n u / (1 - n u), u = 2^-24, times the
// sizes that it was computed from. A point of a triangle takes 5 roundings, one in an instance 4 more, the
// start of the ray 2, its direction 4, and the tracer's own test, which moves vertices to the start of the
// ray, about 8: 23 in all.
template <int W>
Float<W> rounding_between(const Vec3<Float<W>>& P, Float<W> size_at_light) {
    return (size_of(P) + size_at_light) * Float<W>(24 * 0x1p-24f);
}

// `cosine`: between the ray and the light's normal. Half the distance is left in any case.
template <int W>
Float<W> shadow_end(Float<W> distance, Float<W> cosine, Float<W> rounding) {
    return distance - min(rounding / max(cosine, Float<W>(1e-6f)), Float<W>(0.5f) * distance);
}

// ---- places on lights

// The part of its radiance that an emitter with these flags sends where the cosine to its normal is so much.
template <int W>
Float<W> emission_falloff(Int<W> flags, Float<W> cosine) {
    using F = Float<W>;
    using S = store::EmissionShape;
    const F zero(0.0f), one(1.0f), unit(store::Emitter::ConeUnit);
    const F cone((flags >> S::ConeShift) & Int<W>(0xffff));
    const F hard = select(cosine * unit >= cone, one, zero);
    const Int<W> more = (flags >> S::MoreShift) & Int<W>(int(S::MoreMask));
    const Mask<W> shaped = more != Int<W>(0);
    if (!any(shaped))
        return hard;
    const F x = F(more) * F(1 / float(S::MoreMask));
    const F outer = cone / unit, wide = max((one - outer) * x, F(1e-6f));
    const F t = clamp((cosine - outer) / wide, zero, one);
    const F power = exp2((exp2(x * F(S::ExponentRange)) - one) * log2(clamp(cosine, F(1e-6f), one)));
    const Mask<W> powered = (flags & Int<W>(int(S::Power))) != Int<W>(0);
    return hard * select(shaped, select(powered, power, t * t * (F(3.0f) - F(2.0f) * t)), one);
}

// Corner and sides of an emitting triangle in render space, and the normal of the side that shines, as long
// as twice its area.
template <int W>
struct EmitterLanes {
    using F = Float<W>;
    Vec3<F> p0, e1, e2, n;
    F c0, c1, c2, scale;
    F size; // of the numbers its places are made of
    Int<W> flags;

    // placement: index into EmitterSlots::placements; -1 = it lies in render space
    EmitterLanes(const SceneView& scene, Int<W> emitter, Int<W> placement) {
        const auto e = load_rows<sizeof(store::Emitter) / 4>(scene.geometry.emitters, emitter << 4);
        p0 = {e[0], e[1], e[2]}, e1 = {e[3], e[4], e[5]}, e2 = {e[6], e[7], e[8]};
        c0 = e[9], c1 = e[10], c2 = e[11], scale = e[12];
        flags = bitcast_int(e[15]);
        size = size_of(p0) + size_of(e1) + size_of(e2);
        F side = select((flags & Int<W>(1)) != Int<W>(0), F(-1.0f), F(1.0f));
        const Mask<W> placed = placement >= Int<W>(0);
        if (any(placed)) {
            const Int<W> first = select(placed, placement, Int<W>(0)) * Int<W>(12);
            F m[12];
            for (int k = 0; k < 12; k++)
                m[k] = gather(scene.lights.slots.placements.data() + k, first);
            side = select(placed, transform(m, placed) * side, side);
        }
        n = cross(e1, e2) * side;
    }
    // Returns the sign of the determinant: normals turn over where a placement mirrors.
    F transform(const F m[12], Mask<W> where) {
        using V = Vec3<F>;
        const V r0(m[0], m[1], m[2]), r1(m[4], m[5], m[6]), r2(m[8], m[9], m[10]);
        const auto turn = [&](const V& v) { return V(dot(r0, v), dot(r1, v), dot(r2, v)); };
        const auto longest = [](const V& row) { return abs(row.x) + abs(row.y) + abs(row.z); };
        const V moved(m[3], m[7], m[11]);
        size = select(where, size * max(max(longest(r0), longest(r1)), longest(r2)) + size_of(moved), size);
        p0 = select(where, turn(p0) + moved, p0);
        e1 = select(where, turn(e1), e1);
        e2 = select(where, turn(e2), e2);
        return copysign(F(1.0f), dot(r0, cross(r1, r2)));
    }
};

// Uniform on a triangle: the halves of the unit square beside its diagonal, each pressed into a half of the
// triangle (Heitz 2019, A Low-Distortion Map Between Triangle and Square). Folding the square would lay two
// halves of a net over one another.
template <int W>
void place_on_triangle(Float<W> u0, Float<W> u1, Float<W>& b1, Float<W>& b2) {
    const Mask<W> upper = u1 > u0;
    const Float<W> half = Float<W>(0.5f) * min(u0, u1), rest = max(u0, u1) - half;
    b1 = select(upper, half, rest), b2 = select(upper, rest, half);
}

template <int W>
void sample_emitters(const SceneView& scene, const Vec3<Float<W>>& P, Int<W> emitter, Int<W> placement,
                     Float<W> u0, Float<W> u1, LightSample<W>& s, const Float<W> l[Wavelengths], Mask<W> m,
                     Float<W> chance) { // chance < 0: by the table of densities
    using F = Float<W>;
    const EmitterLanes<W> e(scene, emitter, placement);
    F b1, b2;
    place_on_triangle(u0, u1, b1, b2);
    const Vec3<F> to = e.p0 + e.e1 * b1 + e.e2 * b2 - P;
    const F d2 = max(dot(to, to), F(1e-20f)), d = sqrt(d2);
    const Vec3<F> wi = to / d;
    const F twice = sqrt(max(dot(e.n, e.n), F(1e-37f)));
    const F facing = -dot(e.n, wi) / twice;
    const F density = scene.lights.tree.empty() ? gather(scene.lights.alias.pdf_area.data(), emitter) * chance
                                                : F(2.0f) * chance / twice;
    // Closer to its plane than positions are exact, nobody can say on which side of the emitter P lies.
    const F rounding = rounding_between(P, e.size);
    const Mask<W> ok = (facing > F(1e-6f)) & (facing * d > rounding);
    const F falloff = emission_falloff(e.flags, facing);
    s.wi = select(m, wi, s.wi);
    s.distance = select(m, shadow_end(d, facing, rounding), s.distance);
    s.radiance =
        bsdf::select(m, emission_spectrum(scene, e.c0, e.c1, e.c2, e.scale, l) * falloff, s.radiance);
    s.pdf_solid_angle = select(m, density * d2 / max(facing, F(1e-6f)), s.pdf_solid_angle);
    s.valid &= (ok & (falloff > F(0.0f))) | !m;
    s.light = select(m, LightId::of_emitter(emitter), s.light);
}

// Lights of one shape, a lane each.
template <int W>
void sample_analytic(const SceneView& scene, int shape, Int<W> index, const Vec3<Float<W>>& P, Int<W> set,
                     Float<W> u0, Float<W> u1, LightSample<W>& s, const Float<W> l[Wavelengths], Mask<W> m,
                     Float<W> chance) {
    using F = Float<W>;
    using V = Vec3<F>;
    using A = AnalyticLight;
    const LightLanes<W> light(scene, select(m, index, Int<W>(0)));
    if (scene.lights.shadow_linked || scene.lights.shadowless)
        s.passes = select(m, light.get(&A::passes), s.passes);
    if (scene.lights.linked)
        s.valid &= ((set & light.get(&A::sets)) != Int<W>(0)) | !m;
    V place(F(0.0f), F(0.0f), F(0.0f));
    if (shape == A::Distant) {
        // A cone of directions about -axis, all alike.
        const V axis = light.get(&A::axis);
        F sp, cp;
        sincos_2pi(u0, sp, cp);
        const F cone = light.get(&A::cone), drop = u1 * cone, // written for small ones
            r = sqrt(max(drop * (F(2.0f) - drop), F(0.0f)));
        V t, b;
        coordinate_frame(axis, t, b);
        s.wi = select(m, normalize(t * (r * cp) + b * (r * sp) - axis * (F(1.0f) - drop)), s.wi);
        s.pdf_solid_angle = select(m, chance * density_in_cone(cone), s.pdf_solid_angle);
        s.delta |= m & (cone <= F(0.0f));
        if (scene.lights.shadow_linked || scene.lights.shadowless)
            s.delta |= m & (s.passes != Int<W>(0));
    } else if (shape == A::Delta) {
        const V to = light.get(&A::position) - P;
        const F d = sqrt(max(dot(to, to), F(1e-20f)));
        s.wi = select(m, to / d, s.wi);
        // What it lies in is not in its way, as long as that does not lie too flat.
        s.distance = select(m, shadow_end(d, F(0.25f), rounding_between(P, size_of(P + to))), s.distance);
        s.pdf_solid_angle = select(m, chance, s.pdf_solid_angle);
        s.delta |= m;
    } else {
        const LightPoint<W> point = shape == A::Quad ? sample_quad(scene, light, P, u0, u1, m)
                                                     : sample_shape(shape, light, P, u0, u1, m);
        s.wi = select(m, point.wi, s.wi);
        const F rounding = rounding_between(P, size_of(P + point.wi * point.distance));
        s.distance = select(m, shadow_end(point.distance, point.cosine, rounding), s.distance);
        s.pdf_solid_angle = select(m, point.pdf_solid_angle * chance, s.pdf_solid_angle);
        s.valid &= point.valid | !m;
        place = point.place;
        if (scene.lights.shadow_linked ||
            scene.lights.shadowless) // no ray finds what only this light's shadow rays pass through
            s.delta |= m & (s.passes != Int<W>(0));
    }
    s.radiance = bsdf::select(m, light_arriving(scene, light, P, place, l, m), s.radiance);
    if (scene.lights.shadowless) // nothing blocks it
        s.distance = select(m & (s.passes == Int<W>(A::Shadowless)), F(0.0f), s.distance);
}

// What a light sample takes. Where there is but one choice, which of its parts is sampled is of a net with
// the place on it.
template <int W>
struct LightNumbers {
    Float<W> choice{0.0f}, part{0.0f}, u0, u1;

    LightNumbers(const SceneView& scene, const Sampler<W>& sampler, int bounce) {
        const bool one = scene.lights.choices == 1;
        sampler.sample_3d(bounce_net(bounce, Net::Light), u0, u1, one ? part : choice);
        if (scene.lights.emitter_choice >= 0) // the hierarchy goes on with the digits of `choice`
            (one ? choice : part) = sampler.sample_1d(bounce_net(bounce, Net::LightMore));
    }
};

// Through portals, where there are any. chance: of the choice.
template <int W>
void sample_environment(const SceneView& scene, const Receiver<W>& r, Float<W> u0, Float<W> u1,
                        LightSample<W>& s, const Float<W> l[Wavelengths], Mask<W> m, Float<W> chance) {
    if (!scene.lights.portals.empty()) {
        PortalChooser<W>(scene, r.P, m).sample(u0, u1, s);
        s.radiance = bsdf::select(m, environment_radiance(scene, s.wi, r.set, l), s.radiance);
        s.light = select(m, Int<W>(LightId::Picture), s.light);
    } else {
        sample_map(scene, u0, u1, s, l, m);
    }
    s.pdf_solid_angle = select(m, s.pdf_solid_angle * chance, s.pdf_solid_angle);
    if (scene.lights.linked)
        s.valid &= ((r.set & Int<W>(scene.lights.map_choice_sets)) != Int<W>(0)) | !m;
}

template <int W>
LightSample<W> sample_light(const SceneView& scene, const LightChooser<W>& chooser, const Receiver<W>& r,
                            int sample, const LightNumbers<W>& numbers, const Float<W> l[Wavelengths],
                            Mask<W> active) {
    const Float<W> u_choice = numbers.choice, u_part = numbers.part, u0 = numbers.u0, u1 = numbers.u1;
    using F = Float<W>;
    using I = Int<W>;
    LightSample<W> s;
    s.wi = {F(0.0f), F(0.0f), F(1.0f)};
    s.distance = F(1e30f);
    s.radiance = Spectrum<W>(F(0.0f));
    s.pdf_solid_angle = F(1.0f);
    s.delta = Mask<W>(false);
    s.valid = active;
    s.passes = I(0);
    s.light = I(LightId::Surface);
    const I choice = chooser.choose(u_choice, sample);
    I analytic(-1);
    F chance(0.0f);
    if (scene.lights.by_choice > 0) {
        const Mask<W> m = active & (choice >= I(scene.lights.first_light_choice));
        analytic = select(m, choice - I(scene.lights.first_light_choice), analytic);
        if (any(m))
            chance = chooser.pdf(choice);
    }
    if (scene.lights.emitter_choice >= 0) {
        const Mask<W> m = active & (choice == I(scene.lights.emitter_choice));
        if (any(m) && scene.lights.tree.empty()) {
            // Alias table by area.
            const int count = int(scene.lights.alias.probability.size());
            const F x = u_part * F(float(count));
            I k = min(to_int(x), I(count - 1));
            const F rest = x - F(k);
            k = select(rest < gather(scene.lights.alias.probability.data(), k), k,
                       gather(scene.lights.alias.other.data(), k));
            k = gather(scene.lights.alias.emitters.data(), k);
            sample_emitters(scene, r.P, k, I(-1), u0, u1, s, l, m, chooser.pdf(scene.lights.emitter_choice));
        } else if (any(m)) {
            I leaf;
            F part;
            pick_leaf(scene.lights.tree, r, u_part, u_choice, m, leaf, part);
            part *= chooser.pdf(scene.lights.emitter_choice);
            s.valid &= (part > F(0.0f)) | !m;
            const Mask<W> triangle = m & (leaf < I(scene.lights.slots.count)) & (part > F(0.0f));
            if (any(triangle)) {
                I emitter = leaf + I(scene.lights.slots.first_emitter), placement(-1);
                const Mask<W> placed = triangle & (leaf >= I(scene.lights.slots.in_world));
                if (any(placed)) {
                    const I k = select(placed, leaf - I(scene.lights.slots.in_world), I(0));
                    emitter = select(placed, gather(scene.lights.slots.emitter.data(), k), emitter);
                    placement = select(placed, gather(scene.lights.slots.placement.data(), k), placement);
                }
                emitter = select(triangle, emitter, I(0));
                sample_emitters(scene, r.P, emitter, placement, u0, u1, s, l, triangle, part);
            }
            const Mask<W> other = m & (leaf >= I(scene.lights.slots.count)) & (part > F(0.0f));
            analytic = select(other, leaf - I(scene.lights.slots.count), analytic);
            chance = select(other, part, chance);
        }
    }
    if (scene.lights.map_choice >= 0)
        if (const Mask<W> m = active & (choice == I(scene.lights.map_choice)); any(m))
            sample_environment(scene, r, u0, u1, s, l, m, chooser.pdf(scene.lights.map_choice));
    const Mask<W> some = active & (analytic >= I(0));
    if (any(some)) {
        s.light = select(some, analytic, s.light);
        const I shapes = LightLanes<W>(scene, select(some, analytic, I(0))).get(&AnalyticLight::shape);
        for (uint32_t kinds = scene.lights.shapes; kinds; kinds &= kinds - 1) {
            const int shape = __builtin_ctz(kinds);
            const Mask<W> m = some & (shapes == I(shape));
            if (any(m))
                sample_analytic(scene, shape, analytic, r.P, r.set, u0, u1, s, l, m, chance);
        }
    }
    if (scene.lights.linked)
        s.valid &= s.pdf_solid_angle > F(0.0f); // no light shines on some
    return s;
}

} // namespace kanuka::transport
