// Instances: a user geometry whose callbacks take rays to the space of the group that is placed, and back.
#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <optional>

#include "base/tasks.h"
#include "bvh/embree_scene.h"

namespace kanuka::bvh {

namespace {

bool traceable(const RTCRay& r) {
    const float largest = std::max({std::abs(r.org_x), std::abs(r.org_y), std::abs(r.org_z),
                                    std::abs(r.dir_x), std::abs(r.dir_y), std::abs(r.dir_z)});
    const float sum = (r.org_x + r.org_y + r.org_z) + (r.dir_x + r.dir_y + r.dir_z); // max() overlooks NaN
    return largest < LargestCoordinate && std::isfinite(sum);
}

// Between a group and what stands in it at a place.
struct Way {
    Matrix up, down;
    bool open; // there is an inverse

    Way(const Places& places, size_t i) : up(places[i]), open(invert(up.data(), down.data())) {}
    Way(const MotionPath& path, float time) {
        path.at(double(time), up.data());
        open = invert(up.data(), down.data());
    }
};

// The way into an instance, for rays one after the other.
class Passage {
  public:
    Passage(Context& context, const Instances& in, uint32_t instance, const Way& way)
        : m_context(context), m_way(way) {
        context.known = std::min(context.known, context.depth);
        context.parent_from_current[context.depth + 1] = way.up.data();
        context.current_from_parent[context.depth + 1] = way.down.data();
        context.variation[context.depth + 1] = in.variations.empty() || in.variations[instance] == 0
                                                   ? context.variation[context.depth]
                                                   : in.variations[instance];
        const int32_t above = context.slot[context.depth++];
        context.slot[context.depth] = above < 0 || in.first_slot < 0
                                          ? GroupDesc::Unnumbered
                                          : above + in.first_slot + int32_t(instance) * in.slots;
    }
    Passage(const Passage&) = delete;
    Passage& operator=(const Passage&) = delete;
    ~Passage() { m_context.depth--; }
    // Takes a ray to the child's space; false = it meets nothing there.
    bool take(RTCRay& ray) const {
        if (!m_way.open)
            return false;
        const float* const down = m_way.down.data();
        const Vec3f o = apply(down, {ray.org_x, ray.org_y, ray.org_z}, 1),
                    d = apply(down, {ray.dir_x, ray.dir_y, ray.dir_z}, 0);
        ray.org_x = o.x, ray.org_y = o.y, ray.org_z = o.z;
        ray.dir_x = d.x, ray.dir_y = d.y, ray.dir_z = d.z;
        return traceable(ray);
    }

  private:
    Context& m_context;
    const Way& m_way;
};

// Ways to the instances of a cluster, for all rays of a packet. They are made as a ray enters: a matrix and
// its inverse for each instance would be twice what the scene itself takes.
class Ways {
  public:
    Ways(const Instances& in, const Cluster& cluster) : m_in(in), m_cluster(cluster) {
        for (const uint32_t i : cluster.instance) // while the boxes are looked at
            if (i != Cluster::None)
                in.places.prefetch(i);
    }
    const Way& to(int k) {
        if (!m_ways[size_t(k)])
            m_ways[size_t(k)].emplace(m_in.places, m_cluster.instance[k]);
        return *m_ways[size_t(k)];
    }

  private:
    const Instances& m_in;
    const Cluster& m_cluster;
    std::array<std::optional<Way>, Cluster::Size> m_ways;
};

// Calls visit(passage, ray, i) for each ray of the packet and each instance of the cluster that it may hit:
// those whose boxes it meets, the nearest first, whatever the other rays do. It returns where the ray ends
// now.
template <class Visit>
void each_of_cluster(Context& context, const Instances& in, const Cluster& cluster, const int* valid,
                     RTCRayN* rays, unsigned n, const Visit& visit) {
    Ways ways(in, cluster);
    const auto enter = [&](unsigned i, RTCRay& ray, uint32_t boxes, const float* entry, size_t stride) {
        const auto at = [&](int k) { return entry[size_t(k) * stride]; };
        while (boxes != 0) {
            int nearest = std::countr_zero(boxes);
            for (uint32_t rest = boxes & (boxes - 1); rest != 0; rest &= rest - 1)
                if (at(std::countr_zero(rest)) < at(nearest))
                    nearest = std::countr_zero(rest);
            boxes &= ~(1u << nearest);
            if (at(nearest) > ray.tfar)
                break; // something nearer is hit
            if (!in.is_seen(cluster.instance[nearest], context.level[ray.id]))
                continue;
            const Passage passage(context, in, cluster.instance[nearest], ways.to(nearest));
            ray.tfar = visit(passage, ray, i);
        }
    };
    const ClusterBoxes clustered(cluster);
    // A packet that has come apart is faster ray by ray.
    if (n == 8 && std::count(valid, valid + 8, 0) < 6) {
        alignas(32) float entry[Cluster::Size][8];
        const uint32_t met = clustered.meet_eight(rays, entry);
        for (unsigned i = 0; i < 8; i++)
            if (const uint32_t boxes = _pext_u32(met, 0x01010101u << i); boxes != 0 && valid[i] != 0) {
                RTCRay ray = rtcGetRayFromRayN(rays, n, i);
                enter(i, ray, boxes, entry[0] + i, 8);
            }
        return;
    }
    for (unsigned i = 0; i < n; i++) {
        if (valid[i] == 0)
            continue;
        RTCRay ray = rtcGetRayFromRayN(rays, n, i);
        float entry[Cluster::Size];
        enter(i, ray, clustered.meet(ray, entry), entry, 1);
    }
}

// The same for a primitive, which is a cluster, or one instance that moves.
template <class Visit>
void each_instance(Context& context, const Instances& in, unsigned prim, const int* valid, RTCRayN* rays,
                   unsigned n, const Visit& visit) {
    if (in.paths.empty())
        return each_of_cluster(context, in, in.clusters[prim], valid, rays, n, visit);
    for (unsigned i = 0; i < n; i++) {
        if (valid[i] == 0)
            continue;
        const RTCRay ray = rtcGetRayFromRayN(rays, n, i);
        if (!in.is_seen(prim, context.level[ray.id]))
            continue;
        const Way way(in.paths[prim], ray.time);
        visit(Passage(context, in, prim, way), ray, i);
    }
}

float intersect_one(Context& context, const Instances& in, const Passage& passage, const RTCRay& ray,
                    RTCRayN* rays, RTCHitN* hits, unsigned n, unsigned i) {
    RTCRayHit rh;
    rh.ray = ray;
    if (!passage.take(rh.ray))
        return ray.tfar;
    rh.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rh.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    intersect_group(*in.target, context, rh);
    if (rh.hit.geomID == RTC_INVALID_GEOMETRY_ID || !(rh.ray.tfar < ray.tfar))
        return ray.tfar;
    RTCRayN_tfar(rays, n, i) = rh.ray.tfar;
    rtcCopyHitToHitN(hits, &rh.hit, n, i);
    if (rh.hit.instID[0] == RTC_INVALID_GEOMETRY_ID) { // found here, not deeper: note where "here" is
        const Matrix& world_from_here = known_world(context);
        for (size_t k = 0; k < 12; k++)
            context.hit_transform[int(k) * context.width + int(ray.id)] = world_from_here[k];
        const RTCRay& r = rh.ray;
        context.hit_magnitude[r.id] = magnitude_at(
            context, {r.org_x + r.tfar * r.dir_x, r.org_y + r.tfar * r.dir_y, r.org_z + r.tfar * r.dir_z});
        context.hit_group[r.id] = in.group;
        context.hit_variation[r.id] = context.variation[context.depth];
        const int32_t slot = context.slot[context.depth];
        context.hit_slot_shift[r.id] =
            slot < 0 || in.first_emitter < 0 ? std::numeric_limits<int32_t>::min() : slot - in.first_emitter;
    }
    RTCHitN_instID(hits, n, i, 0) = 0; // for the levels above: not one of your own geometries
    return rh.ray.tfar;
}

} // namespace

const Matrix& known_world(Context& context) {
    for (int& k = context.known; k < context.depth; k++)
        context.world_from_current[k + 1] =
            concat(context.world_from_current[k], context.parent_from_current[k + 1]);
    return context.world_from_current[context.depth];
}

float magnitude_at(Context& context, const Vec3f& p) {
    known_world(context);
    Vec3f at = p, sum(0.0f);
    for (int k = context.depth; k > 0; k--) {
        const float* up = context.parent_from_current[k];
        const Vec3f parent = apply(up, at, 1);
        sum += rounding_of(up, context.current_from_parent[k], context.world_from_current[size_t(k) - 1],
                           context.world_from_current[size_t(k)], parent, at);
        at = parent;
    }
    return std::max({sum.x, sum.y, sum.z});
}

namespace {

typedef double Column __attribute__((vector_size(32)));

Column column(const float* m, int c) {
    return Column{double(m[c]), double(m[4 + c]), double(m[8 + c]), 0};
}
Column cross(Column a, Column b) {
    const auto next = [](Column c) { return __builtin_shufflevector(c, c, 1, 2, 0, 3); };
    const auto last = [](Column c) { return __builtin_shufflevector(c, c, 2, 0, 1, 3); };
    return next(a) * last(b) - last(a) * next(b);
}
double sum(Column c) {
    return c[0] + c[1] + c[2];
}
bool is_inverted(double determinant) {
    return std::abs(determinant) > 1e-38;
}

} // namespace

bool has_inverse(const float* m) {
    return is_inverted(sum(column(m, 0) * cross(column(m, 1), column(m, 2))));
}

bool invert(const float* m, float* out) {
    const Column x = column(m, 0), y = column(m, 1), z = column(m, 2), at = column(m, 3);
    const Column yz = cross(y, z);
    const double determinant = sum(x * yz);
    if (!is_inverted(determinant))
        return false;
    const double scale = 1 / determinant;
    const Column rows[3] = {yz * scale, cross(z, x) * scale, cross(x, y) * scale};
    for (const Column& row : rows) {
        for (int c = 0; c < 3; c++)
            *out++ = float(row[c]);
        *out++ = float(-sum(row * at));
    }
    return true;
}

void instance_bounds(const RTCBoundsFunctionArguments* args) {
    const Instances& in = *static_cast<const Instances*>(args->geometryUserPtr);
    const Bounds3f b = in.paths.empty() ? in.clusters[args->primID].bounds()
                                        : in.bounds[size_t(args->primID) * size_t(in.steps) + args->timeStep];
    *args->bounds_o = {b.lo.x, b.lo.y, b.lo.z, 0, b.hi.x, b.hi.y, b.hi.z, 0};
}

void bound_paths(Instances& in) {
    constexpr double TurnAStep = 0.2; // radians
    for (const MotionPath& path : in.paths)
        in.steps = std::max(in.steps, path.times_to_bound(TurnAStep));
    in.bounds.resize(in.paths.size() * size_t(in.steps));
    tasks::parallel_chunks(in.paths.size(), 256, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++)
            in.paths[i].bound(in.child, std::span(in.bounds).subspan(i * size_t(in.steps), size_t(in.steps)));
    });
}

void instance_intersect(const RTCIntersectFunctionNArguments* args) {
    const Instances& in = *static_cast<const Instances*>(args->geometryUserPtr);
    Context& context = *reinterpret_cast<Context*>(args->context);
    if (context.depth >= MaxDepth)
        return;
    RTCRayN* rays = RTCRayHitN_RayN(args->rayhit, args->N);
    RTCHitN* hits = RTCRayHitN_HitN(args->rayhit, args->N);
    each_instance(context, in, args->primID, args->valid, rays, args->N,
                  [&](const Passage& passage, const RTCRay& ray, unsigned i) {
                      return intersect_one(context, in, passage, ray, rays, hits, args->N, i);
                  });
}

void instance_occluded(const RTCOccludedFunctionNArguments* args) {
    const Instances& in = *static_cast<const Instances*>(args->geometryUserPtr);
    Context& context = *reinterpret_cast<Context*>(args->context);
    if (context.depth >= MaxDepth)
        return;
    each_instance(context, in, args->primID, args->valid, args->ray, args->N,
                  [&](const Passage& passage, RTCRay ray, unsigned i) {
                      const float end = ray.tfar;
                      if (!passage.take(ray))
                          return end;
                      occluded_group(*in.target, context, ray);
                      if (!(ray.tfar < 0))
                          return end;
                      RTCRayN_tfar(args->ray, args->N, i) = -std::numeric_limits<float>::infinity();
                      return ray.tfar;
                  });
}

} // namespace kanuka::bvh
