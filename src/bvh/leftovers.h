// What a scene that is over leaves to the next one, which is nearly the same: trees that are to be made again
// only where it is not.
#pragma once

#include <map>

#include "base/digest.h"
#include "hierarchy/build.h"
#include "hierarchy/refit.h"

namespace kanuka::bvh {

struct Leftovers {
    struct OfShapes {
        hierarchy::PageMemory page;
        hierarchy::Lattices lattices;
    };
    std::map<Digest, OfShapes> pages; // by all that they were made of: KeptPages

    // Of the places in a group. Whatever stood there, its tree is but one among many for what stands there
    // now.
    hierarchy::Level* level_of(size_t group, size_t groups) {
        const auto found = m_levels.find(groups - 1 - group);
        return found == m_levels.end() ? nullptr : &found->second;
    }
    void keep_level(size_t group, size_t groups, hierarchy::Level level) {
        m_levels[groups - 1 - group] = std::move(level);
    }

  private:
    std::map<size_t, hierarchy::Level> m_levels; // counted from the world on, which is the last group
};

} // namespace kanuka::bvh
