// Lights over the floor of test_floor.h.
#pragma once

#include "transport/test_floor.h"

namespace kanuka::transport::testing {

using Kind = scene::Light::Kind;

inline scene::Light light(Kind kind, const Rgb& amount, const Transform& t) {
    scene::Light l;
    l.kind = kind;
    l.amount = amount;
    l.world_from_light = t;
    return l;
}

inline const Transform Downwards = Transform::rotate(90, 1, 0, 0); // +z to -y

} // namespace kanuka::transport::testing
