#include "ingest/rib/source.h"

#include <algorithm>
#include <cstring>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

namespace kanuka::ingest {

static std::string read_descriptor(int fd, const std::string& name) {
    std::string all;
    size_t used = 0;
    for (;;) {
        if (all.size() - used < 65536)
            all.resize(std::max<size_t>(all.size() * 2, size_t(1) << 20));
        const ssize_t n = ::read(fd, all.data() + used, all.size() - used);
        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0)
            throw Error(Location{name}, std::string("cannot be read: ") + std::strerror(errno));
        if (n == 0)
            break;
        used += size_t(n);
    }
    all.resize(used);
    return all;
}

// A file may be several gzip members one after another (as `cat a.gz b.gz` makes): all are inflated.
static std::string inflate_gzip(std::string_view packed, const std::string& name) {
    std::string out;
    size_t used = 0;
    z_stream z{};
    if (inflateInit2(&z, 15 + 16) != Z_OK)
        throw Error(Location{name}, "zlib cannot be initialised", ExitCode::Internal);
    const auto* next = reinterpret_cast<const Bytef*>(packed.data());
    size_t left = packed.size();
    int status = Z_OK;
    std::string fault;
    while (left > 0 || z.avail_in > 0) {
        if (z.avail_in == 0) {
            z.next_in = const_cast<Bytef*>(next);
            z.avail_in = uInt(std::min<size_t>(left, size_t(1) << 30));
            next += z.avail_in;
            left -= z.avail_in;
        }
        if (out.size() - used < 65536)
            out.resize(std::max<size_t>(out.size() * 2, packed.size() * 4 + 65536));
        z.next_out = reinterpret_cast<Bytef*>(out.data() + used);
        const size_t room = std::min<size_t>(out.size() - used, size_t(1) << 30);
        z.avail_out = uInt(room);
        status = inflate(&z, Z_NO_FLUSH);
        used += room - z.avail_out;
        if (status == Z_STREAM_END) {
            const bool more = z.avail_in >= 2 && z.next_in[0] == 0x1f && z.next_in[1] == 0x8b;
            if (!more)
                break; // padding after the last member is legal
            inflateReset(&z);
        } else if (status != Z_OK && status != Z_BUF_ERROR) {
            fault = z.msg ? z.msg : "broken data";
            break;
        } else if (status == Z_BUF_ERROR && left == 0 && z.avail_in == 0) {
            break;
        }
    }
    inflateEnd(&z);
    if (status != Z_STREAM_END)
        throw Error(Location{name}, "the gzip data is " +
                                        (fault.empty() ? "cut short" : "damaged (" + fault + ")") +
                                        "; test the file with gzip -t");
    out.resize(used);
    return out;
}

static bool is_gzip(std::string_view bytes) {
    return bytes.size() >= 2 && bytes[0] == '\x1f' && bytes[1] == '\x8b';
}

std::shared_ptr<Source> Source::open(const std::string& path) {
    if (path == "-") {
        std::shared_ptr<Source> source(new Source("(standard input)"));
        source->m_owned = read_descriptor(STDIN_FILENO, source->m_name);
        if (is_gzip(source->m_owned))
            source->m_owned = inflate_gzip(source->m_owned, source->m_name);
        source->m_text = source->m_owned;
        source->find_line_end();
        return source;
    }
    std::shared_ptr<Source> source(new Source(path));
    const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        throw Error(Location{path}, std::string("cannot be opened: ") + std::strerror(errno));
    struct Close {
        int fd;
        ~Close() { ::close(fd); }
    } close{fd};
    struct stat info{};
    if (::fstat(fd, &info) != 0 || S_ISDIR(info.st_mode))
        throw Error(Location{path}, "is a folder, not a RIB file");
    // Only regular files can be mapped; pipes and devices are read to their end.
    if (S_ISREG(info.st_mode) && info.st_size > 0) {
        void* mapping = ::mmap(nullptr, size_t(info.st_size), PROT_READ, MAP_PRIVATE, fd, 0);
        if (mapping != MAP_FAILED) {
            source->m_mapping = mapping;
            source->m_mapped_size = size_t(info.st_size);
            ::madvise(mapping, source->m_mapped_size, MADV_SEQUENTIAL);
            source->m_text = {static_cast<const char*>(mapping), source->m_mapped_size};
        }
    }
    if (!source->m_mapping) {
        source->m_owned = read_descriptor(fd, path);
        source->m_text = source->m_owned;
    }
    if (is_gzip(source->m_text)) {
        source->m_owned = inflate_gzip(source->m_text, path);
        source->m_text = source->m_owned;
    }
    source->find_line_end();
    return source;
}

std::shared_ptr<Source> Source::from_text(std::string text, std::string name) {
    std::shared_ptr<Source> source(new Source(std::move(name)));
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
    if (m_mapping)
        ::munmap(m_mapping, m_mapped_size);
}

Location Source::locate(size_t offset) const {
    offset = std::min(offset, m_text.size());
    if (offset < m_checkpoint) {
        m_checkpoint = 0;
        m_line = 1;
    }
    m_line += int(std::count(m_text.data() + m_checkpoint, m_text.data() + offset, m_line_end));
    m_checkpoint = offset;
    const size_t newline = offset == 0 ? std::string_view::npos : m_text.rfind(m_line_end, offset - 1);
    const size_t start = newline == std::string_view::npos ? 0 : newline + 1;
    return {m_name, m_line, int(offset - start) + 1};
}

} // namespace kanuka::ingest
