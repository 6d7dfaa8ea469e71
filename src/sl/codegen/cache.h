// The folder of compiled shaders. Many processes and hosts may share it, over NFS too: entries are named by a
// hash of their key, hold the key itself and a checksum, and come to life by rename, so that a reader sees a
// whole entry or none.
//
//   HASH.kso                     an entry
//   HASH.kso.HOST.PID.N.kso.tmp  one being written; those an hour old were left by a process that died, and
//   are removed
#pragma once

#include <optional>
#include <string>

#include "sl/sl.h"

namespace kanuka::sl {

class ObjectCache {
  public:
    explicit ObjectCache(std::string folder) : m_folder(std::move(folder)) {}
    // The object of this key; nothing if there is none or it is broken. A read entry counts as used.
    std::optional<std::string> read(const std::string& key) const;
    // Returns what is wrong if it could not be kept: a cache that cannot be written is no cache, and no
    // fault.
    std::string write(const std::string& key, const std::string& object) const;
    // Removes what dead processes left, and the entries not used for longest until the folder is below the
    // limit. Returns the number of files removed.
    uint64_t trim(uint64_t max_bytes) const;
    uint64_t clear() const;
    std::vector<CacheEntry> entries(bool verify) const;
    std::string path(const std::string& key) const;

  private:
    std::string m_folder;
};

// For damage, not for malice.
uint64_t hash_bytes(const void* data, size_t size, uint64_t seed = 0);

} // namespace kanuka::sl
