// Light selection and sampling. One light a bounce is asked; what it gives is combined with what the
// material's own directions find by the balance heuristic (Veach 1997), over wavelengths too (Wilkie et al.
// 2014).
#pragma once

#include "transport/light_shapes.h"
#include "transport/media.h"

namespace kanuka::transport {

template <int W>
using PathRow = Row<W, PathState::Fields>;

// Where light is asked for.
template <int W>
struct Receiver {
    Vec3<Float<W>> P, N; // N: on the side that light comes from; zero = from everywhere
    Mask<W> oriented;    // N is not zero
    Int<W> set{1};       // light linking: store::Links::lit_sets
};

// What the links of each lane's shape say.
template <int W>
Int<W> links_of(const SceneView& scene, Int<W> shape, int32_t store::Links::* field) {
    const Int<W> at =
        gather(scene.shapes + offsetof(store::ShapeRecord, links) / 4, shape * Int<W>(store::ShapeWords));
    return gather(&(scene.links->*field), at * Int<W>(int(sizeof(store::Links) / 4)));
}

// ---- the hierarchy, in lanes
// ---------------------------------------------------------------------------------------

// Importances of a hierarchy of one node; lanes are points, and no lane differs from what the walk of
// light_walk.cpp would do.
template <int W, class Use>
void flat_importances(const LightTree& tree, const Receiver<W>& r, Use&& use) {
    using F = Float<W>;
    const LightNode& n = tree.nodes[0];
    for (int k = 0; k < LightNode::Width && n.power[k] > 0; k++) {
        const LightChild<W> child{{F(n.x[k]), F(n.y[k]), F(n.z[k])},
                                  F(n.radius[k]),
                                  {F(n.axis_x[k]), F(n.axis_y[k]), F(n.axis_z[k])},
                                  F(n.cos_spread[k]),
                                  F(n.cos_reach[k]),
                                  F(n.power[k])};
        const F brings = light_importance(child, r.P, r.N, r.oriented, tree.round);
        use(k, select((Int<W>(n.sets[k]) & r.set) != Int<W>(0), brings, F(0.0f)));
    }
}

template <int W>
LightQuery query_of(const Receiver<W>& r, int i) {
    LightQuery q{{r.P.x[i], r.P.y[i], r.P.z[i]}, {0, 0, 0}, r.set[i]};
    if (r.oriented[i])
        q.N = {r.N.x[i], r.N.y[i], r.N.z[i]};
    return q;
}

// Picks a leaf for each lane of m; the chance is 0 where nothing can bring light. `u_more` goes on where the
// digits of `u` end.
template <int W>
void pick_leaf(const LightTree& tree, const Receiver<W>& r, Float<W> u, Float<W> u_more, Mask<W> m,
               Int<W>& leaf, Float<W>& chance) {
    using F = Float<W>;
    leaf = Int<W>(0);
    chance = F(0.0f);
    if (!tree.flat()) {
        static_assert(W <= MostWalks);
        LightQuery queries[W];
        LightPick picks[W];
        double numbers[W] = {};
        int count = 0;
        for (uint32_t bits = m.bits(); bits; bits &= bits - 1) {
            const int i = __builtin_ctz(bits);
            queries[count] = query_of(r, i);
            numbers[count++] = double(u[i]) + 0x1p-24 * double(u_more[i]);
        }
        pick_lights(tree, count, queries, numbers, picks);
        count = 0;
        for (uint32_t bits = m.bits(); bits; bits &= bits - 1, count++) {
            const int i = __builtin_ctz(bits);
            if (picks[count].leaf >= 0)
                leaf.v[i] = picks[count].leaf, chance.v[i] = picks[count].chance;
        }
        return;
    }
    F up_to[LightNode::Width], total(0.0f);
    int count = 0;
    flat_importances(tree, r, [&](int k, F brings) {
        total += brings;
        up_to[k] = total;
        count++;
    });
    const F target = u * total;
    F before(0.0f), share(0.0f);
    Mask<W> open = m & (total > F(0.0f)) & is_finite(total);
    for (int k = 0; k < count; k++) {
        // The last child with a share takes what rounding leaves.
        const Mask<W> here = open & (up_to[k] > before) & ((target < up_to[k]) | (up_to[k] >= total));
        leaf = select(here, Int<W>(~tree.nodes[0].child[k]), leaf);
        share = select(here, up_to[k] - before, share);
        before = up_to[k];
        open &= !here;
    }
    chance = select(m, share / max(total, F(1e-37f)), F(0.0f));
}

// The chance of pick_leaf() for a leaf a lane.
template <int W>
Float<W> chance_of_leaf(const LightTree& tree, const Receiver<W>& r, Int<W> leaf, Mask<W> m) {
    using F = Float<W>;
    F chance(0.0f);
    if (tree.empty())
        return chance;
    if (!tree.flat()) {
        for (uint32_t bits = m.bits(); bits; bits &= bits - 1) {
            const int i = __builtin_ctz(bits);
            chance.v[i] = chance_of_light(tree, query_of(r, i), leaf[i]);
        }
        return chance;
    }
    F total(0.0f), share(0.0f);
    flat_importances(tree, r, [&](int k, F brings) {
        const F before = total;
        total += brings;
        share = select(leaf == Int<W>(~tree.nodes[0].child[k]), total - before, share);
    });
    return select(m & (total > F(0.0f)) & is_finite(total), share / max(total, F(1e-37f)), F(0.0f));
}

// ---- choosing
// ------------------------------------------------------------------------------------------------------

// How often each choice of light is asked at a point: by an estimate of the irradiance it brings there
// unshadowed, mixed with equal shares, so that none starves where the estimate is wrong. Exact where lights
// are few; scenes with more have them in the hierarchy, or fall back on equal shares where they are distant.
template <int W>
class LightChances {
    using F = Float<W>;

  public:
    static constexpr int Exact = 24;

    LightChances(const SceneView& scene, const Receiver<W>& r) : m_count(scene.choices) {
        m_equal = F(m_count > 0 ? 1.0f / float(m_count) : 0.0f);
        m_exact = m_count <= Exact && (m_count > 1 || scene.linked);
        if (!m_exact)
            return;
        F total(0.0f), open(0.0f);
        const auto set = [&](int choice, F brings, int32_t sets) {
            F share(1.0f);
            if (scene.linked) {
                const Mask<W> shines = (r.set & Int<W>(sets)) != Int<W>(0);
                brings = kanuka::select(shines, brings, F(0.0f));
                share = kanuka::select(shines, F(1.0f), F(0.0f));
                m_share[choice] = share;
            }
            m_chance[choice] = brings;
            total += brings;
            open += share;
        };
        if (scene.emitter_choice >= 0) {
            const Vec3f c = scene.emitter_center;
            const Vec3<F> to = Vec3<F>(F(c.x), F(c.y), F(c.z)) - r.P;
            set(scene.emitter_choice, F(scene.emitter_power) / max(dot(to, to), F(scene.emitter_radius2)),
                -1);
        }
        if (scene.map_choice >= 0)
            set(scene.map_choice, F(scene.map_brings), scene.map_sets);
        for (int k = 0; k < scene.lights_by_choice; k++)
            set(scene.first_light_choice + k, brings(scene, k, r), scene.lights[size_t(k)].sets);
        const Mask<W> some = total > F(1e-20f);
        const F scale = F(0.85f) / max(total, F(1e-20f)), share = F(0.15f) / max(open, F(1.0f)),
                alone = F(1.0f) / max(open, F(1.0f));
        for (int k = 0; k < m_count; k++) {
            m_chance[k] = kanuka::select(some, fma(m_chance[k], scale, share), alone);
            if (scene.linked)
                m_chance[k] *= m_share[k];
        }
    }
    F of(int choice) const {
        if (choice < 0)
            return F(0.0f);
        return m_exact ? m_chance[choice] : m_equal;
    }
    F of(Int<W> choice) const {
        if (!m_exact)
            return m_equal;
        F chance(0.0f);
        for (int k = 0; k < m_count; k++)
            chance = kanuka::select(choice == Int<W>(k), m_chance[k], chance);
        return chance;
    }
    Int<W> choose(F u) const {
        if (!m_exact)
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
    static F brings(const SceneView& scene, int k, const Receiver<W>& r) {
        const AnalyticLight& light = scene.lights[size_t(k)];
        const LightBound& b = scene.bounds[size_t(k)];
        const Vec3<F> axis(F(b.axis.x), F(b.axis.y), F(b.axis.z)),
            center(F(b.center.x), F(b.center.y), F(b.center.z));
        if (light.shape == AnalyticLight::Distant) // surfaces may transmit, too
            return F(b.power) * kanuka::select(r.oriented, max(-dot(axis, r.N), F(0.02f)), F(0.5f));
        const LightChild<W> child{center, F(b.radius), axis, F(b.cos_spread), F(b.cos_reach), F(b.power)};
        F estimate = light_importance(child, r.P, r.N, r.oriented);
        if (light.cos_outer > -2) {
            const Vec3<F> from = r.P - center;
            const F cosine = dot(from, axis) / sqrt(max(dot(from, from), F(1e-20f)));
            estimate *= spot_falloff(F(light.cos_outer), F(light.cos_inner), Int<W>(light.exponent), cosine);
        }
        return estimate;
    }

    int m_count;
    bool m_exact;
    F m_equal, m_chance[Exact], m_share[Exact];
};

// ---- sampling
// ------------------------------------------------------------------------------------------------------

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
    Int<W> flags;

    // placement: index into SceneView::placements; -1 = it lies in render space
    EmitterLanes(const SceneView& scene, Int<W> emitter, Int<W> placement) {
        const auto e = load_rows<sizeof(store::Emitter) / 4>(scene.emitters, emitter << 4);
        p0 = {e[0], e[1], e[2]}, e1 = {e[3], e[4], e[5]}, e2 = {e[6], e[7], e[8]};
        c0 = e[9], c1 = e[10], c2 = e[11], scale = e[12];
        flags = bitcast_int(e[15]);
        F side = select((flags & Int<W>(1)) != Int<W>(0), F(-1.0f), F(1.0f));
        const Mask<W> placed = placement >= Int<W>(0);
        if (any(placed)) {
            const Int<W> first = select(placed, placement, Int<W>(0)) * Int<W>(12);
            F m[12];
            for (int k = 0; k < 12; k++)
                m[k] = gather(scene.placements.data() + k, first);
            side = select(placed, transform(m, placed) * side, side);
        }
        n = cross(e1, e2) * side;
    }
    // Returns the sign of the determinant: normals turn over where a placement mirrors.
    F transform(const F m[12], Mask<W> where) {
        using V = Vec3<F>;
        const V r0(m[0], m[1], m[2]), r1(m[4], m[5], m[6]), r2(m[8], m[9], m[10]);
        const auto turn = [&](const V& v) { return V(dot(r0, v), dot(r1, v), dot(r2, v)); };
        p0 = select(where, turn(p0) + V(m[3], m[7], m[11]), p0);
        e1 = select(where, turn(e1), e1);
        e2 = select(where, turn(e2), e2);
        return copysign(F(1.0f), dot(r0, cross(r1, r2)));
    }
};

template <int W>
void sample_emitters(const SceneView& scene, const Vec3<Float<W>>& P, Int<W> emitter, Int<W> placement,
                     Float<W> u0, Float<W> u1, LightSample<W>& s, const Float<W> l[Wavelengths], Mask<W> m,
                     Float<W> chance) { // chance < 0: by the table of densities
    using F = Float<W>;
    const EmitterLanes<W> e(scene, emitter, placement);
    // Uniform on the triangle: fold the unit square along its diagonal.
    const Mask<W> fold = u0 + u1 > F(1.0f);
    const F b1 = select(fold, F(1.0f) - u0, u0), b2 = select(fold, F(1.0f) - u1, u1);
    const Vec3<F> to = e.p0 + e.e1 * b1 + e.e2 * b2 - P;
    const F d2 = max(dot(to, to), F(1e-20f)), d = sqrt(d2);
    const Vec3<F> wi = to / d;
    const F twice = sqrt(max(dot(e.n, e.n), F(1e-37f)));
    const F facing = -dot(e.n, wi) / twice;
    const F density = scene.tree.empty() ? gather(scene.emitter_density.data(), emitter) * chance
                                         : F(2.0f) * chance / twice;
    // Closer to its plane than positions are exact, nobody can say on which side of the emitter P lies.
    const F blur = max(max(abs(P.x), abs(P.y)), abs(P.z)) * F(1.5e-6f);
    const Mask<W> ok = (facing > F(1e-6f)) & (facing * d > blur);
    const F falloff = emission_falloff(e.flags, facing);
    s.wi = select(m, wi, s.wi);
    s.distance = select(m, d * F(0.9999f), s.distance);
    s.radiance =
        bsdf::select(m, emission_spectrum(scene, e.c0, e.c1, e.c2, e.scale, l) * falloff, s.radiance);
    s.pdf = select(m, density * d2 / max(facing, F(1e-6f)), s.pdf);
    s.valid &= (ok & (falloff > F(0.0f))) | !m;
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
    if (scene.shadow_linked)
        s.passes = select(m, light.get(&A::passes), s.passes);
    if (scene.linked)
        s.valid &= ((set & light.get(&A::sets)) != Int<W>(0)) | !m;
    V place(F(0.0f), F(0.0f), F(0.0f));
    if (shape == A::Distant) {
        // A cone of directions about -axis; the irradiance is the amount for a surface facing it.
        const V axis = light.get(&A::axis);
        F sp, cp;
        sincos_2pi(u0, sp, cp);
        const F z = fma(u1, light.get(&A::cos_angle) - F(1.0f), F(1.0f)),
                r = sqrt(max(F(1.0f) - z * z, F(0.0f)));
        V t, b;
        coordinate_frame(axis, t, b);
        s.wi = select(m, normalize(t * (r * cp) + b * (r * sp) - axis * z), s.wi);
        s.pdf = select(m, chance, s.pdf);
        s.delta |= m;
    } else if (shape == A::Delta) {
        const V to = light.get(&A::position) - P;
        const F d = sqrt(max(dot(to, to), F(1e-20f)));
        s.wi = select(m, to / d, s.wi);
        s.distance = select(m, d, s.distance);
        s.pdf = select(m, chance, s.pdf);
        s.delta |= m;
    } else {
        const LightPoint<W> point = sample_shape(shape, light, P, u0, u1, m);
        s.wi = select(m, point.wi, s.wi);
        s.distance = select(m, point.distance * F(0.9999f), s.distance);
        s.pdf = select(m, point.pdf * chance, s.pdf);
        s.valid &= point.valid | !m;
        place = point.place;
        if (scene.shadow_linked) // no ray finds what only this light's shadow rays pass through
            s.delta |= m & (s.passes != Int<W>(0));
    }
    s.radiance = bsdf::select(m, light_arriving(scene, light, P, place, l, m), s.radiance);
}

template <int W>
LightSample<W> sample_light(const SceneView& scene, const LightChances<W>& chances, const Receiver<W>& r,
                            Float<W> u_choice, Float<W> u_part, Float<W> u0, Float<W> u1,
                            const Float<W> l[Wavelengths], Mask<W> active) {
    using F = Float<W>;
    using I = Int<W>;
    LightSample<W> s;
    s.wi = {F(0.0f), F(0.0f), F(1.0f)};
    s.distance = F(1e30f);
    s.radiance = Spectrum<W>(F(0.0f));
    s.pdf = F(1.0f);
    s.delta = Mask<W>(false);
    s.valid = active;
    s.passes = I(0);
    const I choice = chances.choose(u_choice);
    I analytic(-1);
    F chance(0.0f);
    if (scene.lights_by_choice > 0) {
        const Mask<W> m = active & (choice >= I(scene.first_light_choice));
        analytic = select(m, choice - I(scene.first_light_choice), analytic);
        if (any(m))
            chance = chances.of(choice);
    }
    if (scene.emitter_choice >= 0) {
        const Mask<W> m = active & (choice == I(scene.emitter_choice));
        if (any(m) && scene.tree.empty()) {
            // Alias table by area.
            const int count = int(scene.alias_probability.size());
            const F x = u_part * F(float(count));
            I k = min(to_int(x), I(count - 1));
            const F rest = x - F(k);
            k = select(rest < gather(scene.alias_probability.data(), k), k,
                       gather(scene.alias_other.data(), k));
            k = gather(scene.sampled_emitters.data(), k);
            sample_emitters(scene, r.P, k, I(-1), u0, u1, s, l, m, chances.of(scene.emitter_choice));
        } else if (any(m)) {
            I leaf;
            F part;
            pick_leaf(scene.tree, r, u_part, u_choice, m, leaf, part);
            part *= chances.of(scene.emitter_choice);
            s.valid &= (part > F(0.0f)) | !m;
            const Mask<W> triangle = m & (leaf < I(scene.triangle_slots)) & (part > F(0.0f));
            if (any(triangle)) {
                I emitter = leaf + I(scene.first_emitter), placement(-1);
                const Mask<W> placed = triangle & (leaf >= I(scene.world_slots));
                if (any(placed)) {
                    const I k = select(placed, leaf - I(scene.world_slots), I(0));
                    emitter = select(placed, gather(scene.slot_emitter.data(), k), emitter);
                    placement = select(placed, gather(scene.slot_placement.data(), k), placement);
                }
                emitter = select(triangle, emitter, I(0));
                sample_emitters(scene, r.P, emitter, placement, u0, u1, s, l, triangle, part);
            }
            const Mask<W> other = m & (leaf >= I(scene.triangle_slots)) & (part > F(0.0f));
            analytic = select(other, leaf - I(scene.triangle_slots), analytic);
            chance = select(other, part, chance);
        }
    }
    if (scene.map_choice >= 0) {
        const Mask<W> m = active & (choice == I(scene.map_choice));
        if (any(m)) {
            sample_map(scene, u0, u1, s, l, m);
            s.pdf = select(m, s.pdf * chances.of(scene.map_choice), s.pdf);
            if (scene.linked)
                s.valid &= ((r.set & I(scene.map_sets)) != I(0)) | !m;
        }
    }
    const Mask<W> some = active & (analytic >= I(0));
    if (any(some)) {
        const I shapes = LightLanes<W>(scene, select(some, analytic, I(0))).get(&AnalyticLight::shape);
        for (uint32_t kinds = scene.light_shapes; kinds; kinds &= kinds - 1) {
            const int shape = __builtin_ctz(kinds);
            const Mask<W> m = some & (shapes == I(shape));
            if (any(m))
                sample_analytic(scene, shape, analytic, r.P, r.set, u0, u1, s, l, m, chance);
        }
    }
    if (scene.linked)
        s.valid &= s.pdf > F(0.0f); // no light shines on some
    return s;
}

// ---- lights that rays meet
// ------------------------------------------------------------------------------------------------

// The receiver that a ray left, as its light was asked for.
template <int W>
Receiver<W> receiver_left(const SceneView& scene, const PathState& paths, const PathRow<W>& ray,
                          Int<W> slot) {
    using F = Float<W>;
    Receiver<W> r;
    r.P = vector_of(ray, PathState::Origin);
    r.N = {gather(paths.ask_n[0], slot), gather(paths.ask_n[1], slot), gather(paths.ask_n[2], slot)};
    r.oriented = dot(r.N, r.N) > F(0.0f);
    if (scene.linked)
        r.set = gather(paths.ask_set, slot);
    return r;
}

// Density over area with which light sampling would have asked for an emitting triangle that a ray met, the
// choice of emitters left out.
template <int W>
Float<W> met_emitter_density(const SceneView& scene, const PathState& paths, const PathRow<W>& ray,
                             const HitState& hits, Int<W> slot, Int<W> emitter, Mask<W> m) {
    using F = Float<W>;
    using I = Int<W>;
    if (scene.tree.empty())
        return scene.emitter_density.empty() ? F(0.0f) : gather(scene.emitter_density.data(), emitter);
    m &= ray[PathState::Mis] > F(0.0f);
    I leaf = emitter - I(scene.first_emitter);
    F area = gather(reinterpret_cast<const float*>(scene.emitters) + 14,
                    emitter * I(int(sizeof(store::Emitter) / 4)));
    if (scene.instanced) {
        const Mask<W> instanced = gather(hits.instanced, slot) != I(0), inside = m & instanced;
        m &= (leaf < I(scene.world_slots)) | instanced;
        if (any(inside)) {
            EmitterLanes<W> e(scene, emitter, I(-1));
            F t[12];
            for (int k = 0; k < 12; k++)
                t[k] = gather(hits.world_from_shape[k].data(), slot);
            e.transform(t, inside);
            const Vec3<F> n = cross(e.e1, e.e2);
            area = select(inside, F(0.5f) * sqrt(dot(n, n)), area);
            leaf = select(inside, emitter + gather(hits.slot_shift.data(), slot), leaf);
        }
    } else {
        m &= leaf < I(scene.world_slots);
    }
    m &= (leaf >= I(0)) & (leaf < I(scene.triangle_slots));
    if (!any(m))
        return F(0.0f);
    return chance_of_leaf(scene.tree, receiver_left(scene, paths, ray, slot), select(m, leaf, I(0)), m) /
           max(area, F(1e-37f));
}

// A ray passes through analytic lights: they add to it, and stop nothing.
template <int W>
void meet_light(const SceneView& scene, BatchState& batch, const PathState& paths, const PathRow<W>& ray,
                Int<W> slot, Int<W> index, Float<W> t_max, int bounce, Mask<W> m) {
    using F = Float<W>;
    using I = Int<W>;
    using A = AnalyticLight;
    const LightLanes<W> light(scene, index);
    const Vec3<F> o = vector_of(ray, PathState::Origin), d = vector_of(ray, PathState::Direction);
    const Mask<W> camera = camera_paths(scene, paths, slot, bounce);
    m &= (!camera) | (light.get(&A::visible_camera) != I(0));
    const F before = ray[PathState::Mis];
    if (scene.linked && bounce > 0)
        m &= (gather(paths.ask_set, slot) & light.get(&A::sets)) != I(0);
    if (scene.shadow_linked)
        m &= (light.get(&A::passes) == I(0)) | (before == F(0.0f));
    const I shapes = light.get(&A::shape);
    for (int shape = A::Quad; shape <= A::Cylinder; shape++) {
        const Mask<W> here = m & (shapes == I(shape));
        if (!any(here))
            continue;
        const LightPoint<W> point = meet_shape(shape, light, o, d, here);
        Mask<W> met = point.valid & (point.distance < t_max);
        if (scene.media) // what lies before has been met already
            met &= point.distance >= gather(paths.start, slot);
        if (!any(met))
            continue;
        F density(0.0f);
        const Mask<W> weighed = met & (before > F(0.0f));
        if (any(weighed)) {
            const Receiver<W> r = receiver_left(scene, paths, ray, slot);
            const LightChances<W> chances(scene, r);
            const Mask<W> by_choice = weighed & (index < I(scene.lights_by_choice));
            F chance = select(by_choice, chances.of(index + I(scene.first_light_choice)), F(0.0f));
            const Mask<W> by_tree = weighed & (index >= I(scene.lights_by_choice));
            if (any(by_tree))
                chance = select(by_tree,
                                chances.of(scene.emitter_choice) *
                                    chance_of_leaf(scene.tree, r, index + I(scene.triangle_slots), by_tree),
                                chance);
            density = chance * point.pdf;
        }
        const I path = bitcast_int(ray[PathState::Path]);
        const auto l = load_rows<4>(batch.l, path << 2);
        if (any(met & camera))
            scatter(batch.first[0] + BatchState::Alpha, path << 4, F(1.0f), met & camera);
        const Spectrum<W> arriving = light_arriving(scene, light, o, point.place, l.data(), met);
        if (scene.media) {
            Carried<W> carried{spectrum_of(ray, PathState::Beta), ratios_of(scene, paths, slot), before};
            survive(scene, batch, ray, MediumLanes<W>(scene, bitcast_int(ray[PathState::Interior]), l.data()),
                    gather(paths.start, slot), point.distance, bounce, carried, met);
            const F weight = F(1.0f) / fma(carried.mis, density, carried.ratios());
            add_radiance(batch, path, carried.beta * arriving * weight, met);
            continue;
        }
        const F weight = F(1.0f) / fma(before, density, sum_of_ratios(scene, paths, slot));
        add_radiance(batch, path, spectrum_of(ray, PathState::Beta) * arriving * weight, met);
    }
}

template <int W>
void meet_lights(const SceneView& scene, BatchState& batch, const PathState& paths, Int<W> slot,
                 Float<W> t_max, int bounce, Mask<W> m) {
    const auto ray = load_rows<PathState::Fields>(paths.row, slot << 4);
    for (int32_t k : scene.met_lights)
        meet_light(scene, batch, paths, ray, slot, Int<W>(k), t_max, bounce, m);
    if (scene.met_tree.empty())
        return;
    LightRay rays[W];
    int lane[W], count = 0;
    for (uint32_t bits = m.bits(); bits; bits &= bits - 1) {
        const int i = __builtin_ctz(bits);
        const auto v = [&](int field) { return paths.row[slot[i]][field]; };
        lane[count] = i;
        rays[count++] = {{v(PathState::Origin), v(PathState::Origin + 1), v(PathState::Origin + 2)},
                         {v(PathState::Direction), v(PathState::Direction + 1), v(PathState::Direction + 2)},
                         t_max[i]};
    }
    lights_along(scene.met_tree, count, rays, [&](int k, int32_t light) {
        const int at = slot[lane[k]];
        const auto one = load_rows<PathState::Fields>(paths.row, Int<1>(at << 4));
        meet_light<1>(scene, batch, paths, one, Int<1>(at), Int<1>(light), Float<1>(t_max[lane[k]]), bounce,
                      Mask<1>(true));
    });
}

} // namespace kanuka::transport
