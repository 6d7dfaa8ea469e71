#include "ingest/rib/reports.h"

namespace kanuka::ingest {

// Of messages that are said once: a file of random words knows no end of them.
static constexpr size_t MaxKeys = 1000;

void Reports::report(Severity severity, const Location& where, std::string message) {
    if (m_said || m_said_before) {
        std::string key = where.str() + " " + message;
        if (m_said)
            (*m_said)[std::move(key)]++;
        else if (const auto before = m_said_before->find(key);
                 before != m_said_before->end() && before->second > 0) {
            before->second--;
            return;
        }
    }
    m_journal.report(severity, where, std::move(message));
}

void Reports::at(Severity severity, std::string_view kind, const Location& where, std::string message) {
    if (severity == Severity::Error && mode == Mode::Abort)
        throw Error(where, message + " (ErrorHandler \"abort\": reading ends here)");
    if (mode == Mode::Ignore)
        severity = Severity::Info;
    auto it = m_places.find(kind);
    if (it == m_places.end())
        it = m_places.emplace(std::string(kind), 0).first;
    if (++it->second <= MaxPlaces) {
        report(severity, where, std::move(message));
        return;
    }
    report(severity, Location{where.file},
           "more of the same (" + std::string(kind) + "): the places after the first " +
               std::to_string(MaxPlaces) + " are only counted");
}

void Reports::once(Severity severity, std::string_view key, const Location& where,
                   const std::string& message) {
    if (mode == Mode::Ignore)
        severity = Severity::Info;
    auto it = m_firsts.find(key);
    if (it == m_firsts.end() && m_firsts.size() >= MaxKeys) {
        at(severity, "messages of more than " + std::to_string(MaxKeys) + " sorts", where, message);
        return;
    }
    if (it == m_firsts.end())
        it = m_firsts.emplace(std::string(key), First{where, message}).first;
    report(severity, it->second.where, it->second.message);
}

} // namespace kanuka::ingest
