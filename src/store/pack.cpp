#include "store/pack.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>
#define XXH_INLINE_ALL // no library is needed where this runs
#include <xxhash.h>

#include "store/compress.h"
#include "store/page_check.h"

namespace kanuka::store {

namespace {

uint64_t checksum_of(const PackHeader& header, const std::vector<PackEntry>& entries,
                     const std::string& texts) {
    uint64_t sum = XXH3_64bits(&header, sizeof header);
    sum = XXH3_64bits_withSeed(entries.data(), entries.size() * sizeof(PackEntry), sum);
    return XXH3_64bits_withSeed(texts.data(), texts.size(), sum);
}

} // namespace

// ---- reading

PackReader::PackReader(std::string path) : m_path(std::move(path)) {
    m_handle = ::open(m_path.c_str(), O_RDONLY | O_CLOEXEC);
    if (m_handle < 0)
        m_problem = "it cannot be opened";
    else
        open();
}

PackReader::~PackReader() {
    if (m_handle >= 0)
        ::close(m_handle);
}

bool PackReader::read(void* to, uint64_t bytes, uint64_t at) const {
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

void PackReader::open() {
    struct stat about;
    PackHeader header;
    PackFooter footer;
    if (fstat(m_handle, &about) != 0 || !S_ISREG(about.st_mode)) {
        m_problem = "it is no file";
        return;
    }
    const uint64_t size = uint64_t(about.st_size);
    if (size < sizeof header + sizeof footer || !read(&header, sizeof header, 0) ||
        !read(&footer, sizeof footer, size - sizeof footer)) {
        m_problem = "it ends early";
        return;
    }
    if (header.magic != PackMagic || footer.magic != PackMagic) {
        m_problem = "it is no pack";
        return;
    }
    m_build = digest_in(header.build);
    if (header.version != PackVersion || footer.version != PackVersion) {
        m_problem = "it is of another version";
        return;
    }
    const uint64_t rest = size - sizeof footer; // where the index ends
    if (footer.index_at > rest || footer.entries > (rest - footer.index_at) / sizeof(PackEntry) ||
        footer.texts_size != rest - footer.index_at - footer.entries * sizeof(PackEntry)) {
        m_problem = "its index does not fit";
        return;
    }
    std::vector<PackEntry> entries(footer.entries);
    std::string texts(footer.texts_size, '\0');
    if (!read(entries.data(), entries.size() * sizeof(PackEntry), footer.index_at) ||
        !read(texts.data(), texts.size(), footer.index_at + entries.size() * sizeof(PackEntry))) {
        m_problem = "it ends early";
        return;
    }
    if (checksum_of(header, entries, texts) != footer.checksum) {
        m_problem = "the checksum of its index does not match";
        return;
    }
    size_t text = 0;
    for (const PackEntry& e : entries) {
        const uint64_t bytes = uint64_t(e.words) * 4;
        if (e.at > footer.index_at || e.bytes > footer.index_at - e.at || e.bytes > bytes ||
            bytes > e.bytes * MostCompressed || e.reads_size > texts.size() - text ||
            (e.words == 0) != (e.empty != 0)) {
            m_problem = "its index does not fit";
            m_index.clear();
            return;
        }
        StoredPage page;
        page.content = digest_in(e.content), page.of_read = digest_in(e.of_read);
        page.palette = digest_in(e.palette);
        page.spectra = e.spectra, page.empty = e.empty != 0;
        page.words = e.words, page.at = e.at, page.bytes = e.bytes;
        page.reads = texts.substr(text, e.reads_size);
        text += e.reads_size;
        m_index.push_back(std::move(page));
    }
}

bool PackReader::read(const StoredPage& stored, Page& page) const {
    page.words.resize(stored.words);
    if (!stored.is_compressed())
        return read(page.words.data(), stored.bytes, stored.at);
    // What cannot be unpacked is left zero, which no checksum fits.
    std::vector<char> packed(stored.bytes);
    if (!read(packed.data(), stored.bytes, stored.at))
        return false;
    if (!decompress(packed, {page.words.data(), page.words.size()}))
        std::fill(page.words.begin(), page.words.end(), 0);
    return true;
}

void PackReader::touch() {
    if (!m_is_touched.exchange(true))
        utimensat(AT_FDCWD, m_path.c_str(), nullptr, 0);
}

// ---- writing

PackWriter::PackWriter(const std::string& folder, const Digest& build) : m_folder(folder) {
    m_path = folder + "/XXXXXX" + UnfinishedSuffix;
    const int handle = mkstemps(m_path.data(), int(std::strlen(UnfinishedSuffix)));
    if (handle < 0) {
        m_path.clear();
        fail("making a file");
        return;
    }
    fchmod(handle, 0644); // other users read it
    m_file = fdopen(handle, "wb");
    m_header.magic = PackMagic, m_header.version = PackVersion;
    kanuka::store::put(build, m_header.build);
    put(&m_header, sizeof m_header);
}

PackWriter::~PackWriter() {
    if (m_file)
        std::fclose(m_file);
    if (!m_path.empty())
        ::unlink(m_path.c_str());
}

bool PackWriter::fail(const char* doing) {
    if (m_problem.empty())
        m_problem = std::string(doing) + ": " + std::strerror(errno);
    return false;
}

bool PackWriter::put(const void* data, size_t bytes) {
    if (!m_file || (bytes > 0 && std::fwrite(data, bytes, 1, m_file) != 1))
        return fail("writing");
    m_at += bytes;
    return true;
}

bool PackWriter::write(const StoredPage& stored, const Page& page, bool compresses) {
    static constexpr char Zeros[PageAlignmentOnDisk] = {};
    if (!put(Zeros, size_t(-m_at % PageAlignmentOnDisk)))
        return false;
    PackEntry e{};
    kanuka::store::put(stored.content, e.content);
    kanuka::store::put(stored.of_read, e.of_read);
    kanuka::store::put(stored.palette, e.palette);
    e.at = m_at;
    e.words = uint32_t(page.words.size());
    e.spectra = stored.spectra;
    e.reads_size = uint32_t(stored.reads.size());
    e.empty = page.words.empty();
    m_texts += stored.reads;
    if (page.words.empty()) {
        m_entries.push_back(e);
        return true;
    }
    PageHeader header = page.header();
    kanuka::store::put(stored.content, header.key);
    header.checksum = store::checksum_of(header, page);
    std::vector<char> packed;
    if (compresses) {
        Page whole = page;
        whole.header() = header;
        packed = compress({whole.words.data(), whole.words.size()});
    }
    e.bytes = packed.empty() ? uint64_t(e.words) * 4 : packed.size();
    m_entries.push_back(e);
    if (!packed.empty())
        return put(packed);
    constexpr size_t HeaderWords = sizeof header / 4;
    return put(&header, sizeof header) &&
           put(page.words.data() + HeaderWords, (page.words.size() - HeaderWords) * 4);
}

// A full disk may show only when the file is closed: file servers write late. What a failing machine leaves
// unwritten under the name is found by checksums, so nothing waits for the disk.
std::string PackWriter::close() {
    PackFooter footer{PackMagic,        PackVersion,    m_at,
                      m_entries.size(), m_texts.size(), checksum_of(m_header, m_entries, m_texts)};
    const bool written = put(m_entries.data(), m_entries.size() * sizeof(PackEntry)) &&
                         put(m_texts.data(), m_texts.size()) && put(&footer, sizeof footer);
    std::FILE* const file = std::exchange(m_file, nullptr);
    if (file && std::fclose(file) != 0)
        fail("writing");
    if (!written || !m_problem.empty())
        return {};
    // By what is in it: of two hosts that made the same, one pack stays.
    std::string path = m_folder + "/" + digest_of(footer.checksum, footer.index_at).text() + PackSuffix;
    if (::rename(m_path.c_str(), path.c_str()) != 0) {
        fail("renaming");
        return {};
    }
    m_path.clear();
    return path;
}

} // namespace kanuka::store
