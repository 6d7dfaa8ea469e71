// A file that appears under its name whole or not at all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace kanuka::film {

// Writes go to ".NAME.PID-COUNT.part" in the same directory: hidden, and not ending as a picture does, so
// that what a killed process leaves behind is not taken for one. commit() syncs and renames; without it the
// destructor removes the file. Throws Error with ExitCode::Output.
class AtomicFile {
  public:
    explicit AtomicFile(std::string path);
    ~AtomicFile();
    AtomicFile(const AtomicFile&) = delete;

    void write(const void* data, size_t size);
    uint64_t position() const { return m_position; }
    void seek(uint64_t position) { m_position = position; }
    void commit();
    const std::string& path() const { return m_path; }
    const std::string& temporary() const { return m_temporary; }

  private:
    [[noreturn]] void fail(const char* doing) const;

    std::string m_path, m_directory, m_temporary;
    int m_file = -1;
    uint64_t m_position = 0;
};

} // namespace kanuka::film
