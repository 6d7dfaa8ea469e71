// Groups in groups: how many instances one ray enters is the product of what overlaps at every level, and a
// text of a few lines can make that any number. Before anything is built, copies that lie in each other are
// made one, chains of groups become one level, and what would still go beyond a bound is left out.
#pragma once

#include <vector>

#include "bvh/bvh.h"

namespace kanuka::bvh {

struct Nesting {
    double entered = 0;  // instances that a ray enters at the spot where most overlap: an estimate
    uint64_t merged = 0; // still instances with the matrix of another one of the same group in the same group
    uint64_t left_out = 0; // instances, for going beyond the bound
    uint64_t too_deep = 0; // likewise, for lying deeper than rays follow
};

constexpr double MostEntered = 4096; // a millisecond a ray, or so

// The last group is the world. Matrices that change are kept in `room`, which must outlive the groups. Again
// it finds nothing to do. What goes to the bounds of solids, and what moves, is neither merged nor made one
// level.
Nesting bound_nesting(const store::Store& store, std::span<GroupDesc> groups,
                      std::vector<std::vector<float>>& room, double most = MostEntered);

} // namespace kanuka::bvh
