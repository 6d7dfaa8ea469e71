// Pictures of all directions by latitude and longitude: where a direction lies in one, and back.
// environment(), skies, light shaders that are tabulated and cube faces that are unfolded go by this;
// environment lights have the same for lanes (transport/light_environment.h).
//
// RISpec 3.2, MakeLatLongEnvironment: longitude 0 at the left and 360 degrees at the right, the north pole at
// the top, and direction = (cos(longitude) cos(latitude), sin(longitude) cos(latitude), sin(latitude)). Seen
// from inside, such a picture is the right way round in a left-handed space.
//
// OpenEXR (Technical Introduction, Environment Maps), and USD's DomeLight after it: +y is at the top, +z in
// the picture's middle, +x a quarter from the left: the right way round in a right-handed space.
#pragma once

#include <algorithm>
#include <cmath>

#include "base/vec.h"

namespace kanuka {

struct LatLongPlace {
    float u, v; // from the left and from the top, 0 to 1
};
inline LatLongPlace latlong_place(const Vec3f& d) {
    const float size = length(d), phi = std::atan2(d.y, d.x);
    return {(phi < 0 ? phi + 2 * Pi : phi) * (0.5f * InvPi),
            size > 0 ? std::acos(std::clamp(d.z / size, -1.0f, 1.0f)) * InvPi : 0.5f};
}
inline Vec3f latlong_direction(float u, float v) {
    const float theta = Pi * v, phi = 2 * Pi * u;
    return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

// From RISpec's directions to OpenEXR's: the same texel. A reflection, for one is made for a left-handed
// space and the other for a right-handed one.
inline Transform openexr_from_rispec_latlong() {
    Transform t;
    t.m[0] = {0, 1, 0, 0};
    t.m[1] = {0, 0, 1, 0};
    t.m[2] = {-1, 0, 0, 0};
    return t;
}

} // namespace kanuka
