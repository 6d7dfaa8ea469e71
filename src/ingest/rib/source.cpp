#include "ingest/rib/source.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <fcntl.h>
#include <immintrin.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

#include "ingest/rib/unpack.h"
#include "ingest/rib/zip.h"

namespace kanuka::ingest {

// A pipe or device, read to its end.
static void read_descriptor(int fd, const std::string& name, Spool& to) {
    std::string chunk(size_t(1) << 20, '\0');
    std::unique_ptr<Unpacker> unpacker;
    size_t total = 0, filled = 0;
    for (bool end = false; !end;) {
        // The first bytes of a pipe may come one by one.
        const ssize_t n = ::read(fd, chunk.data() + filled, chunk.size() - filled);
        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0)
            throw Error(Location{name}, std::string("cannot be read: ") + std::strerror(errno));
        filled += size_t(n);
        end = n == 0;
        if (!end && filled < 4)
            continue;
        const std::string_view bytes(chunk.data(), filled);
        if (total == 0)
            unpacker = find_unpacker(bytes, name);
        total += filled;
        filled = 0;
        if (unpacker)
            unpacker->feed(bytes, to);
        else
            to.append(bytes);
    }
    if (unpacker)
        unpacker->finish();
}

void Source::map(int fd, size_t size) {
    void* mapping = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, fd, 0);
    if (mapping == MAP_FAILED)
        throw Error(Location{m_name}, std::string("cannot be read: ") + std::strerror(errno));
    m_mapping = mapping;
    m_mapped_size = size;
    ::madvise(mapping, size, MADV_SEQUENTIAL);
    m_text = {static_cast<const char*>(mapping), size};
}

void Source::unmap() {
    if (m_mapping)
        ::munmap(m_mapping, m_mapped_size);
    m_mapping = nullptr;
}

void Source::take(Spool& spool) {
    if (spool.file() >= 0) {
        map(spool.file(), spool.size());
    } else {
        m_owned = spool.take_text();
        m_text = m_owned;
    }
}

std::shared_ptr<Source> Source::open_member(const std::string& path, const std::string& zip,
                                            const std::string& member) {
    std::shared_ptr<Source> source(new Source(path));
    Spool spool(path);
    std::unique_ptr<Unpacker> unpacker; // a member may be packed for itself
    bool first = true;
    read_zip(zip, member, [&](std::string_view piece) {
        if (std::exchange(first, false))
            unpacker = find_unpacker(piece, path);
        unpacker ? unpacker->feed(piece, spool) : spool.append(piece);
    });
    if (unpacker)
        unpacker->finish();
    source->take(spool);
    source->find_line_end();
    return source;
}

std::shared_ptr<Source> Source::open(const std::string& path) {
    if (const auto zipped = split_zip(path); zipped && ::access(path.c_str(), F_OK) != 0)
        return open_member(path, zipped->first, zipped->second);
    const bool standard = path == "-";
    std::shared_ptr<Source> source(new Source(standard ? FileName("(standard input)") : FileName(path)));
    struct File {
        int fd;
        bool ours;
        ~File() {
            if (ours && fd >= 0)
                ::close(fd);
        }
    } const file{standard ? STDIN_FILENO : ::open(path.c_str(), O_RDONLY | O_CLOEXEC), !standard};
    if (file.fd < 0)
        throw Error(Location{path}, std::string("cannot be opened: ") + std::strerror(errno));
    struct stat info{};
    if (::fstat(file.fd, &info) != 0 || S_ISDIR(info.st_mode))
        throw Error(Location{path}, "is a folder, not a RIB file");
    Spool spool(source->m_name);
    // Only regular files can be mapped; pipes and devices are read to their end.
    if (!standard && S_ISREG(info.st_mode) && info.st_size > 0) {
        source->map(file.fd, size_t(info.st_size));
        if (const auto unpacker = find_unpacker(source->m_text, path)) {
            // In pieces: what was unpacked leaves memory.
            constexpr size_t Piece = size_t(8) << 20;
            for (size_t at = 0; at < source->m_text.size(); at += Piece) {
                unpacker->feed(source->m_text.substr(at, Piece), spool);
                source->passed(at);
            }
            unpacker->finish();
            source->unmap();
            source->m_released = 0;
            source->take(spool);
        }
    } else {
        read_descriptor(file.fd, source->m_name, spool);
        source->take(spool);
    }
    source->find_line_end();
    return source;
}

// The pages stay in the file: they come back if somebody looks.
void Source::passed(size_t offset) const {
    constexpr size_t Step = size_t(32) << 20;
    if (!m_mapping || offset < m_released + 2 * Step)
        return;
    const size_t to = (offset - Step) / Step * Step;
    ::madvise(static_cast<char*>(m_mapping) + m_released, to - m_released, MADV_DONTNEED);
    m_released = to;
}

std::shared_ptr<Source> Source::from_text(std::string text, FileName name) {
    std::shared_ptr<Source> source(new Source(name));
    source->m_owned = std::move(text);
    source->m_text = source->m_owned;
    source->find_line_end();
    return source;
}

void Source::find_line_end() {
    const std::string_view start = m_text.substr(0, 65536);
    if (start.find('\n') == std::string_view::npos && start.find('\r') != std::string_view::npos)
        m_line_end = '\r';
}

Source::~Source() {
    unmap();
}

// 32 at a time: every byte of a file is looked at for line ends, binary ones too.
static size_t count_bytes(const char* p, size_t size, char wanted) {
    size_t count = 0;
    const __m256i pattern = _mm256_set1_epi8(wanted);
    for (; size >= 32; p += 32, size -= 32) {
        const __m256i bytes = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p));
        count += size_t(std::popcount(unsigned(_mm256_movemask_epi8(_mm256_cmpeq_epi8(bytes, pattern)))));
    }
    for (; size > 0; p++, size--)
        count += *p == wanted;
    return count;
}

// Of fewer than 32 bytes, where 32 can be read.
static size_t count_few_bytes(const char* p, size_t size, char wanted) {
    const __m256i bytes = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p));
    const auto equal = unsigned(_mm256_movemask_epi8(_mm256_cmpeq_epi8(bytes, _mm256_set1_epi8(wanted))));
    return size_t(std::popcount(equal & ((1u << size) - 1)));
}

Location Source::locate(size_t offset) const {
    constexpr size_t Apart = size_t(1) << 16;
    offset = std::min(offset, m_text.size());
    if (offset < m_place.offset) {
        while (!m_places.empty() && m_places.back().offset > offset)
            m_places.pop_back();
        m_place = m_places.empty() ? Place{} : m_places.back();
    } else if (m_place.offset >= (m_places.empty() ? 0 : m_places.back().offset) + Apart) {
        m_places.push_back(m_place);
    }
    const char* const from = m_text.data() + m_place.offset;
    const size_t size = offset - m_place.offset;
    const size_t whole = m_text.size() - offset >= 32 ? size / 32 * 32 : size;
    size_t lines = count_bytes(from, whole, m_line_end);
    if (whole < size)
        lines += count_few_bytes(from + whole, size - whole, m_line_end);
    if (lines > 0) {
        m_place.line += int(lines);
        m_place.line_start =
            size_t(static_cast<const char*>(::memrchr(from, m_line_end, size)) - m_text.data()) + 1;
    }
    m_place.offset = offset;
    return {m_name, m_place.line, int(offset - m_place.line_start) + 1};
}

} // namespace kanuka::ingest
