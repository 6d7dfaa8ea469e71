#include "render/group_views.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "render/de_instance.h"
#include "scene/bounds.h"

namespace kanuka::render {
namespace {

constexpr size_t MostPlaces = 8; // that are looked at one by one

struct Sphere {
    Vec3f center{0, 0, 0};
    float radius = 0;
};

Transform from_rows(const float* rows) {
    Transform t;
    for (size_t i = 0; i < 12; i++)
        t.m[i / 4][i % 4] = double(rows[i]);
    return t;
}

float largest_scale(const float* m) {
    return std::sqrt(
        std::max({m[0] * m[0] + m[4] * m[4] + m[8] * m[8], m[1] * m[1] + m[5] * m[5] + m[9] * m[9],
                  m[2] * m[2] + m[6] * m[6] + m[10] * m[10]}));
}

template <class Visit> // visit(row-major 3x4 matrix); moving ones at all their times
void each_transform(const scene::Group::Instances& in, Visit visit) {
    for (size_t i = 0; i + 12 <= in.transforms.size(); i += 12)
        visit(in.transforms.data() + i);
}

// What the group's primitives and its own instances reach, before displacement.
std::vector<Sphere> bound_groups(const scene::Scene& scene, size_t first) {
    std::vector<Sphere> spheres(scene.groups.size());
    for (size_t g = 0; g < spheres.size(); g++) { // groups hold instances of lower ones
        Bounds3f box;
        const auto add = [&](const Vec3f& center, float radius) {
            box.extend(center - Vec3f(radius));
            box.extend(center + Vec3f(radius));
        };
        for (const scene::Primitive& p : scene.groups[g].primitives)
            if (const Bounds3f b = scene::world_bounds(p); !b.empty())
                box.extend(b);
            else // a blobby
                add(p.world_from_object->point({0, 0, 0}), 1);
        for (const auto& in : scene.groups[g].instances)
            if (size_t(in.group) >= first)
                each_transform(in, [&](const float* m) {
                    const Sphere& child = spheres[size_t(in.group) - first];
                    add(from_rows(m).point(child.center), child.radius * largest_scale(m));
                });
        if (!box.empty())
            spheres[g] = {(box.lo + box.hi) * 0.5f, length(box.hi - box.lo) * 0.5f};
    }
    return spheres;
}

struct Seen {
    std::vector<Transform> places; // render_from_group, while they are few
    bool many = false, moves = false;
    float pixels_per_unit = 0;
};

// As the shutter opens.
std::vector<Vec3f> eyes_of(const dice::DicingCamera& camera) {
    std::vector<Vec3f> eyes;
    for (const Transform& c : camera.shot.empty() ? std::vector{camera.page_from_camera} : camera.shot)
        eyes.push_back(c.point({0, 0, 0}));
    return eyes;
}

} // namespace

std::vector<GroupView> view_groups(const scene::Scene& scene, size_t first,
                                   const Transform& render_from_world, const dice::DicingCamera& camera) {
    const std::vector<Sphere> bounds = bound_groups(scene, first);
    std::vector<Transform> cameras = camera.shot;
    if (cameras.empty()) {
        cameras = camera.also_from;
        cameras.insert(cameras.begin(), camera.page_from_camera);
    }
    const std::vector<Vec3f> eyes = eyes_of(camera);
    std::vector<Seen> seen(scene.groups.size());
    const auto place = [&](int group, const Transform& render_from_group, float scale) {
        if (size_t(group) < first) // built before
            return;
        Seen& s = seen[size_t(group) - first];
        const Sphere& bound = bounds[size_t(group) - first];
        const float radius = bound.radius * scale;
        // From within the bound it is unknown how near it comes.
        float nearest = INFINITY;
        const Vec3f center = render_from_group.point(bound.center);
        for (const Vec3f& eye : eyes)
            nearest = std::min(nearest, length(center - eye));
        const float distance = std::max({nearest - radius, 0.5f * radius, camera.near_clip, 1e-6f});
        const float rate = camera.projection != Projection::Orthographic ? camera.finest_pixels() / distance
                                                                         : camera.finest_pixels();
        s.pixels_per_unit = std::max(s.pixels_per_unit, rate * scale);
        s.many |= s.places.size() == MostPlaces;
        if (!s.many)
            s.places.push_back(render_from_group);
    };
    // What is unique is seen by itself; what is instanced in it is seen in each of its places.
    const std::function<void(const scene::Group::Instances&, const Transform&, float)> place_all =
        [&](const scene::Group::Instances& in, const Transform& render_from_parent, float scale) {
            const bool apart = are_unique(in) && size_t(in.group) >= first;
            if (size_t(in.group) >= first)
                seen[size_t(in.group) - first].moves |= in.moves();
            each_transform(in, [&](const float* m) {
                const Transform here = render_from_parent * from_rows(m);
                if (!apart)
                    return place(in.group, here, scale * largest_scale(m));
                for (const auto& inner : scene.groups[size_t(in.group) - first].instances)
                    place_all(inner, here, float(std::cbrt(std::abs(here.determinant3()))));
            });
        };
    for (const auto& in : scene.instances)
        place_all(in, render_from_world, 1);
    for (size_t g = seen.size(); g-- > 0;)
        for (const auto& in : scene.groups[g].instances)
            each_transform(in, [&](const float* m) {
                if (!seen[g].many) {
                    for (const Transform& outer : seen[g].places) {
                        const float scale = float(std::cbrt(std::abs(outer.determinant3())));
                        place(in.group, outer * from_rows(m), scale * largest_scale(m));
                    }
                } else if (size_t(in.group) >= first) {
                    Seen& inner = seen[size_t(in.group) - first];
                    inner.many = true;
                    inner.pixels_per_unit =
                        std::max(inner.pixels_per_unit, seen[g].pixels_per_unit * largest_scale(m));
                }
            });
    std::vector<GroupView> views(seen.size());
    for (size_t g = 0; g < views.size(); g++) {
        // Much farther than it is large; what can be built where it is keeps its place to the last bit.
        constexpr float Far = 4;
        if (length(bounds[g].center) > Far * bounds[g].radius && std::isfinite(length(bounds[g].center)))
            views[g].center = bounds[g].center;
        const Vec3f c = -views[g].center;
        const Transform built_from_group = Transform::translate(double(c.x), double(c.y), double(c.z));
        views[g].pixels_per_unit = seen[g].pixels_per_unit;
        views[g].stands_in_many = !seen[g].moves && (seen[g].many || seen[g].places.size() > 1);
        if (seen[g].many)
            continue;
        for (const Transform& render_from_group : seen[g].places)
            try {
                const Transform group_from_render = built_from_group * render_from_group.inverse();
                for (const Transform& render_from_camera : cameras)
                    views[g].cameras.push_back(group_from_render * render_from_camera);
            } catch (const Error&) { // flattened: it shows nothing
            }
    }
    return views;
}

} // namespace kanuka::render
