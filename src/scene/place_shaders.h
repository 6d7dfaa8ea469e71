// The shaders and coordinate systems that attributes hold, taken along where what they belong to is placed.
#pragma once

#include "scene/coordinate_system.h"

namespace kanuka::scene {

inline void place_shaders(const Transform& placed_from_here, Attributes& a) {
    for (std::optional<ShaderRef>* shader :
         {&a.surface, &a.displacement, &a.interior, &a.exterior, &a.atmosphere, &a.area_light})
        if (*shader)
            transform_shader(placed_from_here, **shader);
    for (ShaderRef& c : a.coshaders)
        transform_shader(placed_from_here, c);
    for (Value& v : a.user.values)
        if (is_coordinate_system(v)) {
            const Location where = v.where;
            v = matrix_value(v.name, placed_from_here * matrix_of(v));
            v.where = where;
        }
}

} // namespace kanuka::scene
