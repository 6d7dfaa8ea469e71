// Rays through the surfaces of solids: all crossings of a ray are noted by a filter that turns every hit
// down.
#include <algorithm>
#include <limits>

#include "bvh/embree_scene.h"

namespace kanuka::bvh {

void note_crossing(const RTCFilterFunctionNArguments* args) {
    const Geometry& g = *static_cast<const Geometry*>(args->geometryUserPtr);
    Context& context = *reinterpret_cast<Context*>(args->context);
    if (!context.crossings) // not traced as part of a solid
        return;
    Crossings& crossings = *context.crossings;
    for (unsigned i = 0; i < args->N; i++) {
        if (args->valid[i] == 0)
            continue;
        args->valid[i] = 0;
        const RTCRay r = rtcGetRayFromRayN(args->ray, args->N, i);
        const RTCHit h = rtcGetHitFromHitN(args->hit, args->N, i);
        Crossing c;
        c.t = r.tfar, c.u = h.u, c.v = h.v;
        c.Ng = {h.Ng_x, h.Ng_y, h.Ng_z};
        c.entering = dot(c.Ng, {r.dir_x, r.dir_y, r.dir_z}) < 0;
        c.solid = g.solid;
        c.geometry = h.geomID, c.primitive = h.primID;
        c.shape = g.shape(h.primID);
        c.place = -1;
        if (context.depth > crossings.depth) {
            c.place = int(crossings.places.size());
            const Vec3f p{r.org_x + c.t * r.dir_x, r.org_y + c.t * r.dir_y, r.org_z + c.t * r.dir_z};
            crossings.places.push_back(
                {&g, known_world(context), magnitude_at(context, p), context.variation[context.depth]});
        }
        crossings.all.push_back(c);
    }
}

static Precision precision_of(const RTCRay& ray) {
    return {{ray.org_x, ray.org_y, ray.org_z}, {ray.dir_x, ray.dir_y, ray.dir_z}};
}

void SolidHit::gather(const Group& group, Context& context, RTCRayHit rh, Crossings& crossings) {
    crossings.depth = context.depth;
    rh.ray.tfar = 1e30f; // beyond the ray's end: that tells where it starts
    rh.hit.geomID = rh.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    context.crossings = &crossings;
    const Precision precision = precision_of(rh.ray);
    rtcIntersect1(group.solids, &context.embree, &rh);
    context.crossings = nullptr;
    std::erase_if(crossings.all, [&](const Crossing& c) { return !group.trees.holds(c.solid); });
    order_crossings(crossings.all, precision);
}

bool SolidHit::find(const Group& group, Context& context, const RTCRay& ray) {
    m_hit = nullptr;
    m_crossings.all.clear();
    m_crossings.places.clear();
    RTCRayHit rh;
    rh.ray = ray;
    gather(group, context, rh, m_crossings);
    if (m_crossings.all.empty())
        return false;
    if (any_odd(m_crossings.all)) { // it starts inside of something, or passed a crack: what is behind tells
        rh.ray.org_x += ray.dir_x * ray.tnear;
        rh.ray.org_y += ray.dir_y * ray.tnear;
        rh.ray.org_z += ray.dir_z * ray.tnear;
        rh.ray.dir_x = -ray.dir_x, rh.ray.dir_y = -ray.dir_y, rh.ray.dir_z = -ray.dir_z;
        rh.ray.tnear = 0;
        Crossings behind;
        gather(group, context, rh, behind);
        drop_unpaired(m_crossings.all, behind.all);
    }
    const Precision precision = precision_of(ray);
    const Crossing* hit = first_boundary(group.trees, m_crossings.all, precision, [&](const Crossing& c) {
        if (c.t > ray.tfar)
            return true; // and so are all that come
        const Geometry& g =
            c.place < 0 ? *group.geometries[c.geometry] : *m_crossings.places[size_t(c.place)].geometry;
        return !g.partly ||
               is_present(*g.store, c.shape, int(c.primitive), c.u, c.v, c.t, context.beholder(ray.id));
    });
    if (hit && hit->t <= ray.tfar)
        m_hit = hit;
    return m_hit != nullptr;
}

void SolidHit::put(Context& context, unsigned ray_id, RTCHit& hit) const {
    const Crossing& c = *m_hit;
    hit.Ng_x = c.Ng.x, hit.Ng_y = c.Ng.y, hit.Ng_z = c.Ng.z;
    hit.u = c.u, hit.v = c.v;
    hit.geomID = c.geometry, hit.primID = c.primitive;
    hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    if (c.place < 0)
        return;
    const Crossings::Place& place = m_crossings.places[size_t(c.place)];
    for (size_t k = 0; k < 12; k++)
        context.hit_transform[k * size_t(context.width) + ray_id] = place.world_from_shape[k];
    context.hit_magnitude[ray_id] = place.magnitude;
    context.hit_variation[ray_id] = place.variation;
    context.hit_group[ray_id] = place.geometry->group;
    context.hit_slot_shift[ray_id] = std::numeric_limits<int32_t>::min();
    hit.instID[0] = 0;
}

void intersect_group(const Group& group, Context& context, RTCRayHit& rh) {
    if (!group.solids) {
        rtcIntersect1(group.scene, &context.embree, &rh);
        return;
    }
    SolidHit solid;
    const bool found = solid.find(group, context, rh.ray);
    if (found)
        rh.ray.tfar = solid.t();
    rtcIntersect1(group.scene, &context.embree, &rh);
    if (found && rh.hit.geomID == RTC_INVALID_GEOMETRY_ID)
        solid.put(context, rh.ray.id, rh.hit);
}

void occluded_group(const Group& group, Context& context, RTCRay& ray) {
    rtcOccluded1(group.scene, &context.embree, &ray);
    if (!group.solids || ray.tfar < 0)
        return;
    SolidHit solid;
    if (solid.find(group, context, ray))
        ray.tfar = -std::numeric_limits<float>::infinity();
}

RTCBounds bounds_of(const Group& group) {
    RTCBounds b;
    rtcGetSceneBounds(group.scene, &b);
    if (!group.solids)
        return b;
    RTCBounds s;
    rtcGetSceneBounds(group.solids, &s);
    b.lower_x = std::min(b.lower_x, s.lower_x), b.upper_x = std::max(b.upper_x, s.upper_x);
    b.lower_y = std::min(b.lower_y, s.lower_y), b.upper_y = std::max(b.upper_y, s.upper_y);
    b.lower_z = std::min(b.lower_z, s.lower_z), b.upper_z = std::max(b.upper_z, s.upper_z);
    return b;
}

} // namespace kanuka::bvh
