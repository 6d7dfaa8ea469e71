// How finely what is instanced is diced: as its instances are seen.
#pragma once

#include <vector>

#include "dice/dice.h"

namespace kanuka::render {

// A group of the scene: it is diced once, in its own space, as finely as the instance needs that shows it
// largest.
struct GroupView {
    // While there are few instances: the camera as each of them sees it, page_from_camera in the group's
    // space. Each place of the group then has the rate that its nearest view asks for.
    std::vector<Transform> cameras;
    // Where there are more: that of the closest one all over the group. 0 = nothing shows it.
    float pixels_per_unit = 0;
    // What is modelled far from its origin has few digits for its shape. Its group is built around this point
    // instead, which the matrices of its instances take back; 0 where it makes no difference.
    Vec3f center{0, 0, 0};
    bool stands_in_many = false; // still places
};

// One a group of the scene. `first`: number of the scene's first group, as instances count. Cameras are those
// of the group as it is built, around its centre.
std::vector<GroupView> view_groups(const scene::Scene& scene, size_t first,
                                   const Transform& render_from_world, const dice::DicingCamera& camera);

} // namespace kanuka::render
