#include "base/error.h"

#include <algorithm>
#include <set>

namespace kanuka {

const std::string FileName::Empty; // no location is asked for its file before main()

const std::string* FileName::kept(std::string_view text) {
    if (text.empty())
        return nullptr;
    // Never freed: an error of the last moment may still ask.
    static std::mutex& mutex = *new std::mutex;
    static auto& names = *new std::set<std::string, std::less<>>;
    std::lock_guard lock(mutex);
    const auto found = names.find(text);
    return &*(found != names.end() ? found : names.emplace(text).first);
}

std::string Location::str() const {
    std::string s = file;
    if (line > 0) {
        s += ":" + std::to_string(line);
        if (column > 0)
            s += ":" + std::to_string(column);
    }
    return s;
}

static std::string prefixed(const Location& where, const std::string& what) {
    const std::string at = where.str();
    return at.empty() ? what : at + ": " + what;
}

Error::Error(Location where, const std::string& what, ExitCode code)
    : std::runtime_error(prefixed(where, what)), m_where(where), m_code(code) {}

void Journal::report(Severity severity, Location where, std::string message) {
    std::lock_guard lock(m_mutex);
    const std::string key = std::to_string(int(severity)) + where.str() + '\n' + message;
    auto [it, fresh] = m_entries.try_emplace(key, Entry{severity, where, std::move(message), 0});
    it->second.count++;
    if (severity == Severity::Error)
        m_errors++;
    if (fresh && m_listener)
        m_listener(it->second, m_user);
}

std::vector<Journal::Entry> Journal::entries() const {
    std::lock_guard lock(m_mutex);
    std::vector<Entry> all;
    for (const auto& [key, entry] : m_entries)
        all.push_back(entry);
    std::stable_sort(all.begin(), all.end(), [](const Entry& a, const Entry& b) {
        return std::tie(a.where.file, a.where.line, a.where.column, a.message) <
               std::tie(b.where.file, b.where.line, b.where.column, b.message);
    });
    return all;
}

void Journal::set_listener(void (*listener)(const Entry&, void*), void* user) {
    std::lock_guard lock(m_mutex);
    m_listener = listener;
    m_user = user;
}

} // namespace kanuka
