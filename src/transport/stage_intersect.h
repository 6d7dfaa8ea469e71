// Intersect: the closest hit of every living path. What misses sees the environment; hits are put in the
// order of their layering programs, so that all lanes of a surface call run the same lobes.
#pragma once

#include "transport/light_hits.h"
#include "transport/stage_fog.h"
#include "transport/tint.h"

namespace kanuka::transport {

// For a pilot, by path.
template <int W>
[[gnu::noinline]] void note_sky(float* sky, Int<W> path, const Spectrum<W>& radiance, Mask<W> m) {
    for (uint32_t bits = m.bits(); bits; bits &= bits - 1) {
        const int i = __builtin_ctz(bits);
        for (int k = 0; k < Wavelengths; k++)
            sky[path[i]] += radiance[k][i];
    }
}

// Light from where nothing is: the hit side of the balance between light and direction sampling.
template <int W>
void add_environment(const SceneView& scene, BatchState& batch, const PathQueue& paths, Int<W> slot,
                     Mask<W> m, int bounce) {
    if (scene.lights.map.width == 0 && !scene.lights.constant.present && scene.lights.suns.empty())
        return;
    using F = Float<W>;
    using P = PathQueue;
    const auto ray = load_rows<P::Fields>(paths.row, slot << 4);
    const Int<W> path = bitcast_int(ray[P::Path]);
    const auto l = load_rows<4>(batch.l, path << 2);
    Spectrum<W> throughput = spectrum_of(ray, P::Throughput);
    if (scene.media.tracked) {
        // What only absorbs and has no end leaves nothing; what scatters has let it pass.
        const MediumLanes<W> medium(scene, bitcast_int(ray[P::Interior]), l.data());
        for (int k = 0; k < Wavelengths; k++)
            throughput[k] = select(medium.scatters | (medium.absorption[k] <= Float<W>(0.0f)), throughput[k],
                                   Float<W>(0.0f));
    }
    if (!scene.lights.suns.empty())
        hit_suns(scene, batch, paths, ray, throughput, slot, bounce, m);
    const Mask<W> camera = camera_paths(scene, paths, slot, bounce), all(true), none(false);
    const Mask<W> constant =
        scene.lights.constant.present ? (!camera) | Mask<W>(scene.lights.constant.visible_camera) : none;
    const Mask<W> map =
        scene.lights.map.width > 0 ? (!camera) | Mask<W>(scene.lights.map.visible_camera) : none;
    if (any(m & camera & (constant | map)))
        scatter(batch.first[0] + BatchState::Alpha, path << 4, F(1.0f), m & camera & (constant | map));
    const F ratios = sum_of_ratios(scene, paths, slot);
    const auto shines = [&](int32_t sets) {
        return m & (scene.lights.linked && bounce > 0
                        ? (gather(paths.receiver_set, slot) & Int<W>(sets)) != Int<W>(0)
                        : all);
    };
    // What is not sampled, directions alone find: docs/transport.md, "Choice of light".
    F weight = F(1.0f) / ratios;
    if (const Mask<W> sampled = m & (ray[P::Mis] > F(0.0f)); !scene.lights.portals.empty() && any(sampled)) {
        const F pdf =
            PortalChooser<W>(scene, vector_of(ray, P::Origin), sampled).pdf(vector_of(ray, P::Direction));
        weight = select(sampled,
                        PathVertex<W>::in_direction(ray[P::PdfMapChoice], pdf).weight(ray[P::Mis], ratios),
                        weight);
    }
    if (any(m & constant)) {
        // Of a pair of directions each counts by half.
        const F share = select(bitcast_int(ray[P::PdfMapChoice]) < Int<W>(0), F(0.5f), F(1.0f));
        const Spectrum<W> radiance =
            throughput * emission_spectrum(scene, scene.lights.constant.c, l.data()) * (weight * share);
        const Mask<W> shown = constant & shines(scene.lights.constant.sets);
        contribute(batch, Contribution<W>{path, radiance, Int<W>(LightId::Constant)}, shown);
        if (batch.sky) [[unlikely]]
            note_sky(batch.sky, path, radiance, shown);
    }
    if (any(m & map)) {
        const MapPlace<W> p = map_place(scene.lights.map, vector_of(ray, P::Direction));
        const MapCell<W> c(scene.lights.map, p);
        const MapTexels<W> texels(scene.lights.map, c);
        if (scene.lights.map_choice >= 0 && scene.lights.portals.empty()) {
            const Float<W> pdf =
                map_pdf(scene.lights.map, texels.weights(scene.lights.map, c), c, p.sin_theta);
            weight = PathVertex<W>::in_direction(ray[P::PdfMapChoice], pdf).weight(ray[P::Mis], ratios);
        }
        contribute(batch,
                   Contribution<W>{path, throughput * map_radiance(scene, texels, c, l.data()) * weight,
                                   Int<W>(LightId::Picture)},
                   map & shines(scene.lights.map.sets));
    }
}

// Colours the light of paths by what they have passed.
template <int W>
[[gnu::noinline]] void tint_paths(const SceneView& scene, const BatchState& batch, PathQueue& paths,
                                  Int<W> slot, const Passages<W>& passages, Float<W> end, Mask<W> m) {
    const auto ray = load_rows<PathQueue::Fields>(paths.row, slot << 4);
    const auto l = load_rows<4>(batch.l, bitcast_int(ray[PathQueue::Path]) << 2);
    const Spectrum<W> throughput =
        spectrum_of(ray, PathQueue::Throughput) * passages.before(scene, end, l.data());
    for (int k = 0; k < Wavelengths; k++)
        scatter(paths.row[0] + PathQueue::Throughput + k, slot << 4, throughput[k], m);
}

struct ProgramRuns {
    std::vector<int> first; // of each program's run in `order`; one more at the end
    std::vector<int32_t> order;
    std::vector<int32_t> program;                         // by slot; or:
    static constexpr int32_t Missed = -1, Scattered = -2; // a collision in the medium, before any surface
};

inline void sort_by_program(ProgramRuns& runs, int count) {
    const int programs = int(runs.first.size()) - 1;
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

// For the surface stage, which reads them by slot.
template <int W>
void keep_hits(const SceneView& scene, const bvh::HitPacket<W>& hit, HitState& hits, int first) {
    const Row<W, HitState::Fields> row{hit.t,    hit.u,    hit.v,    bitcast_float(hit.shape),
                                       hit.Ng.x, hit.Ng.y, hit.Ng.z, bitcast_float(hit.prim)};
    compress_rows(hits.row[first], row, Mask<W>(true).bits());
    if (!scene.geometry.instanced)
        return;
    hit.instanced.store(hits.instanced + first);
    if (any(hit.instanced != Int<W>(0)))
        for (int k = 0; k < 12; k++)
            std::memcpy(hits.world_from_shape[k].data() + first, hit.world_from_shape[k], sizeof(float) * W);
    hit.slot_shift.store(hits.slot_shift.data() + first);
    hit.magnitude.store(hits.magnitude.data() + first);
    hit.variation.store(hits.variation.data() + first);
}

// The rays of some paths. `slots` are those of lanes; `in_use` the same, within the queue.
template <int W>
bvh::RayPacket<W> rays_of(const SceneView& scene, const BatchState& batch, const PathQueue& paths,
                          Int<W> slots, Int<W> in_use, int bounce) {
    using I = Int<W>;
    bvh::RayPacket<W> rays;
    const auto ray = load_rows<8>(paths.row, slots << 4);
    rays.o = vector_of(ray, PathQueue::Origin);
    rays.d = vector_of(ray, PathQueue::Direction);
    rays.active = slots < I(paths.count);
    if (scene.media.tracked)
        rays.t_min = gather(paths.start, in_use);
    rays.seed = seed_of(seeds::ClosestHit, bitcast_int(ray[PathQueue::PixelHash]), bounce,
                        batch.reversed_progression);
    rays.coherent = bounce == 0;
    const I path = select(rays.active, bitcast_int(ray[PathQueue::Path]), I(0));
    if (scene.geometry.moving)
        rays.time = select(rays.active, gather(batch.time, path), Float<W>(0.0f));
    if (scene.geometry.fades)
        rays.level = gather(batch.level, path);
    if (scene.geometry.hides)
        rays.camera = select(camera_paths(scene, paths, in_use, bounce), I(1), I(0));
    return rays;
}

// The rays of a batch and what they find, packet by packet.
template <int W>
struct RayBatch {
    std::vector<bvh::RayPacket<W>> rays;
    std::vector<bvh::HitPacket<W>> hits;
    std::vector<Float<W>> reach; // how far paths may go, whatever is hit
    std::vector<Mask<W>> hidden;
    std::vector<Passages<W>> passages; // where GeometryView::tinted

    void resize(int rays_in_all, bool tinted) {
        const size_t packets = size_t(rays_in_all + W - 1) / W;
        rays.resize(packets), hits.resize(packets), reach.resize(packets), hidden.resize(packets);
        if (tinted)
            passages.resize(packets);
    }
    // Of the rays as they are now.
    void note_passages() {
        for (size_t p = 0; p < rays.size(); p++)
            passages[p].note(rays[p]);
    }
};

// What the rays hit; paths take the colours along of what they have passed.
template <int W>
void find_hits(const SceneView& scene, const BatchState& batch, PathQueue& paths, RayBatch<W>& all) {
    if (scene.geometry.tinted)
        all.note_passages();
    scene.geometry.ray_query.intersect<W>(all.rays, all.hits);
    if (!scene.geometry.tinted)
        return;
    for (size_t p = 0; p < all.rays.size(); p++) {
        const bvh::RayPacket<W>& rays = all.rays[p];
        const bvh::HitPacket<W>& hit = all.hits[p];
        const Int<W> slots = min(Int<W>::lane_index() + Int<W>(int(p) * W), Int<W>(paths.count - 1));
        tint_paths(scene, batch, paths, slots, all.passages[p], select(hit.hit, hit.t, rays.t_max),
                   rays.active);
    }
}

// Collisions before the hits, which then are none; `reach` becomes how far paths may go.
template <int W>
void collide(const SceneView& scene, BatchState& batch, PathQueue& paths, Int<W> slots, int bounce,
             bvh::HitPacket<W>& hit, Float<W>& reach, RayQueue& shadow_rays, Mask<W> m) {
    if (!scene.lights.fog_lamps.empty()) {
        const Float<W> surface = select(hit.hit, hit.t, Float<W>(1e30f));
        surface.store(paths.surface + slots[0]); // lanes are of paths side by side
        sample_fog_lamps(scene, batch, paths, slots, surface, bounce, shadow_rays, m);
        hit.hit &= hit.t < reach;
    }
    if (!scene.media.fields.empty()) {
        const Float<W> collision =
            field_path(scene, batch, paths, slots, select(hit.hit, hit.t, reach), bounce, m);
        hit.hit &= !(collision < hit.t);
        reach = min(reach, collision);
    }
}

// By which paths are sorted: see ProgramRuns.
template <int W>
Int<W> program_of(const SceneView& scene, const PathQueue& paths, Int<W> slots, const bvh::HitPacket<W>& hit,
                  Mask<W> scattered, int bounce) {
    using I = Int<W>;
    Mask<W> shows = hit.hit;
    if (scene.geometry.holds_out) // what hides all behind it and is black itself is a miss without a sky
        shows &= !(camera_paths(scene, paths, slots, bounce) &
                   ((links_of(scene, select(hit.hit, hit.shape, I(0)), &store::Links::seen) &
                     I(store::Links::HeldOut)) != I(0)));
    return select(shows,
                  gather(scene.geometry.shapes + offsetof(store::ShapeRecord, program) / 4,
                         hit.shape * I(store::ShapeWords)),
                  select(scattered, I(ProgramRuns::Scattered), I(ProgramRuns::Missed)));
}

template <int W>
void intersect(const SceneView& scene, BatchState& batch, PathQueue& paths, int bounce, HitState& hits,
               ProgramRuns& runs, RayQueue& shadow_rays, RayBatch<W>& all) {
    const int count = paths.count;
    runs.first.assign(scene.geometry.materials.size() + 1, 0);
    runs.program.resize(BatchPadded);
    runs.order.resize(BatchPadded);
    const Float<W> far(1e30f);
    const auto slots_of = [](int first) { return Int<W>::lane_index() + Int<W>(first); };
    const auto in_use_of = [&](int first) { return min(slots_of(first), Int<W>(count - 1)); };
    all.resize(count, scene.geometry.tinted);
    for (int first = 0; first < count; first += W) {
        const Int<W> in_use = in_use_of(first);
        bvh::RayPacket<W>& rays = all.rays[size_t(first / W)];
        Float<W>& reach = all.reach[size_t(first / W)];
        rays = rays_of(scene, batch, paths, slots_of(first), in_use, bounce);
        reach = far;
        if (scene.media.scatters)
            reach = free_path(scene, batch, load_rows<PathQueue::Fields>(paths.row, in_use << 4), rays.t_min,
                              bounce);
        rays.t_max = scene.lights.fog_lamps.empty() ? reach : far;
    }
    find_hits(scene, batch, paths, all);
    for (int first = 0; first < count; first += W) {
        const Int<W> in_use = in_use_of(first);
        const bvh::RayPacket<W>& rays = all.rays[size_t(first / W)];
        bvh::HitPacket<W>& hit = all.hits[size_t(first / W)];
        Float<W>& reach = all.reach[size_t(first / W)];
        collide(scene, batch, paths, in_use, bounce, hit, reach, shadow_rays, rays.active);
        const Mask<W> missed = rays.active & !hit.hit, scattered = missed & (reach < far);
        if (scene.media.scatters)
            hit.t = select(hit.hit, hit.t, reach);
        keep_hits(scene, hit, hits, first);
        program_of(scene, paths, in_use, hit, scattered, bounce).store(runs.program.data() + first);
        if (scene.lights.any_hittable())
            hit_lights(scene, batch, paths, in_use, select(hit.hit, hit.t, reach), bounce, rays.active);
        if (scene.media.scatters)
            end_flight(scene, batch, paths, in_use, hit.t, bounce, rays.active);
        const Mask<W> escaped = missed & !scattered;
        if (any(escaped))
            add_environment(scene, batch, paths, in_use, escaped, bounce);
    }
    sort_by_program(runs, count);
}

} // namespace kanuka::transport
