// The shaders and coordinate systems that attributes hold, taken along where what they belong to is placed.
#pragma once

#include "scene/coordinate_system.h"

namespace kanuka::ingest {

inline void place_shaders(const Transform& placed_from_here, scene::Attributes& a) {
    for (std::optional<scene::ShaderRef>* shader :
         {&a.surface, &a.displacement, &a.interior, &a.exterior, &a.atmosphere, &a.area_light})
        if (*shader)
            scene::transform_shader(placed_from_here, **shader);
    for (scene::ShaderRef& c : a.coshaders)
        scene::transform_shader(placed_from_here, c);
    for (scene::Value& v : a.user.values)
        if (scene::is_coordinate_system(v)) {
            const Location where = v.where;
            v = scene::matrix_value(v.name, placed_from_here * scene::matrix_of(v));
            v.where = where;
        }
}

} // namespace kanuka::ingest
