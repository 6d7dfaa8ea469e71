// Makes boundaries of grids agree bit for bit: positions and normals before displacement, positions after it.
#pragma once

#include <span>

#include "dice/gridder.h"

namespace kanuka::dice {

constexpr float SameNormal = 0.9998f; // cosine of about 1 degree

// All grids' boundary vertices, gathered by point.
// Thread safety: the members run tasks of their own; call one at a time.
class Seams {
  public:
    Seams(const Splitter& splitter, const std::vector<grid::Grid>& grids);

    // The point's first member lends its position to the others, and its normal to those that have almost the
    // same (the surface is smooth there; across a crease or between flat polygons each side keeps its own).
    void join(std::vector<grid::Grid>& grids);
    // After displacement: everybody moves to the mean; normals that were joined become their mean.
    void weld(std::vector<grid::Grid>& grids) const;

    int points() const { return int(m_first.size()) - 1; }
    // At a step: 0 = the first.
    Vec3f position(const std::vector<grid::Grid>& grids, int point, int step = 0) const;

    struct Member {
        uint32_t grid;
        uint32_t vertex : 31;
        uint32_t moved : 1; // it does not lie there of itself
    };
    std::span<const Member> members(int point) const {
        return {m_members.data() + m_first[size_t(point)], m_members.data() + m_first[size_t(point) + 1]};
    }
    std::span<const BoundaryVertex> boundary(size_t grid) const {
        return {m_boundary.data() + m_begin[grid], m_boundary.data() + m_begin[grid + 1]};
    }

  private:
    std::vector<size_t> m_begin; // of a grid in m_boundary
    std::vector<BoundaryVertex> m_boundary;
    std::vector<uint32_t> m_first; // of a point in m_members
    std::vector<Member> m_members; // of a point: those that lie there of themselves first
    std::vector<uint8_t> m_group;  // of a member: which of the point's smooth groups its normal belongs to
};

} // namespace kanuka::dice
