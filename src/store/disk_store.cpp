#include "store/disk_store.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <unistd.h>
#include <utility>

#include "base/build_id.h"
#include "base/byte_size.h"
#include "base/cache_folder.h"
#include "store/hierarchy_files.h"
#include "store/pack.h"
#include "store/page_check.h"

namespace kanuka::store {

namespace fs = std::filesystem;

namespace {

constexpr auto Abandoned = std::chrono::hours(24);
constexpr std::array<CacheKind, 2> Kinds{
    {{PackSuffix, UnfinishedSuffix, Abandoned}, {HierarchySuffix, UnfinishedSuffix, Abandoned}}};

bool before(const StoredPage& a, const StoredPage& b) {
    return a.content < b.content;
}

} // namespace

DiskStore::DiskStore(Settings settings, Journal& journal)
    : m_settings(std::move(settings)), m_journal(journal) {
    if (m_settings.build.empty())
        m_settings.build = build_id();
    std::error_code ec;
    if (m_settings.writes)
        fs::create_directories(m_settings.folder, ec);
    if (ec || !fs::is_directory(m_settings.folder, ec)) {
        fail(ec ? ec.message() : "there is no such folder");
        tell_of_failure();
        return;
    }
    std::vector<std::string> files;
    for (fs::directory_iterator it(m_settings.folder, ec), end; !ec && it != end; it.increment(ec))
        if (it->path().extension() == PackSuffix)
            files.push_back(it->path().string());
    std::ranges::sort(files); // the same choice among equal pages on every host
    for (const std::string& file : files)
        add_pack(file);
    std::ranges::stable_sort(m_pages, before);
}

DiskStore::~DiskStore() {
    close();
}

void DiskStore::fail(const std::string& what) {
    if (m_failed.exchange(true))
        return;
    const std::lock_guard lock(m_mutex);
    m_failure = what;
}

void DiskStore::tell_of_failure() {
    const std::lock_guard lock(m_mutex);
    if (m_failure.empty() || std::exchange(m_has_told, true))
        return;
    m_journal.warning({m_settings.folder}, "the store cannot be " +
                                               std::string(m_settings.writes ? "written" : "read") + " (" +
                                               m_failure + "): the render goes on without it");
}

void DiskStore::add_pack(const std::string& path) {
    auto pack = std::make_unique<PackReader>(path);
    if (pack->build() != digest_of(m_settings.build) && !pack->problem())
        return;
    std::vector<StoredPage> pages;
    if (!pack->problem())
        pages = pack->index();
    if (const char* problem = pack->problem()) {
        if (!pack->is_gone()) // removed by another host meanwhile: no damage
            m_journal.warning({path}, std::string("a pack of the store is not used: ") + problem);
        return;
    }
    for (StoredPage& page : pages) {
        page.pack = uint32_t(m_packs.size());
        m_pages.push_back(std::move(page));
    }
    m_packs.push_back(std::move(pack));
}

std::span<const StoredPage> DiskStore::find(const Digest& content) const {
    StoredPage wanted;
    wanted.content = content;
    const auto [begin, end] = std::equal_range(m_pages.begin(), m_pages.end(), wanted, before);
    return {begin, end};
}

bool DiskStore::read(const StoredPage& stored, const grid::LayeringProgram& program, Page& page) {
    PackReader& pack = *m_packs[stored.pack];
    if (!pack.read(stored, page)) // gone, or the disk fails: nothing is known of the rest of it
        return false;
    const char* fault = stored.empty ? nullptr : fault_of(page, program);
    if (!fault && !stored.empty && Digest{page.header().key[0], page.header().key[1]} != stored.content)
        fault = "it is another page";
    if (fault) {
        tell_of_damage(pack, fault);
        return false;
    }
    if (!stored.empty) { // as it was made
        page.header().key[0] = page.header().key[1] = 0;
        page.header().checksum = 0;
    }
    if (m_settings.writes)
        pack.touch();
    m_bytes_read += page.words.size() * 4;
    return true;
}

// Whoever may write removes it: the folder is a cache, and what it held is made again.
void DiskStore::tell_of_damage(PackReader& pack, const char* fault) {
    const std::lock_guard lock(m_mutex);
    if (pack.is_told())
        return;
    pack.set_told();
    m_journal.warning({pack.path()}, std::string("a page of the store is damaged (") + fault +
                                         "): what is damaged is made again" +
                                         (m_settings.writes ? ", and the pack is removed" : ""));
    if (m_settings.writes)
        ::unlink(pack.path().c_str());
}

void DiskStore::tell_of_damaged_hierarchy(const std::string& path, const std::string& fault) {
    m_journal.warning({path}, "a page of the hierarchy in the store is damaged (" + fault +
                                  "): it is built again" +
                                  (m_settings.writes ? ", and the file is removed" : ""));
    if (m_settings.writes)
        ::unlink(path.c_str());
}

// ---- writing

void DiskStore::write(const StoredPage& stored, std::shared_ptr<const Page> page) {
    if (!m_settings.writes || m_failed)
        return tell_of_failure();
    const uint64_t bytes = page->words.size() * 4;
    m_bytes_written += bytes;
    m_background.post(bytes, [this, stored, page = std::move(page)] { write_now(stored, *page); });
}

void DiskStore::write_now(const StoredPage& stored, const Page& page) {
    if (m_failed)
        return;
    if (!m_writer)
        m_writer = std::make_unique<PackWriter>(m_settings.folder, digest_of(m_settings.build));
    if (!m_writer->write(stored, page)) {
        fail(m_writer->problem());
        m_writer.reset();
    } else if (m_writer->bytes() >= m_settings.pack_bytes) {
        end_pack_now();
    }
}

void DiskStore::end_pack_now() {
    if (!m_writer || m_failed)
        return;
    const std::string path = m_writer->close();
    if (path.empty())
        fail(m_writer->problem());
    m_writer.reset();
    if (path.empty())
        return;
    trim_store(m_settings.folder, m_settings.most_bytes);
    const std::lock_guard lock(m_mutex);
    m_ended.push_back(path);
}

void DiskStore::end_pack() {
    if (m_settings.writes && !m_failed)
        m_background.post(0, [this] { end_pack_now(); });
}

void DiskStore::write_file(std::function<std::string()> job) {
    m_background.post(0, [this, job = std::move(job)] {
        if (m_failed)
            return;
        if (const std::string failure = job(); !failure.empty())
            fail(failure);
        else
            trim_store(m_settings.folder, m_settings.most_bytes);
    });
}

void DiskStore::close() {
    end_pack();
    m_background.wait();
    add_ended_packs();
    tell_of_failure();
}

void DiskStore::add_ended_packs() {
    if (m_ended.empty()) // nobody writes any more
        return;
    for (const std::string& path : m_ended)
        add_pack(path);
    m_ended.clear();
    std::ranges::stable_sort(m_pages, before);
}

// ---- folders

std::vector<PackInfo> packs_in(const std::string& folder, bool verify) {
    std::error_code ec;
    if (!fs::is_directory(folder, ec))
        throw Error({folder}, "there is no such folder");
    const auto now = fs::file_time_type::clock::now();
    std::vector<PackInfo> packs;
    const auto add = [&](PackInfo info, const CachedFile& file) {
        info.bytes = file.bytes;
        info.age_s = std::chrono::duration<double>(now - file.used).count();
        packs.push_back(std::move(info));
    };
    for (const CachedFile& file : cached_files(folder, std::array{Kinds[0].suffix, Kinds[1].suffix})) {
        if (file.path.extension() == HierarchySuffix) {
            add(hierarchy_file_info(file.path.string(), verify), file);
            continue;
        }
        PackReader pack(file.path.string());
        PackInfo info{.file = file.path.string()};
        info.of_this_build = !pack.problem() && pack.build() == digest_of(build_id());
        const std::vector<StoredPage> index = pack.problem() ? std::vector<StoredPage>() : pack.index();
        info.pages = index.size();
        for (const StoredPage& page : index)
            info.compressed_pages += page.is_compressed();
        if (pack.problem())
            info.problem = pack.problem();
        for (size_t i = 0; verify && info.problem.empty() && i < index.size(); i++) {
            Page page;
            const char* fault = !pack.read(index[i], page) ? "it ends early"
                                : index[i].empty           ? nullptr
                                                           : fault_of(page);
            if (fault)
                info.problem =
                    "page " + std::to_string(i + 1) + " of " + std::to_string(index.size()) + ": " + fault;
        }
        add(std::move(info), file);
    }
    std::ranges::reverse(packs);
    return packs;
}

uint64_t trim_store(const std::string& folder, uint64_t most_bytes) {
    return trim_cache(folder, Kinds, most_bytes);
}

// The new pack's path; empty: it stays as it is, since a page of it is damaged.
static std::string compress_pack(const std::string& folder, PackReader& pack,
                                 const std::vector<StoredPage>& index) {
    PackWriter writer(folder, pack.build());
    for (const StoredPage& stored : index) {
        Page page;
        if (!pack.read(stored, page) || (!stored.empty && fault_of(page)))
            return {};
        if (!writer.write(stored, page, true))
            throw Error({folder}, writer.problem());
    }
    const std::string path = writer.close();
    if (path.empty())
        throw Error({folder}, writer.problem());
    return path;
}

Compression compress_store(const std::string& folder, double idle_s, const Progress& progress) {
    std::error_code ec;
    if (!fs::is_directory(folder, ec))
        throw Error({folder}, "there is no such folder");
    Compression done;
    const auto now = fs::file_time_type::clock::now();
    const std::vector<CachedFile> files = cached_files(folder, PackSuffix);
    for (size_t i = 0; i < files.size() && !progress.cancelled(); i++) {
        const CachedFile& file = files[i];
        progress.update("compress", double(i) / double(files.size()));
        PackReader pack(file.path.string());
        if (std::chrono::duration<double>(now - file.used).count() < idle_s || pack.problem() ||
            pack.build() != digest_of(build_id()))
            continue;
        const std::vector<StoredPage> index = pack.index();
        if (std::ranges::none_of(index, [](const StoredPage& p) { return p.words && !p.is_compressed(); }))
            continue;
        const std::string made = compress_pack(folder, pack, index);
        if (made.empty())
            continue;
        fs::last_write_time(made, file.used, ec); // it is no younger than what it stands for
        done.packs++;
        done.bytes_before += file.bytes;
        done.bytes_after += fs::file_size(made, ec);
        if (made != file.path)
            fs::remove(file.path, ec);
    }
    progress.update("compress", 1);
    return done;
}

DiskStore::Settings store_settings_of_environment() {
    const auto value = [](const char* name) {
        const char* text = std::getenv(name);
        return std::string(text ? text : "");
    };
    DiskStore::Settings settings;
    settings.folder = value("KANUKA_STORE");
    if (const std::string mode = value("KANUKA_STORE_MODE"); !mode.empty()) {
        if (mode != "read" && mode != "write")
            throw Error("KANUKA_STORE_MODE is \"" + mode + "\"; read and write are known", ExitCode::Usage);
        settings.writes = mode == "write";
    }
    if (const std::string size = value("KANUKA_STORE_SIZE"); !size.empty()) {
        const auto bytes = parse_byte_size(size);
        if (!bytes)
            throw Error("KANUKA_STORE_SIZE is \"" + size + "\"; a size as 500M or 20G is expected",
                        ExitCode::Usage);
        settings.most_bytes = *bytes;
    }
    return settings;
}

} // namespace kanuka::store
