// The members of attributes, for whoever compares or digests them all.
#pragma once

#include <tuple>

#include "scene/scene.h"

namespace kanuka::scene {

// Structured bindings name every member: one that is added does not compile here until it is named.
inline auto members_of(const Attributes& attributes) {
    const auto& [color, opacity, shading_rate, sides, reverse_orientation, matte, surface, displacement,
                 interior, exterior, atmosphere, area_light, coshaders, displacement_bound,
                 displacement_bound_space, name, visible_camera, dice_flatness, texture_coordinates,
                 shadow_terminator, density_primvar, color_spectrum, lights_on, lights_only, lights_off,
                 shadows_off, casts_shadows, area_light_by_intensity, level_from, level_to, variants, user] =
        attributes;
    return std::tie(color, opacity, shading_rate, sides, reverse_orientation, matte, surface, displacement,
                    interior, exterior, atmosphere, area_light, coshaders, displacement_bound,
                    displacement_bound_space, name, visible_camera, dice_flatness, texture_coordinates,
                    shadow_terminator, density_primvar, color_spectrum, lights_on, lights_only, lights_off,
                    shadows_off, casts_shadows, area_light_by_intensity, level_from, level_to, variants,
                    user);
}

} // namespace kanuka::scene
