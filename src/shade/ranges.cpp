#include "shade/ranges.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <tuple>
#include <utility>

namespace kanuka::shade {

void Ranges::add(const sl::OutOfRange& what, const Location& where) {
    const std::lock_guard lock(m_mutex);
    const auto [at, fresh] = m_entries.try_emplace({what.shader, what.slot.name});
    Entry& e = at->second;
    const auto place = [](const Location& l) { return std::tuple(l.file.str(), l.line, l.column); };
    if (fresh || place(where) < place(e.where))
        e.where = where;
    e.low = what.slot.low, e.high = what.slot.high;
    e.least = fresh ? what.least : std::min(e.least, what.least);
    e.most = fresh ? what.most : std::max(e.most, what.most);
    e.count += what.count;
}

void Ranges::report(Journal& journal) {
    const std::lock_guard lock(m_mutex);
    for (auto& [name, e] : m_entries) {
        if (std::exchange(e.told, true))
            continue;
        std::ostringstream text;
        text << "shader \"" << name.first << "\": " << name.second << " ";
        if (e.least > e.most)
            text << "is no number";
        else
            text << "goes from " << e.least << " to " << e.most;
        text << " (outside at " << e.count << (e.count == 1 ? " vertex" : " vertices") << "); it is kept ";
        if (std::isfinite(e.high) && e.high < 65504)
            text << "within " << e.low << " and " << e.high;
        else
            text << "at or above " << e.low;
        journal.warning(e.where, text.str());
    }
}

} // namespace kanuka::shade
