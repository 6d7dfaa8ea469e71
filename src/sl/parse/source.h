// Source files, places in them, and diagnostics with the source line and a caret.
#pragma once

#include <deque>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "base/error.h"

namespace kanuka::sl {

// A place in a source: file is an index into the Sources; line and column start at 1.
struct Loc {
    uint32_t file = 0;
    uint32_t line = 0;
    uint32_t column = 0;
};

// The texts that one compilation reads. Texts never move: tokens are views into them.
class Sources {
  public:
    uint32_t add(std::string name, std::string text);
    const std::string& name(uint32_t file) const { return m_files[file]->name; }
    std::string_view text(uint32_t file) const { return m_files[file]->text; }
    std::string_view line(Loc at) const; // without its newline
    Location location(Loc at) const;
    // Texts made by the preprocessor (pasted tokens, strings); alive as long as the Sources.
    std::string_view keep(std::string text);
    // The comment that ends on `line` of `file`, or empty.
    void note_comment(uint32_t file, uint32_t line, std::string_view text);
    std::string_view comment(uint32_t file, uint32_t line) const;
    const std::unordered_map<uint32_t, std::string_view>& comments(uint32_t file) const {
        return m_files[file]->comments;
    }
    uint32_t count() const { return uint32_t(m_files.size()); }

  private:
    struct File {
        std::string name, text;
        std::vector<size_t> line_starts;
        std::unordered_map<uint32_t, std::string_view> comments;
    };
    std::vector<std::unique_ptr<File>> m_files;
    std::deque<std::string> m_kept;
};

// Collects a compilation's errors and warnings and hands them to the journal with the line they are about.
// After MaxErrors the rest is counted only.
class Diagnostics {
  public:
    static constexpr int MaxErrors = 20;
    Diagnostics(Sources& sources, Journal& journal) : m_sources(sources), m_journal(journal) {}
    void error(Loc at, const std::string& what);
    void warning(Loc at, const std::string& what) { tell(Severity::Warning, at, what); }
    void info(Loc at, const std::string& what) { tell(Severity::Info, at, what); }
    int errors() const { return m_errors; }
    // While set, errors are warnings that begin with this text, and only the first is told: code that nothing
    // runs need not be right.
    void set_lenient(const std::string* why) {
        m_lenient = why;
        m_demoted = 0;
    }
    bool lenient() const { return m_lenient != nullptr; }
    Sources& sources() { return m_sources; }

  private:
    std::string excerpt(Loc at) const;
    void tell(Severity severity, Loc at, const std::string& what);
    Sources& m_sources;
    Journal& m_journal;
    int m_errors = 0;
    const std::string* m_lenient = nullptr;
    int m_demoted = 0;
    Loc m_last{};
    std::set<std::string> m_warnings; // said already: a shader may be lowered more than once
};

// The candidates closest in spelling to `name`, for "did you mean": empty if none is near.
std::string closest(std::string_view name, const std::vector<std::string_view>& candidates);

} // namespace kanuka::sl
