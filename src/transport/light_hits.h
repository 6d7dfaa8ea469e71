// Lights that rays hit: the other half of light sampling.
#pragma once

#include "transport/lights.h"
#include "transport/path_vertex.h"

namespace kanuka::transport {

// The receiver that a ray left, as light was sampled for it.
template <int W>
Receiver<W> receiver_left(const SceneView& scene, const PathQueue& paths, const PathRow<W>& ray,
                          Int<W> slot) {
    using F = Float<W>;
    Receiver<W> r;
    r.P = vector_of(ray, PathQueue::Origin);
    r.N = {gather(paths.receiver_n[0], slot), gather(paths.receiver_n[1], slot),
           gather(paths.receiver_n[2], slot)};
    r.oriented = dot(r.N, r.N) > F(0.0f);
    if (scene.lights.linked)
        r.set = gather(paths.receiver_set, slot);
    return r;
}

// Density over area with which light sampling would have found the place of a ray on an emitting triangle; of
// the choices, that of the leaf is in it.
template <int W>
Float<W> pdf_area_of_emitter(const SceneView& scene, const PathQueue& paths, const PathRow<W>& ray,
                             const HitState& hits, Int<W> slot, Int<W> emitter, Mask<W> m) {
    using F = Float<W>;
    using I = Int<W>;
    if (scene.lights.tree.empty())
        return scene.lights.alias.pdf_area.empty() ? F(0.0f)
                                                   : gather(scene.lights.alias.pdf_area.data(), emitter);
    m &= ray[PathQueue::Mis] > F(0.0f);
    I leaf = emitter - I(scene.lights.slots.first_emitter);
    F area = gather(reinterpret_cast<const float*>(scene.geometry.emitters) + 14,
                    emitter * I(int(sizeof(store::Emitter) / 4)));
    if (scene.geometry.instanced) {
        const Mask<W> instanced = gather(hits.instanced, slot) != I(0), inside = m & instanced;
        m &= (leaf < I(scene.lights.slots.in_world)) | instanced;
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
        m &= leaf < I(scene.lights.slots.in_world);
    }
    m &= (leaf >= I(0)) & (leaf < I(scene.lights.slots.count));
    if (!any(m))
        return F(0.0f);
    return chance_of_leaf(scene.lights.tree, receiver_left(scene, paths, ray, slot), select(m, leaf, I(0)),
                          m) /
           max(area, F(1e-37f));
}

// The vertex of a ray on an emitting triangle at distance t, under an angle with this cosine.
template <int W>
PathVertex<W> emitter_vertex(const SceneView& scene, const PathQueue& paths, const PathRow<W>& ray,
                             const HitState& hits, Int<W> slot, Int<W> emitter, Float<W> t, Float<W> cosine,
                             Mask<W> m) {
    return PathVertex<W>::on_area(ray[PathQueue::PdfEmitterChoice],
                                  pdf_area_of_emitter(scene, paths, ray, hits, slot, emitter, m), t, cosine);
}

// With which light sampling would have chosen a light that is a choice of its own, from where a ray left.
template <int W>
Float<W> pdf_light_choice(const SceneView& scene, const PathQueue& paths, const PathRow<W>& ray, Int<W> slot,
                          Int<W> light) {
    const LightChooser<W> chooser(scene, receiver_left(scene, paths, ray, slot));
    return chooser.pdf(light + Int<W>(scene.lights.first_light_choice));
}

// Is a light there for a ray as links, shadow links and the camera have it?
template <int W>
Mask<W> shows_itself(const SceneView& scene, const PathQueue& paths, const PathRow<W>& ray, Int<W> slot,
                     const LightLanes<W>& light, Mask<W> camera, int bounce) {
    using I = Int<W>;
    using A = AnalyticLight;
    Mask<W> m = (!camera) | (light.get(&A::visible_camera) != I(0));
    if (scene.lights.linked && bounce > 0)
        m &= (gather(paths.receiver_set, slot) & light.get(&A::sets)) != I(0);
    if (scene.lights.shadow_linked || scene.lights.shadowless)
        m &= (light.get(&A::passes) == I(0)) | (ray[PathQueue::Mis] == Float<W>(0.0f));
    return m;
}

// The vertex of a ray on an analytic light. `sampled`: lanes in which light sampling could have chosen it.
template <int W>
PathVertex<W> analytic_vertex(const SceneView& scene, const PathQueue& paths, const PathRow<W>& ray,
                              Int<W> slot, Int<W> index, Float<W> pdf, Mask<W> sampled) {
    using F = Float<W>;
    using I = Int<W>;
    const Receiver<W> r = receiver_left(scene, paths, ray, slot);
    const LightChooser<W> chooser(scene, r);
    const Mask<W> by_choice = sampled & (index < I(scene.lights.by_choice)),
                  by_tree = sampled & (index >= I(scene.lights.by_choice));
    F choice = select(by_choice, chooser.pdf(index + I(scene.lights.first_light_choice)), F(0.0f));
    if (any(by_tree))
        choice =
            select(by_tree,
                   chooser.pdf(scene.lights.emitter_choice) *
                       chance_of_leaf(scene.lights.tree, r, index + I(scene.lights.slots.count), by_tree),
                   choice);
    return PathVertex<W>::in_direction(choice, pdf);
}

// A ray passes through analytic lights: they add to it, and stop nothing.
template <int W>
void hit_light(const SceneView& scene, BatchState& batch, const PathQueue& paths, const PathRow<W>& ray,
               Int<W> slot, Int<W> index, Float<W> t_max, int bounce, Mask<W> m) {
    using F = Float<W>;
    using I = Int<W>;
    using A = AnalyticLight;
    const LightLanes<W> light(scene, index);
    const Vec3<F> o = vector_of(ray, PathQueue::Origin), d = vector_of(ray, PathQueue::Direction);
    const Mask<W> camera = camera_paths(scene, paths, slot, bounce);
    m &= shows_itself(scene, paths, ray, slot, light, camera, bounce);
    const F mis = ray[PathQueue::Mis];
    const I shapes = light.get(&A::shape);
    for (int shape = A::Quad; shape <= A::Cylinder; shape++) {
        const Mask<W> here = m & (shapes == I(shape));
        if (!any(here))
            continue;
        const LightPoint<W> point = shape == A::Quad ? intersect_quad(scene, light, o, d, here)
                                                     : intersect_shape(shape, light, o, d, here);
        Mask<W> hit = point.valid & (point.distance < t_max);
        if (scene.media.tracked) // what lies before has been hit already
            hit &= point.distance >= gather(paths.start, slot);
        if (!any(hit))
            continue;
        PathVertex<W> vertex;
        if (const Mask<W> sampled = hit & (mis > F(0.0f)); any(sampled))
            vertex = analytic_vertex(scene, paths, ray, slot, index, point.pdf_solid_angle, sampled);
        const I path = bitcast_int(ray[PathQueue::Path]);
        const auto l = load_rows<4>(batch.l, path << 2);
        if (any(hit & camera))
            scatter(batch.first[0] + BatchState::Alpha, path << 4, F(1.0f), hit & camera);
        const Spectrum<W> arriving = light_arriving(scene, light, o, point.place, l.data(), hit);
        if (scene.media.tracked) {
            PathWeights<W> weights{spectrum_of(ray, PathQueue::Throughput), ratios_of(scene, paths, slot),
                                   mis};
            survive(scene, batch, ray, MediumLanes<W>(scene, bitcast_int(ray[PathQueue::Interior]), l.data()),
                    gather(paths.start, slot), point.distance, bounce, weights, hit);
            const F weight = vertex.weight(weights.mis, weights.ratios());
            contribute(batch, Contribution<W>{path, weights.throughput * arriving * weight, index}, hit);
            continue;
        }
        const F weight = vertex.weight(mis, sum_of_ratios(scene, paths, slot));
        contribute(batch,
                   Contribution<W>{path, spectrum_of(ray, PathQueue::Throughput) * arriving * weight, index},
                   hit);
    }
}

template <int W>
void hit_lights(const SceneView& scene, BatchState& batch, const PathQueue& paths, Int<W> slot,
                Float<W> t_max, int bounce, Mask<W> m) {
    const auto ray = load_rows<PathQueue::Fields>(paths.row, slot << 4);
    for (int32_t k : scene.lights.hittable)
        hit_light(scene, batch, paths, ray, slot, Int<W>(k), t_max, bounce, m);
    if (scene.lights.hittable_tree.empty())
        return;
    LightRay rays[W];
    int lane[W], count = 0;
    for (uint32_t bits = m.bits(); bits; bits &= bits - 1) {
        const int i = __builtin_ctz(bits);
        const auto v = [&](int field) { return paths.row[slot[i]][field]; };
        lane[count] = i;
        rays[count++] = {{v(PathQueue::Origin), v(PathQueue::Origin + 1), v(PathQueue::Origin + 2)},
                         {v(PathQueue::Direction), v(PathQueue::Direction + 1), v(PathQueue::Direction + 2)},
                         t_max[i]};
    }
    lights_along(scene.lights.hittable_tree, count, rays, [&](int k, int32_t light) {
        const int at = slot[lane[k]];
        const auto one = load_rows<PathQueue::Fields>(paths.row, Int<1>(at << 4));
        hit_light<1>(scene, batch, paths, one, Int<1>(at), Int<1>(light), Float<1>(t_max[lane[k]]), bounce,
                     Mask<1>(true));
    });
}

// What leaves the scene sees distant lights that fill a cone. throughput: with what lies before infinity.
template <int W>
void hit_suns(const SceneView& scene, BatchState& batch, const PathQueue& paths, const PathRow<W>& ray,
              const Spectrum<W>& throughput, Int<W> slot, int bounce, Mask<W> m) {
    using F = Float<W>;
    using I = Int<W>;
    using A = AnalyticLight;
    const Vec3<F> o = vector_of(ray, PathQueue::Origin), d = vector_of(ray, PathQueue::Direction);
    for (int32_t k : scene.lights.suns) {
        const I index(k);
        const LightLanes<W> light(scene, index);
        const F cone = light.get(&A::cone);
        const Vec3<F> off = d + light.get(&A::axis); // |off|^2 = 2 (1 - cos): digits that a cosine loses
        const Mask<W> camera = camera_paths(scene, paths, slot, bounce);
        const Mask<W> hit = m & (dot(off, off) <= F(2.0f) * cone) &
                            shows_itself(scene, paths, ray, slot, light, camera, bounce);
        if (!any(hit))
            continue;
        const F mis = ray[PathQueue::Mis];
        PathVertex<W> vertex;
        if (any(hit & (mis > F(0.0f))))
            vertex = PathVertex<W>::in_direction(pdf_light_choice(scene, paths, ray, slot, index),
                                                 density_in_cone(cone));
        const I path = bitcast_int(ray[PathQueue::Path]);
        const auto l = load_rows<4>(batch.l, path << 2);
        if (any(hit & camera))
            scatter(batch.first[0] + BatchState::Alpha, path << 4, F(1.0f), hit & camera);
        const F weight = vertex.weight(mis, sum_of_ratios(scene, paths, slot));
        const Vec3<F> nowhere(F(0.0f), F(0.0f), F(0.0f));
        contribute(
            batch,
            Contribution<W>{
                path, throughput * light_arriving(scene, light, o, nowhere, l.data(), hit) * weight, index},
            hit);
    }
}

} // namespace kanuka::transport
