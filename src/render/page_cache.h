// What primitives became, kept from one making of a scene to the next: pages by the digest of all that they
// were made of, so that an edit dices and shades nothing that it did not touch.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <utility>

#include "base/digest.h"
#include "base/motion.h"
#include "render/volumes.h"
#include "store/store.h"

namespace kanuka::render {

// Thread safety: find() and keep() may run at the same time, next() alone.
class PageCache {
  public:
    // keeps: false = pages are given their keys, and go.
    explicit PageCache(bool keeps) : m_keeps(keeps) {}
    bool keeps() const { return m_keeps; }
    struct Entry {
        store::Page page;
        bool empty = true, changes = false; // as in Prepared
        std::vector<MotionPath> path;
        Thickness inside;
    };
    std::shared_ptr<const Entry> find(const Digest& key) { // null = it is not there
        const std::lock_guard lock(m_mutex);
        const auto found = m_entries.find(key);
        if (found == m_entries.end())
            return nullptr;
        found->second.used = true;
        return found->second.entry;
    }
    void keep(const Digest& key, std::shared_ptr<const Entry> entry) {
        const std::lock_guard lock(m_mutex);
        m_entries[key] = {std::move(entry), true};
    }
    // A making is over: what it did not use goes.
    void next() {
        for (auto at = m_entries.begin(); at != m_entries.end();)
            if (std::exchange(at->second.used, false))
                ++at;
            else
                at = m_entries.erase(at);
    }
    void clear() { m_entries.clear(); }

  private:
    struct Kept {
        std::shared_ptr<const Entry> entry;
        bool used;
    };
    const bool m_keeps;
    std::mutex m_mutex;
    std::map<Digest, Kept> m_entries;
};

} // namespace kanuka::render
