// Moving primitives and instances, brought into the time that the shutter is open: 0 = opens, 1 = is closed.
#pragma once

#include "render/camera.h"

namespace kanuka::render {

// What a primitive is while the shutter is open.
struct MovingPrimitive {
    scene::Primitive rest;               // when it opens
    std::vector<scene::Primitive> later; // at further even times; empty = it keeps its shape
    std::vector<TransformKey>
        places; // of world_from_object, times in the shutter; empty = it stays where it is
};
MovingPrimitive in_shutter(const scene::Primitive& primitive, const Shutter& shutter);

// The same keys at times in the shutter; empty where they make no difference in there.
std::vector<TransformKey> keys_in_shutter(std::span<const TransformKey> keys, const Shutter& shutter);

// Fewest even pieces of [0, 1] on whose ends all times in there lie, or `most` where no number of them fits.
int even_pieces(std::span<const double> times, int most);

} // namespace kanuka::render
