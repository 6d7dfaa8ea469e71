// Pages of a group that a store may keep: those of the same shapes at the same places are not built again.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/digest.h"
#include "store/hierarchy_files.h"
#include "store/store.h"

namespace kanuka::bvh {

// All that follows from the shapes of a group, page by page, before their vertices are moved.
Digest digest_of_pages(const store::Store& store, std::span<const std::vector<int>> pages);

// Where a page may come from, and go to: without files it is none of both. Of what changes there is one for
// each interval of time.
class KeptPages {
  public:
    // Those of some shapes, which are page `number` of a group, that lie in files.
    void find(store::HierarchyFiles& files, const Digest& group, size_t number, const store::Store& store,
              std::span<const int> shapes);
    const hierarchy::Lattices* lattices() const; // null: none is found
    std::optional<hierarchy::PageMemory> take(size_t interval);
    void keep(size_t interval, const hierarchy::PageMemory& page, const hierarchy::Lattices& lattices);

  private:
    store::HierarchyFiles* m_files = nullptr;
    std::vector<Digest> m_content;
    std::vector<std::optional<store::HierarchyFiles::Found>> m_found;
};

} // namespace kanuka::bvh
