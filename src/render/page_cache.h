// What primitives became, kept from one making of a scene to the next: pages by what they were made of, so
// that an edit dices and shades nothing that it did not touch. Pages take no more than a budget; those beyond
// it are absent: known, and made again where they are needed.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "base/digest.h"
#include "shade/spaces.h"
#include "store/store.h"

namespace kanuka::render {

// Thread safety: find() may run at the same time, the others alone.
class PageCache {
  public:
    struct Made {
        store::Page page; // in its own space
        bool empty = true;
    };
    // What is pinned stays as long as the pin, evicted or not.
    using Pin = std::shared_ptr<const Made>;
    struct Entry {
        shade::SpacesRead read; // by its shaders, of where the primitive stood
        Digest of_read;         // the values of that
        Pin made;               // null = absent
    };

    // keeps: false = pages are given their keys, and go.
    explicit PageCache(bool keeps) : m_keeps(keeps) {}
    bool keeps() const { return m_keeps; }
    void set_budget(uint64_t bytes) { m_budget = bytes; } // holds from next() on for what is there

    // Of one content there may be several, which were made in different places. `fits`: of an entry, is what
    // it read the same here? None = it was never made.
    template <class Fits>
    std::optional<Entry> find(const Digest& content, const Fits& fits) {
        const std::lock_guard lock(m_mutex);
        const auto [begin, end] = m_known.equal_range(content);
        for (auto at = begin; at != end; ++at)
            if (fits(at->second.entry)) {
                at->second.used = m_making;
                return at->second.entry;
            }
        return std::nullopt;
    }
    // Which pages find room depends on the order of calls, and must not depend on threads. What the last
    // making has used is not evicted for another page: the scene is walked through in order, and the least
    // recently used page would be the one that is needed next.
    void keep(const Digest& content, Entry entry);
    // A making is over: what it has not used may be evicted from now on, those first that were used longest
    // ago.
    void next();
    void clear();

    uint64_t bytes() const { return m_bytes; }

  private:
    struct Known {
        Entry entry;
        uint64_t used;   // number of the making
        uint64_t number; // in the order in which they came
    };
    using Table = std::multimap<Digest, Known>;
    static uint64_t bytes_of(const Entry& entry);
    void evict(Known& known);

    const bool m_keeps;
    uint64_t m_budget = ~uint64_t(0), m_bytes = 0;
    uint64_t m_making = 1, m_count = 0;
    std::mutex m_mutex;
    Table m_known;
    std::vector<Table::iterator> m_stale; // to be evicted, the last one first
};

} // namespace kanuka::render
