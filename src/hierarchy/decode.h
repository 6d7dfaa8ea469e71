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
// Of the triangle that a hit is on. `fraction` of the interval, here and below: of shapes that change.
Corners corners_of(const Page& page, Ref leaf, uint32_t primitive, float fraction = 0);

struct Segment {
    Vec3f end[2];
    float radius[2];
};
// `number`: in its leaf; of a hit half of its primitive.
Segment segment_of(const Page& page, Ref leaf, uint32_t number, float fraction = 0);

// Of what was hit by the ray, as it runs in the page; not of unit length. Of fibres it leads out of them.
Vec3f normal_of(const Page& page, const Ray& ray, const Hit& hit, float fraction = 0);

} // namespace kanuka::hierarchy
