// Rays in sixteen lanes through a list: this file alone is built for AVX-512, and is called only where the
// machine has it.
#include "hierarchy/triangle_list.h"

namespace kanuka::hierarchy {

ListHits<16> list_hits_16(const TriangleList& list, const RayLanes<16>& rays, Query asked) {
    AcceptsAll all;
    if (asked == Query::Any)
        return ListTracer<16, Query::Any, AcceptsAll>(list, rays, all).run();
    return ListTracer<16, Query::Closest, AcceptsAll>(list, rays, all).run();
}

} // namespace kanuka::hierarchy
