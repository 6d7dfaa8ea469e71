#include "base/cache_folder.h"

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <map>
#include <mutex>
#include <unistd.h>

namespace kanuka {

namespace fs = std::filesystem;

std::string cache_folder(const char* variable, const std::string& name) {
    if (const char* folder = std::getenv(variable); folder && *folder)
        return folder;
    if (const char* folder = std::getenv("XDG_CACHE_HOME"); folder && *folder)
        return std::string(folder) + "/kanuka/" + name;
    const char* home = std::getenv("HOME");
    return std::string(home && *home ? home : "/tmp") + "/.cache/kanuka/" + name;
}

std::vector<CachedFile> cached_files(const std::string& folder, std::string_view suffix) {
    return cached_files(folder, std::span(&suffix, 1));
}

std::vector<CachedFile> cached_files(const std::string& folder, std::span<const std::string_view> suffixes) {
    std::vector<CachedFile> files;
    std::error_code failed;
    for (fs::directory_iterator it(folder, failed), end; !failed && it != end; it.increment(failed)) {
        const std::string name = it->path().filename().string();
        if (std::ranges::none_of(suffixes, [&](std::string_view suffix) { return name.ends_with(suffix); }))
            continue;
        std::error_code gone; // by another process, in the meantime
        CachedFile file{it->path(), it->last_write_time(gone), 0};
        if (!gone)
            file.bytes = it->file_size(gone);
        if (!gone)
            files.push_back(std::move(file));
    }
    std::ranges::sort(files, [](const CachedFile& a, const CachedFile& b) { return a.used < b.used; });
    return files;
}

void note_use(const std::string& path) {
    constexpr auto Precision = std::chrono::minutes(1);
    std::error_code failed;
    const auto now = fs::file_time_type::clock::now();
    if (const auto used = fs::last_write_time(path, failed); !failed && now - used > Precision)
        fs::last_write_time(path, now, failed);
}

std::string unfinished_name(const std::string& path, std::string_view suffix) {
    static std::atomic<unsigned> serial{0};
    char host[128] = {};
    gethostname(host, sizeof host - 1);
    return path + "." + host + "." + std::to_string(getpid()) + "." + std::to_string(serial++) +
           std::string(suffix);
}

uint64_t trim_cache(const std::string& folder, const CacheKind& kind, uint64_t most_bytes) {
    return trim_cache(folder, std::span(&kind, 1), most_bytes);
}

uint64_t trim_cache(const std::string& folder, std::span<const CacheKind> kinds, uint64_t most_bytes) {
    uint64_t removed = 0, total = 0;
    std::error_code failed;
    const auto now = fs::file_time_type::clock::now();
    std::vector<std::string_view> suffixes;
    for (const CacheKind& kind : kinds) {
        suffixes.push_back(kind.suffix);
        for (const CachedFile& file : cached_files(folder, kind.unfinished_suffix))
            if (now - file.used > kind.abandoned) // else it may be somebody's who is at work
                removed += fs::remove(file.path, failed);
    }
    const std::vector<CachedFile> files = cached_files(folder, suffixes);
    for (const CachedFile& file : files)
        total += file.bytes;
    for (const CachedFile& file : files) {
        if (total <= most_bytes)
            break;
        removed += fs::remove(file.path, failed); // not there any more: another process was faster
        total -= file.bytes;
    }
    return removed;
}

void make_room_in_cache(const std::string& folder, const CacheKind& kind, uint64_t written,
                        uint64_t most_bytes) {
    static std::mutex mutex;
    static std::map<std::string, uint64_t> since; // bytes, by folder
    {
        const std::lock_guard lock(mutex);
        const auto [it, first] = since.try_emplace(folder, 0);
        it->second += written;
        if (!first && it->second < most_bytes / 16)
            return;
        it->second = 0;
    }
    trim_cache(folder, kind, most_bytes);
}

} // namespace kanuka
