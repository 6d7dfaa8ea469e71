#include "bvh/bvh.h"

#include <atomic>
#include <cstring>
#include <embree3/rtcore.h>

#include "base/error.h"
#include "base/sampling.h"
#include "base/tasks.h"

namespace kanuka::bvh {

namespace {

constexpr int MaxDepth = 16; // of nested instances

using Matrix = std::array<float, 12>; // row-major 3x4

Matrix concat(const Matrix& a, const float* b) {
    Matrix r;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++)
            r[i * 4 + j] = a[i * 4] * b[j] + a[i * 4 + 1] * b[4 + j] + a[i * 4 + 2] * b[8 + j] +
                           (j == 3 ? a[i * 4 + 3] : 0);
    return r;
}

Vec3f apply(const float* m, const Vec3f& p, float w) {
    return {m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3] * w, m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7] * w,
            m[8] * p.x + m[9] * p.y + m[10] * p.z + m[11] * w};
}

// Inverse of an affine 3x4 matrix by its adjugate; false if singular.
bool invert(const float* m, float* out) {
    const double a = m[0], b = m[1], c = m[2], d = m[4], e = m[5], f = m[6], g = m[8], h = m[9], i = m[10];
    const double det = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g);
    if (!(std::abs(det) > 1e-38))
        return false;
    const double s = 1 / det;
    const double r[9] = {(e * i - f * h) * s, (c * h - b * i) * s, (b * f - c * e) * s,
                         (f * g - d * i) * s, (a * i - c * g) * s, (c * d - a * f) * s,
                         (d * h - e * g) * s, (b * g - a * h) * s, (a * e - b * d) * s};
    for (int row = 0; row < 3; row++) {
        for (int col = 0; col < 3; col++)
            out[row * 4 + col] = float(r[row * 3 + col]);
        out[row * 4 + 3] = float(-(r[row * 3] * m[3] + r[row * 3 + 1] * m[7] + r[row * 3 + 2] * m[11]));
    }
    return true;
}

// Embree's packaged build asserts that rays lie in the range that it can compute with. What does not hits
// nothing.
constexpr float LargestCoordinate = 1e18f;

bool traceable(const RTCRay& r) {
    const float largest = std::max({std::abs(r.org_x), std::abs(r.org_y), std::abs(r.org_z),
                                    std::abs(r.dir_x), std::abs(r.dir_y), std::abs(r.dir_z)});
    const float sum = (r.org_x + r.org_y + r.org_z) + (r.dir_x + r.dir_y + r.dir_z); // max() overlooks NaN
    return largest < LargestCoordinate && std::isfinite(sum);
}

template <int W>
Mask<W> traceable(const RayPacket<W>& rays) {
    Mask<W> m = rays.active & (rays.t_max >= Float<W>(0.0f));
    for (int c = 0; c < 3; c++)
        m &= (abs(rays.o[c]) < Float<W>(LargestCoordinate)) & (abs(rays.d[c]) < Float<W>(LargestCoordinate));
    return m;
}

struct Geometry {
    const store::Store* store;
    std::vector<int> shape_of_grid; // grids: by primID; meshes: one entry
};

struct Instances;

struct Group {
    RTCScene scene = nullptr;
    std::vector<std::unique_ptr<Geometry>> geometries; // by geomID; null for instances
    std::vector<std::unique_ptr<Instances>> instances;
};

struct Instances {
    int group;
    int first_slot, slots; // of the first place; of each
    int first_emitter;     // of the group that is placed; -1 = its own have no numbers
    const Group* target;
    std::span<const float> transforms;
    std::vector<float> inverses; // 12 floats each
    RTCBounds child;
};

// Travels with a query through all levels; filters and callbacks find their ray by ray.id.
struct Context {
    RTCIntersectContext embree; // first member: Embree hands it back (checked below)
    const int32_t* seeds;
    float* hit_transform; // [12][width]
    int32_t* hit_group;
    int32_t* hit_slot_shift;
    const int32_t* passes; // null: shadow linking is not asked for
    int width;
    int depth = 0;
    Matrix world_from_current[MaxDepth + 1];
    int32_t slot[MaxDepth + 1]; // where the numbers of emitters in the current group begin
};
static_assert(offsetof(Context, embree) == 0);

// Stochastic transparency: a surface of presence p stops a ray with probability p. One decision per ray and
// cell, by hash, so hits and shadows need no special case.
void presence_filter(const RTCFilterFunctionNArguments* args) {
    const Geometry& g = *static_cast<const Geometry*>(args->geometryUserPtr);
    const Context& context = *reinterpret_cast<const Context*>(args->context);
    for (unsigned i = 0; i < args->N; i++) {
        if (args->valid[i] == 0)
            continue;
        const unsigned prim = RTCHitN_primID(args->hit, args->N, i);
        const float u = RTCHitN_u(args->hit, args->N, i), v = RTCHitN_v(args->hit, args->N, i);
        const int shape = g.shape_of_grid.size() == 1 ? g.shape_of_grid[0] : g.shape_of_grid[prim];
        const int seed = context.seeds[RTCRayN_id(args->ray, args->N, i)];
        const float t = RTCRayN_tfar(args->ray, args->N, i);
        int t_bits;
        std::memcpy(&t_bits, &t, 4);
        const Int<1> h = hash_bits(Int<1>(seed) ^ hash_bits(Int<1>(int(uint32_t(shape) * 0x9e3779b1u + prim +
                                                                       (uint32_t(t_bits) & ~0xffu)))));
        if (to_unit(h)[0] >= g.store->presence(shape, int(prim), u, v))
            args->valid[i] = 0;
        if (context.passes && (context.passes[RTCRayN_id(args->ray, args->N, i)] &
                               g.store->shapes()[size_t(shape)].lets_through) != 0)
            args->valid[i] = 0;
    }
}

void instance_bounds(const RTCBoundsFunctionArguments* args) {
    const Instances& in = *static_cast<const Instances*>(args->geometryUserPtr);
    const float* m = in.transforms.data() + size_t(args->primID) * 12;
    const RTCBounds& c = in.child;
    Bounds3f b;
    for (int k = 0; k < 8; k++)
        b.extend(apply(
            m, {k & 1 ? c.upper_x : c.lower_x, k & 2 ? c.upper_y : c.lower_y, k & 4 ? c.upper_z : c.lower_z},
            1));
    *args->bounds_o = {b.lo.x, b.lo.y, b.lo.z, 0, b.hi.x, b.hi.y, b.hi.z, 0};
}

RTCRay ray_in_child(const RTCRayN* rays, unsigned n, unsigned i, const float* inverse) {
    RTCRay r = rtcGetRayFromRayN(const_cast<RTCRayN*>(rays), n, i);
    const Vec3f o = apply(inverse, {r.org_x, r.org_y, r.org_z}, 1),
                d = apply(inverse, {r.dir_x, r.dir_y, r.dir_z}, 0);
    r.org_x = o.x, r.org_y = o.y, r.org_z = o.z;
    r.dir_x = d.x, r.dir_y = d.y, r.dir_z = d.z;
    return r;
}

void enter(Context& context, const Instances& in, unsigned prim) {
    context.world_from_current[context.depth + 1] =
        concat(context.world_from_current[context.depth], in.transforms.data() + size_t(prim) * 12);
    const int32_t above = context.slot[context.depth++];
    context.slot[context.depth] = above < 0 || in.first_slot < 0
                                      ? GroupDesc::Unnumbered
                                      : above + in.first_slot + int32_t(prim) * in.slots;
}

void instance_intersect(const RTCIntersectFunctionNArguments* args) {
    const Instances& in = *static_cast<const Instances*>(args->geometryUserPtr);
    Context& context = *reinterpret_cast<Context*>(args->context);
    if (context.depth >= MaxDepth)
        return;
    enter(context, in, args->primID);
    RTCRayN* rays = RTCRayHitN_RayN(args->rayhit, args->N);
    RTCHitN* hits = RTCRayHitN_HitN(args->rayhit, args->N);
    for (unsigned i = 0; i < args->N; i++) {
        if (args->valid[i] == 0)
            continue;
        RTCRayHit rh;
        rh.ray = ray_in_child(rays, args->N, i, in.inverses.data() + size_t(args->primID) * 12);
        if (!traceable(rh.ray))
            continue;
        rh.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        rh.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        const float before = rh.ray.tfar;
        rtcIntersect1(in.target->scene, &context.embree, &rh);
        if (rh.hit.geomID == RTC_INVALID_GEOMETRY_ID || !(rh.ray.tfar < before))
            continue;
        RTCRayN_tfar(rays, args->N, i) = rh.ray.tfar;
        rtcCopyHitToHitN(hits, &rh.hit, args->N, i);
        if (rh.hit.instID[0] == RTC_INVALID_GEOMETRY_ID) { // found here, not deeper: note where "here" is
            for (int k = 0; k < 12; k++)
                context.hit_transform[k * context.width + int(rh.ray.id)] =
                    context.world_from_current[context.depth][k];
            context.hit_group[rh.ray.id] = in.group;
            const int32_t slot = context.slot[context.depth];
            context.hit_slot_shift[rh.ray.id] = slot < 0 || in.first_emitter < 0
                                                    ? std::numeric_limits<int32_t>::min()
                                                    : slot - in.first_emitter;
        }
        RTCHitN_instID(hits, args->N, i, 0) = 0; // for the levels above: not one of your own geometries
    }
    context.depth--;
}

void instance_occluded(const RTCOccludedFunctionNArguments* args) {
    const Instances& in = *static_cast<const Instances*>(args->geometryUserPtr);
    Context& context = *reinterpret_cast<Context*>(args->context);
    if (context.depth >= MaxDepth)
        return;
    enter(context, in, args->primID);
    for (unsigned i = 0; i < args->N; i++) {
        if (args->valid[i] == 0)
            continue;
        RTCRay ray = ray_in_child(args->ray, args->N, i, in.inverses.data() + size_t(args->primID) * 12);
        if (!traceable(ray))
            continue;
        rtcOccluded1(in.target->scene, &context.embree, &ray);
        if (ray.tfar < 0)
            RTCRayN_tfar(args->ray, args->N, i) = -std::numeric_limits<float>::infinity();
    }
    context.depth--;
}

} // namespace

struct Scene::Impl {
    RTCDevice device = nullptr;
    std::vector<Group> groups;
    std::atomic<int64_t> bytes{0};
    const store::Store& store;

    explicit Impl(const store::Store& store) : store(store) {
        device = rtcNewDevice(nullptr);
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
        for (Group& g : groups)
            rtcReleaseScene(g.scene);
        rtcReleaseDevice(device);
    }

    bool cuts_out(const store::ShapeRecord& s) const { // for some rays
        return store.programs()[size_t(s.program)].presence >= 0 || s.lets_through != 0;
    }

    void attach(Group& group, RTCGeometry geometry, std::unique_ptr<Geometry> ours) {
        if (ours) {
            rtcSetGeometryUserData(geometry, ours.get());
            if (cuts_out(store.shapes()[size_t(ours->shape_of_grid[0])])) {
                rtcSetGeometryIntersectFilterFunction(geometry, presence_filter);
                rtcSetGeometryOccludedFilterFunction(geometry, presence_filter);
            }
        }
        rtcCommitGeometry(geometry);
        const unsigned id = rtcAttachGeometry(group.scene, geometry);
        if (id != group.geometries.size())
            throw Error("Embree numbered geometries in an unexpected order", ExitCode::Internal);
        group.geometries.push_back(std::move(ours));
        rtcReleaseGeometry(geometry);
    }

    // All grids of a group whose hits are filtered, or all whose hits are not: their vertices lie in the
    // arena as they are.
    void add_grids(Group& group, const std::vector<int>& shapes) {
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
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, store.words(), 0,
                                   12, last);
        auto ours = std::make_unique<Geometry>(Geometry{&store, shapes});
        attach(group, geometry, std::move(ours));
    }

    void add_mesh(Group& group, int shape) {
        const store::ShapeRecord& s = store.shapes()[size_t(shape)];
        const bool quads = s.flags & store::ShapeRecord::Quads;
        RTCGeometry geometry =
            rtcNewGeometry(device, quads ? RTC_GEOMETRY_TYPE_QUAD : RTC_GEOMETRY_TYPE_TRIANGLE);
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                   store.words() + s.positions, 0, 12, size_t(s.mu));
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0,
                                   quads ? RTC_FORMAT_UINT4 : RTC_FORMAT_UINT3, store.words() + s.indices, 0,
                                   quads ? 16 : 12, size_t(s.mv));
        attach(group, geometry, std::make_unique<Geometry>(Geometry{&store, {shape}}));
    }

    void add_instances(Group& group, const GroupDesc::Instances& desc, const GroupDesc& child) {
        const size_t count = desc.transforms.size() / 12;
        auto in = std::make_unique<Instances>();
        in->group = desc.group;
        in->first_slot = desc.first_slot;
        in->slots = child.slots;
        in->first_emitter = child.emitters > 0 ? child.first_emitter : -1;
        in->target = &groups[size_t(desc.group)];
        in->transforms = desc.transforms;
        in->inverses.resize(count * 12);
        rtcGetSceneBounds(in->target->scene, &in->child);
        tasks::parallel_chunks(count, 4096, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; i++)
                if (!invert(desc.transforms.data() + i * 12, in->inverses.data() + i * 12))
                    std::fill_n(in->inverses.data() + i * 12, 12, 0.0f); // a flattened instance: never hit
        });
        RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
        rtcSetGeometryUserPrimitiveCount(geometry, unsigned(count));
        rtcSetGeometryUserData(geometry, in.get());
        rtcSetGeometryBoundsFunction(geometry, instance_bounds, nullptr);
        rtcSetGeometryIntersectFunction(geometry, instance_intersect);
        rtcSetGeometryOccludedFunction(geometry, instance_occluded);
        bytes += int64_t(in->inverses.size() * sizeof(float));
        group.instances.push_back(std::move(in));
        attach(group, geometry, nullptr);
    }

    template <int W>
    Context context(const RayPacket<W>& rays, float* transforms, int32_t* hit_group,
                    int32_t* hit_slot_shift) const {
        Context c;
        rtcInitIntersectContext(&c.embree);
        c.seeds = reinterpret_cast<const int32_t*>(&rays.seed.v);
        c.hit_transform = transforms;
        c.hit_group = hit_group;
        c.hit_slot_shift = hit_slot_shift;
        c.passes = nullptr;
        c.slot[0] = 0;
        c.width = W;
        c.world_from_current[0] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
        return c;
    }
};

Scene::Scene(const store::Store& store, std::span<const GroupDesc> groups, bool compact)
    : m_impl(std::make_unique<Impl>(store)) {
    Impl& impl = *m_impl;
    impl.groups.resize(groups.size());
    for (size_t g = 0; g < groups.size(); g++) {
        Group& group = impl.groups[g];
        group.scene = rtcNewScene(impl.device);
        rtcSetSceneFlags(group.scene,
                         RTCSceneFlags(RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION |
                                       (compact ? RTC_SCENE_FLAG_COMPACT : 0)));
        std::vector<int> solid, cut_out;
        for (const auto& range : groups[g].shapes)
            for (int s = range.first; s < range.first + range.count; s++) {
                const store::ShapeRecord& shape = store.shapes()[size_t(s)];
                if (shape.flags & store::ShapeRecord::Mesh)
                    impl.add_mesh(group, s);
                else
                    (impl.cuts_out(shape) ? cut_out : solid).push_back(s);
            }
        impl.add_grids(group, solid);
        impl.add_grids(group, cut_out);
        for (const auto& instances : groups[g].instances)
            impl.add_instances(group, instances, groups[size_t(instances.group)]);
        rtcCommitScene(group.scene);
    }
}

Scene::~Scene() = default;

Bounds3f Scene::bounds() const {
    RTCBounds b;
    rtcGetSceneBounds(m_impl->groups.back().scene, &b);
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
    put(r.tnear, Float<W>(0.0f)), put(r.tfar, rays.t_max), put(r.time, Float<W>(0.0f));
    put(r.mask, Int<W>(-1)), put(r.id, Int<W>::lane_index()), put(r.flags, Int<W>(0));
}

} // namespace

template <int W>
void Scene::intersect(const RayPacket<W>& rays, HitPacket<W>& hits) const {
    using E = EmbreeTypes<W>;
    alignas(64) typename E::RayHit rh;
    alignas(64) int32_t hit_group[W], slot_shift[W];
    const int world = int(m_impl->groups.size()) - 1;
    for (int i = 0; i < W; i++)
        hit_group[i] = world;
    fill<W>(rh.ray, rays);
    const Int<W> none(-1);
    std::memcpy(&rh.hit.geomID, &none.v, sizeof none.v);
    std::memcpy(&rh.hit.instID[0], &none.v, sizeof none.v);
    Context context = m_impl->context<W>(rays, &hits.world_from_shape[0][0], hit_group, slot_shift);
    const Mask<W> active = traceable(rays);
    alignas(64) int32_t valid[W];
    std::memcpy(valid, &active.v, sizeof valid);
    if (W > 1 || valid[0])
        E::intersect(valid, m_impl->groups.back().scene, &context.embree, &rh);
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
    hits.shape = Int<W>(0);
    for (uint32_t bits = hits.hit.bits(); bits; bits &= bits - 1) {
        const int i = __builtin_ctz(bits);
        const bool inside = instance.v[i] != -1;
        const Geometry& g =
            *m_impl->groups[size_t(inside ? hit_group[i] : world)].geometries[size_t(geometry.v[i])];
        hits.instanced.v[i] = inside;
        if (inside)
            hits.slot_shift.v[i] = slot_shift[i];
        hits.shape.v[i] =
            g.shape_of_grid.size() == 1 ? g.shape_of_grid[0] : g.shape_of_grid[size_t(hits.prim.v[i])];
    }
}

template <int W>
Mask<W> Scene::occluded(const RayPacket<W>& rays) const {
    using E = EmbreeTypes<W>;
    alignas(64) typename E::Ray r;
    alignas(64) float transforms[12 * W];
    int32_t hit_group[W], slot_shift[W], passes[W];
    fill<W>(r, rays);
    Context context = m_impl->context<W>(rays, transforms, hit_group, slot_shift);
    rays.passes.store(passes);
    context.passes = passes;
    const Mask<W> active = traceable(rays);
    alignas(64) int32_t valid[W];
    std::memcpy(valid, &active.v, sizeof valid);
    if (W > 1 || valid[0])
        E::occluded(valid, m_impl->groups.back().scene, &context.embree, &r);
    Float<W> t;
    std::memcpy(&t.v, &r.tfar, sizeof t.v);
    return (t < Float<W>(0.0f)) & active;
}

template void Scene::intersect<1>(const RayPacket<1>&, HitPacket<1>&) const;
template void Scene::intersect<8>(const RayPacket<8>&, HitPacket<8>&) const;
template void Scene::intersect<16>(const RayPacket<16>&, HitPacket<16>&) const;
template Mask<1> Scene::occluded<1>(const RayPacket<1>&) const;
template Mask<8> Scene::occluded<8>(const RayPacket<8>&) const;
template Mask<16> Scene::occluded<16>(const RayPacket<16>&) const;

} // namespace kanuka::bvh
