// The way of every message of the RIB reader to the journal: said once where once is enough, and never
// flooding it.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "base/error.h"

namespace kanuka::ingest {

class Reports {
  public:
    explicit Reports(Journal& journal) : m_journal(journal) {}

    // ErrorHandler: Ignore makes information of warnings and errors; Abort throws the first mistake in the
    // file (what is well written but not supported here is none) as an Error.
    enum class Mode : uint8_t { Print, Ignore, Abort };
    Mode mode = Mode::Print;

    Journal& journal() { return m_journal; }
    // One entry a place. `kind` names the message's sort: after MaxPlaces of one sort the rest are counted in
    // one entry, for a broken exporter may make the same mistake a million times.
    void at(Severity severity, std::string_view kind, const Location& where, std::string message);
    void error(std::string_view kind, const Location& where, std::string message) {
        at(Severity::Error, kind, where, std::move(message));
    }
    void warning(std::string_view kind, const Location& where, std::string message) {
        at(Severity::Warning, kind, where, std::move(message));
    }
    void info(std::string_view kind, const Location& where, std::string message) {
        at(Severity::Info, kind, where, std::move(message));
    }
    // One entry in all, at the first place; later ones of the same key raise its count.
    void once(Severity severity, std::string_view key, const Location& where, const std::string& message);

    static constexpr int MaxPlaces = 50;

    // Of a file that is read twice: what the first reading said is not said by the second.
    using Said = std::map<std::string, uint64_t>; // how often
    void remember(Said* said) { m_said = said; }  // null ends it
    void leave_out(Said* said) { m_said_before = said; }

  private:
    void report(Severity severity, const Location& where, std::string message);
    Said *m_said = nullptr, *m_said_before = nullptr;
    struct First {
        Location where;
        std::string message;
    };
    Journal& m_journal;
    std::map<std::string, int, std::less<>> m_places;
    std::map<std::string, First, std::less<>> m_firsts;
};

} // namespace kanuka::ingest
