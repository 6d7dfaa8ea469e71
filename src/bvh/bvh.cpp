#include "bvh/bvh.h"

#include <atomic>
#include <cstring>
#include <limits>
#include <map>

#include "base/cancel.h"
#include "base/error.h"
#include "base/sampling.h"
#include "base/tasks.h"
#include "bvh/embree_scene.h"

namespace kanuka::bvh {

namespace {

// Up to this many cells, the opaque grids of a group become quads: 78 bytes a cell instead of 17, and rays a
// tenth faster (Cornell box, a ball on a plane; four incoherent rays for three on a height field).
constexpr size_t MostQuads = size_t(1) << 18;

template <int W>
Mask<W> traceable(const RayPacket<W>& rays) {
    Mask<W> m = rays.active & (rays.t_max >= Float<W>(0.0f));
    for (int c = 0; c < 3; c++)
        m &= (abs(rays.o[c]) < Float<W>(LargestCoordinate)) & (abs(rays.d[c]) < Float<W>(LargestCoordinate));
    return m;
}

void presence_filter(const RTCFilterFunctionNArguments* args) {
    const Geometry& g = *static_cast<const Geometry*>(args->geometryUserPtr);
    const Context& context = *reinterpret_cast<const Context*>(args->context);
    for (unsigned i = 0; i < args->N; i++) {
        if (args->valid[i] == 0)
            continue;
        const unsigned prim = RTCHitN_primID(args->hit, args->N, i);
        if (is_back(g, prim,
                    {RTCHitN_Ng_x(args->hit, args->N, i), RTCHitN_Ng_y(args->hit, args->N, i),
                     RTCHitN_Ng_z(args->hit, args->N, i)},
                    {RTCRayN_dir_x(args->ray, args->N, i), RTCRayN_dir_y(args->ray, args->N, i),
                     RTCRayN_dir_z(args->ray, args->N, i)}) ||
            !is_present(g, context, RTCRayN_id(args->ray, args->N, i), prim, RTCHitN_u(args->hit, args->N, i),
                        RTCHitN_v(args->hit, args->N, i), RTCRayN_tfar(args->ray, args->N, i)))
            args->valid[i] = 0;
    }
}

} // namespace

struct Scene::Impl {
    RTCDevice device = nullptr;
    std::vector<Group> groups;
    std::vector<Scene::Plane> planes; // that clip, at so many times
    int plane_times = 1;
    std::atomic<int64_t> bytes{0};
    const store::Store& store;

    explicit Impl(const store::Store& store) : store(store) {
        device = rtcNewDevice(EmbreeSettings);
        if (!device)
            throw Error("Embree could not start", ExitCode::Internal);
        rtcSetDeviceMemoryMonitorFunction(
            device,
            [](void* user, ssize_t n, bool) {
                static_cast<std::atomic<int64_t>*>(user)->fetch_add(n);
                return true;
            },
            &bytes);
    }
    ~Impl() {
        for (Group& g : groups) {
            rtcReleaseScene(g.scene);
            if (g.solids)
                rtcReleaseScene(g.solids);
        }
        rtcReleaseDevice(device);
    }

    bool cuts_out(const store::ShapeRecord& s) const { // for some rays
        const store::Links& links = store.links()[size_t(s.links)];
        return store.programs()[size_t(s.program)].presence >= 0 || links.lets_through != 0 ||
               (links.seen & (store::Links::OneSided | store::Links::Unseen)) != 0 || links.fades() ||
               (s.flags & store::ShapeRecord::Layer) != 0;
    }

    // `ours`: null for instances, of which `bounds_solid` tells where they go.
    void attach(Group& group, RTCGeometry geometry, std::unique_ptr<Geometry> ours,
                bool bounds_solid = false) {
        if (ours) {
            rtcSetGeometryUserData(geometry, ours.get());
            ours->group = int(&group - groups.data());
            ours->partly = cuts_out(store.shapes()[size_t(ours->shape_of_grid[0])]);
            bounds_solid = ours->solid >= 0;
            if (bounds_solid || ours->partly) {
                const auto filter = bounds_solid ? note_crossing : presence_filter;
                rtcSetGeometryIntersectFilterFunction(geometry, filter);
                rtcSetGeometryOccludedFilterFunction(geometry, filter);
            }
        }
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(bounds_solid && group.solids ? group.solids : group.scene, geometry,
                              unsigned(group.geometries.size()));
        group.geometries.push_back(std::move(ours));
        rtcReleaseGeometry(geometry);
    }

    // Grids of a group that move by the same steps and whose hits are all filtered, or all not: their
    // vertices lie in the arena as they are.
    void add_grids(Group& group, const std::vector<int>& shapes, int solid) {
        if (shapes.empty())
            return;
        RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_GRID);
        size_t last = 0;
        auto* grids = static_cast<RTCGrid*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_GRID, 0, RTC_FORMAT_GRID, sizeof(RTCGrid), shapes.size()));
        for (size_t i = 0; i < shapes.size(); i++) {
            const store::ShapeRecord& s = store.shapes()[size_t(shapes[i])];
            const unsigned first = unsigned(s.positions) / 3;
            grids[i] = {first, unsigned(s.mu + 1), uint16_t(s.mu + 1), uint16_t(s.mv + 1)};
            last = std::max(last, size_t(first) + size_t(s.mu + 1) * size_t(s.mv + 1));
        }
        const store::ShapeRecord& first = store.shapes()[size_t(shapes[0])]; // all move by the same steps
        rtcSetGeometryTimeStepCount(geometry, unsigned(first.motion_segments) + 1);
        for (int k = 0; k <= first.motion_segments; k++)
            rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, unsigned(k), RTC_FORMAT_FLOAT3,
                                       store.words(), size_t(k) * size_t(first.motion_stride) * 4, 12, last);
        auto ours = std::make_unique<Geometry>(Geometry{&store, shapes, {}, solid});
        attach(group, geometry, std::move(ours));
    }

    // The same grids as quads that share the grids' vertices; for still ones. Embree splits both along the
    // same diagonal.
    void add_quads(Group& group, const std::vector<int>& shapes, size_t cells, int solid) {
        RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_QUAD);
        auto* corner = static_cast<uint32_t*>(
            rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4, 16, cells));
        auto ours = std::make_unique<Geometry>(Geometry{&store, {}, {}, solid});
        ours->shape_of_grid.reserve(cells);
        ours->cell.reserve(cells);
        size_t last = 0;
        for (int shape : shapes) {
            const store::ShapeRecord& s = store.shapes()[size_t(shape)];
            const unsigned first = unsigned(s.positions) / 3, row = unsigned(s.mu + 1);
            for (unsigned j = 0; j < unsigned(s.mv); j++)
                for (unsigned i = 0; i < unsigned(s.mu); i++) {
                    const unsigned at = first + j * row + i;
                    *corner++ = at, *corner++ = at + 1, *corner++ = at + row + 1, *corner++ = at + row;
                    ours->shape_of_grid.push_back(shape);
                    ours->cell.push_back(i | j << 16);
                }
            last = std::max(last, size_t(first) + size_t(row) * size_t(s.mv + 1));
        }
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, store.words(), 0,
                                   12, last);
        bytes += int64_t(cells * 2 * sizeof(int));
        attach(group, geometry, std::move(ours));
    }

    void add_mesh(Group& group, int shape, int solid) {
        const store::ShapeRecord& s = store.shapes()[size_t(shape)];
        struct Kind {
            RTCGeometryType type;
            RTCFormat vertex, index;
            size_t vertex_bytes, index_bytes;
        };
        const Kind kind =
            s.flags & store::ShapeRecord::Fibre
                ? Kind{RTC_GEOMETRY_TYPE_ROUND_LINEAR_CURVE, RTC_FORMAT_FLOAT4, RTC_FORMAT_UINT, 16, 4}
            : s.flags & store::ShapeRecord::Quads
                ? Kind{RTC_GEOMETRY_TYPE_QUAD, RTC_FORMAT_FLOAT3, RTC_FORMAT_UINT4, 12, 16}
                : Kind{RTC_GEOMETRY_TYPE_TRIANGLE, RTC_FORMAT_FLOAT3, RTC_FORMAT_UINT3, 12, 12};
        RTCGeometry geometry = rtcNewGeometry(device, kind.type);
        rtcSetGeometryTimeStepCount(geometry, unsigned(s.motion_segments) + 1);
        for (int k = 0; k <= s.motion_segments; k++)
            rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, unsigned(k), kind.vertex,
                                       store.words() + s.positions, size_t(k) * size_t(s.motion_stride) * 4,
                                       kind.vertex_bytes, size_t(s.mu));
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, kind.index, store.words() + s.indices,
                                   0, kind.index_bytes, size_t(s.mv));
        attach(group, geometry, std::make_unique<Geometry>(Geometry{&store, {shape}, {}, solid}));
    }

    void add_instances(Group& group, const GroupDesc::Instances& desc, const GroupDesc& child) {
        const size_t count = desc.paths.empty() ? desc.transforms.size() / 12 : desc.paths.size();
        if (count == 0)
            return;
        auto in = std::make_unique<Instances>();
        in->group = desc.group;
        in->first_slot = desc.first_slot;
        in->slots = child.slots;
        in->first_emitter = child.emitters > 0 ? child.first_emitter : -1;
        in->target = &groups[size_t(desc.group)];
        in->transforms = desc.transforms;
        in->paths = desc.paths;
        in->child = bounds_of(*in->target);
        if (!in->paths.empty())
            bound_paths(*in);
        else
            in->inverses.resize(count * 12);
        tasks::parallel_chunks(in->inverses.size() / 12, 4096, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; i++)
                if (!invert(desc.transforms.data() + i * 12, in->inverses.data() + i * 12))
                    std::fill_n(in->inverses.data() + i * 12, 12, 0.0f); // a flattened instance: never hit
        });
        RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
        rtcSetGeometryUserPrimitiveCount(geometry, unsigned(count));
        rtcSetGeometryTimeStepCount(geometry, unsigned(in->steps));
        rtcSetGeometryUserData(geometry, in.get());
        rtcSetGeometryBoundsFunction(geometry, instance_bounds, nullptr);
        rtcSetGeometryIntersectFunction(geometry, instance_intersect);
        rtcSetGeometryOccludedFunction(geometry, instance_occluded);
        bytes += int64_t(in->inverses.size() * sizeof(float) + in->bounds.size() * sizeof(Bounds3f));
        group.instances.push_back(std::move(in));
        attach(group, geometry, nullptr, desc.bounds_solid);
    }

    // Embree's tasks are none of ours: it asks by itself.
    void commit(RTCScene scene, const Build& build) {
        if (build.cancelled)
            rtcSetSceneProgressMonitorFunction(
                scene, [](void* of, double) { return !static_cast<const Build*>(of)->cancelled(); },
                const_cast<Build*>(&build));
        rtcCommitScene(scene);
        rtcSetSceneProgressMonitorFunction(scene, nullptr, nullptr);
        tasks::check_cancelled(); // then it is not built
        const RTCError error = rtcGetDeviceError(device);
        if (error == RTC_ERROR_CANCELLED)
            throw tasks::Cancelled();
        if (error == RTC_ERROR_OUT_OF_MEMORY)
            throw Error("there is not enough memory for the structure by which " +
                        std::to_string(bytes >> 20) +
                        " MB and more of geometry are traced: a larger shading rate or instances would do");
    }

    template <int W>
    Context context(const RayPacket<W>& rays, float* transforms, float* hit_magnitude, int32_t* hit_group,
                    int32_t* hit_slot_shift) const {
        Context c;
        rtcInitIntersectContext(&c.embree);
        c.seeds = reinterpret_cast<const int32_t*>(&rays.seed.v);
        c.hit_transform = transforms;
        c.hit_magnitude = hit_magnitude;
        c.hit_group = hit_group;
        c.hit_slot_shift = hit_slot_shift;
        c.passes = nullptr;
        c.camera = reinterpret_cast<const int32_t*>(&rays.camera.v);
        c.level = reinterpret_cast<const float*>(&rays.level.v);
        c.passages = rays.passages;
        c.slot[0] = 0;
        c.width = W;
        c.world_from_current[0] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
        return c;
    }
};

Scene::Scene(const store::Store& store, std::span<const GroupDesc> groups, Build build)
    : m_impl(std::make_unique<Impl>(store)) {
    Impl& impl = *m_impl;
    impl.groups.resize(groups.size());
    for (size_t g = 0; g < groups.size(); g++) {
        Group& group = impl.groups[g];
        const auto new_scene = [&] {
            RTCScene s = rtcNewScene(impl.device);
            // No flag for filters of a query's own: there are none, and without it Embree takes intersectors
            // that call no filters wherever no geometry has one.
            rtcSetSceneFlags(s, RTCSceneFlags((build.watertight ? RTC_SCENE_FLAG_ROBUST : 0) |
                                              (build.compact ? RTC_SCENE_FLAG_COMPACT : 0)));
            return s;
        };
        group.scene = new_scene();
        group.trees = SolidTrees(groups[g].solids);
        if (!group.trees.empty())
            group.solids = new_scene();
        // Grids by whether hits are filtered, their steps, and how far apart those lie; and by the solid
        // that they bound.
        std::map<std::array<int32_t, 4>, std::vector<int>> grids;
        for (const auto& range : groups[g].shapes) {
            const int solid = group.trees.empty() || group.trees.holds(range.solid) ? range.solid : -1;
            for (int s = range.first; s < range.first + range.count; s++) {
                const store::ShapeRecord& shape = store.shapes()[size_t(s)];
                if (shape.flags & store::ShapeRecord::Mesh)
                    impl.add_mesh(group, s, solid);
                else
                    grids[{impl.cuts_out(shape), shape.motion_segments,
                           shape.motion_segments > 0 ? shape.motion_stride : 0, solid}]
                        .push_back(s);
            }
        }
        for (const auto& [kind, list] : grids) {
            size_t cells = 0;
            for (int shape : list)
                cells += size_t(store.shapes()[size_t(shape)].mu) * size_t(store.shapes()[size_t(shape)].mv);
            const bool opaque = kind[0] == 0, still = kind[1] == 0;
            if (opaque && still && cells > 0 && cells <= MostQuads && !build.compact)
                impl.add_quads(group, list, cells, kind[3]);
            else
                impl.add_grids(group, list, kind[3]);
        }
        for (const auto& instances : groups[g].instances)
            impl.add_instances(group, instances, groups[size_t(instances.group)]);
        impl.commit(group.scene, build);
        if (group.solids)
            impl.commit(group.solids, build);
    }
}

Scene::~Scene() = default;

void Scene::clip(std::span<const Plane> planes, int times) {
    m_impl->planes.assign(planes.begin(), planes.end());
    m_impl->plane_times = times;
}

Bounds3f Scene::bounds() const {
    const RTCBounds b = bounds_of(m_impl->groups.back());
    Bounds3f r;
    r.lo = {b.lower_x, b.lower_y, b.lower_z};
    r.hi = {b.upper_x, b.upper_y, b.upper_z};
    return r;
}

uint64_t Scene::bytes() const {
    return uint64_t(std::max<int64_t>(0, m_impl->bytes.load()));
}

namespace {

template <int W>
struct EmbreeTypes;
template <>
struct EmbreeTypes<1> {
    using Ray = RTCRay;
    using RayHit = RTCRayHit;
    static void intersect(const int*, RTCScene s, RTCIntersectContext* c, RayHit* r) {
        rtcIntersect1(s, c, r);
    }
    static void occluded(const int*, RTCScene s, RTCIntersectContext* c, Ray* r) { rtcOccluded1(s, c, r); }
};
template <>
struct EmbreeTypes<8> {
    using Ray = RTCRay8;
    using RayHit = RTCRayHit8;
    static void intersect(const int* v, RTCScene s, RTCIntersectContext* c, RayHit* r) {
        rtcIntersect8(v, s, c, r);
    }
    static void occluded(const int* v, RTCScene s, RTCIntersectContext* c, Ray* r) {
        rtcOccluded8(v, s, c, r);
    }
};
template <>
struct EmbreeTypes<16> {
    using Ray = RTCRay16;
    using RayHit = RTCRayHit16;
    static void intersect(const int* v, RTCScene s, RTCIntersectContext* c, RayHit* r) {
        rtcIntersect16(v, s, c, r);
    }
    static void occluded(const int* v, RTCScene s, RTCIntersectContext* c, Ray* r) {
        rtcOccluded16(v, s, c, r);
    }
};

template <int W, class Ray>
void fill(Ray& r, const RayPacket<W>& rays) {
    const auto put = [](auto& field, const auto& value) { std::memcpy(&field, &value.v, sizeof value.v); };
    put(r.org_x, rays.o.x), put(r.org_y, rays.o.y), put(r.org_z, rays.o.z);
    put(r.dir_x, rays.d.x), put(r.dir_y, rays.d.y), put(r.dir_z, rays.d.z);
    put(r.tnear, rays.t_min), put(r.tfar, rays.t_max), put(r.time, rays.time);
    put(r.mask, Int<W>(-1)), put(r.id, Int<W>::lane_index()), put(r.flags, Int<W>(0));
}

// A field of a lane: packets have arrays where single rays have values.
template <class T>
T& at(T* field, int) {
    return *field;
}
template <class T, size_t N>
T& at(T (*field)[N], int i) {
    return (*field)[i];
}

template <int W>
RTCRay lane(const RayPacket<W>& rays, int i) {
    RTCRay r;
    r.org_x = rays.o.x.v[i], r.org_y = rays.o.y.v[i], r.org_z = rays.o.z.v[i];
    r.dir_x = rays.d.x.v[i], r.dir_y = rays.d.y.v[i], r.dir_z = rays.d.z.v[i];
    r.tnear = rays.t_min.v[i], r.tfar = rays.t_max.v[i], r.time = rays.time.v[i];
    r.mask = unsigned(-1), r.id = unsigned(i), r.flags = 0;
    return r;
}

// What planes leave of a ray is one piece of it: they all cut half of space.
template <int W>
RayPacket<W> clipped(RayPacket<W> rays, const std::vector<Scene::Plane>& planes, int times) {
    const size_t count = planes.size() / size_t(times);
    for (size_t p = 0; p < count; p++) {
        Vec3<Float<W>> point(planes[p].point), n(planes[p].normal);
        if (times > 1) { // linear between two times, as the camera is
            static_assert(sizeof(Scene::Plane) == 6 * sizeof(float));
            const int stride = int(6 * count);
            const Float<W> x = rays.time * Float<W>(float(times - 1));
            const Int<W> i = max(min(to_int(x), Int<W>(times - 2)), Int<W>(0)); // idle lanes have any time
            const Float<W> f = x - Float<W>(i);
            const float* first = &planes[p].point.x;
            for (int k = 0; k < 6; k++) {
                const Float<W> a = gather(first + k, i * Int<W>(stride)),
                               b = gather(first + stride + k, i * Int<W>(stride));
                (k < 3 ? point[k] : n[k - 3]) = fma(f, b - a, a);
            }
        }
        const Float<W> ahead = dot(point - rays.o, n), rises = dot(rays.d, n), t = ahead / rises;
        rays.t_max = select((rises > Float<W>(0.0f)) & (t < rays.t_max), t, rays.t_max);
        rays.t_min = select((rises < Float<W>(0.0f)) & (t > rays.t_min), t, rays.t_min);
        rays.active &= !((rises == Float<W>(0.0f)) & (ahead < Float<W>(0.0f)));
    }
    rays.active &= rays.t_min <= rays.t_max;
    return rays;
}

} // namespace

namespace {

// Embree's packets round otherwise than its single rays, so one coherent ray is a packet of one: then all
// lane counts find the same bits.
void intersect_as_packet(const Scene& scene, const RayPacket<1>& ray, HitPacket<1>& hit) {
    RayPacket<8> rays;
    HitPacket<8> hits;
    for (int c = 0; c < 3; c++)
        rays.o[c] = Float<8>(ray.o[c][0]), rays.d[c] = Float<8>(ray.d[c][0]);
    rays.t_max = Float<8>(ray.t_max[0]);
    rays.t_min = Float<8>(ray.t_min[0]);
    rays.active = Int<8>::lane_index() == Int<8>(ray.active[0] ? 0 : -1);
    rays.seed = Int<8>(ray.seed[0]);
    rays.time = Float<8>(ray.time[0]);
    rays.camera = Int<8>(ray.camera[0]);
    rays.level = Float<8>(ray.level[0]);
    LetThrough passages[8];
    rays.passages = ray.passages ? passages : nullptr;
    rays.coherent = true;
    scene.intersect(rays, hits);
    if (ray.passages)
        *ray.passages = passages[0];
    hit.hit = Mask<1>(hits.hit[0]);
    hit.t = hits.t[0], hit.u = hits.u[0], hit.v = hits.v[0];
    hit.Ng = {hits.Ng.x[0], hits.Ng.y[0], hits.Ng.z[0]};
    hit.shape = hits.shape[0], hit.prim = hits.prim[0], hit.instanced = hits.instanced[0];
    hit.magnitude = hits.magnitude[0], hit.slot_shift = hits.slot_shift[0];
    for (int k = 0; k < 12; k++)
        hit.world_from_shape[k][0] = hits.world_from_shape[k][0];
}

} // namespace

template <int W>
void Scene::intersect(const RayPacket<W>& rays, HitPacket<W>& hits) const {
    if constexpr (W == 1)
        if (rays.coherent)
            return intersect_as_packet(*this, rays, hits);
    if (m_impl->planes.empty()) {
        intersect_kept(rays, hits);
    } else {
        intersect_kept(clipped(rays, m_impl->planes, m_impl->plane_times), hits);
        hits.t = select(hits.hit, hits.t, rays.t_max);
    }
    if (m_watch)
        tell(rays, traceable(rays), select(hits.hit, hits.t, rays.t_max));
}

template <int W>
void Scene::tell(const RayPacket<W>& rays, const Mask<W>& which, const Float<W>& t_max) const {
    for (uint32_t bits = which.bits(); bits; bits &= bits - 1) {
        const int i = __builtin_ctz(bits);
        m_watch->look({rays.o.x[i], rays.o.y[i], rays.o.z[i]}, {rays.d.x[i], rays.d.y[i], rays.d.z[i]},
                      rays.t_min[i], t_max[i]);
    }
}

template <int W>
void Scene::find_occluded(const RayPacket<W>& rays, Mask<W>& hidden) const {
    hidden =
        occluded_kept(m_impl->planes.empty() ? rays : clipped(rays, m_impl->planes, m_impl->plane_times));
    if (m_watch)
        tell(rays, traceable(rays) & !hidden, rays.t_max);
}

template <int W>
void Scene::intersect_kept(const RayPacket<W>& rays, HitPacket<W>& hits) const {
    using E = EmbreeTypes<W>;
    alignas(64) typename E::RayHit rh;
    alignas(64) float magnitude[W];
    alignas(64) int32_t hit_group[W], slot_shift[W];
    const int world = int(m_impl->groups.size()) - 1;
    for (int i = 0; i < W; i++)
        hit_group[i] = world;
    fill<W>(rh.ray, rays);
    const Int<W> none(-1);
    std::memcpy(&rh.hit.geomID, &none.v, sizeof none.v);
    std::memcpy(&rh.hit.instID[0], &none.v, sizeof none.v);
    Context context =
        m_impl->context<W>(rays, &hits.world_from_shape[0][0], magnitude, hit_group, slot_shift);
    if (rays.coherent)
        context.embree.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    const Mask<W> active = traceable(rays);
    alignas(64) int32_t valid[W];
    std::memcpy(valid, &active.v, sizeof valid);
    const Group& group = m_impl->groups.back();
    std::vector<SolidHit> solids(group.solids ? W : 0);
    uint32_t bounded = 0; // rays that meet a solid, which nothing behind it hides
    if (group.solids)
        for (uint32_t bits = active.bits(); bits; bits &= bits - 1) {
            const int i = __builtin_ctz(bits);
            if (!solids[size_t(i)].find(group, context, lane(rays, i)))
                continue;
            bounded |= 1u << i;
            at(&rh.ray.tfar, i) = solids[size_t(i)].t();
        }
    if (W > 1 || valid[0])
        E::intersect(valid, group.scene, &context.embree, &rh);
    for (; bounded; bounded &= bounded - 1) {
        const int i = __builtin_ctz(bounded);
        if (at(&rh.hit.geomID, i) != RTC_INVALID_GEOMETRY_ID)
            continue;
        RTCHit hit;
        solids[size_t(i)].put(context, unsigned(i), hit);
        at(&rh.hit.Ng_x, i) = hit.Ng_x, at(&rh.hit.Ng_y, i) = hit.Ng_y, at(&rh.hit.Ng_z, i) = hit.Ng_z;
        at(&rh.hit.u, i) = hit.u, at(&rh.hit.v, i) = hit.v;
        at(&rh.hit.geomID, i) = hit.geomID, at(&rh.hit.primID, i) = hit.primID;
        at(&rh.hit.instID[0], i) = hit.instID[0];
    }
    const auto get = [](auto& value, const auto& field) { std::memcpy(&value.v, &field, sizeof value.v); };
    get(hits.t, rh.ray.tfar);
    get(hits.u, rh.hit.u), get(hits.v, rh.hit.v);
    get(hits.Ng.x, rh.hit.Ng_x), get(hits.Ng.y, rh.hit.Ng_y), get(hits.Ng.z, rh.hit.Ng_z);
    get(hits.prim, rh.hit.primID);
    Int<W> geometry, instance;
    get(geometry, rh.hit.geomID);
    get(instance, rh.hit.instID[0]);
    hits.hit = (geometry != none) & active;
    hits.instanced = Int<W>(0);
    hits.magnitude = Float<W>(0.0f);
    hits.shape = Int<W>(0);
    for (uint32_t bits = hits.hit.bits(); bits; bits &= bits - 1) {
        const int i = __builtin_ctz(bits);
        const bool inside = instance.v[i] != -1;
        const Geometry& g =
            *m_impl->groups[size_t(inside ? hit_group[i] : world)].geometries[size_t(geometry.v[i])];
        hits.instanced.v[i] = inside;
        if (inside)
            hits.slot_shift.v[i] = slot_shift[i], hits.magnitude.v[i] = magnitude[i];
        hits.shape.v[i] =
            g.shape_of_grid.size() == 1 ? g.shape_of_grid[0] : g.shape_of_grid[size_t(hits.prim.v[i])];
        if (!g.cell.empty()) {
            const store::ShapeRecord& s = m_impl->store.shapes()[size_t(hits.shape.v[i])];
            const uint32_t cell = g.cell[size_t(hits.prim.v[i])];
            hits.u.v[i] = (float(cell & 0xffff) + hits.u.v[i]) / float(s.mu);
            hits.v.v[i] = (float(cell >> 16) + hits.v.v[i]) / float(s.mv);
        }
    }
}

template <int W>
Mask<W> Scene::occluded_kept(const RayPacket<W>& rays) const {
    using E = EmbreeTypes<W>;
    alignas(64) typename E::Ray r;
    alignas(64) float transforms[12 * W], magnitude[W];
    int32_t hit_group[W], slot_shift[W], passes[W];
    fill<W>(r, rays);
    Context context = m_impl->context<W>(rays, transforms, magnitude, hit_group, slot_shift);
    rays.passes.store(passes);
    context.passes = passes;
    const Mask<W> active = traceable(rays);
    alignas(64) int32_t valid[W];
    std::memcpy(valid, &active.v, sizeof valid);
    if (W > 1 || valid[0])
        E::occluded(valid, m_impl->groups.back().scene, &context.embree, &r);
    const Group& group = m_impl->groups.back();
    if (group.solids)
        for (uint32_t bits = active.bits(); bits; bits &= bits - 1) {
            const int i = __builtin_ctz(bits);
            SolidHit solid;
            if (!(at(&r.tfar, i) < 0) && solid.find(group, context, lane(rays, i)))
                at(&r.tfar, i) = -std::numeric_limits<float>::infinity();
        }
    Float<W> t;
    std::memcpy(&t.v, &r.tfar, sizeof t.v);
    return (t < Float<W>(0.0f)) & active;
}

template void Scene::intersect<1>(const RayPacket<1>&, HitPacket<1>&) const;
template void Scene::intersect<8>(const RayPacket<8>&, HitPacket<8>&) const;
template void Scene::intersect<16>(const RayPacket<16>&, HitPacket<16>&) const;
template void Scene::find_occluded<1>(const RayPacket<1>&, Mask<1>&) const;
template void Scene::find_occluded<8>(const RayPacket<8>&, Mask<8>&) const;
template void Scene::find_occluded<16>(const RayPacket<16>&, Mask<16>&) const;

} // namespace kanuka::bvh
