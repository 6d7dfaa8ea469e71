// What a pilot learns of a scene that was made by hand.
#pragma once

#include "transport/roulette_pilot.h"
#include "transport/test_scene.h"

namespace kanuka::transport::testing {

// Of a finished scene, whose picture is `width` x `height`.
inline std::optional<RouletteFactors> learn_by_pilot(TestScene& s, int width, int height, int lanes) {
    s.view.settings.roulette = &RoulettePilot::Weak;
    RoulettePilot pilot(width, height);
    const auto kernel = make_kernel(s.view, lanes);
    for (size_t b = 0; b < pilot.batches(); b++)
        pilot.trace(b, *kernel);
    return pilot.learn();
}

} // namespace kanuka::transport::testing
