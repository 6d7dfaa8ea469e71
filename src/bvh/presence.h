// Surfaces that are there for some rays alone: by presence, links, levels of detail, and the side that they
// are seen from.
#pragma once

#include "bvh/bvh.h"

namespace kanuka::bvh {

// Of a ray, what decides that.
struct Beholder {
    int32_t seed = 0, passes = 0, camera = 0;
    float level = 0.5f;
    LetThrough* passages = nullptr; // null = nobody asks
};

// Can it be that a ray passes the shape?
bool is_partly_there(const store::Store& store, const store::ShapeRecord& shape);
// Is the surface there for a ray, by its presence, the lights that it lets through and what sees it? Of its
// sides both are: is_back() tells. `prim` as in HitPacket.
bool is_present(const store::Store& store, int shape, int prim, float u, float v, float t,
                const Beholder& beholder);
// Is that the inside of a shape that is not there from there? By the winding, in the space of the shape:
// mirrors keep it.
inline bool is_back(const store::Store& store, int shape, const Vec3f& Ng, const Vec3f& d) {
    const int32_t flags = store.shapes()[size_t(shape)].flags;
    if (!(flags & store::ShapeRecord::Layer) && !(store.links_of(shape).seen & store::Links::OneSided))
        return false;
    const bool flips = flags & store::ShapeRecord::Flips;
    return (dot(Ng, d) > 0) != flips;
}

} // namespace kanuka::bvh
