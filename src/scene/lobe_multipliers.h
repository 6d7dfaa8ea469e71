// How much of a light lobes show: RenderMan's and UsdLux's multipliers. 1 = as it is.
#pragma once

#include <compare>

namespace kanuka::scene {

struct LobeMultipliers {
    float diffuse = 1, specular = 1; // by diffuse lobes, and by all others
    auto operator<=>(const LobeMultipliers&) const = default;
    bool none() const { return diffuse == 1 && specular == 1; }
};

} // namespace kanuka::scene
