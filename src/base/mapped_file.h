// A file as memory, to be read. Where memory has a bound (paged_memory.h) it comes and goes like the rest.
// Who removes the file's name takes nothing from those who have it mapped, as long as the file lies on a disk
// of this machine; what is cut short, or cannot be read, ends the process at the access.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <utility>

namespace kanuka {

class MappedFile {
  public:
    MappedFile() = default;
    // Of an open file, which may be closed then. Empty where it cannot be mapped.
    MappedFile(int handle, size_t bytes);
    ~MappedFile();
    MappedFile(MappedFile&& other) noexcept : m_bytes(std::exchange(other.m_bytes, {})) {}
    MappedFile& operator=(MappedFile&& other) noexcept {
        std::swap(m_bytes, other.m_bytes);
        return *this;
    }

    bool empty() const { return m_bytes.empty(); }
    std::span<const std::byte> bytes() const { return m_bytes; }

  private:
    std::span<std::byte> m_bytes;
};

// Its file system is this machine's own, by which mapped files stay whatever others do. Over a network
// somebody else may remove or replace what is mapped here.
bool is_on_this_machine(int handle);

} // namespace kanuka
