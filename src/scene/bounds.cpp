#include "scene/bounds.h"

#include <cmath>

namespace kanuka::scene {
namespace {

Bounds3f quadric_bounds(const Quadric& q) {
    const auto& a = q.arguments;
    const auto at = [&](size_t i) { return i < a.size() ? a[i] : 0.0f; };
    Bounds3f b;
    const auto box = [&](float radius, float z0, float z1) {
        radius = std::abs(radius);
        b.extend(Vec3f(-radius, -radius, min(z0, z1)));
        b.extend(Vec3f(radius, radius, max(z0, z1)));
    };
    switch (q.kind) {
    case Quadric::Kind::Sphere:
    case Quadric::Kind::Cylinder:
        box(at(0), at(1), at(2));
        break;
    case Quadric::Kind::Cone:
        box(at(1), 0, at(0));
        break;
    case Quadric::Kind::Hyperboloid:
        box(max(std::hypot(at(0), at(1)), std::hypot(at(3), at(4))), at(2), at(5));
        break;
    case Quadric::Kind::Paraboloid:
        box(at(0), at(1), at(2));
        break;
    case Quadric::Kind::Disk:
        box(at(1), at(0), at(0));
        break;
    case Quadric::Kind::Torus:
        box(at(0) + at(1), -at(1), at(1));
        break;
    }
    return b;
}

Bounds3f transformed(const Transform& t, const Bounds3f& b) {
    Bounds3f r;
    if (b.empty())
        return r;
    for (int i = 0; i < 8; i++)
        r.extend(t.point({i & 1 ? b.hi.x : b.lo.x, i & 2 ? b.hi.y : b.lo.y, i & 4 ? b.hi.z : b.lo.z}));
    return r;
}

bool is_finite(const Bounds3f& b) {
    return std::isfinite(b.lo.x + b.lo.y + b.lo.z) && std::isfinite(b.hi.x + b.hi.y + b.hi.z);
}

// Of the points that faces have.
Bounds3f bounds_of_faces(const Buffer<int32_t>& vertices, const Value& points) {
    Bounds3f b;
    const size_t count = points.floats.size() / 3;
    for (const int32_t v : vertices)
        if (v >= 0 && size_t(v) < count)
            b.extend(Vec3f(points.floats[3 * size_t(v)], points.floats[3 * size_t(v) + 1],
                           points.floats[3 * size_t(v) + 2]));
    return b;
}

// All of a shape at one time, in object space.
Bounds3f shape_bounds(const Primitive& p) {
    const Buffer<int32_t>* vertices = nullptr;
    if (const auto* mesh = std::get_if<PolygonMesh>(&p.geometry))
        vertices = &mesh->vertices;
    else if (const auto* cage = std::get_if<SubdivisionMesh>(&p.geometry))
        vertices = &cage->vertices;
    const Value* points = p.primvars.find("P");
    Bounds3f b =
        vertices && !vertices->empty() && points ? bounds_of_faces(*vertices, *points) : object_bounds(p);
    if (b.empty() || !is_finite(b))
        return {};
    if (std::holds_alternative<Curves>(p.geometry) || std::holds_alternative<Points>(p.geometry)) {
        float half = 0;
        for (const char* name : {"width", "constantwidth"})
            if (const Value* widths = p.primvars.find(name))
                for (const float width : widths->floats)
                    half = max(half, std::isfinite(width) ? width / 2 : 0);
        b = {b.lo - Vec3f(half, half, half), b.hi + Vec3f(half, half, half)};
    }
    return b;
}

// In the space of what holds it.
Bounds3f bounds_of(const Primitive& p) {
    Bounds3f shape = shape_bounds(p);
    if (!p.motion)
        return transformed(p.world_from_object, shape);
    for (const Motion::Shape& later : p.motion->shapes) {
        Primitive then = p;
        then.geometry = later.geometry, then.primvars = later.primvars;
        shape.extend(shape_bounds(then));
    }
    Bounds3f b = transformed(p.world_from_object, shape);
    for (const TransformKey& k : p.motion->places)
        b.extend(transformed(k.transform, shape));
    return b;
}

// Of a box at all of some places, at all times. Rows as Group::Instances has them; by middle and reach, as
// there may be millions.
Bounds3f placed(const Group::Instances& instances, const Bounds3f& box) {
    Bounds3f b;
    if (box.empty())
        return b;
    const Vec3f middle = box.center(), reach = box.diagonal() * 0.5f;
    for (size_t i = 0; i + 12 <= instances.transforms.size(); i += 12) {
        float low[3], high[3];
        for (size_t k = 0; k < 3; k++) {
            const float* m = instances.transforms.data() + i + 4 * k;
            const float at = m[0] * middle.x + m[1] * middle.y + m[2] * middle.z + m[3];
            const float away = std::abs(m[0]) * reach.x + std::abs(m[1]) * reach.y + std::abs(m[2]) * reach.z;
            low[k] = at - away, high[k] = at + away;
        }
        const Bounds3f one{{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
        if (is_finite(one))
            b.extend(one);
    }
    return b;
}

} // namespace

Bounds3f object_bounds(const Primitive& p) {
    if (const auto* v = std::get_if<Volume>(&p.geometry))
        return {{v->bound[0], v->bound[2], v->bound[4]}, {v->bound[1], v->bound[3], v->bound[5]}};
    if (const auto* q = std::get_if<Quadric>(&p.geometry))
        return quadric_bounds(*q);
    Bounds3f b;
    if (const Value* v = p.primvars.find("P"))
        for (size_t i = 0; i + 2 < v->floats.size(); i += 3)
            b.extend(Vec3f(v->floats[i], v->floats[i + 1], v->floats[i + 2]));
    else if (const Value* w = p.primvars.find("Pw"))
        for (size_t i = 0; i + 3 < w->floats.size(); i += 4)
            if (w->floats[i + 3] != 0)
                b.extend(Vec3f(w->floats[i], w->floats[i + 1], w->floats[i + 2]) / w->floats[i + 3]);
    return b;
}

Bounds3f world_bounds(const Primitive& primitive) {
    return transformed(primitive.world_from_object, object_bounds(primitive));
}

Bounds3f bounds(const Scene& scene) {
    Bounds3f all;
    for (const Primitive& p : scene.primitives)
        all.extend(bounds_of(p));
    // Children have lower indices than their parents: one pass up.
    std::vector<Bounds3f> groups(scene.groups.size());
    const auto add = [&](const Group::Instances& instances, Bounds3f& to, size_t below) {
        if (instances.group >= 0 && size_t(instances.group) < below)
            to.extend(placed(instances, groups[size_t(instances.group)]));
    };
    for (size_t g = 0; g < scene.groups.size(); g++) {
        for (const Primitive& p : scene.groups[g].primitives)
            groups[g].extend(bounds_of(p));
        for (const Group::Instances& instances : scene.groups[g].instances)
            add(instances, groups[g], g);
    }
    for (const Group::Instances& instances : scene.instances)
        add(instances, all, scene.groups.size());
    return all;
}

} // namespace kanuka::scene
