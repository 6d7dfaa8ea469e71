#include "sl/codegen/cache.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <unistd.h>
#include <vector>

namespace kanuka::sl {

namespace fs = std::filesystem;

// FNV-1a over words with a finaliser: guards against damage, not against malice.
uint64_t hash_bytes(const void* data, size_t size, uint64_t seed) {
    const unsigned char* p = static_cast<const unsigned char*>(data);
    uint64_t h = 0xcbf29ce484222325ull ^ (seed * 0x9e3779b97f4a7c15ull) ^ size;
    for (; size >= 8; p += 8, size -= 8) {
        uint64_t word;
        std::memcpy(&word, p, 8);
        h = (h ^ word) * 0x100000001b3ull;
        h ^= h >> 32;
    }
    for (; size; p++, size--)
        h = (h ^ *p) * 0x100000001b3ull;
    h ^= h >> 33;
    h *= 0xff51afd7ed558ccdull;
    return h ^ (h >> 33);
}

static constexpr char Magic[8] = {'K', 'N', 'K', 'S', 'L', 'O', '0', '1'};

struct Header {
    char magic[8];
    uint64_t key_size, object_size, checksum;
};

std::string ObjectCache::path(const std::string& key) const {
    char name[40];
    std::snprintf(name, sizeof name, "%016llx%016llx.o",
                  static_cast<unsigned long long>(hash_bytes(key.data(), key.size(), 1)),
                  static_cast<unsigned long long>(hash_bytes(key.data(), key.size(), 2)));
    return (fs::path(m_folder) / name).string();
}

std::optional<std::string> ObjectCache::read(const std::string& key) const {
    const std::string file = path(key);
    std::ifstream in(file, std::ios::binary);
    if (!in)
        return std::nullopt;
    std::ostringstream text;
    text << in.rdbuf();
    std::string all = std::move(text).str();
    Header h;
    if (all.size() < sizeof h)
        return std::nullopt;
    std::memcpy(&h, all.data(), sizeof h);
    if (std::memcmp(h.magic, Magic, sizeof Magic) != 0 || h.key_size != key.size() ||
        h.object_size != all.size() - sizeof h - key.size() || all.compare(sizeof h, key.size(), key) != 0 ||
        h.checksum != hash_bytes(all.data() + sizeof h, all.size() - sizeof h))
        return std::nullopt;
    std::error_code ec;
    fs::last_write_time(file, fs::file_time_type::clock::now(), ec);
    return all.substr(sizeof h + key.size());
}

void ObjectCache::write(const std::string& key, const std::string& object) const {
    std::error_code ec;
    fs::create_directories(m_folder, ec);
    Header h;
    std::memcpy(h.magic, Magic, sizeof Magic);
    h.key_size = key.size();
    h.object_size = object.size();
    const std::string payload = key + object;
    h.checksum = hash_bytes(payload.data(), payload.size());
    // Unique beside other hosts, processes and threads that write the same entry.
    static std::atomic<unsigned> serial{0};
    char host[128] = {};
    gethostname(host, sizeof host - 1);
    const std::string file = path(key);
    const std::string temporary =
        file + "." + host + "." + std::to_string(getpid()) + "." + std::to_string(serial++) + ".tmp";
    {
        std::ofstream out(temporary, std::ios::binary);
        out.write(reinterpret_cast<const char*>(&h), sizeof h);
        out.write(payload.data(), std::streamsize(payload.size()));
        out.flush();
        if (!out) {
            out.close();
            fs::remove(temporary, ec);
            return;
        }
    }
    fs::rename(temporary, file, ec);
    if (ec)
        fs::remove(temporary, ec);
    else if ((h.checksum & 31) == 0) // now and then: reading a folder over a network is slow
        trim(MaxBytes);
}

void ObjectCache::trim(uint64_t max_bytes) const {
    struct Entry {
        fs::file_time_type used;
        uint64_t bytes;
        fs::path path;
    };
    std::vector<Entry> entries;
    uint64_t total = 0;
    std::error_code ec;
    for (fs::directory_iterator it(m_folder, ec), end; !ec && it != end; it.increment(ec)) {
        if (it->path().extension() != ".o" && it->path().extension() != ".tmp")
            continue;
        std::error_code gone;
        const uint64_t bytes = it->file_size(gone);
        const auto used = it->last_write_time(gone);
        if (gone)
            continue;
        entries.push_back({used, bytes, it->path()});
        total += bytes;
    }
    std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) { return a.used < b.used; });
    for (const Entry& e : entries) {
        if (total <= max_bytes)
            break;
        fs::remove(e.path, ec);
        total -= e.bytes;
    }
}

} // namespace kanuka::sl
