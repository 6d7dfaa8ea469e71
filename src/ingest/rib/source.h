// The bytes of one RIB stream: a plain file (mapped), a gzip or zstd file (unpacked), standard input, or a
// text in memory.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.h"

namespace kanuka::ingest {

class Spool;

// Thread safety: none; one reader a source.
class Source {
  public:
    // "-" is standard input. Throws Error where the file cannot be read. Gzip and zstd are told by their
    // first bytes; "a.zip!b.rib" is the member b.rib of a.zip.
    static std::shared_ptr<Source> open(const std::string& path);
    static std::shared_ptr<Source> from_text(std::string text, FileName name);
    ~Source();
    Source(const Source&) = delete;
    Source& operator=(const Source&) = delete;

    const std::string& name() const { return m_name.str(); }
    std::string_view text() const { return m_text; }
    // Line and column of a byte. Lines are counted from the last place asked, so that asking in order costs
    // one pass over the file in all, and scanning numbers need not watch for line ends.
    Location locate(size_t offset) const;

    // Reading has got this far: the memory of mapped bytes before it may go.
    void passed(size_t offset) const;

  private:
    static std::shared_ptr<Source> open_member(const std::string& path, const std::string& zip,
                                               const std::string& member);
    void map(int fd, size_t size);
    void unmap();
    void take(Spool& spool);
    explicit Source(FileName name) : m_name(name) {}
    FileName m_name;
    std::string m_owned;
    void* m_mapping = nullptr;
    size_t m_mapped_size = 0;
    mutable size_t m_released = 0;
    std::string_view m_text;
    // Where lines are counted up to, and places before it to start from when somebody asks backwards.
    struct Place {
        size_t offset = 0, line_start = 0;
        int line = 1;
    };
    mutable Place m_place;
    mutable std::vector<Place> m_places;
    char m_line_end = '\n'; // '\r' in files of old Macintoshes
    void find_line_end();
};

} // namespace kanuka::ingest
