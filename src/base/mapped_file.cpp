#include "base/mapped_file.h"

#include <algorithm>
#include <array>
#include <linux/magic.h>
#include <sys/mman.h>
#include <sys/statfs.h>

#include "base/paged_memory.h"

namespace kanuka {

MappedFile::MappedFile(int handle, size_t bytes) {
    if (bytes == 0)
        return;
    void* const p = mmap(nullptr, bytes, PROT_READ, MAP_SHARED, handle, 0);
    if (p == MAP_FAILED)
        return;
    m_bytes = {static_cast<std::byte*>(p), bytes};
    paged_memory::adopt(p, bytes);
}

MappedFile::~MappedFile() {
    if (!m_bytes.empty() && !paged_memory::release(m_bytes.data()))
        munmap(m_bytes.data(), m_bytes.size());
}

bool is_on_this_machine(int handle) {
    // Those that are known to be: of others nobody knows.
    constexpr long Zfs = 0x2fc12fc1;
    constexpr std::array<long, 8> Local{
        EXT4_SUPER_MAGIC,      XFS_SUPER_MAGIC, BTRFS_SUPER_MAGIC, F2FS_SUPER_MAGIC, Zfs,
        OVERLAYFS_SUPER_MAGIC, TMPFS_MAGIC,     RAMFS_MAGIC};
    struct statfs of;
    return fstatfs(handle, &of) == 0 && std::ranges::find(Local, long(of.f_type)) != Local.end();
}

} // namespace kanuka
