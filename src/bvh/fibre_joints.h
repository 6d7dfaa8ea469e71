// Where segments of a fibre join: each is traced as a body of its own, round at both ends, and what lies in
// the one before or behind is no surface of the fibre.
#pragma once

#include "store/store.h"

namespace kanuka::bvh {

// Between which steps of its shape's motion something is.
struct Step {
    uint32_t number = 0;
    float fraction = 0; // of the way to the next
};
// Is the point o + t d, on a segment of a shape, inside of the segment before or behind?
bool is_inside_fibre(const store::Store& store, int shape, int segment, Step step, const Vec3f& o,
                     const Vec3f& d, float t);

} // namespace kanuka::bvh
