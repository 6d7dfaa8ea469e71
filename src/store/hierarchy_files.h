// Pages of the ray tracer in the store's folder, a file each, which is mapped and traced as it lies there:
// what is not there is built, and written. docs/store.md has the format.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/digest.h"
#include "hierarchy/content.h"
#include "store/disk_store.h"

namespace kanuka::store {

inline constexpr const char* HierarchySuffix = ".khierarchy";
inline constexpr uint32_t HierarchyFileMagic = 0x4650484b, HierarchyFileVersion = 1; // "KHPF"

// Little-endian. The page follows.
struct HierarchyFileHeader {
    uint32_t magic, version;
    uint64_t build[2]; // digest of build_id()
    uint64_t content[2];
    int32_t grids, meshes, fibres; // steps of the lattices that its vertices stand on
    uint32_t least_radius;
    uint64_t bytes; // of the page
    uint64_t unused[7];
    uint64_t checksum; // xxh3 of all before; the page has its own
};
static_assert(sizeof(HierarchyFileHeader) == 128);

// One thread at a time; what is found may outlive it.
class HierarchyFiles {
  public:
    struct How {
        bool writes = true; // where the store may be written
        // For tests.
        bool maps = true;                         // false: as where the folder lies on another machine
        uint64_t least_bytes = uint64_t(1) << 20; // of a group: less is built in two milliseconds
    };
    explicit HierarchyFiles(DiskStore& disk) : HierarchyFiles(disk, How()) {}
    HierarchyFiles(DiskStore& disk, How how) : m_disk(disk), m_how(how) {}

    struct Found {
        hierarchy::PageMemory page;
        hierarchy::Lattices lattices;
    };
    // None: it is not there, or it is refused, which is told.
    std::optional<Found> find(const Digest& content, const hierarchy::ContentSize& size);
    // Are pages of a group of so many bytes kept? More would leave no room for others.
    bool is_worth_files(uint64_t bytes) const;
    // Written in the background; its bytes are held as long as that takes.
    void keep(const Digest& content, const hierarchy::PageMemory& page, const hierarchy::Lattices& lattices);

  private:
    std::string path_of(const Digest& content) const;

    DiskStore& m_disk;
    How m_how;
};

// Of a file in a folder, for who keeps that; verify: all of it is read.
PackInfo hierarchy_file_info(const std::string& path, bool verify);

} // namespace kanuka::store
