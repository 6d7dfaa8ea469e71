#include "ingest/rib/zip.h"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <vector>
#include <zlib.h>

#include "base/error.h"

namespace kanuka::ingest {

namespace {

// PKWARE, APPNOTE.TXT 6.3, sections 4.3.7 (local header), 4.3.12 (central directory), 4.3.16 (its end).
constexpr std::string_view LocalMagic = "PK\3\4", EntryMagic = "PK\1\2", EndMagic = "PK\5\6";
constexpr size_t LocalSize = 30, EntrySize = 46, EndSize = 22, LongestComment = 65535;

class Mapped {
  public:
    explicit Mapped(const std::string& path) {
        const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
        struct stat info{};
        if (fd < 0 || ::fstat(fd, &info) != 0 || !S_ISREG(info.st_mode)) {
            const std::string why = fd < 0 ? std::strerror(errno) : "it is no file";
            if (fd >= 0)
                ::close(fd);
            throw Error(Location{path}, "cannot be opened: " + why);
        }
        m_size = size_t(info.st_size);
        m_data = m_size > 0 ? ::mmap(nullptr, m_size, PROT_READ, MAP_PRIVATE, fd, 0) : nullptr;
        ::close(fd);
        if (m_data == MAP_FAILED) {
            m_data = nullptr;
            throw Error(Location{path}, std::string("cannot be read: ") + std::strerror(errno));
        }
    }
    ~Mapped() {
        if (m_data)
            ::munmap(m_data, m_size);
    }
    Mapped(const Mapped&) = delete;
    Mapped& operator=(const Mapped&) = delete;
    std::string_view bytes() const { return {static_cast<const char*>(m_data), m_data ? m_size : 0}; }

  private:
    void* m_data = nullptr;
    size_t m_size = 0;
};

uint32_t number(std::string_view bytes, size_t at, size_t count) { // little-endian; within `bytes`
    uint32_t n = 0;
    for (size_t i = 0; i < count; i++)
        n |= uint32_t(static_cast<unsigned char>(bytes[at + i])) << (8 * i);
    return n;
}

struct Member {
    uint32_t flags, method, crc, packed, size, offset;
};

// "./a//b" is "a/b"; some writers have backslashes.
std::string plain(std::string_view name) {
    std::string out;
    for (char c : name) {
        c = c == '\\' ? '/' : c;
        if (c != '/' || (!out.empty() && out.back() != '/'))
            out += c;
        if (out == "./")
            out.clear();
    }
    return out;
}

// By the central directory, which lies before its end at the end of the file. What is wrong goes into
// `fault`.
std::optional<Member> find(std::string_view zip, std::string_view member, std::string& fault) {
    const size_t from = zip.size() > EndSize + LongestComment ? zip.size() - EndSize - LongestComment : 0;
    const size_t in_tail = zip.size() < EndSize ? std::string_view::npos : zip.substr(from).rfind(EndMagic);
    if (in_tail == std::string_view::npos || zip.size() - from - in_tail < EndSize) {
        fault = "it is no zip file, or its end is missing";
        return std::nullopt;
    }
    const std::string_view end = zip.substr(from + in_tail);
    size_t at = number(end, 16, 4);
    const uint32_t count = number(end, 10, 2);
    if (at == 0xffffffff || count == 0xffff) {
        fault = "zip files of more than 4 GiB or 65534 members are not read; unpack it";
        return std::nullopt;
    }
    const std::string wanted = plain(member);
    for (uint32_t k = 0; k < count; k++) {
        if (at > zip.size() || zip.size() - at < EntrySize || !zip.substr(at).starts_with(EntryMagic)) {
            fault = "its directory is damaged; test it with unzip -t";
            return std::nullopt;
        }
        const std::string_view entry = zip.substr(at);
        const size_t name_size = number(entry, 28, 2);
        const size_t next = EntrySize + name_size + number(entry, 30, 2) + number(entry, 32, 2);
        if (name_size <= entry.size() - EntrySize && plain(entry.substr(EntrySize, name_size)) == wanted)
            return Member{number(entry, 8, 2),  number(entry, 10, 2), number(entry, 16, 4),
                          number(entry, 20, 4), number(entry, 24, 4), number(entry, 42, 4)};
        at += next;
    }
    fault = "it has no member \"" + std::string(member) + "\"";
    return std::nullopt;
}

} // namespace

std::optional<std::pair<std::string, std::string>> split_zip(const std::string& name) {
    constexpr std::string_view Mark = ".zip!";
    const size_t at = name.find(Mark);
    if (at == std::string::npos || at + Mark.size() == name.size())
        return std::nullopt;
    return std::pair{name.substr(0, at + Mark.size() - 1), name.substr(at + Mark.size())};
}

bool zip_has(const std::string& zip, std::string_view member) {
    try {
        const Mapped file(zip);
        std::string fault;
        return find(file.bytes(), member, fault).has_value();
    } catch (const Error&) {
        return false;
    }
}

void read_zip(const std::string& zip, const std::string& member,
              const std::function<void(std::string_view)>& piece) {
    const Mapped file(zip);
    const std::string_view bytes = file.bytes();
    const auto fail = [&](const std::string& why) { throw Error(Location{zip}, why); };
    std::string fault;
    const auto found = find(bytes, member, fault);
    if (!found)
        fail(fault);
    // The local header has a name and extra fields of its own before the data.
    const size_t at = found->offset;
    if (at > bytes.size() || bytes.size() - at < LocalSize || !bytes.substr(at).starts_with(LocalMagic))
        fail("the place of \"" + member + "\" is damaged; test it with unzip -t");
    const size_t begin = LocalSize + number(bytes, at + 26, 2) + number(bytes, at + 28, 2);
    if (begin > bytes.size() - at || found->packed > bytes.size() - at - begin)
        fail("\"" + member + "\" is cut short; test it with unzip -t");
    if (found->flags & 1)
        fail("\"" + member + "\" is encrypted; unpack it");
    const std::string_view packed = bytes.substr(at + begin, found->packed);
    uLong crc = crc32(0, nullptr, 0);
    size_t total = 0;
    const auto pass = [&](std::string_view some) {
        total += some.size();
        if (total > found->size)
            fail("\"" + member + "\" is longer than the directory says; test it with unzip -t");
        crc = crc32_z(crc, reinterpret_cast<const Bytef*>(some.data()), some.size());
        piece(some);
    };
    if (found->method == 0) {
        pass(packed);
    } else if (found->method == 8) {
        struct Stream {
            z_stream z{};
            ~Stream() { inflateEnd(&z); }
        } stream;
        if (inflateInit2(&stream.z, -15) != Z_OK)
            throw Error(Location{zip}, "zlib cannot be initialised", ExitCode::Internal);
        std::vector<char> buffer(1 << 18);
        stream.z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
        stream.z.avail_in = uInt(packed.size());
        int status = Z_OK;
        while (status == Z_OK) {
            stream.z.next_out = reinterpret_cast<Bytef*>(buffer.data());
            stream.z.avail_out = uInt(buffer.size());
            status = inflate(&stream.z, Z_NO_FLUSH);
            pass({buffer.data(), buffer.size() - stream.z.avail_out});
        }
        if (status != Z_STREAM_END)
            fail("\"" + member + "\" is damaged (" + (stream.z.msg ? stream.z.msg : "cut short") +
                 "); test it with unzip -t");
    } else {
        fail("\"" + member + "\" is packed by method " + std::to_string(found->method) +
             "; stored and deflated members are read. Pack it by zip, or unpack it");
    }
    if (total != found->size || crc != found->crc)
        fail("\"" + member + "\" is damaged (its checksum differs); test it with unzip -t");
}

} // namespace kanuka::ingest
