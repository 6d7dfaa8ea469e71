// gzip and zstd, and where their contents go.
#pragma once

#include <memory>
#include <string>
#include <string_view>

namespace kanuka::ingest {

// Bytes of unknown number: in memory while they are few, beyond that in a nameless temporary file, which the
// system can page out at will. So a stream of any length is read in bounded memory.
// Thread safety: none.
class Spool {
  public:
    explicit Spool(std::string name) : m_name(std::move(name)) {}
    ~Spool();
    Spool(const Spool&) = delete;
    Spool& operator=(const Spool&) = delete;
    void append(std::string_view bytes);
    std::string take_text();          // if it stayed in memory
    int file() const { return m_fd; } // else -1
    size_t size() const { return m_size; }

    static constexpr size_t InMemory = size_t(64) << 20;

  private:
    void write_out(std::string_view bytes);
    std::string m_name, m_text;
    int m_fd = -1;
    size_t m_size = 0;
};

class Unpacker {
  public:
    virtual ~Unpacker() = default;
    virtual void feed(std::string_view bytes, Spool& to) = 0;
    virtual void finish() = 0; // throws Error where the data was cut short
};

// By the first bytes of a file; null = it is not packed. `name` is for messages.
std::unique_ptr<Unpacker> find_unpacker(std::string_view start, const std::string& name);

} // namespace kanuka::ingest
