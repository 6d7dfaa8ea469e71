#include "render/page_cache.h"

#include <algorithm>
#include <iterator>

namespace kanuka::render {

uint64_t PageCache::bytes_of(const Entry& entry) {
    return entry.made ? sizeof(Known) + entry.made->page.words.size() * sizeof(entry.made->page.words[0]) : 0;
}

void PageCache::evict(Known& known) {
    m_bytes -= bytes_of(known.entry);
    known.entry.made = nullptr;
}

void PageCache::keep(const Digest& content, Entry entry) {
    if (!m_keeps)
        return;
    const auto [begin, end] = m_known.equal_range(content);
    const auto same =
        std::find_if(begin, end, [&](const auto& of) { return of.second.entry.of_read == entry.of_read; });
    if (same != end && same->second.entry.made)
        return; // two of one content in a run
    const uint64_t bytes = bytes_of(entry);
    while (m_bytes + bytes > m_budget && !m_stale.empty()) {
        Known& known = m_stale.back()->second;
        m_stale.pop_back();
        if (known.used != m_making)
            evict(known);
    }
    if (m_bytes + bytes > m_budget)
        entry.made = nullptr;
    m_bytes += bytes_of(entry);
    if (same != end)
        same->second.entry = std::move(entry);
    else
        m_known.emplace(content, Known{std::move(entry), m_making, ++m_count});
}

void PageCache::next() {
    m_stale.clear();
    std::vector<Table::iterator> in_use;
    for (auto at = m_known.begin(); at != m_known.end();) {
        const bool used = at->second.used == m_making;
        if (!used && !at->second.entry.made) {
            at = m_known.erase(at);
            continue;
        }
        (used ? in_use : m_stale).push_back(at++);
    }
    const auto later = [](const Table::iterator& a, const Table::iterator& b) {
        return std::pair(a->second.used, a->second.number) > std::pair(b->second.used, b->second.number);
    };
    std::ranges::sort(m_stale, later);
    for (; m_bytes > m_budget && !m_stale.empty(); m_stale.pop_back()) // it was lowered
        evict(m_stale.back()->second);
    if (m_bytes > m_budget) {
        std::ranges::sort(in_use, later);
        for (size_t i = 0; m_bytes > m_budget && i < in_use.size(); i++)
            evict(in_use[i]->second);
    }
    m_making++;
}

void PageCache::clear() {
    m_stale.clear();
    m_known.clear();
    m_bytes = 0;
}

} // namespace kanuka::render
