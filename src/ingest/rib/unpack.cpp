#include "ingest/rib/unpack.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <unistd.h>
#include <vector>
#include <zlib.h>
#include <zstd.h>

#include "base/error.h"

namespace kanuka::ingest {

// ---- Spool ------------------------------------------------------------------------------------------

Spool::~Spool() {
    if (m_fd >= 0)
        ::close(m_fd);
}

void Spool::append(std::string_view bytes) {
    m_size += bytes.size();
    if (m_fd >= 0) {
        write_out(bytes);
        return;
    }
    m_text += bytes;
    if (m_text.size() < InMemory)
        return;
    const char* folder = std::getenv("TMPDIR");
    std::string path = std::string(folder && *folder ? folder : "/tmp") + "/kanuka_XXXXXX";
    m_fd = ::mkstemp(path.data());
    if (m_fd < 0)
        throw Error(Location{m_name}, "no room to unpack it: " + path + ": " + std::strerror(errno) +
                                          "; set TMPDIR to a folder with room");
    ::unlink(path.c_str());
    write_out(m_text);
    m_text = {};
}

void Spool::write_out(std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t n = ::write(m_fd, bytes.data(), bytes.size());
        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0)
            throw Error(Location{m_name}, std::string("no room to unpack it: ") + std::strerror(errno) +
                                              "; set TMPDIR to a folder with room");
        bytes.remove_prefix(size_t(n));
    }
}

std::string Spool::take_text() {
    m_text.shrink_to_fit();
    return std::move(m_text);
}

// ---- unpackers --------------------------------------------------------------------------------------

namespace {

constexpr std::string_view GzipMagic = "\x1f\x8b", ZstdMagic = "\x28\xb5\x2f\xfd";

[[noreturn]] void damaged(const std::string& name, const char* format, const std::string& fault) {
    throw Error(Location{name}, "the " + std::string(format) + " data is " +
                                    (fault.empty() ? "cut short" : "damaged (" + fault + ")") +
                                    "; test the file with " + format + " -t");
}

// A file may be several gzip members one after another (as `cat a.gz b.gz` makes): all are inflated. Padding
// after the last member is legal.
class Gunzip final : public Unpacker {
  public:
    explicit Gunzip(std::string name) : m_name(std::move(name)), m_buffer(1 << 18) {
        if (inflateInit2(&m_z, 15 + 16) != Z_OK)
            throw Error(Location{m_name}, "zlib cannot be initialised", ExitCode::Internal);
    }
    ~Gunzip() override { inflateEnd(&m_z); }

    void feed(std::string_view bytes, Spool& to) override {
        while (!bytes.empty() && !m_padding) {
            if (m_between) { // is there one more?
                const size_t known = m_start.size();
                m_start += bytes.substr(0, GzipMagic.size() - known);
                bytes.remove_prefix(m_start.size() - known);
                if (m_start.size() < GzipMagic.size())
                    return;
                m_padding = m_start != GzipMagic;
                if (m_padding)
                    return;
                m_between = false;
                inflateReset(&m_z);
                run(m_start, to);
                m_start.clear();
            }
            const std::string_view chunk = bytes.substr(0, size_t(1) << 30);
            bytes.remove_prefix(run(chunk, to));
        }
    }
    void finish() override {
        if (!m_between)
            damaged(m_name, "gzip", "");
    }

  private:
    size_t run(std::string_view bytes, Spool& to) { // how many were used
        m_z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
        m_z.avail_in = uInt(bytes.size());
        do {
            m_z.next_out = reinterpret_cast<Bytef*>(m_buffer.data());
            m_z.avail_out = uInt(m_buffer.size());
            const int status = inflate(&m_z, Z_NO_FLUSH);
            to.append({m_buffer.data(), m_buffer.size() - m_z.avail_out});
            if (status == Z_STREAM_END) {
                m_between = true;
                break;
            }
            if (status != Z_OK && status != Z_BUF_ERROR)
                damaged(m_name, "gzip", m_z.msg ? m_z.msg : "broken data");
        } while (m_z.avail_in > 0 || m_z.avail_out == 0);
        return bytes.size() - m_z.avail_in;
    }

    std::string m_name;
    std::vector<char> m_buffer;
    z_stream m_z{};
    bool m_between = false, m_padding = false; // members; bytes behind the last
    std::string m_start;                       // of the next member
};

class Unzstd final : public Unpacker {
  public:
    explicit Unzstd(std::string name)
        : m_name(std::move(name)), m_buffer(ZSTD_DStreamOutSize()), m_stream(ZSTD_createDStream()) {
        if (!m_stream)
            throw Error(Location{m_name}, "zstd cannot be initialised", ExitCode::Internal);
    }
    ~Unzstd() override { ZSTD_freeDStream(m_stream); }

    void feed(std::string_view bytes, Spool& to) override {
        if (bytes.empty()) // asks for what comes after the end
            return;
        ZSTD_inBuffer in{bytes.data(), bytes.size(), 0};
        ZSTD_outBuffer out{m_buffer.data(), m_buffer.size(), 0};
        do {
            out.pos = 0;
            m_left = ZSTD_decompressStream(m_stream, &out, &in);
            if (ZSTD_isError(m_left))
                damaged(m_name, "zstd", ZSTD_getErrorName(m_left));
            to.append({m_buffer.data(), out.pos});
        } while (in.pos < in.size || (out.pos == out.size && m_left != 0));
    }
    void finish() override {
        if (m_left != 0)
            damaged(m_name, "zstd", "");
    }

  private:
    std::string m_name;
    std::vector<char> m_buffer;
    ZSTD_DStream* m_stream;
    size_t m_left = 1;
};

} // namespace

std::unique_ptr<Unpacker> find_unpacker(std::string_view start, const std::string& name) {
    if (start.starts_with(GzipMagic))
        return std::make_unique<Gunzip>(name);
    if (start.starts_with(ZstdMagic))
        return std::make_unique<Unzstd>(name);
    return nullptr;
}

} // namespace kanuka::ingest
