// The folder of compiled shaders. Many processes and hosts may share it: entries are named by a hash of their
// key, hold the key itself and a checksum, and come to life by rename.
#pragma once

#include <optional>
#include <string>

namespace kanuka::sl {

class ObjectCache {
  public:
    static constexpr uint64_t MaxBytes = uint64_t(1) << 30;
    explicit ObjectCache(std::string folder) : m_folder(std::move(folder)) {}
    // The object of this key; nothing if there is none or it is broken. A read entry counts as used.
    std::optional<std::string> read(const std::string& key) const;
    // Never fails loudly: a cache that cannot be written is no cache.
    void write(const std::string& key, const std::string& object) const;
    // Removes the entries not used for longest until the folder is below the limit.
    void trim(uint64_t max_bytes) const;
    std::string path(const std::string& key) const;

  private:
    std::string m_folder;
};

uint64_t hash_bytes(const void* data, size_t size, uint64_t seed = 0);

} // namespace kanuka::sl
