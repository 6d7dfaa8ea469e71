#include "ingest/rib/output.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <unistd.h>
#include <vector>
#include <zlib.h>
#include <zstd.h>

#include "base/error.h"

namespace kanuka::ingest {

namespace {

[[noreturn]] void cannot_write(const std::string& path, const std::string& why) {
    throw Error(Location{path}, "cannot be written: " + why, ExitCode::Output);
}

class ToString final : public Output {
  public:
    explicit ToString(std::string& text) : m_text(text) {}
    void write(std::string_view bytes) override { m_text += bytes; }
    void finish() override {}

  private:
    std::string& m_text;
};

// Written beside the target and renamed at the end: a reader never sees half of it.
class ToFile final : public Output {
  public:
    explicit ToFile(std::string path) : m_path(std::move(path)), m_standard(m_path == "-") {
        if (m_standard) {
            m_fd = STDOUT_FILENO;
            return;
        }
        m_partial = m_path + ".part";
        m_fd = ::open(m_partial.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
        if (m_fd < 0)
            cannot_write(m_path, std::strerror(errno));
    }
    ~ToFile() override {
        if (m_standard || m_fd < 0)
            return;
        ::close(m_fd);
        ::unlink(m_partial.c_str());
    }
    void write(std::string_view bytes) override {
        while (!bytes.empty()) {
            const ssize_t n = ::write(m_fd, bytes.data(), bytes.size());
            if (n < 0 && errno == EINTR)
                continue;
            if (n < 0)
                cannot_write(m_path, std::strerror(errno));
            bytes.remove_prefix(size_t(n));
        }
    }
    void finish() override {
        if (m_standard)
            return;
        const bool closed = ::close(m_fd) == 0;
        m_fd = -1;
        if (!closed || ::rename(m_partial.c_str(), m_path.c_str()) != 0) {
            const std::string why = std::strerror(errno);
            ::unlink(m_partial.c_str());
            cannot_write(m_path, why);
        }
    }

  private:
    std::string m_path, m_partial;
    bool m_standard;
    int m_fd = -1;
};

class Gzip final : public Output {
  public:
    explicit Gzip(std::unique_ptr<Output> to) : m_to(std::move(to)), m_buffer(1 << 16) {
        if (deflateInit2(&m_z, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK)
            throw Error("zlib cannot be initialised", ExitCode::Internal);
    }
    ~Gzip() override { deflateEnd(&m_z); }
    void write(std::string_view bytes) override { // buffers of ours are far below the 4 GB of zlib's counters
        m_z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
        m_z.avail_in = uInt(bytes.size());
        while (m_z.avail_in > 0)
            pump(Z_NO_FLUSH);
    }
    void finish() override {
        while (pump(Z_FINISH) != Z_STREAM_END)
            ;
        m_to->finish();
    }

  private:
    int pump(int flush) {
        m_z.next_out = reinterpret_cast<Bytef*>(m_buffer.data());
        m_z.avail_out = uInt(m_buffer.size());
        const int status = deflate(&m_z, flush);
        m_to->write({m_buffer.data(), m_buffer.size() - m_z.avail_out});
        return status;
    }
    std::unique_ptr<Output> m_to;
    std::vector<char> m_buffer;
    z_stream m_z{};
};

class Zstd final : public Output {
  public:
    explicit Zstd(std::unique_ptr<Output> to)
        : m_to(std::move(to)), m_buffer(ZSTD_CStreamOutSize()), m_stream(ZSTD_createCStream()) {
        if (!m_stream)
            throw Error("zstd cannot be initialised", ExitCode::Internal);
    }
    ~Zstd() override { ZSTD_freeCStream(m_stream); }
    void write(std::string_view bytes) override {
        ZSTD_inBuffer in{bytes.data(), bytes.size(), 0};
        while (in.pos < in.size)
            pump(in, ZSTD_e_continue);
    }
    void finish() override {
        ZSTD_inBuffer in{nullptr, 0, 0};
        while (pump(in, ZSTD_e_end) != 0)
            ;
        m_to->finish();
    }

  private:
    size_t pump(ZSTD_inBuffer& in, ZSTD_EndDirective directive) {
        ZSTD_outBuffer out{m_buffer.data(), m_buffer.size(), 0};
        const size_t left = ZSTD_compressStream2(m_stream, &out, &in, directive);
        if (ZSTD_isError(left))
            throw Error(std::string("zstd: ") + ZSTD_getErrorName(left), ExitCode::Internal);
        m_to->write({m_buffer.data(), out.pos});
        return left;
    }
    std::unique_ptr<Output> m_to;
    std::vector<char> m_buffer;
    ZSTD_CStream* m_stream;
};

} // namespace

Packing packing_by_name(std::string_view path) {
    return path.ends_with(".gz") ? Packing::Gzip : path.ends_with(".zst") ? Packing::Zstd : Packing::None;
}

std::unique_ptr<Output> open_output(const std::string& path, Packing packing) {
    std::unique_ptr<Output> file = std::make_unique<ToFile>(path);
    if (packing == Packing::Gzip)
        return std::make_unique<Gzip>(std::move(file));
    if (packing == Packing::Zstd)
        return std::make_unique<Zstd>(std::move(file));
    return file;
}

std::unique_ptr<Output> output_to(std::string& text) {
    return std::make_unique<ToString>(text);
}

} // namespace kanuka::ingest
