// Where the instances of a level are, for its nodes: the boxes of what stands, moves and changes.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/large_pages.h"
#include "base/level_range.h"
#include "base/motion.h"
#include "base/tasks.h"
#include "hierarchy/nodes.h"
#include "hierarchy/page.h"
#include "hierarchy/reach.h"

namespace kanuka::hierarchy {

inline constexpr size_t PlacesATask = 4096;

// An instance as a level is told of it.
struct Placed {
    uint32_t page, run;
    uint32_t matrix = 0;             // of the run, and
    std::array<float, 12> rows = {}; // what it is: by floats, as whoever shades a hit has it
    bool stays = false;
    const MotionPath* path = nullptr;
    LevelRange seen = {};
    uint32_t intervals = 0; // of time: what lies there changes

    bool moves() const { return path || intervals > 0; } // or changes
};

Transform transform_of(const std::array<float, 12>& rows);
// Around what changes, at the times between its intervals.
void bound(std::span<const Page> pages, std::span<Bounds3f> at);
// Two boxes between which all that are given, at as many even times, lie where they go straight meanwhile.
BoxOfEnds straight(std::span<const Bounds3f> at);

// How many rays more meet a box that goes straight than those that are given, as a part of these: what goes
// in circles has boxes that hold all of a circle.
double surplus(std::span<const Bounds3f> at);

// Radians between two boxes of what turns. It swells by a twentieth meanwhile, and most that turns has but
// two.
inline constexpr double TurnAStep = 0.6;

// Of the instances of a level that move or change: their boxes at the times that each needs, one behind the
// other.
struct Boxes {
    LargeVector<uint64_t> first; // of each instance, and behind the last; none where nothing moves
    LargeVector<Bounds3f> boxes;
    bool are_two = true; // of each, which nodes have

    template <class PlacementOf>
    void measure(size_t count, const PlacementOf& placement_of) {
        first.resize(count + 1);
        tasks::parallel_chunks(count, PlacesATask, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; i++)
                if (const Placed p = placement_of(i); p.moves())
                    first[i] = p.path ? uint64_t(p.path->times_to_bound(TurnAStep)) : p.intervals + 1;
        });
        uint64_t sum = 0;
        for (uint64_t& n : first) {
            are_two &= n <= 2;
            sum += std::exchange(n, sum);
        }
        boxes.resize(sum);
    }
    bool move(size_t i) const { return !first.empty() && first[i] < first[i + 1]; }
    // The mean of all instances.
    double surplus() const;
    std::span<const Bounds3f> of(size_t i) const { return const_cast<Boxes*>(this)->of(i); }
    std::span<Bounds3f> of(size_t i) { return {boxes.data() + first[i], size_t(first[i + 1] - first[i])}; }
};

// How far pages reach that stand at many places, by their numbers.
class Reaches {
  public:
    // `places`: how many each page has.
    Reaches(std::span<const Page> pages, std::span<const size_t> places);
    // Around what is in `box` in a page.
    Bounds3f box(uint32_t page, const Transform& t, const Bounds3f& box) const;
    // The same along a path.
    MotionPath::Around around(uint32_t page) const;

  private:
    std::vector<std::optional<Reach>> m_reach;
};

} // namespace kanuka::hierarchy
