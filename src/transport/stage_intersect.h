// Intersect: the closest hit of every living path. What misses meets the environment; hits are put in the
// order of their layering programs, so that all lanes of a surface call run the same lobes.
#pragma once

#include "transport/light_hits.h"
#include "transport/stage_fog.h"
#include "transport/tint.h"

namespace kanuka::transport {

// Light from where nothing is: the hit side of the balance between light and direction sampling.
template <int W>
void add_environment(const SceneView& scene, BatchState& batch, const PathState& paths, Int<W> slot,
                     Mask<W> m, int bounce) {
    if (scene.map.width == 0 && !scene.constant.present && scene.suns.empty())
        return;
    using F = Float<W>;
    using P = PathState;
    const auto ray = load_rows<P::Fields>(paths.row, slot << 4);
    const Int<W> path = bitcast_int(ray[P::Path]);
    const auto l = load_rows<4>(batch.l, path << 2);
    Spectrum<W> beta = spectrum_of(ray, P::Beta);
    if (scene.media) { // what only absorbs and has no end leaves nothing; what scatters has let it pass
        const MediumLanes<W> medium(scene, bitcast_int(ray[P::Interior]), l.data());
        for (int k = 0; k < Wavelengths; k++)
            beta[k] =
                select(medium.scatters | (medium.absorption[k] <= Float<W>(0.0f)), beta[k], Float<W>(0.0f));
    }
    if (!scene.suns.empty())
        meet_suns(scene, batch, paths, ray, beta, slot, bounce, m);
    const Mask<W> camera = camera_paths(scene, paths, slot, bounce), all(true), none(false);
    const Mask<W> constant =
        scene.constant.present ? (!camera) | Mask<W>(scene.constant.visible_camera) : none;
    const Mask<W> map = scene.map.width > 0 ? (!camera) | Mask<W>(scene.map.visible_camera) : none;
    if (any(m & camera & (constant | map)))
        scatter(batch.first[0] + BatchState::Alpha, path << 4, F(1.0f), m & camera & (constant | map));
    const F ratios = sum_of_ratios(scene, paths, slot);
    const auto shines = [&](int32_t sets) {
        return m &
               (scene.linked && bounce > 0 ? (gather(paths.ask_set, slot) & Int<W>(sets)) != Int<W>(0) : all);
    };
    if (any(m & constant)) // directions alone find it: docs/transport.md, "Choice of light"
        add_radiance(batch, path,
                     beta * emission_spectrum(scene, scene.constant.c, l.data()) * (F(1.0f) / ratios),
                     constant & shines(scene.constant_sets));
    if (any(m & map)) {
        const MapPlace<W> p = map_place(scene.map, vector_of(ray, P::Direction));
        const MapCell<W> c(scene.map, p);
        const MapTexels<W> texels(scene.map, c);
        Float<W> weight = Float<W>(1.0f) / ratios;
        if (scene.map_choice >= 0) {
            const Float<W> pdf = map_pdf(scene.map, texels.weights(scene.map, c), c, p.sin_theta);
            weight = Float<W>(1.0f) / fma(ray[P::Mis], pdf * ray[P::AskMap], ratios);
        }
        add_radiance(batch, path, beta * map_radiance(scene, texels, c, l.data()) * weight,
                     map & shines(scene.map_sets));
    }
}

// Colours the light of paths by what they have passed.
template <int W>
[[gnu::noinline]] void tint_paths(const SceneView& scene, const BatchState& batch, PathState& paths,
                                  Int<W> slot, const Passages<W>& passages, Float<W> end, Mask<W> m) {
    const auto ray = load_rows<PathState::Fields>(paths.row, slot << 4);
    const auto l = load_rows<4>(batch.l, bitcast_int(ray[PathState::Path]) << 2);
    const Spectrum<W> beta = spectrum_of(ray, PathState::Beta) * passages.before(scene, end, l.data());
    for (int k = 0; k < Wavelengths; k++)
        scatter(paths.row[0] + PathState::Beta + k, slot << 4, beta[k], m);
}

struct ProgramRuns {
    std::vector<int> first; // of each program's run in `order`; one more at the end
    std::vector<int32_t> order;
    std::vector<int32_t> program;                         // by slot; or:
    static constexpr int32_t Missed = -1, Scattered = -2; // in the medium, before any surface
};

template <int W>
void intersect(const SceneView& scene, BatchState& batch, PathState& paths, int count, int bounce,
               HitState& hits, ProgramRuns& runs, ShadowState& shadows, int& shadow_count) {
    const int programs = int(scene.materials.size());
    runs.first.assign(size_t(programs) + 1, 0);
    runs.program.resize(BatchPadded);
    runs.order.resize(BatchPadded);
    bvh::HitPacket<W> hit;
    for (int first = 0; first < count; first += W) {
        const Int<W> slot = Int<W>::lane_index() + Int<W>(first);
        bvh::RayPacket<W> rays;
        const auto ray = load_rows<8>(paths.row, slot << 4);
        rays.o = vector_of(ray, PathState::Origin);
        rays.d = vector_of(ray, PathState::Direction);
        Float<W> reach(1e30f);
        rays.active = slot < Int<W>(count);
        const Int<W> in_use = min(slot, Int<W>(count - 1));
        if (scene.media) {
            rays.t_min = gather(paths.start, in_use);
            if (scene.scatters)
                reach = free_path(scene, batch, load_rows<PathState::Fields>(paths.row, in_use << 4),
                                  rays.t_min, bounce);
        }
        const bool fog = !scene.fog_lamps.empty();
        rays.t_max = fog ? Float<W>(1e30f) : reach;
        rays.seed =
            way_seed(bitcast_int(ray[PathState::PixelHash]) ^ Int<W>(int(uint32_t(bounce) * 0x3c6ef372u)),
                     batch.reversed_progression);
        rays.coherent = bounce == 0;
        if (scene.moving)
            rays.time =
                select(rays.active,
                       gather(batch.time, select(rays.active, bitcast_int(ray[PathState::Path]), Int<W>(0))),
                       Float<W>(0.0f));
        if (scene.fades)
            rays.level =
                gather(batch.level, select(rays.active, bitcast_int(ray[PathState::Path]), Int<W>(0)));
        if (scene.hides)
            rays.camera = select(camera_paths(scene, paths, in_use, bounce), Int<W>(1), Int<W>(0));
        if (scene.tinted) {
            Passages<W> passages(rays);
            scene.bvh->intersect(rays, hit);
            tint_paths(scene, batch, paths, in_use, passages, select(hit.hit, hit.t, rays.t_max),
                       rays.active);
            rays.passages = nullptr;
        } else {
            scene.bvh->intersect(rays, hit);
        }
        if (fog) {
            const Float<W> sight = select(hit.hit, hit.t, Float<W>(1e30f));
            sight.store(paths.sight + first);
            ask_in_fog(scene, batch, paths, in_use, sight, bounce, shadows, shadow_count, rays.active);
            hit.hit &= hit.t < reach;
        }
        if (!scene.fields.empty()) {
            const Float<W> particle =
                field_path(scene, batch, paths, in_use, select(hit.hit, hit.t, reach), bounce, rays.active);
            hit.hit &= !(particle < hit.t);
            reach = min(reach, particle);
        }
        const Mask<W> missed = rays.active & !hit.hit, scattered = missed & (reach < Float<W>(1e30f));
        if (scene.scatters)
            hit.t = select(hit.hit, hit.t, reach);
        const Row<W, HitState::Fields> row{hit.t,    hit.u,    hit.v,    bitcast_float(hit.shape),
                                           hit.Ng.x, hit.Ng.y, hit.Ng.z, bitcast_float(hit.prim)};
        compress_rows(hits.row[first], row, Mask<W>(true).bits());
        if (scene.instanced) {
            hit.instanced.store(hits.instanced + first);
            if (any(hit.instanced != Int<W>(0)))
                for (int k = 0; k < 12; k++)
                    std::memcpy(hits.world_from_shape[k].data() + first, hit.world_from_shape[k],
                                sizeof(float) * W);
            hit.slot_shift.store(hits.slot_shift.data() + first);
            hit.magnitude.store(hits.magnitude.data() + first);
        }
        Mask<W> shows = hit.hit;
        if (scene.holds_out) // what hides all behind it and is black itself is a miss without a sky
            shows &= !(camera_paths(scene, paths, in_use, bounce) &
                       ((links_of(scene, select(hit.hit, hit.shape, Int<W>(0)), &store::Links::seen) &
                         Int<W>(store::Links::HeldOut)) != Int<W>(0)));
        const Int<W> program =
            select(shows,
                   gather(scene.shapes + offsetof(store::ShapeRecord, program) / 4,
                          hit.shape * Int<W>(store::ShapeWords)),
                   select(scattered, Int<W>(ProgramRuns::Scattered), Int<W>(ProgramRuns::Missed)));
        program.store(runs.program.data() + first);
        if (scene.meets_lights())
            meet_lights(scene, batch, paths, in_use, select(hit.hit, hit.t, reach), bounce, rays.active);
        if (scene.scatters)
            end_flight(scene, batch, paths, in_use, hit.t, bounce, rays.active);
        const Mask<W> escaped = missed & !scattered;
        if (any(escaped))
            add_environment(scene, batch, paths, in_use, escaped, bounce);
    }
    // Counting sort by program; stable, so the order of slots is a function of the batch alone.
    for (int i = 0; i < count; i++)
        if (runs.program[size_t(i)] >= 0)
            runs.first[size_t(runs.program[size_t(i)]) + 1]++;
    for (int p = 0; p < programs; p++)
        runs.first[size_t(p) + 1] += runs.first[size_t(p)];
    std::vector<int>& next = runs.first;
    // `next` is advanced past each run while filling, then shifted back by one program.
    for (int i = 0; i < count; i++)
        if (runs.program[size_t(i)] >= 0)
            runs.order[size_t(next[size_t(runs.program[size_t(i)])]++)] = i;
    for (int p = programs; p > 0; p--)
        next[size_t(p)] = next[size_t(p) - 1];
    next[0] = 0;
}

} // namespace kanuka::transport
