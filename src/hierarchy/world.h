// Pages, and levels of places that they stand at: instances in instances.
#pragma once

#include <deque>
#include <span>
#include <vector>

#include "base/level_range.h"
#include "base/motion.h"
#include "base/places.h"
#include "hierarchy/page.h"
#include "hierarchy/refit.h"

namespace kanuka::hierarchy {

struct Placement {
    Transform world_from_page;        // affine; of a level inside, "world" is the page that it stands in
    uint32_t page;                    // number in the world
    const MotionPath* path = nullptr; // along which it moves instead; whoever has it keeps it
};
// Many of one page, as renderers have them.
struct Placements {
    uint32_t page;
    Places world_from_page = {};            // none: the page lies there as it is
    std::span<const MotionPath> paths = {}; // moving ones instead. Whoever has these and matrices keeps them
    std::span<const LevelRange> seen = {};  // by which rays each is; none: by all
    // Of what changes: it lies there as it is, in one page for each of so many even intervals of time.
    uint32_t intervals = 0;
    // It lies there as it is, and bounds solids: what of it is hit a SolidResolver tells.
    bool bounds_solids = false;

    bool stays() const { return world_from_page.empty() && paths.empty(); }
    size_t size() const { return stays() ? 1 : paths.empty() ? world_from_page.size() : paths.size(); }
};

// Thread safety: const members may run at the same time.
class World {
  public:
    // A page's number. Whoever made or mapped its bytes keeps them.
    uint32_t add(const Page& page);
    // A level, which is a page like any other: instances of pages that are there already. Those whose
    // transform has no inverse, or is no affine one of finite numbers, are left out and counted; of those
    // that move, what is nowhere at some time. In parallel; the same bytes for any number of threads, but for
    // addresses. Throws Error where instances would lie deeper in each other
    // than MostNesting, a page has no such number, or the level would be larger than 2 GiB.
    uint32_t add(std::span<const Placement> placements);
    // Instances are numbered through all runs; of a page that lies there as it is there is one. `before`: of
    // as many instances as they stood before, whose tree is used again where it still does; it is taken.
    // Null = none. What rays find does not depend on it.
    uint32_t add(std::span<const Placements> runs, Level* before = nullptr);
    // All levels, in the order in which they were added, for another world to use again. Ends this one.
    std::vector<Level> take_levels();

    const Page& page(uint32_t number) const { return m_pages[number]; }
    std::span<const Page> pages() const { return m_pages; }
    std::span<const Placements> runs() const { return m_runs; }      // of all levels, for leaves to refer to
    int nesting(uint32_t number) const { return m_nesting[number]; } // 0: it is no level
    size_t left_out() const { return m_left_out; }
    size_t refitted() const { return m_refitted; }
    // By how much boxes of nodes are larger than they would have to be, since things do not go straight: the
    // mean of all instances of a level, the largest of all levels. Zero: by nothing.
    double surplus() const { return m_surplus; }
    size_t level_bytes() const;            // of all levels together
    bool moves() const { return m_moves; } // something does: rays need times
    bool fades() const { return m_fades; } // some rays do not see something: they need levels

  private:
    uint32_t add_run(uint32_t page, std::span<const float> matrices); // its number
    template <class PlacementOf>
    uint32_t add_level(size_t count, std::span<const size_t> places, int nesting, bool moves,
                       const PlacementOf& placement_of, Level* before); // `places`: of each page
    template <class Instances>
    PageMemory build(size_t count, const Instances& instances, bool moves);
    int nesting_of(uint32_t page) const; // of a level that it stands in
    std::vector<Page> m_pages;
    std::vector<Placements> m_runs;
    std::deque<LargeVector<float>> m_matrices; // of runs that come without
    std::vector<int> m_nesting;
    std::deque<Level> m_levels;
    std::deque<LargeVector<Bounds3f>> m_boxes; // of moving instances, level by level
    bool m_moves = false, m_fades = false;
    double m_surplus = 0;
    size_t m_left_out = 0, m_refitted = 0; // instances; levels
};

} // namespace kanuka::hierarchy
