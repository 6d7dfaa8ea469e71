#define XXH_INLINE_ALL
#include "store/hierarchy_files.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include "base/build_id.h"
#include "base/cache_folder.h"
#include "base/tasks.h"
#include "store/pack.h"

namespace kanuka::store {

namespace {

constexpr size_t ReadBytes = size_t(16) << 20; // a task

class Handle {
  public:
    explicit Handle(int handle) : m_handle(handle) {}
    ~Handle() {
        if (m_handle >= 0)
            ::close(m_handle);
    }
    Handle(const Handle&) = delete;
    int get() const { return m_handle; }

    bool read(void* to, uint64_t bytes, uint64_t at) const {
        char* place = static_cast<char*>(to);
        while (bytes > 0) {
            const ssize_t n = ::pread(m_handle, place, bytes, off_t(at));
            if (n < 0 && errno == EINTR)
                continue;
            if (n <= 0)
                return false;
            place += n, at += uint64_t(n), bytes -= uint64_t(n);
        }
        return true;
    }
    bool write(const void* from, uint64_t bytes) const {
        const char* place = static_cast<const char*>(from);
        while (bytes > 0) {
            const ssize_t n = ::write(m_handle, place, bytes);
            if (n < 0 && errno == EINTR)
                continue;
            if (n < 0)
                return false;
            place += n, bytes -= uint64_t(n);
        }
        return true;
    }
    bool close() { // a full disk may show only here
        return ::close(std::exchange(m_handle, -1)) == 0;
    }

  private:
    int m_handle;
};

uint64_t checksum_of_header(const HierarchyFileHeader& header) {
    return XXH3_64bits(&header, offsetof(HierarchyFileHeader, checksum));
}
bool are_steps(const HierarchyFileHeader& h) {
    return std::ranges::all_of(std::array{h.grids, h.meshes, h.fibres}, [](int32_t exponent) {
        return exponent >= hierarchy::Lattice::LeastExponent && exponent <= hierarchy::Lattice::MostExponent;
    });
}

std::string read_header(const Handle& file, HierarchyFileHeader& header) {
    struct stat about;
    if (fstat(file.get(), &about) != 0 || !S_ISREG(about.st_mode))
        return "it is no file";
    if (!file.read(&header, sizeof header, 0))
        return "it ends early";
    if (header.magic != HierarchyFileMagic)
        return "it is no page of a hierarchy";
    if (header.version != HierarchyFileVersion)
        return "it is of another version";
    if (header.checksum != checksum_of_header(header))
        return "the checksum of its header does not match";
    if (uint64_t(about.st_size) != sizeof header + header.bytes || header.bytes < sizeof(hierarchy::Header))
        return "it ends early";
    return are_steps(header) ? "" : "its lattice has no step";
}

// Mapped where others cannot take it away; else, and where that fails, a copy.
std::optional<hierarchy::PageMemory> memory_of(const Handle& file, const HierarchyFileHeader& header,
                                               bool maps) {
    if (maps && is_on_this_machine(file.get()))
        if (MappedFile mapped(file.get(), sizeof header + header.bytes); !mapped.empty())
            return hierarchy::PageMemory(std::move(mapped), sizeof header);
    hierarchy::PageMemory copy(header.bytes);
    std::atomic<bool> whole = true;
    tasks::parallel_chunks(header.bytes, ReadBytes, [&](size_t begin, size_t end) {
        if (!file.read(copy.data() + begin, end - begin, sizeof header + begin))
            whole = false;
    });
    return whole ? std::optional(std::move(copy)) : std::nullopt;
}

// Nothing is read but what lies in the page, whatever the bytes are: so both may go at once.
std::string page_refusal_of(std::span<const std::byte> page) {
    std::string refused;
    bool matches = true;
    tasks::parallel_for(2, [&](size_t i) {
        if (i == 0)
            refused = hierarchy::structural_refusal_of(page);
        else
            matches = hierarchy::checksum_of(page) == hierarchy::Page(page.data()).header().checksum;
    });
    return !matches ? "its checksum does not match" : refused;
}

std::string open_page(const Handle& file, HierarchyFileHeader& header, hierarchy::PageMemory& page,
                      bool maps = true) {
    if (std::string refused = read_header(file, header); !refused.empty())
        return refused;
    auto memory = memory_of(file, header, maps);
    if (!memory)
        return "it ends early";
    page = std::move(*memory);
    if (page.page().header().bytes != header.bytes)
        return "it ends early";
    return page_refusal_of(page.bytes());
}

} // namespace

std::string HierarchyFiles::path_of(const Digest& content) const {
    const DiskStore::Settings& s = m_disk.settings();
    return s.folder + "/" + digest_of(s.build, HierarchyFileVersion, content).text() + HierarchySuffix;
}

bool HierarchyFiles::is_worth_files(uint64_t bytes) const {
    return bytes >= m_how.least_bytes && bytes <= m_disk.settings().most_bytes / 2;
}

std::optional<HierarchyFiles::Found> HierarchyFiles::find(const Digest& content,
                                                          const hierarchy::ContentSize& size) {
    const std::string path = path_of(content);
    const Handle file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
    if (file.get() < 0)
        return {};
    HierarchyFileHeader header;
    Found found;
    std::string refused = open_page(file, header, found.page, m_how.maps);
    if (refused.empty() && (digest_in(header.build) != digest_of(m_disk.settings().build) ||
                            digest_in(header.content) != content))
        refused = "it is another page";
    if (refused.empty())
        refused = hierarchy::names_refusal_of(found.page.page(), size);
    if (!refused.empty()) {
        m_disk.tell_of_damaged_hierarchy(path, refused);
        return {};
    }
    found.lattices = {{header.grids}, {header.meshes}, {{header.fibres}, header.least_radius}};
    if (m_disk.settings().writes)
        note_use(path);
    return found;
}

void HierarchyFiles::keep(const Digest& content, const hierarchy::PageMemory& page,
                          const hierarchy::Lattices& lattices) {
    const DiskStore::Settings& s = m_disk.settings();
    if (!s.writes || !m_how.writes || m_disk.has_failed())
        return;
    HierarchyFileHeader header{};
    header.magic = HierarchyFileMagic, header.version = HierarchyFileVersion;
    put(digest_of(s.build), header.build);
    put(content, header.content);
    header.grids = lattices.grids.exponent, header.meshes = lattices.meshes.exponent;
    header.fibres = lattices.fibres.places.exponent, header.least_radius = lattices.fibres.least_radius;
    header.bytes = page.size();
    header.checksum = checksum_of_header(header);

    m_disk.write_file([header, page = page.bytes(), held = page.hold(), path = path_of(content)] {
        const std::string unfinished = unfinished_name(path, UnfinishedSuffix);
        Handle file(::open(unfinished.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644));
        if (file.get() >= 0 && file.write(&header, sizeof header) && file.write(page.data(), page.size()) &&
            file.close() && ::rename(unfinished.c_str(), path.c_str()) == 0)
            return std::string();
        const int why = errno;
        ::unlink(unfinished.c_str());
        return std::string("a page of the hierarchy: ") + std::strerror(why);
    });
}

PackInfo hierarchy_file_info(const std::string& path, bool verify) {
    PackInfo info{.file = path, .is_hierarchy = true};
    const Handle file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
    if (file.get() < 0) {
        info.problem = "it cannot be opened";
        return info;
    }
    HierarchyFileHeader header{};
    hierarchy::PageMemory page;
    info.problem = verify ? open_page(file, header, page) : read_header(file, header);
    info.pages = 1;
    info.of_this_build = digest_in(header.build) == digest_of(build_id());
    return info;
}

} // namespace kanuka::store
