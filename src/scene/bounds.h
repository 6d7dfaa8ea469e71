// Boxes around what is in a scene, of control points: surfaces of splines and of subdivision stay within
// those.
#pragma once

#include "scene/scene.h"

namespace kanuka::scene {

Bounds3f object_bounds(const Primitive& primitive); // of its control points; empty: it has none
Bounds3f world_bounds(const Primitive& primitive);

// World space: all that may be seen, at all times. Points that no face has do not count; widths of curves and
// points do. What is not finite, blobbies and what procedurals will make are left out. Empty: nothing is
// there.
Bounds3f bounds(const Scene& scene);

} // namespace kanuka::scene
