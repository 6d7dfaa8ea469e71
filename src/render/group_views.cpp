#include "render/group_views.h"

#include <algorithm>
#include <cmath>

#include "base/tasks.h"
#include "render/de_instance.h"
#include "scene/bounds.h"

namespace kanuka::render {
namespace {

constexpr size_t MostPlaces = 8; // that are looked at one by one

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
float mean_scale(const Transform& t) {
    return float(std::cbrt(std::abs(t.determinant3())));
}

template <class Visit> // visit(row-major 3x4 matrix); moving ones at all their times
void each_transform(const scene::Group::Instances& in, Visit visit) {
    for (size_t i = 0; i + 12 <= in.transforms.size(); i += 12)
        visit(in.transforms.data() + i);
}
// The same for one of them.
template <class Visit>
void each_transform_of(const scene::Group::Instances& in, size_t i, Visit visit) {
    for (; 12 * i < in.transforms.size(); i += in.count())
        visit(in.transforms.data() + 12 * i);
}

// ---- levels of detail

constexpr float LevelStep = 4;      // between their rates
constexpr float Band = 1.41421356f; // of what is asked for, below a level's rate: where it takes over
// What is as large as the level that it lies in is made at the same rate, and no part of it at a finer one.
constexpr float InLevel = 0.999f / Band;
constexpr int MostLevels = 8;       // beside the finest
constexpr float FewestAcross = 32;  // micropolygons: fewer, and outlines shrink
constexpr size_t MostInLevels = 64; // instances in a group, of which each level has its own

float part(float x) {
    return x > 0 ? std::min(x, 1.0f) : 0.0f;
}

} // namespace

ShownLevels shown_levels(const GroupView& view, int levels, float wanted) {
    // The coarsest that is as fine as it is asked for, and, in a band, the one that follows it.
    const auto rate = [&](int level) { return view.coarser[size_t(level) - 1]; };
    int level = 0;
    while (level + 1 < levels && rate(level + 1) > wanted)
        level++;
    std::array<float, MostLevels + 1> shares{};
    const float own = level > 0 ? part(std::log(rate(level) / wanted) / std::log(Band)) : 1;
    shares[size_t(level)] = own;
    if (level > 0)
        shares[size_t(level) - 1] += 1 - own;
    if (levels > 1) {
        const float left = shares[1] * (1 - view.share_of_first);
        shares[1] -= left, shares[0] += left;
    }
    ShownLevels shown;
    float sum = 0;
    uint32_t from = 0;
    for (int k = 0; k <= level && shown.count < shown.levels.size(); k++) {
        sum += shares[size_t(k)];
        const uint32_t end =
            k == level ? LevelRange::Steps : std::min(uint32_t(sum * LevelRange::Steps), LevelRange::Steps);
        if (end > from)
            shown.levels[shown.count++] = {k, {uint16_t(from), uint16_t(end - 1)}};
        from = end;
    }
    return shown;
}

GroupViews::GroupViews(const scene::Scene& scene, size_t first, const Transform& render_from_world,
                       const dice::DicingCamera& camera, const Levels& levels)
    : m_scene(scene), m_first(first), m_camera(camera), m_wanted(levels), m_seen(scene.groups.size()),
      m_views(scene.groups.size()) {
    bound_groups();
    std::vector<Transform> cameras = camera.shot;
    if (cameras.empty()) {
        cameras = camera.also_from;
        cameras.insert(cameras.begin(), camera.page_from_camera);
    }
    for (const Transform& c : camera.shot.empty() ? std::vector{camera.page_from_camera} : camera.shot)
        m_eyes.push_back(c.point({0, 0, 0}));
    for (const auto& in : scene.instances)
        place_all(in, render_from_world);
    for (size_t g = m_seen.size(); g-- > 0;) { // groups hold instances of lower ones
        m_views[g] = view_of(g, cameras);
        if (levels.finer > 0)
            choose_levels(g);
        place_inner(g);
    }
}

// What the group's primitives and its own instances reach, before displacement.
void GroupViews::bound_groups() {
    m_bounds.resize(m_scene.groups.size());
    for (size_t g = 0; g < m_bounds.size(); g++) {
        Bounds3f box;
        const auto add = [&](const Vec3f& center, float radius) {
            box.extend(center - Vec3f(radius));
            box.extend(center + Vec3f(radius));
        };
        for (const scene::Primitive& p : m_scene.groups[g].primitives)
            if (const Bounds3f b = scene::world_bounds(p); !b.empty())
                box.extend(b);
            else // a blobby
                add(p.world_from_object->point({0, 0, 0}), 1);
        for (const auto& in : m_scene.groups[g].instances)
            if (size_t(in.group) >= m_first)
                each_transform(in, [&](const float* m) {
                    const Sphere& child = m_bounds[size_t(in.group) - m_first];
                    add(from_rows(m).point(child.center), child.radius * largest_scale(m));
                });
        if (!box.empty())
            m_bounds[g] = {(box.lo + box.hi) * 0.5f, length(box.hi - box.lo) * 0.5f};
    }
}

// What it asks for in a place.
float GroupViews::rate_at(int group, const Transform& render_from_group, float scale) const {
    const Sphere& bound = m_bounds[size_t(group) - m_first];
    const float radius = bound.radius * scale;
    // From within the bound it is unknown how near it comes.
    float nearest = INFINITY;
    const Vec3f center = render_from_group.point(bound.center);
    for (const Vec3f& eye : m_eyes)
        nearest = std::min(nearest, length(center - eye));
    const float distance = std::max({nearest - radius, 0.5f * radius, m_camera.near_clip, 1e-6f});
    const float rate = m_camera.projection != Projection::Orthographic ? m_camera.finest_pixels() / distance
                                                                       : m_camera.finest_pixels();
    return rate * scale;
}

void GroupViews::place(int group, const Transform& render_from_group, float scale) {
    if (size_t(group) < m_first) // built before
        return;
    Seen& s = m_seen[size_t(group) - m_first];
    const float asked = rate_at(group, render_from_group, scale);
    s.pixels_per_unit = std::max(s.pixels_per_unit, asked);
    s.least = std::min(s.least, m_wanted.finer * asked);
    s.many |= s.places.size() == MostPlaces;
    if (!s.many)
        s.places.push_back(render_from_group);
}

// In parallel: what they ask for at most, and want at least, does not depend on their order.
void GroupViews::place_instanced(const scene::Group::Instances& in, const Transform& render_from_parent,
                                 float scale) {
    if (size_t(in.group) < m_first) // built before
        return;
    constexpr size_t PlacesATask = 4096;
    const size_t count = in.transforms.size() / 12; // moving ones at all their times
    const auto here = [&](size_t i) { return render_from_parent * from_rows(in.transforms.data() + 12 * i); };
    struct Asked {
        float most = 0, least = INFINITY;
    };
    std::vector<Asked> asked((count + PlacesATask - 1) / PlacesATask);
    tasks::parallel_chunks(count, PlacesATask, [&](size_t begin, size_t end) {
        Asked& all = asked[begin / PlacesATask];
        for (size_t i = begin; i < end; i++) {
            const float one =
                rate_at(in.group, here(i), scale * largest_scale(in.transforms.data() + 12 * i));
            all.most = std::max(all.most, one), all.least = std::min(all.least, m_wanted.finer * one);
        }
    });
    Seen& s = m_seen[size_t(in.group) - m_first];
    for (const Asked& all : asked) {
        s.pixels_per_unit = std::max(s.pixels_per_unit, all.most);
        s.least = std::min(s.least, all.least);
    }
    for (size_t i = 0; i < count && !s.many; i++) {
        s.many = s.places.size() == MostPlaces;
        if (!s.many)
            s.places.push_back(here(i));
    }
}

// What is unique is seen by itself; what is instanced in it is seen in each of its places.
void GroupViews::place_all(const scene::Group::Instances& in, const Transform& render_from_parent) {
    const bool is_ours = size_t(in.group) >= m_first;
    const float outer = mean_scale(render_from_parent);
    if (is_ours)
        m_seen[size_t(in.group) - m_first].moves |= in.moves();
    if (!is_ours || !are_unique(in))
        return place_instanced(in, render_from_parent, outer);
    each_transform(in, [&](const float* m) {
        const Transform here = render_from_parent * from_rows(m);
        for (const auto& inner : m_scene.groups[size_t(in.group) - m_first].instances)
            place_all(inner, here);
    });
}

void GroupViews::place_inner(size_t g) {
    const Seen& outer = m_seen[g];
    const GroupView& view = m_views[g];
    const float finest = view.pixels_per_unit, coarsest = view.coarser.empty() ? finest : view.coarser.back();
    for (const auto& in : m_scene.groups[g].instances)
        each_transform(in, [&](const float* m) {
            if (!outer.many) {
                for (const Transform& here : outer.places)
                    place(in.group, here * from_rows(m), mean_scale(here) * largest_scale(m));
            } else if (size_t(in.group) >= m_first) {
                Seen& inner = m_seen[size_t(in.group) - m_first];
                inner.many = true;
                inner.pixels_per_unit = std::max(inner.pixels_per_unit, finest * largest_scale(m));
                inner.least = std::min(inner.least, coarsest * largest_scale(m) * InLevel);
            }
        });
}

GroupView GroupViews::view_of(size_t g, const std::vector<Transform>& cameras) const {
    // Much farther than it is large; what can be built where it is keeps its place to the last bit.
    constexpr float Far = 4;
    GroupView view;
    if (length(m_bounds[g].center) > Far * m_bounds[g].radius && std::isfinite(length(m_bounds[g].center)))
        view.center = m_bounds[g].center;
    const Vec3f c = -view.center;
    const Transform built_from_group = Transform::translate(double(c.x), double(c.y), double(c.z));
    const Seen& seen = m_seen[g];
    view.pixels_per_unit = seen.pixels_per_unit;
    view.stands_in_many = !seen.moves && (seen.many || seen.places.size() > 1);
    if (seen.many)
        return view;
    for (const Transform& render_from_group : seen.places)
        try {
            const Transform group_from_render = built_from_group * render_from_group.inverse();
            for (const Transform& render_from_camera : cameras)
                view.cameras.push_back(group_from_render * render_from_camera);
        } catch (const Error&) { // flattened: it shows nothing
        }
    return view;
}

void GroupViews::choose_levels(size_t g) {
    const Seen& seen = m_seen[g];
    size_t inside = 0; // instances, which each level has again
    for (const auto& in : m_scene.groups[g].instances)
        inside += in.count();
    if (!seen.many || inside > MostInLevels || !(seen.least > 0) || !std::isfinite(seen.pixels_per_unit))
        return;
    GroupView& view = m_views[g];
    float coarsest = 0; // shading rate
    for (const scene::Primitive& p : m_scene.groups[g].primitives)
        coarsest = std::max(coarsest, p.attributes ? p.attributes->shading_rate : 1);
    const float finest = seen.pixels_per_unit,
                across = 2 * m_bounds[g].radius /
                         std::sqrt(std::max(coarsest * m_wanted.shading_rate_scale, 1e-6f));
    float rate = std::exp2(2 * std::floor(std::log2(finest / LevelStep) / 2)); // a power of four
    view.share_of_first = part(std::log2(finest / (LevelStep * rate)));
    for (; view.coarser.size() < MostLevels && rate > seen.least && rate * across >= FewestAcross;
         rate /= LevelStep)
        view.coarser.push_back(rate);
}

float GroupViews::wanted(const scene::Group::Instances& in, size_t i, const Around& around) const {
    if (size_t(in.group) < m_first)
        return INFINITY;
    const Seen* outer = around.group < 0 ? nullptr : &m_seen[size_t(around.group)];
    float most = 0;
    each_transform_of(in, i, [&](const float* m) {
        if (outer && outer->many) {
            most = std::max(most, around.pixels_per_unit * largest_scale(m) * InLevel);
            return;
        }
        const auto look = [&](const Transform& t) {
            most = std::max(most, m_wanted.finer *
                                      rate_at(in.group, t * from_rows(m), mean_scale(t) * largest_scale(m)));
        };
        if (!outer)
            look(around.render_from_around);
        else
            std::ranges::for_each(outer->places, look);
    });
    return most;
}

} // namespace kanuka::render
