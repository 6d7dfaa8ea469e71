// Lights that rays meet: the other half of light sampling.
#pragma once

#include "transport/lights.h"

namespace kanuka::transport {

template <int W>
using PathRow = Row<W, PathState::Fields>;

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

// With which light sampling would have asked for a light by choice of its own, from where a ray left.
template <int W>
Float<W> chance_of_choice(const SceneView& scene, const PathState& paths, const PathRow<W>& ray, Int<W> slot,
                          Int<W> light) {
    const LightChances<W> chances(scene, receiver_left(scene, paths, ray, slot));
    return chances.of(light + Int<W>(scene.first_light_choice));
}

// Is a light there for a ray as links, shadow links and the camera have it?
template <int W>
Mask<W> shows_itself(const SceneView& scene, const PathState& paths, const PathRow<W>& ray, Int<W> slot,
                     const LightLanes<W>& light, Mask<W> camera, int bounce) {
    using I = Int<W>;
    using A = AnalyticLight;
    Mask<W> m = (!camera) | (light.get(&A::visible_camera) != I(0));
    if (scene.linked && bounce > 0)
        m &= (gather(paths.ask_set, slot) & light.get(&A::sets)) != I(0);
    if (scene.shadow_linked || scene.shadowless)
        m &= (light.get(&A::passes) == I(0)) | (ray[PathState::Mis] == Float<W>(0.0f));
    return m;
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
    m &= shows_itself(scene, paths, ray, slot, light, camera, bounce);
    const F before = ray[PathState::Mis];
    const I shapes = light.get(&A::shape);
    for (int shape = A::Quad; shape <= A::Cylinder; shape++) {
        const Mask<W> here = m & (shapes == I(shape));
        if (!any(here))
            continue;
        const LightPoint<W> point =
            shape == A::Quad ? meet_quad(scene, light, o, d, here) : meet_shape(shape, light, o, d, here);
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

// What leaves the scene sees distant lights that fill a cone. beta: with what is on the way to infinity.
template <int W>
void meet_suns(const SceneView& scene, BatchState& batch, const PathState& paths, const PathRow<W>& ray,
               const Spectrum<W>& beta, Int<W> slot, int bounce, Mask<W> m) {
    using F = Float<W>;
    using I = Int<W>;
    using A = AnalyticLight;
    const Vec3<F> o = vector_of(ray, PathState::Origin), d = vector_of(ray, PathState::Direction);
    for (int32_t k : scene.suns) {
        const I index(k);
        const LightLanes<W> light(scene, index);
        const F cone = light.get(&A::cone);
        const Vec3<F> off = d + light.get(&A::axis); // |off|^2 = 2 (1 - cos): digits that a cosine loses
        const Mask<W> camera = camera_paths(scene, paths, slot, bounce);
        const Mask<W> met = m & (dot(off, off) <= F(2.0f) * cone) &
                            shows_itself(scene, paths, ray, slot, light, camera, bounce);
        if (!any(met))
            continue;
        const F before = ray[PathState::Mis];
        F density(0.0f);
        if (any(met & (before > F(0.0f))))
            density = chance_of_choice(scene, paths, ray, slot, index) * density_in_cone(cone);
        const I path = bitcast_int(ray[PathState::Path]);
        const auto l = load_rows<4>(batch.l, path << 2);
        if (any(met & camera))
            scatter(batch.first[0] + BatchState::Alpha, path << 4, F(1.0f), met & camera);
        const F weight = F(1.0f) / fma(before, density, sum_of_ratios(scene, paths, slot));
        const Vec3<F> nowhere(F(0.0f), F(0.0f), F(0.0f));
        add_radiance(batch, path, beta * light_arriving(scene, light, o, nowhere, l.data(), met) * weight,
                     met);
    }
}

} // namespace kanuka::transport
