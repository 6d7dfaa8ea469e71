// Geometry of hits, read back from a page: for normals, filters and tests.
#pragma once

#include "hierarchy/page.h"
#include "hierarchy/ray.h"

namespace kanuka::hierarchy {

struct Corners {
    Vec3f at[3];
    // Along the direction that u and v turn to, as cross(dP/du, dP/dv) does; not of unit length.
    Vec3f normal() const { return cross(at[1] - at[0], at[2] - at[0]); }
};
// Of the triangle that a hit is on.
Corners corners_of(const Page& page, Ref leaf, uint32_t primitive);

} // namespace kanuka::hierarchy
