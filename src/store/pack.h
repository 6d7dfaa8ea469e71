// A pack of the store: a file of pages with an index at its end. Written once, under another name until it is
// whole; read by any number of processes.
//
//   header (64 bytes) │ pages, each at a multiple of 64 bytes │ index: entries, then their texts │ footer (40
//   bytes)
#pragma once

#include <atomic>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "store/disk_store.h"

namespace kanuka::store {

inline constexpr const char *PackSuffix = ".kpack", *UnfinishedSuffix = ".unfinished";
inline constexpr uint32_t PackMagic = 0x4b41504b, PackVersion = 3; // "KPAK"

// Little-endian, as all of it.
struct PackHeader {
    uint32_t magic, version;
    uint64_t build[2]; // digest of build_id()
    uint64_t unused[5];
};
struct PackEntry {
    uint64_t content[2], of_read[2], palette[2]; // StoredPage's
    uint64_t at;                                 // bytes from the file's beginning
    uint32_t words;                              // of the page; 0 = empty
    uint32_t spectra;
    uint32_t reads_size, empty; // reads_size: bytes of its text, which follow those of the entries before it
    uint64_t bytes;             // of the page in the file: fewer than those of its words = compress()
};
struct PackFooter {
    uint32_t magic, version;
    uint64_t index_at, entries, texts_size;
    uint64_t checksum; // xxh3 of header, entries and texts
};
static_assert(sizeof(PackHeader) == 64 && sizeof(PackEntry) == 80 && sizeof(PackFooter) == 40);
inline constexpr uint64_t PageAlignmentOnDisk = 64; // bytes

// Digests as they lie in files.
inline void put(const Digest& digest, uint64_t (&to)[2]) {
    to[0] = digest.high, to[1] = digest.low;
}
inline Digest digest_in(const uint64_t (&from)[2]) {
    return {from[0], from[1]};
}

// Thread safety: read() and touch() may run at the same time.
class PackReader {
  public:
    explicit PackReader(std::string path); // reads its header and index
    ~PackReader();
    PackReader(const PackReader&) = delete;

    const std::string& path() const { return m_path; }
    const char* problem() const { return m_problem; } // null = none; else nothing of it may be used
    bool is_gone() const { return m_handle < 0; }
    const Digest& build() const { return m_build; }
    std::vector<StoredPage> index() { return std::move(m_index); } // once
    bool read(const StoredPage& stored, Page& page) const;         // as it lies there: nothing is checked
    void touch();                                                  // it is of use: once
    // Damage is told once.
    bool is_told() const { return m_is_told; }
    void set_told() { m_is_told = true; }

  private:
    void open();
    bool read(void* to, uint64_t bytes, uint64_t at) const;

    std::string m_path;
    int m_handle = -1;
    uint64_t m_index_at = 0;
    const char* m_problem = nullptr;
    Digest m_build;
    std::vector<StoredPage> m_index;
    std::atomic<bool> m_is_touched{false};
    bool m_is_told = false;
};

class PackWriter {
  public:
    PackWriter(const std::string& folder, const Digest& build);
    ~PackWriter(); // what is not closed is removed

    bool write(const StoredPage& stored, const Page& page, bool compresses = false); // false: problem()
    // The path under which it is found from now on; empty: problem().
    std::string close();
    uint64_t bytes() const { return m_at; }
    const std::string& problem() const { return m_problem; }

  private:
    bool put(const void* data, size_t bytes);
    bool put(const std::vector<char>& data) { return put(data.data(), data.size()); }
    bool fail(const char* doing);

    std::string m_folder, m_path;
    std::FILE* m_file = nullptr;
    uint64_t m_at = 0;
    PackHeader m_header{};
    std::vector<PackEntry> m_entries;
    std::string m_texts, m_problem;
};

} // namespace kanuka::store
