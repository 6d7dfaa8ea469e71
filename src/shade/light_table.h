// Runs a light shader of any make over directions and distances, or over the plane across its direction, and
// keeps what it sends out as an analytic light with a table.
#pragma once

#include "base/vec.h"
#include "scene/scene.h"
#include "sl/sl.h"

namespace kanuka::shade {

// `lit`: bounds of what may be lit, in world space, which is the shader's current space, too. Answers with
// light of which nothing may remain (amount zero). What a table cannot say is reported: Cl of an ambient
// light that differs from place to place.
scene::Light shade_light(const sl::Instance& shader, const scene::ShaderRef& ref, const Bounds3f& lit,
                         sl::Services& services);

} // namespace kanuka::shade
