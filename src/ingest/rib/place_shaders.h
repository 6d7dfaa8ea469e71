// The shaders that attributes hold, taken along where what they belong to is placed.
#pragma once

#include "scene/scene.h"

namespace kanuka::ingest {

inline void place_shaders(const Transform& placed_from_here, scene::Attributes& a) {
    for (std::optional<scene::ShaderRef>* shader :
         {&a.surface, &a.displacement, &a.interior, &a.exterior, &a.atmosphere, &a.area_light})
        if (*shader)
            scene::transform_shader(placed_from_here, **shader);
    for (scene::ShaderRef& c : a.coshaders)
        scene::transform_shader(placed_from_here, c);
}

} // namespace kanuka::ingest
