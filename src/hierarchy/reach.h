// How far a page reaches in any direction: so places where it stands turned have smaller boxes than turned
// boxes have.
#pragma once

#include "base/vec.h"
#include "hierarchy/page.h"

namespace kanuka::hierarchy {

// The reach along a direction is the largest product with it, over all that is in the page. It is convex, and
// grows with the length of the direction; so between directions on the faces of a cube it is at most what is
// interpolated [Jensen's inequality]. Those of a few are kept.
class Reach {
  public:
    // What stands at fewer places is not worth the making.
    static constexpr size_t FewestPlaces = 256;

    // Of a page of what stands still, or of a level.
    explicit Reach(const Page& page);
    // Around the page where it stands, and a little more, since rays are made for it by numbers that are
    // rounded.
    Bounds3f box(const Transform& world_from_page) const;

  private:
    static constexpr int Steps = 4, Row = Steps + 1, Face = Row * Row; // along an edge of the cube
    static constexpr size_t MostBoxes = 256;                           // of the page's nodes

    Vec3f m_center; // of the page, from which it reaches
    float m_most;   // of all that are kept
    // By the axis that a direction follows most, downwards or upwards, and then by the two that come next.
    float m_reach[6 * Face];
};

} // namespace kanuka::hierarchy
