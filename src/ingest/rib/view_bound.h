// A bounding box as the camera sees it: for level of detail and procedurals.
#pragma once

#include "base/vec.h"
#include "scene/scene.h"

namespace kanuka::ingest {

class Context;

struct ViewBound {
    double area = 0;      // pixels of its image, times RelativeDetail (RISpec 4.2.5); infinite behind the eye
    bool outside = false; // wholly beside the picture, or behind the eye
};
ViewBound view_bound(const Context& context, const Bounds3f& bound, const Transform& camera_from_bound);
// Of the world's own bound, as another camera sees it.
ViewBound view_bound(const Context& context, const scene::Camera& camera, const Bounds3f& bound,
                     const Transform& world_from_bound);

} // namespace kanuka::ingest
