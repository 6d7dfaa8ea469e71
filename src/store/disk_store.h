// Pages on disk, so that nothing is diced or shaded twice: not by the next render, the next frame, nor
// another host. A folder of packs, each with an index; what a pack's name is, what it holds and who wrote it
// are told by itself, so any number of renders may share the folder without locks. docs/store.md has the
// format.
//
// The folder is a cache: what is missing, damaged or of another build of Kanuka is made again.
#pragma once

#include <atomic>
#include <cstdio>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "base/background.h"
#include "base/digest.h"
#include "base/error.h"
#include "base/progress.h"
#include "store/store.h"

namespace kanuka::store {

// What the index says of a page.
struct StoredPage {
    Digest content;    // what it was made of, but for
    Digest of_read;    // the values of what its shaders read of where it stands,
    std::string reads; // which is told here, in the writer's words
    Digest palette;    // the measured spectra that it may name by number, and how many of them there were
    uint32_t spectra = 0;
    bool empty = false; // nothing came of it

    // Where it lies.
    uint32_t pack = 0, words = 0;
    uint64_t at = 0, bytes = 0;
    bool is_compressed() const { return bytes < uint64_t(words) * 4; }
};

class PackReader;
class PackWriter;

// Thread safety: find() and read() may run at the same time, the others alone. Nobody waits for the disk but
// close(): files are written by a thread of the store's own, in the order in which they were asked for, so
// packs are the same on every host.
class DiskStore {
  public:
    static constexpr uint64_t DefaultBytes = uint64_t(20) << 30;
    struct Settings {
        std::string folder;
        bool writes = true;
        uint64_t most_bytes = DefaultBytes;        // of the folder: packs that were not used for longest go
        uint64_t pack_bytes = uint64_t(256) << 20; // a larger one is closed, so that a crash loses no more
        std::string build;                         // empty = this one: build_id()
    };

    // Never throws: what cannot be used is told, and the store is empty then.
    DiskStore(Settings settings, Journal& journal);
    ~DiskStore();
    DiskStore(const DiskStore&) = delete;
    const Settings& settings() const { return m_settings; }

    std::span<const StoredPage> find(const Digest& content) const;
    // False: it is damaged, or gone. `program`: that the page must be of.
    bool read(const StoredPage& stored, const grid::LayeringProgram& program, Page& page);
    // The page is held until it is written, in the background. After a failure, which is told once, nothing
    // is written any more.
    void write(const StoredPage& stored, std::shared_ptr<const Page> page);
    // Ends the pack that is being written, in the background: others see it soon.
    void end_pack();
    // Ends the pack and waits until all is written: find() sees it from now on. Failures are told.
    void close();

    // Of pages of the hierarchy, which have files of their own beside the packs (hierarchy_files.h).
    void tell_of_damaged_hierarchy(const std::string& path, const std::string& fault);
    // Writes another file in the background: `job` returns what went wrong, or nothing. What it reads stays
    // as it is until close().
    void write_file(std::function<std::string()> job);
    bool has_failed() const { return m_failed; }

    uint64_t bytes_read() const { return m_bytes_read; }
    uint64_t bytes_written() const { return m_bytes_written; }

  private:
    // More would have to wait in memory for a slow disk.
    static constexpr uint64_t MostWaiting = uint64_t(64) << 20;

    void add_pack(const std::string& path);
    void add_ended_packs();
    void tell_of_damage(PackReader& pack, const char* fault);
    // Nothing is written any more.
    void fail(const std::string& what);
    void tell_of_failure();
    // What the thread in the background does.
    void write_now(const StoredPage& stored, const Page& page);
    void end_pack_now();

    Settings m_settings;
    Journal& m_journal;
    std::vector<std::unique_ptr<PackReader>> m_packs;
    std::vector<StoredPage> m_pages; // by content
    uint64_t m_bytes_written = 0;
    bool m_has_told = false; // of a failure
    std::atomic<uint64_t> m_bytes_read{0};
    std::atomic<bool> m_failed = false;
    std::mutex m_mutex; // of damage that is told and removed, and of these:
    std::string m_failure;
    std::vector<std::string> m_ended; // packs that are written, and not read yet
    // Of the thread in the background, which ends first.
    std::unique_ptr<PackWriter> m_writer;
    Background m_background{MostWaiting};
};

// ---- folders, for those who keep them

struct PackInfo {
    std::string file;
    bool is_hierarchy = false; // a page of the ray tracer, which is no pack
    uint64_t bytes = 0, pages = 0, compressed_pages = 0;
    double age_s = 0; // since it was used last
    bool of_this_build = false;
    std::string problem; // empty = none that was looked for
};
// Packs and pages of the hierarchy in a folder, what was used last first. verify: every page is read. Throws
// Error where there is no such folder.
std::vector<PackInfo> packs_in(const std::string& folder, bool verify);
// Deletes files that were not used for longest until no more than so many bytes are left, and what
// interrupted renders left behind a day ago; returns how many. 0 = all.
uint64_t trim_store(const std::string& folder, uint64_t most_bytes);

// Writes packs of this build anew that were not used for so long, their pages compressed, and removes what
// they were. Others may read meanwhile. Throws Error where there is no such folder, or it cannot be written;
// what is damaged stays as it is. Cancelled, it ends after the pack that it is at.
struct Compression {
    uint64_t packs = 0, bytes_before = 0, bytes_after = 0;
};
Compression compress_store(const std::string& folder, double idle_s, const Progress& progress = {});

// What KANUKA_STORE, KANUKA_STORE_MODE (read or write) and KANUKA_STORE_SIZE (as 20G) say; an empty folder =
// no store. Throws Error where they cannot be read.
DiskStore::Settings store_settings_of_environment();

} // namespace kanuka::store
