// Pages of the hierarchy in files: what was kept is found as it was, and nothing else ever is.
#include "store/hierarchy_files.h"

#include <csignal>
#include <cstring>
#include <fstream>
#include <sys/resource.h>

#include "hierarchy/test_oracle.h"
#include "store/pack.h"
#include "store/test_stored.h"

namespace kanuka::store {

using hierarchy::ContentSize;
using hierarchy::Lattices;
using hierarchy::PageMemory;

namespace {

constexpr ContentSize BallSize{.grids = 6, .triangles = 0, .segments = 2};

class Kept : public Stored {
  protected:
    Kept() {
        const std::vector<hierarchy::testing::TestGrid> ball = hierarchy::testing::ball(1, 8, 1, 0.2f, 5);
        EXPECT_EQ(ball.size(), BallSize.grids);
        const std::vector<hierarchy::GridView> grids = hierarchy::testing::views(ball);
        const float vertices[] = {0, 0, 0, 0.1f, 0, 1, 0, 0.1f, 1, 1, 0, 0.2f};
        const uint32_t first[] = {0, 1};
        const hierarchy::FibreView hair{vertices, 3, first, 2};
        const hierarchy::Content content{grids, {}, false, {&hair, 1}};
        const hierarchy::Lattice lattice = hierarchy::votes_of(content).lattice();
        m_lattices = {lattice, {lattice.exponent + 1}, hierarchy::fibre_lattice_of({&hair, 1})};
        m_page = hierarchy::build(content, m_lattices);
    }
    void keep(uint64_t i) {
        DiskStore disk(settings(), m_journal);
        HierarchyFiles(disk).keep(name(i), m_page, m_lattices);
    }
    bool is_whole(const PageMemory& page) const {
        return page.size() == m_page.size() && std::memcmp(page.data(), m_page.data(), page.size()) == 0;
    }
    bool comes_back(DiskStore& disk, uint64_t i, bool maps = true) const {
        const auto found = HierarchyFiles(disk, {.maps = maps}).find(name(i), BallSize);
        if (!found)
            return false;
        EXPECT_TRUE(is_whole(found->page));
        EXPECT_EQ(reinterpret_cast<uintptr_t>(found->page.data()) % 64, 0u);
        EXPECT_EQ(digest_of(found->lattices), digest_of(m_lattices));
        return true;
    }
    static std::string bytes_of(const fs::path& path) {
        std::ifstream in(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    static void put(const fs::path& path, const std::string& bytes) {
        std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
    }
    // Of the folder's one file, with other bytes for these: is it refused, told and removed?
    bool is_refused(const std::string& bytes, const std::string& why = "") const {
        const fs::path path = packs().at(0);
        const std::string before = bytes_of(path);
        put(path, bytes);
        Journal journal;
        DiskStore disk(settings(), journal);
        const bool back = comes_back(disk, 1);
        const bool told = journal.entries().size() == 1 && !fs::exists(path) &&
                          journal.entries()[0].message.find(why) != std::string::npos;
        EXPECT_EQ(told, !back) << (journal.entries().empty() ? "" : journal.entries()[0].message);
        put(path, before);
        return told;
    }
    std::string forged(size_t at, uint32_t value) const { // with checksums that fit
        std::string bytes = bytes_of(packs().at(0));
        std::memcpy(bytes.data() + at, &value, 4);
        PageMemory page(bytes.size() - sizeof(HierarchyFileHeader));
        std::memcpy(page.data(), bytes.data() + sizeof(HierarchyFileHeader), page.size());
        const uint64_t checksum = hierarchy::checksum_of(page.bytes());
        std::memcpy(bytes.data() + sizeof(HierarchyFileHeader) + offsetof(hierarchy::Header, checksum),
                    &checksum, 8);
        return bytes;
    }

    PageMemory m_page;
    Lattices m_lattices;
};

} // namespace

TEST_F(Kept, ComesBackAsItWas) {
    keep(1);
    for (const bool maps : {true, false})
        for (const bool writes : {true, false}) {
            DiskStore::Settings s = settings();
            s.writes = writes;
            DiskStore disk(s, m_journal);
            EXPECT_TRUE(comes_back(disk, 1, maps));
            EXPECT_FALSE(comes_back(disk, 2, maps));
        }
    EXPECT_EQ(warnings(), 0u);
    const auto before = packs();
    ASSERT_EQ(before.size(), 1u);
    const std::string bytes = bytes_of(before[0]);
    keep(1); // by a second host
    EXPECT_EQ(packs(), before);
    EXPECT_EQ(bytes_of(before[0]), bytes);
}

TEST_F(Kept, DamageIsFound) {
    keep(1);
    const std::string whole = bytes_of(packs().at(0));
    const size_t step = 1 + whole.size() / 700;
    for (size_t i = 0; i < whole.size(); i += i < 2 * sizeof(HierarchyFileHeader) ? 1 : step) {
        std::string damaged = whole;
        damaged[i] = char(damaged[i] ^ (i % 3 == 0 ? 0xff : 1 << (i % 8)));
        EXPECT_TRUE(is_refused(damaged)) << i;
    }
    for (size_t length = 0; length < whole.size(); length += step)
        EXPECT_TRUE(is_refused(whole.substr(0, length), "it ends early")) << length;
    EXPECT_TRUE(is_refused(whole + "more"));
    EXPECT_TRUE(is_refused(std::string(whole.size(), 'x'), "it is no page of a hierarchy"));
    EXPECT_FALSE(is_refused(whole));
}

TEST_F(Kept, WhoMayNotWriteRemovesNothing) {
    keep(1);
    const fs::path path = packs().at(0);
    std::string damaged = bytes_of(path);
    damaged[damaged.size() / 2] ^= 1;
    put(path, damaged);
    const auto used = fs::last_write_time(path);
    DiskStore::Settings s = settings();
    s.writes = false;
    DiskStore disk(s, m_journal);
    EXPECT_FALSE(comes_back(disk, 1));
    EXPECT_EQ(warnings(), 1u);
    EXPECT_NE(m_journal.entries()[0].message.find("it is built again"), std::string::npos);
    HierarchyFiles(disk).keep(name(2), m_page, m_lattices);
    EXPECT_EQ(packs(), std::vector{path});
    EXPECT_EQ(fs::last_write_time(path), used);
}

// A page of another build or content under this name, and one of an older format.
TEST_F(Kept, WhatIsForeignIsRefused) {
    DiskStore::Settings s = settings();
    s.build = "another";
    {
        DiskStore disk(s, m_journal);
        HierarchyFiles(disk).keep(name(1), m_page, m_lattices);
    }
    const fs::path theirs = packs().at(0);
    const std::string of_theirs = bytes_of(theirs);
    DiskStore mine(settings(), m_journal);
    EXPECT_FALSE(comes_back(mine, 1));
    EXPECT_EQ(warnings(), 0u) << "it has another name";
    fs::remove(theirs);
    keep(2);
    const std::string of_two = bytes_of(packs().at(0));
    fs::remove(packs().at(0));
    keep(1);
    EXPECT_TRUE(is_refused(of_theirs, "it is another page"));
    EXPECT_TRUE(is_refused(of_two, "it is another page"));
    EXPECT_TRUE(is_refused(forged(4, HierarchyFileVersion + 1), "it is of another version"));
    const size_t page = sizeof(HierarchyFileHeader);
    EXPECT_TRUE(is_refused(forged(page + 4, hierarchy::Version - 1), "it is of version"));
}

// Checksums fit, references lie within, and still it is no page of this content: hits would lie in shapes
// that are none.
TEST_F(Kept, NamesOutsideOfTheContentAreRefused) {
    keep(1);
    const hierarchy::Header& h = m_page.page().header();
    const size_t page = sizeof(HierarchyFileHeader);
    EXPECT_TRUE(is_refused(forged(page + h.tiles, uint32_t(BallSize.grids)), "it names"));
    for (int k = int(hierarchy::Kind::Fibre32); k <= int(hierarchy::Kind::FibreFloat); k++) {
        const hierarchy::Section& s = h.section[k];
        for (uint64_t n = 0; n < s.name_count && s.leaf_bytes > 0; n++)
            EXPECT_TRUE(is_refused(forged(page + s.names + 4 * n, 2), "it names"));
    }
    DiskStore disk(settings(), m_journal);
    EXPECT_FALSE(HierarchyFiles(disk).find(name(1), {.grids = 6}).has_value());
}

TEST_F(Kept, IsOfUseWhenItsFileIsGone) {
    keep(1);
    DiskStore disk(settings(), m_journal);
    const auto found = HierarchyFiles(disk).find(name(1), BallSize);
    ASSERT_TRUE(found.has_value());
    EXPECT_EQ(trim_store(settings().folder, 0), 1u);
    EXPECT_TRUE(packs().empty());
    EXPECT_TRUE(is_whole(found->page));
    EXPECT_EQ(hierarchy::refusal_of(found->page.bytes()), "");
    EXPECT_FALSE(comes_back(disk, 1));
    EXPECT_EQ(warnings(), 0u);
}

// Packs and pages of the hierarchy share the folder's bytes, and go in order of their last use.
TEST_F(Kept, TheOldestGoFirst) {
    const auto older = [&] {
        for (const fs::path& file : packs())
            fs::last_write_time(file, fs::last_write_time(file) - std::chrono::minutes(2));
    };
    keep(1), older();
    write({1}), older();
    keep(2), older();
    const std::vector<PackInfo> all = packs_in(settings().folder, true);
    ASSERT_EQ(all.size(), 3u);
    EXPECT_TRUE(all[0].is_hierarchy && !all[1].is_hierarchy && all[2].is_hierarchy);
    for (const PackInfo& info : all) {
        EXPECT_EQ(info.problem, "");
        EXPECT_EQ(info.pages, 1u);
        EXPECT_TRUE(info.of_this_build);
        EXPECT_EQ(info.bytes, fs::file_size(info.file));
    }
    DiskStore disk(settings(), m_journal);
    EXPECT_TRUE(comes_back(disk, 1)); // of use again
    EXPECT_EQ(trim_store(settings().folder, 2 * all[0].bytes), 1u);
    DiskStore after(settings(), m_journal);
    EXPECT_TRUE(after.find(name(1)).empty());
    EXPECT_TRUE(comes_back(after, 1) && comes_back(after, 2));
    EXPECT_EQ(compress_store(settings().folder, 0).packs, 0u);
    put(packs().at(0), "x");
    EXPECT_EQ(std::ranges::count(packs_in(settings().folder, false), "it ends early", &PackInfo::problem), 1);
}

TEST_F(Kept, AScenesEndLosesNone) {
    DiskStore disk(settings(), m_journal);
    HierarchyFiles files(disk);
    std::atomic<bool> may_go = false;
    disk.write_file([&] {
        may_go.wait(false);
        return std::string();
    });
    {
        const PageMemory of_scene = hierarchy::testing::copy_of(m_page);
        files.keep(name(1), of_scene, m_lattices);
    } // before it is written
    may_go = true;
    may_go.notify_one();
    disk.close();
    EXPECT_TRUE(comes_back(disk, 1));
}

TEST_F(Kept, WhatCannotBeWrittenIsToldOnce) {
    DiskStore disk(settings(), m_journal);
    HierarchyFiles files(disk);
    rlimit before{};
    getrlimit(RLIMIT_FSIZE, &before);
    const auto handler = std::signal(SIGXFSZ, SIG_IGN); // as a full disk: the write fails
    const rlimit small{m_page.size() / 2, before.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
    files.keep(name(1), m_page, m_lattices);
    files.keep(name(2), m_page, m_lattices);
    disk.close();
    setrlimit(RLIMIT_FSIZE, &before);
    std::signal(SIGXFSZ, handler);
    ASSERT_EQ(warnings(), 1u);
    EXPECT_NE(m_journal.entries()[0].message.find("the render goes on without it"), std::string::npos);
    EXPECT_TRUE(packs().empty());
}

TEST_F(Kept, FilesAreForWhatIsNeitherSmallNorTooLarge) {
    DiskStore::Settings s = settings();
    s.most_bytes = uint64_t(64) << 20;
    DiskStore disk(s, m_journal);
    const HierarchyFiles files(disk);
    EXPECT_FALSE(files.is_worth_files(10'000));
    EXPECT_TRUE(files.is_worth_files(uint64_t(8) << 20));
    EXPECT_FALSE(files.is_worth_files(uint64_t(40) << 20));
}

// Every number that a page is made of has a part in the digest.
TEST(ContentDigest, ChangesWithEveryInput) {
    std::vector<float> positions(3 * 12), vertices(4 * 5);
    std::vector<uint32_t> corners{0, 1, 2, 3, 4, 5}, first{0, 1, 3};
    for (size_t i = 0; i < positions.size(); i++)
        positions[i] = float(i);
    const hierarchy::GridView grid{positions.data(), 3, 2, 1};
    const hierarchy::MeshView mesh{positions.data(), 12, corners.data(), 2, 3};
    const hierarchy::FibreView fibre{vertices.data(), 5, first.data(), 3};
    const auto all = [&] { return digest_of(digest_of(grid), digest_of(mesh), digest_of(fibre)); };
    const Digest before = all();
    std::set<Digest> seen{before};
    const auto expect_new = [&](const Digest& d) { EXPECT_TRUE(seen.insert(d).second); };
    for (std::vector<float>* values : {&positions, &vertices})
        for (float& f : *values) {
            const float was = std::exchange(f, std::nextafter(f, 1e9f));
            expect_new(all());
            expect_new(digest_of(digest_of(grid), digest_of(fibre)));
            f = was;
            seen = {before};
        }
    for (std::vector<uint32_t>* values : {&corners, &first})
        for (uint32_t& word : *values) {
            word ^= 8;
            expect_new(all());
            word ^= 8;
        }
    EXPECT_EQ(all(), before);
    seen = {digest_of(grid), digest_of(mesh)};
    for (const hierarchy::GridView& g :
         {hierarchy::GridView{positions.data(), 2, 3, 1}, hierarchy::GridView{positions.data(), 3, 2, 2}})
        expect_new(digest_of(g));
    for (hierarchy::MeshView m : {hierarchy::MeshView{positions.data(), 11, corners.data(), 2, 3},
                                  hierarchy::MeshView{positions.data(), 12, corners.data(), 1, 3},
                                  hierarchy::MeshView{positions.data(), 12, corners.data(), 1, 4},
                                  hierarchy::MeshView{positions.data(), 12, corners.data(), 2, 3, true}})
        expect_new(digest_of(m));
}

} // namespace kanuka::store
