// How finely what is instanced is diced: as its instances are seen.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "base/level_range.h"
#include "dice/dice.h"
#include "scene/scene.h"

namespace kanuka::render {

// A group of the scene: it is diced once, in its own space, as finely as the instance needs that shows it
// largest; or at a few rates, where many show it much smaller.
struct GroupView {
    // While there are few instances: the camera as each of them sees it, page_from_camera in the group's
    // space. Each place of the group then has the rate that its nearest view asks for.
    std::vector<Transform> cameras;
    // Where there are more: that of the closest one all over the group. 0 = nothing shows it.
    float pixels_per_unit = 0;
    // Levels of detail: those that it is made at as well, from fine to coarse. They are powers of four, so
    // that they stay as the camera moves.
    std::vector<float> coarser;
    // How much of the first of them is shown where all of it could be: from 0 to 1 as the finest comes to be
    // eight times as fine. So one that is new takes over little by little.
    float share_of_first = 1;
    // What is modelled far from its origin has few digits for its shape. Its group is built around this point
    // instead, which the matrices of its instances take back; 0 where it makes no difference.
    Vec3f center{0, 0, 0};
    bool stands_in_many = false;                // still places
    std::span<const scene::ValueList> variants; // InstancePrimvars::variants_of
    size_t group = 0;                           // of the scene's
};

// A level of detail that an instance shows, the finest is 0, and which paths see it.
struct ShownLevel {
    int level = 0;
    LevelRange range;
};
// One to three, which share all paths. `wanted`: pixels a unit; `levels`: how many of the view's there are,
// the finest counted.
struct ShownLevels {
    std::array<ShownLevel, 3> levels;
    size_t count = 0;
    std::span<const ShownLevel> all() const { return {levels.data(), count}; }
};
ShownLevels shown_levels(const GroupView& view, int levels, float wanted);

// Of the groups of a scene.
class GroupViews {
  public:
    // Levels of detail are so many times as fine as instances ask for; 0 = there are none.
    struct Levels {
        float finer = 0, shading_rate_scale = 1;
    };
    // `first`: number of the scene's first group, as instances count. Cameras are those of the group as it is
    // built, around its centre.
    GroupViews(const scene::Scene& scene, size_t first, const Transform& render_from_world,
               const dice::DicingCamera& camera, const Levels& levels);
    GroupViews(const scene::Scene& scene, size_t first, const Transform& render_from_world,
               const dice::DicingCamera& camera)
        : GroupViews(scene, first, render_from_world, camera, Levels()) {}

    size_t size() const { return m_views.size(); }
    const GroupView& operator[](size_t g) const { return m_views[g]; }

    // What instances stand in: the world, or a group at one of its rates.
    struct Around {
        Transform render_from_around; // of the world
        int group = -1;               // of the scene's, from `first` on; -1 = the world
        float pixels_per_unit = 0;    // that it is made at
    };
    // How finely instance `i` is to see its group, where that has levels of detail.
    float wanted(const scene::Group::Instances& in, size_t i, const Around& around) const;

  private:
    struct Sphere {
        Vec3f center{0, 0, 0};
        float radius = 0;
    };
    struct Seen {
        std::vector<Transform> places; // render_from_group, while they are few
        bool many = false, moves = false;
        float pixels_per_unit = 0, least = INFINITY; // what instances ask for at most, and want at least
    };
    void bound_groups();
    float rate_at(int group, const Transform& render_from_group, float scale) const;
    void place(int group, const Transform& render_from_group, float scale);
    void place_instanced(const scene::Group::Instances& in, const Transform& render_from_parent, float scale);
    void place_all(const scene::Group::Instances& in, const Transform& render_from_parent);
    void place_inner(size_t g);
    void choose_levels(size_t g);
    GroupView view_of(size_t g, const std::vector<Transform>& cameras) const;

    const scene::Scene& m_scene;
    const size_t m_first;
    const dice::DicingCamera& m_camera;
    const Levels m_wanted;
    std::vector<Vec3f> m_eyes; // as the shutter opens
    std::vector<Sphere> m_bounds;
    std::vector<Seen> m_seen;
    std::vector<GroupView> m_views;
};

} // namespace kanuka::render
