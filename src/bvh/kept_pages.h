// Pages of a group that a store may keep, or the scene before has left: those of the same shapes at the same
// places are not built again.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/digest.h"
#include "bvh/leftovers.h"
#include "store/hierarchy_files.h"
#include "store/store.h"

namespace kanuka::bvh {

// All that follows from the shapes of a group, page by page, before their vertices are moved. `exact`: these
// keep 22 bits.
Digest digest_of_pages(const store::Store& store, std::span<const std::vector<int>> pages, bool exact);

// Where a page may come from, and go to: it is none of both where nothing was looked for. Of what changes
// there is one for each interval of time.
class KeptPages {
  public:
    // Those of some shapes, which are page `number` of a group, that are left over, or lie in files. Either
    // may be null.
    void find(Leftovers* leftovers, store::HierarchyFiles* files, const Digest& group, size_t number,
              const store::Store& store, std::span<const int> shapes);
    const hierarchy::Lattices* lattices() const; // null: none is found
    std::optional<hierarchy::PageMemory> take(size_t interval);
    bool is_left_over(size_t interval) const { return m_found[interval]->is_left_over; } // once it is taken
    Digest content(size_t interval) const { // null: nobody has asked
        return interval < m_content.size() ? m_content[interval] : Digest();
    }
    void keep(size_t interval, const hierarchy::PageMemory& page, const hierarchy::Lattices& lattices);

  private:
    store::HierarchyFiles* m_files = nullptr;
    std::vector<Digest> m_content;
    struct Found : store::HierarchyFiles::Found {
        bool is_left_over;
    };
    std::vector<std::optional<Found>> m_found;
};

} // namespace kanuka::bvh
