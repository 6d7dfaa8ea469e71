// Rays through the scene: pages first, then what is Embree's, packet by packet; what planes cut away, and
// solids before the rest.
#include <cstring>
#include <limits>

#include "bvh/clip.h"
#include "bvh/scene_impl.h"

namespace kanuka::bvh {

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

template <int W>
Context context_of(const RayPacket<W>& rays, float* transforms, float* hit_magnitude, int32_t* hit_group,
                   int32_t* hit_slot_shift, int32_t* hit_variation) {
    Context c;
    rtcInitIntersectContext(&c.embree);
    c.seeds = reinterpret_cast<const int32_t*>(&rays.seed.v);
    c.hit_transform = transforms;
    c.hit_magnitude = hit_magnitude;
    c.hit_group = hit_group;
    c.hit_slot_shift = hit_slot_shift;
    c.hit_variation = hit_variation;
    c.passes = nullptr;
    c.camera = reinterpret_cast<const int32_t*>(&rays.camera.v);
    c.level = reinterpret_cast<const float*>(&rays.level.v);
    c.passages = rays.passages;
    c.slot[0] = c.variation[0] = 0;
    c.width = W;
    c.world_from_current[0] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    return c;
}

template <int W>
Mask<W> traceable(const RayPacket<W>& rays) {
    Mask<W> m = rays.active & (rays.t_max >= Float<W>(0.0f));
    for (int c = 0; c < 3; c++)
        m &= (abs(rays.o[c]) < Float<W>(LargestCoordinate)) & (abs(rays.d[c]) < Float<W>(LargestCoordinate));
    return m;
}

// Packets without what planes cut away, chunk by chunk.
template <int W, class Body>
void without_clipped(std::span<const RayPacket<W>> rays, const std::vector<Scene::Plane>& planes, int times,
                     const Body& body) {
    if (planes.empty())
        return body(rays, size_t(0));
    constexpr size_t Chunk = 16;
    RayPacket<W> kept[Chunk];
    for (size_t first = 0; first < rays.size(); first += Chunk) {
        const size_t count = std::min(Chunk, rays.size() - first);
        for (size_t i = 0; i < count; i++)
            kept[i] = clipped(rays[first + i], planes, times);
        body(std::span<const RayPacket<W>>(kept, count), first);
    }
}

} // namespace

void Scene::clip(std::span<const Plane> planes, int times) {
    m_impl->planes.assign(planes.begin(), planes.end());
    m_impl->plane_times = times;
}

// Embree's part first, which is small, or surfaces that hide fibres behind them.
template <int W>
void Scene::intersect(std::span<const RayPacket<W>> rays, std::span<HitPacket<W>> hits) const {
    const bool embree = m_impl->embree().scene;
    without_clipped<W>(rays, m_impl->planes, m_impl->plane_times, [&](auto kept, size_t first) {
        const std::span<HitPacket<W>> found = hits.subspan(first, kept.size());
        for (size_t i = 0; i < kept.size(); i++)
            if (embree)
                intersect_embree(kept[i], found[i]);
            else
                found[i].clear(kept[i].t_max);
        if (m_impl->few)
            m_impl->few->intersect<W>(kept, found);
        m_impl->pages->intersect<W>(kept, found);
    });
    for (size_t i = 0; i < rays.size(); i++) {
        if (!m_impl->planes.empty())
            hits[i].t = select(hits[i].hit, hits[i].t, rays[i].t_max);
        if (m_watch)
            tell(rays[i], traceable(rays[i]), select(hits[i].hit, hits[i].t, rays[i].t_max));
    }
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
void Scene::find_occluded(std::span<const RayPacket<W>> rays, std::span<Mask<W>> hidden) const {
    const bool embree = m_impl->embree().scene;
    without_clipped<W>(rays, m_impl->planes, m_impl->plane_times, [&](auto kept, size_t first) {
        const std::span<Mask<W>> found = hidden.subspan(first, kept.size());
        for (size_t i = 0; i < kept.size(); i++)
            found[i] = embree ? occluded_embree(kept[i]) : Mask<W>(false);
        if (m_impl->few)
            m_impl->few->find_occluded<W>(kept, found);
        m_impl->pages->find_occluded<W>(kept, found);
    });
    if (m_watch)
        for (size_t i = 0; i < rays.size(); i++)
            tell(rays[i], traceable(rays[i]) & !hidden[i], rays[i].t_max);
}

// Embree's packets round otherwise than its single rays, so one coherent ray is a packet of one: then all
// lane counts find the same bits.
template <class Intersect>
void intersect_as_packet(const Intersect& intersect, const RayPacket<1>& ray, HitPacket<1>& hit) {
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
    intersect(rays, hits);
    if (ray.passages)
        *ray.passages = passages[0];
    hit.hit = Mask<1>(hits.hit[0]);
    hit.t = hits.t[0], hit.u = hits.u[0], hit.v = hits.v[0];
    hit.Ng = {hits.Ng.x[0], hits.Ng.y[0], hits.Ng.z[0]};
    hit.shape = hits.shape[0], hit.prim = hits.prim[0], hit.instanced = hits.instanced[0];
    hit.magnitude = hits.magnitude[0], hit.slot_shift = hits.slot_shift[0];
    hit.variation = hits.variation[0];
    for (int k = 0; k < 12; k++)
        hit.world_from_shape[k][0] = hits.world_from_shape[k][0];
}

template <int W>
void Scene::intersect_embree(const RayPacket<W>& rays, HitPacket<W>& hits) const {
    using E = EmbreeTypes<W>;
    if constexpr (W == 1)
        if (rays.coherent)
            return intersect_as_packet(
                [this](const RayPacket<8>& r, HitPacket<8>& h) { intersect_embree(r, h); }, rays, hits);
    alignas(64) typename E::RayHit rh;
    alignas(64) float magnitude[W];
    alignas(64) int32_t hit_group[W], slot_shift[W], variation[W];
    const int world = int(m_impl->world());
    for (int i = 0; i < W; i++)
        hit_group[i] = world;
    fill<W>(rh.ray, rays);
    const Int<W> none(-1);
    std::memcpy(&rh.hit.geomID, &none.v, sizeof none.v);
    std::memcpy(&rh.hit.instID[0], &none.v, sizeof none.v);
    Context context =
        context_of(rays, &hits.world_from_shape[0][0], magnitude, hit_group, slot_shift, variation);
    if (rays.coherent)
        context.embree.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    const Mask<W> active = traceable(rays);
    alignas(64) int32_t valid[W];
    std::memcpy(valid, &active.v, sizeof valid);
    const Group& group = m_impl->embree();
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
    hits.shape = hits.slot_shift = hits.variation = Int<W>(0);
    for (uint32_t bits = hits.hit.bits(); bits; bits &= bits - 1) {
        const int i = __builtin_ctz(bits);
        const bool inside = instance.v[i] != -1;
        const Geometry& g =
            *m_impl->groups[size_t(inside ? hit_group[i] : world)].geometries[size_t(geometry.v[i])];
        hits.instanced.v[i] = inside;
        if (inside)
            hits.slot_shift.v[i] = slot_shift[i], hits.magnitude.v[i] = magnitude[i],
            hits.variation.v[i] = variation[i];
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
Mask<W> Scene::occluded_embree(const RayPacket<W>& rays) const {
    using E = EmbreeTypes<W>;
    alignas(64) typename E::Ray r;
    alignas(64) float transforms[12 * W], magnitude[W];
    int32_t hit_group[W], slot_shift[W], variation[W], passes[W];
    fill<W>(r, rays);
    Context context = context_of(rays, transforms, magnitude, hit_group, slot_shift, variation);
    rays.passes.store(passes);
    context.passes = passes;
    const Mask<W> active = traceable(rays);
    alignas(64) int32_t valid[W];
    std::memcpy(valid, &active.v, sizeof valid);
    if (W > 1 || valid[0])
        E::occluded(valid, m_impl->embree().scene, &context.embree, &r);
    const Group& group = m_impl->embree();
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

template void Scene::intersect<1>(std::span<const RayPacket<1>>, std::span<HitPacket<1>>) const;
template void Scene::intersect<8>(std::span<const RayPacket<8>>, std::span<HitPacket<8>>) const;
template void Scene::intersect<16>(std::span<const RayPacket<16>>, std::span<HitPacket<16>>) const;
template void Scene::find_occluded<1>(std::span<const RayPacket<1>>, std::span<Mask<1>>) const;
template void Scene::find_occluded<8>(std::span<const RayPacket<8>>, std::span<Mask<8>>) const;
template void Scene::find_occluded<16>(std::span<const RayPacket<16>>, std::span<Mask<16>>) const;

} // namespace kanuka::bvh
