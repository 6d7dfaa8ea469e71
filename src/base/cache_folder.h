// Folders of files that can be made again, which many processes and hosts share, over NFS too. A file comes
// to life by rename, so that a reader sees a whole one or none; what was not used for longest goes first.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace kanuka {

// Where a cache is unless `variable` of the environment names another: a folder of the user's cache.
std::string cache_folder(const char* variable, const std::string& name);

struct CachedFile {
    std::filesystem::path path;
    std::filesystem::file_time_type used;
    uint64_t bytes;
};

// Files of a folder whose names end so, those used longest ago first.
std::vector<CachedFile> cached_files(const std::string& folder, std::string_view suffix);
std::vector<CachedFile> cached_files(const std::string& folder, std::span<const std::string_view> suffixes);

// Use is noted to a minute: each note is a message to the file server.
void note_use(const std::string& path);

// What a file is called while it is written: unique beside other hosts, processes and threads that make the
// same.
std::string unfinished_name(const std::string& path, std::string_view suffix);

struct CacheKind {
    std::string_view suffix, unfinished_suffix;
    std::chrono::seconds abandoned; // an unfinished file of this age was left by a process that died
};

// Removes what was abandoned, then those used longest ago until the others have at most `most_bytes`, of all
// kinds together. Returns the number of files removed.
uint64_t trim_cache(const std::string& folder, std::span<const CacheKind> kinds, uint64_t most_bytes);
uint64_t trim_cache(const std::string& folder, const CacheKind& kind, uint64_t most_bytes);
// The same at a process's first file in a folder, then whenever it has written a sixteenth of the limit: to
// read a folder over a network is slow.
void make_room_in_cache(const std::string& folder, const CacheKind& kind, uint64_t written,
                        uint64_t most_bytes);

} // namespace kanuka
