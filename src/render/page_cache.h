// What primitives became, kept from one making of a scene to the next: pages by what they were made of, so
// that an edit dices and shades nothing that it did not touch.
#pragma once

#include <iterator>
#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "base/digest.h"
#include "shade/spaces.h"
#include "store/store.h"

namespace kanuka::render {

// Thread safety: find() and keep() may run at the same time, next() alone.
class PageCache {
  public:
    // keeps: false = pages are given their keys, and go.
    explicit PageCache(bool keeps) : m_keeps(keeps) {}
    bool keeps() const { return m_keeps; }
    struct Entry {
        store::Page page; // in its own space
        bool empty = true;
        shade::SpacesRead read; // by its shaders, of where the primitive stood
        Digest of_read;         // the values of that
    };
    // From earlier makings; of this one it would depend on the order in which threads come. Of one content
    // there may be several, which were made in different places. `fits`: of an entry, is what it read the
    // same here? Null = there is none.
    template <class Fits>
    std::shared_ptr<const Entry> find(const Digest& content, const Fits& fits) {
        const std::lock_guard lock(m_mutex);
        const auto found = m_entries.find(content);
        if (found != m_entries.end())
            for (Kept& kept : found->second)
                if (!kept.fresh && fits(*kept.entry)) {
                    kept.used = true;
                    return kept.entry;
                }
        return nullptr;
    }
    void keep(const Digest& content, std::shared_ptr<const Entry> entry) {
        const std::lock_guard lock(m_mutex);
        std::vector<Kept>& of_content = m_entries[content];
        for (const Kept& kept : of_content)
            if (kept.fresh && kept.entry->of_read == entry->of_read)
                return;
        of_content.push_back({std::move(entry), true, true});
    }
    // A making is over: what it did not use goes.
    void next() {
        for (auto at = m_entries.begin(); at != m_entries.end();) {
            std::erase_if(at->second, [](Kept& kept) {
                kept.fresh = false;
                return !std::exchange(kept.used, false);
            });
            at = at->second.empty() ? m_entries.erase(at) : std::next(at);
        }
    }
    void clear() { m_entries.clear(); }

  private:
    struct Kept {
        std::shared_ptr<const Entry> entry;
        bool used, fresh; // in, and since, the making that goes on
    };
    const bool m_keeps;
    std::mutex m_mutex;
    std::map<Digest, std::vector<Kept>> m_entries;
};

} // namespace kanuka::render
