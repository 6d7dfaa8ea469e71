#include "sl/codegen/cache.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>
#include <vector>

#include "base/byte_size.h"
#include "base/cache_folder.h"

namespace kanuka::sl {

namespace fs = std::filesystem;

// FNV-1a over words, four of them side by side, with a finaliser.
uint64_t hash_bytes(const void* data, size_t size, uint64_t seed) {
    const unsigned char* p = static_cast<const unsigned char*>(data);
    const uint64_t start = 0xcbf29ce484222325ull ^ (seed * 0x9e3779b97f4a7c15ull) ^ size;
    const auto mix = [](uint64_t h, uint64_t word) {
        h = (h ^ word) * 0x100000001b3ull;
        return h ^ (h >> 32);
    };
    const auto word = [&p](size_t k) {
        uint64_t w;
        std::memcpy(&w, p + 8 * k, 8);
        return w;
    };
    uint64_t lanes[4] = {start, start + 1, start + 2, start + 3};
    for (; size >= 32; p += 32, size -= 32)
        for (size_t k = 0; k < 4; k++)
            lanes[k] = mix(lanes[k], word(k));
    uint64_t h = lanes[0];
    for (size_t k = 1; k < 4; k++)
        h = mix(h, lanes[k]);
    for (; size >= 8; p += 8, size -= 8)
        h = mix(h, word(0));
    for (; size; p++, size--)
        h = (h ^ *p) * 0x100000001b3ull;
    h ^= h >> 33;
    h *= 0xff51afd7ed558ccdull;
    return h ^ (h >> 33);
}

namespace {

constexpr char Magic[8] = {'K', 'N', 'K', 'C', 'O', 'D', 'E', '2'};
constexpr CacheKind Kind{".kso", ".kso.tmp", std::chrono::hours(1)};
constexpr uint64_t DefaultLimit = uint64_t(1) << 30;

struct Header {
    char magic[8];
    uint64_t key_size, object_size, checksum;
};

class File {
  public:
    File(const std::string& path, int flags) : m_handle(::open(path.c_str(), flags | O_CLOEXEC, 0666)) {}
    ~File() { close(); }
    bool ok() const { return m_handle >= 0; }
    bool close() {
        const int handle = std::exchange(m_handle, -1);
        return handle >= 0 && ::close(handle) == 0;
    }
    bool write(const char* data, size_t size) const {
        while (size > 0) {
            const ssize_t n = ::write(m_handle, data, size);
            if (n < 0 && errno == EINTR)
                continue;
            if (n <= 0)
                return false;
            data += n;
            size -= size_t(n);
        }
        return true;
    }
    std::optional<std::string> read() const {
        struct stat about;
        if (fstat(m_handle, &about) != 0 || !S_ISREG(about.st_mode))
            return std::nullopt;
        std::string all(size_t(about.st_size), '\0');
        size_t have = 0;
        while (have < all.size()) {
            const ssize_t n = ::read(m_handle, all.data() + have, all.size() - have);
            if (n < 0 && errno == EINTR)
                continue;
            if (n <= 0)
                break;
            have += size_t(n);
        }
        all.resize(have);
        return all;
    }

  private:
    int m_handle;
};

// Null if the entry is whole and, where a key is given, of that key.
const char* check(const std::string& all, Header& h, const std::string* key) {
    if (all.size() < sizeof h)
        return "it ends early";
    std::memcpy(&h, all.data(), sizeof h);
    if (std::memcmp(h.magic, Magic, sizeof Magic) != 0)
        return "it is no entry of this version";
    const uint64_t rest = all.size() - sizeof h;
    if (h.key_size > rest || h.object_size != rest - h.key_size)
        return "its size is wrong";
    if (key && all.compare(sizeof h, h.key_size, *key) != 0)
        return "it is another shader's";
    if (h.checksum != hash_bytes(all.data() + sizeof h, rest))
        return "its checksum does not fit";
    return nullptr;
}

} // namespace

std::string ObjectCache::path(const std::string& key) const {
    char name[48];
    std::snprintf(name, sizeof name, "%016llx%016llx%s",
                  static_cast<unsigned long long>(hash_bytes(key.data(), key.size(), 1)),
                  static_cast<unsigned long long>(hash_bytes(key.data(), key.size(), 2)), Kind.suffix.data());
    return (fs::path(m_folder) / name).string();
}

std::optional<std::string> ObjectCache::read(const std::string& key) const {
    const std::string file = path(key);
    std::optional<std::string> all;
    if (const File in(file, O_RDONLY); in.ok())
        all = in.read();
    Header h;
    if (!all || check(*all, h, &key))
        return std::nullopt;
    note_use(file);
    all->erase(0, sizeof h + key.size());
    return all;
}

std::string ObjectCache::write(const std::string& key, const std::string& object) const {
    const auto problem = [&](const char* what, int error) {
        return "the shader cache " + m_folder + " cannot be written (" + what + ": " + std::strerror(error) +
               "): shaders are compiled anew each time; KANUKA_SHADER_CACHE names another folder";
    };
    std::error_code ec;
    fs::create_directories(m_folder, ec);
    Header h;
    std::memcpy(h.magic, Magic, sizeof Magic);
    h.key_size = key.size();
    h.object_size = object.size();
    const std::string payload = key + object;
    h.checksum = hash_bytes(payload.data(), payload.size());
    const std::string file = path(key), temporary = unfinished_name(file, Kind.unfinished_suffix);
    File out(temporary, O_WRONLY | O_CREAT | O_EXCL);
    if (!out.ok())
        return problem("making a file", errno);
    // A full disk may show only when the file is closed: file servers write late.
    const bool written =
        out.write(reinterpret_cast<const char*>(&h), sizeof h) && out.write(payload.data(), payload.size());
    const int write_error = errno;
    if (const bool closed = out.close(); !written || !closed) {
        const int error = written ? errno : write_error;
        ::unlink(temporary.c_str());
        return problem("writing", error);
    }
    if (::rename(temporary.c_str(), file.c_str()) != 0) {
        const int error = errno;
        ::unlink(temporary.c_str());
        return problem("renaming", error);
    }
    make_room_in_cache(m_folder, Kind, sizeof h + payload.size(), cache_limit());
    return {};
}

uint64_t ObjectCache::trim(uint64_t max_bytes) const {
    return trim_cache(m_folder, Kind, max_bytes);
}

uint64_t ObjectCache::clear() const {
    uint64_t removed = 0;
    std::error_code ec;
    for (const std::string_view suffix : {Kind.suffix, Kind.unfinished_suffix})
        for (const CachedFile& file : cached_files(m_folder, suffix))
            removed += fs::remove(file.path, ec);
    return removed;
}

std::vector<CacheEntry> ObjectCache::entries(bool verify) const {
    std::vector<CacheEntry> list;
    const auto now = fs::file_time_type::clock::now();
    std::vector<CachedFile> found = cached_files(m_folder, Kind.suffix);
    std::reverse(found.begin(), found.end());
    for (const CachedFile& f : found) {
        CacheEntry e;
        e.file = f.path.string();
        e.bytes = f.bytes;
        e.age_s = std::chrono::duration<double>(now - f.used).count();
        const File in(e.file, O_RDONLY);
        std::optional<std::string> all;
        if (in.ok())
            all = in.read();
        Header h;
        const char* problem = all ? check(*all, h, nullptr) : "it cannot be read";
        if (!problem || (all && all->size() >= sizeof h && h.key_size <= all->size() - sizeof h)) {
            e.key = all->substr(sizeof h, h.key_size);
            if (!problem && path(e.key) != e.file)
                problem = "its name is another shader's";
        }
        // "shader NAME, …": cache keys begin so.
        const size_t begin = e.key.find("shader "), end = e.key.find(',');
        if (begin == 0 && end != std::string::npos)
            e.shader = e.key.substr(7, end - 7);
        if (verify && problem)
            e.problem = problem;
        list.push_back(std::move(e));
    }
    return list;
}

uint64_t cache_limit() {
    const char* given = std::getenv("KANUKA_SHADER_CACHE_SIZE");
    return parse_byte_size(given ? given : "").value_or(DefaultLimit);
}

std::vector<CacheEntry> cache_entries(const std::string& folder, bool verify) {
    return ObjectCache(folder).entries(verify);
}
uint64_t cache_clear(const std::string& folder) {
    return ObjectCache(folder).clear();
}
uint64_t cache_trim(const std::string& folder, uint64_t max_bytes) {
    return ObjectCache(folder).trim(max_bytes);
}

} // namespace kanuka::sl
