// The space that a primitive's page is in, and how it asks to be diced. Neither depends on where things
// stand: pages have the axes and units of the space that the primitive is placed in, but an origin of their
// own, and what follows from the camera is taken in steps. So a camera that moves a little, or a scene that
// moves as a whole, changes no page.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "dice/dice.h"
#include "render/group_views.h"
#include "scene/scene.h"

namespace kanuka::render {

struct PageFrame {
    Transform page_from_object;
    Transform page_from_world; // or from the space of the primitive's group
    std::array<double, 3> offset{
        0, 0, 0}; // of the page's origin in the parent's space: render space, or a group as built
    // Of the dicing camera, in the page's space: where it sees the primitive from, at all times that count.
    // None: `pixels_per_unit` holds everywhere.
    std::vector<Transform> cameras;
    dice::DicingCamera::Border border = dice::DicingCamera::Border::Across;
    float pixels_per_unit = 0; // of what is instanced, where it is seen largest
};

// `rest`: the primitive as the shutter opens. `parent_from_group`: a translation (render space from the
// world, for what is in no group). `instanced`: null = in the world. `while_moving`: more cameras, in the
// parent's space, for what moves as a whole.
PageFrame page_frame(const scene::Primitive& rest, const Transform& parent_from_group,
                     const GroupView* instanced, const dice::DicingCamera& camera,
                     std::span<const Transform> while_moving);

} // namespace kanuka::render
