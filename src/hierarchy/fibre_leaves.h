// Fibres as leaves of up to eight segments.
#pragma once

#include <vector>

#include "hierarchy/build.h"
#include "hierarchy/encode.h"
#include "hierarchy/leaf_groups.h"

namespace kanuka::hierarchy {

// What segments wish their lattice to be.
class FibreVotes {
  public:
    void add(const Vec3f& leaf_extent, float radius); // the larger of a segment
    void add(const FibreVotes& other);
    // Steps are half as wide as radii at the most, but for a tenth of the segments: tips, and finer hairs.
    FibreLattice lattice() const;

  private:
    StepVotes m_steps;
    std::array<uint64_t, 256> m_radii{}; // by exponent, biased
    float m_largest = 0;
};

class FibreLeaves {
  public:
    FibreLeaves(std::span<const FibreView> fibres, const FibreLattice& lattice);

    const LargeVector<Group>& groups() const { return m_leaves.groups; } // `source` numbers their leaves
    // At an end of the interval, 0 or 1.
    void write(const Group& group, int i, uint8_t* to, int end = 0) const;
    Bounds3f box(const Group& group, int i, int end) const;
    // Segments of a leaf, counted through all fibres; the last is repeated.
    void names(const Group& group, int i, uint32_t (&to)[LeafSegments]) const;

    static void vote(const FibreView& fibre, size_t segment, FibreVotes& votes);

  private:
    struct Segment {
        Vec3f end[2];
        float radius[2];
    };
    struct Points {
        Vec3f at[2 * LeafSegments]; // end by end, as they are stored; the last segment is repeated
        uint16_t radius[2][LeafSegments];
        uint32_t count;
    };
    static bool find(const FibreView& fibre, size_t segment, int end, Segment& to); // false = it is nowhere
    Segment found(uint32_t segment, int end) const;                                 // on the lattice
    Segment on_lattice(const Segment& s) const;
    size_t fibre_of(uint32_t segment) const;
    uint32_t number(const LeafGroups::Leaf& leaf, uint32_t k) const;
    Points points(const LeafGroups::Leaf& leaf, int end) const;
    Kind kind_of_group(const Group& group) const;

    std::span<const FibreView> m_fibres;
    FibreLattice m_lattice;
    int m_ends;                    // 2: they change
    std::vector<uint64_t> m_first; // segment of each fibre
    LeafGroups m_leaves;
};

} // namespace kanuka::hierarchy
