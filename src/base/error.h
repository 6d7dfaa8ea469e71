// Errors and the journal. An Error stops what cannot go on (a missing scene file); everything a render
// survives goes to the Journal: once a message and place, with a count.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/file_name.h"

namespace kanuka {

// Where in an input something was found. Line and column start at 1; 0 = unknown.
struct Location {
    FileName file;
    int line = 0;
    int column = 0;
    std::string str() const; // "file:line:column", as much of it as is known
};

// What a farm acts on; the command's exit code is the number.
enum class ExitCode : int {
    Ok = 0,
    Warnings = 0, // warnings alone do not fail a frame
    Errors = 3,   // a picture was written, but something in it is missing or replaced
    Usage = 2,    // wrong command line
    Input = 4,    // no picture: the scene could not be read
    Output = 5,   // no picture: it could not be written
    Internal = 70,
};

class Error : public std::runtime_error {
  public:
    Error(Location where, const std::string& what, ExitCode code = ExitCode::Input);
    explicit Error(const std::string& what, ExitCode code = ExitCode::Input)
        : Error(Location{}, what, code) {}
    const Location& where() const { return m_where; }
    ExitCode code() const { return m_code; }

  private:
    Location m_where;
    ExitCode m_code;
};

enum class Severity { Info, Warning, Error };

// Collects what went wrong without stopping. The same message (severity, location, text) is kept once, with a
// count. Thread safety: all members may be called from any thread.
class Journal {
  public:
    struct Entry {
        Severity severity;
        Location where;
        std::string message; // what was found, and what would do
        uint64_t count;
    };
    void report(Severity severity, Location where, std::string message);
    void warning(Location where, std::string message) {
        report(Severity::Warning, where, std::move(message));
    }
    void error(Location where, std::string message) { report(Severity::Error, where, std::move(message)); }
    // Sorted by first file, line, column, message: the same for any thread count.
    std::vector<Entry> entries() const;
    bool has_errors() const { return m_errors.load() > 0; }
    uint64_t error_count() const { return m_errors.load(); }
    // Called for each new entry as it comes (from any thread); null = silent.
    void set_listener(void (*listener)(const Entry&, void*), void* user);

  private:
    mutable std::mutex m_mutex;
    std::map<std::string, Entry> m_entries;
    std::atomic<uint64_t> m_errors{0};
    void (*m_listener)(const Entry&, void*) = nullptr;
    void* m_user = nullptr;
};

} // namespace kanuka
