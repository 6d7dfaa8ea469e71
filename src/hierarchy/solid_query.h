// Pages whose surfaces bound solids that set operations are made of (constructive solid geometry): what of
// them a ray hits depends on all that it crosses, which whoever knows the operations asks for.
#pragma once

#include <span>

#include "hierarchy/instances.h"
#include "hierarchy/ray.h"

namespace kanuka::hierarchy {

struct SolidQuery {
    size_t ray;    // its number
    uint32_t page; // of the surfaces
    Ray here;      // as it runs there
    float time;    // of the shutter
};
class SolidResolver {
  public:
    // Of each query the closest hit, with the path from the page of the surfaces on; none up to its end: not
    // found. Queries are of different rays, few at once.
    virtual void resolve(std::span<const SolidQuery> queries, std::span<InstanceHit> hits) const = 0;

  protected:
    ~SolidResolver() = default;
};

} // namespace kanuka::hierarchy
