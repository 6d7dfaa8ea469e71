// Packs: what is written is found, by this process and by others; damage of any kind is found, and costs no
// more than the pages that it hit.
#include "store/disk_store.h"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <thread>

#include <gtest/gtest.h>

#include "base/build_id.h"
#include "base/byte_size.h"
#include "store/pack.h"
#include "store/page_check.h"
#include "store/test_stored.h"

namespace kanuka::store {

namespace fs = std::filesystem;
using namespace testing;

namespace {

class Damaged : public Stored {
  protected:
    // Of a folder's one pack, which holds pages 1 and 2.
    void expect_damage_is_found(int size);
};
void Damaged::expect_damage_is_found(int size) {
    const fs::path path = packs().at(0);
    std::string intact;
    {
        std::ifstream in(path, std::ios::binary);
        intact.assign(std::istreambuf_iterator<char>(in), {});
    }
    const auto put = [&](const std::string& bytes) {
        std::ofstream out(path, std::ios::binary | std::ios::trunc);
        out << bytes;
    };
    const auto both_or_one = [&](size_t at) {
        Journal journal;
        DiskStore disk(settings(), journal);
        int back = 0;
        for (const uint64_t i : {1, 2})
            for (const StoredPage& stored : disk.find(name(i))) {
                Page page_back;
                if (disk.read(stored, m_program, page_back)) {
                    EXPECT_EQ(page_back.words, page(uint32_t(i), size).words) << at;
                    back++;
                }
            }
        return back;
    };
    const size_t step = size == 1 ? 1 : 1 + intact.size() / 512;
    int found = 0, tried = 0;
    for (size_t i = 0; i < intact.size(); i += step, tried++) {
        std::string damaged = intact;
        damaged[i] = char(damaged[i] ^ (i % 3 == 0 ? 0xff : 1 << (i % 8)));
        put(damaged);
        const int back = both_or_one(i);
        EXPECT_LE(back, 2);
        found += back < 2;
    }
    // All but what pads pages to whole rows.
    EXPECT_GT(found, tried - 2 * int(PageAlignmentOnDisk / step) - 2);
    for (size_t length = 0; length < intact.size(); length += step) {
        put(intact.substr(0, length));
        EXPECT_EQ(both_or_one(length), 0) << length;
    }
    put(intact);
    EXPECT_EQ(both_or_one(0), 2);
    put("something else altogether, and longer than a header and a footer are: of no use to anybody at all. "
        "It goes on for a while.");
    EXPECT_EQ(both_or_one(0), 0);
}

} // namespace

TEST_F(Stored, ComesBackAsItWas) {
    write({1, 2, 3});
    DiskStore disk(settings(), m_journal);
    for (const uint64_t i : {1, 2, 3})
        EXPECT_TRUE(comes_back(disk, i));
    EXPECT_TRUE(disk.find(name(4)).empty());
    const StoredPage& found = disk.find(name(2))[0];
    EXPECT_EQ(found.of_read, entry(2).of_read);
    EXPECT_EQ(found.reads, entry(2).reads);
    EXPECT_EQ(found.palette, entry(2).palette);
    EXPECT_EQ(found.spectra, 3u);
    EXPECT_FALSE(found.empty);
    EXPECT_GT(disk.bytes_read(), 3u * 1000);
    EXPECT_EQ(warnings(), 0u);
}

TEST_F(Stored, WhatIsEmptyIsKnownToBe) {
    {
        DiskStore disk(settings(), m_journal);
        StoredPage e = entry(1);
        e.empty = true;
        disk.write(e, shared({}));
    }
    DiskStore disk(settings(), m_journal);
    ASSERT_EQ(disk.find(name(1)).size(), 1u);
    EXPECT_TRUE(disk.find(name(1))[0].empty);
    Page back;
    EXPECT_TRUE(disk.read(disk.find(name(1))[0], m_program, back));
    EXPECT_TRUE(back.words.empty());
}

TEST_F(Stored, OfOneContentThereMayBeSeveral) {
    DiskStore disk(settings(), m_journal);
    disk.write(entry(1, 1), shared(page(1)));
    disk.write(entry(1, 2), shared(page(2)));
    EXPECT_TRUE(disk.find(name(1)).empty()); // the pack is still being written
    disk.close();
    ASSERT_EQ(disk.find(name(1)).size(), 2u);
    EXPECT_NE(disk.find(name(1))[0].of_read, disk.find(name(1))[1].of_read);
}

TEST_F(Stored, LargePacksAreClosedOnTheWay) {
    DiskStore::Settings s = settings();
    s.pack_bytes = 10'000;
    DiskStore disk(s, m_journal);
    for (uint64_t i = 0; i < 40; i++)
        disk.write(entry(i), shared(page(uint32_t(i))));
    for (int i = 0; i < 1000 && packs().size() <= 5; i++) // in the background
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    EXPECT_GT(packs().size(), 5u); // though it goes on
    DiskStore other(settings(), m_journal);
    EXPECT_TRUE(comes_back(other, 0));
    disk.close();
    for (uint64_t i = 0; i < 40; i++)
        EXPECT_TRUE(comes_back(disk, i));
    // The same pages in the same order are the same packs: a second host adds none.
    const auto before = packs();
    DiskStore second(s, m_journal);
    for (uint64_t i = 0; i < 40; i++)
        second.write(entry(i), shared(page(uint32_t(i))));
    second.close();
    EXPECT_EQ(packs(), before);
}

TEST_F(Stored, WhatIsPostedLastIsWrittenToo) {
    {
        DiskStore disk(settings(), m_journal);
        disk.write(entry(1), shared(page(1)));
        disk.end_pack();
        disk.write(entry(2), shared(page(2)));
        disk.write_file([this] {
            std::ofstream(m_folder + "/pages/another") << "file";
            return std::string();
        });
    } // without close()
    EXPECT_TRUE(fs::exists(m_folder + "/pages/another"));
    DiskStore disk(settings(), m_journal);
    EXPECT_TRUE(comes_back(disk, 1));
    EXPECT_TRUE(comes_back(disk, 2));
}

TEST_F(Stored, OfFilesThatFailOneIsTold) {
    DiskStore disk(settings(), m_journal);
    std::atomic<int> tried = 0;
    for (int i = 0; i < 3; i++)
        disk.write_file([&] {
            tried++;
            return std::string("no room");
        });
    disk.write(entry(1), shared(page(1)));
    disk.close();
    EXPECT_EQ(tried, 1);
    EXPECT_TRUE(disk.has_failed());
    ASSERT_EQ(warnings(), 1u);
    EXPECT_NE(m_journal.entries()[0].message.find("no room"), std::string::npos);
    EXPECT_TRUE(packs().empty());
}

TEST_F(Stored, AnotherBuildsPagesAreNotUsed) {
    DiskStore::Settings s = settings();
    s.build = "another";
    {
        DiskStore disk(s, m_journal);
        disk.write(entry(1), shared(page(1)));
    }
    DiskStore mine(settings(), m_journal);
    EXPECT_FALSE(comes_back(mine, 1));
    DiskStore theirs(s, m_journal);
    EXPECT_TRUE(comes_back(theirs, 1));
    ASSERT_EQ(packs_in(s.folder, true).size(), 1u);
    EXPECT_FALSE(packs_in(s.folder, true)[0].of_this_build);
    EXPECT_EQ(packs_in(s.folder, true)[0].problem, "");
    EXPECT_GE(build_id().size(), 16u) << "the linker is told to give one";
}

TEST_F(Stored, ReadingChangesNothing) {
    write({1});
    const auto before = packs();
    const auto used = fs::last_write_time(before[0]);
    DiskStore::Settings s = settings();
    s.writes = false;
    {
        DiskStore disk(s, m_journal);
        EXPECT_TRUE(comes_back(disk, 1));
        disk.write(entry(2), shared(page(2)));
    }
    EXPECT_EQ(packs(), before);
    EXPECT_EQ(fs::last_write_time(before[0]), used);
    s.folder = m_folder + "/none";
    DiskStore nowhere(s, m_journal);
    EXPECT_FALSE(comes_back(nowhere, 1));
    EXPECT_EQ(warnings(), 1u);
    EXPECT_FALSE(fs::exists(s.folder));
}

// Every byte of a small pack changed, and every length: what comes back is what was written, or nothing.
TEST_F(Damaged, IsFound) {
    for (const bool compressed : {false, true}) {
        const int size = compressed ? 6 : 1; // the smallest do not get smaller
        {
            DiskStore disk(settings(), m_journal);
            for (const uint64_t i : {1, 2})
                disk.write(entry(i), shared(page(uint32_t(i), size)));
        }
        if (compressed) {
            EXPECT_EQ(compress_store(settings().folder, 0).packs, 1u);
        }
        expect_damage_is_found(size);
        fs::remove(packs().at(0));
    }
}

TEST_F(Stored, ADamagedPackIsToldAndRemoved) {
    write({1, 2, 3});
    const fs::path path = packs().at(0);
    {
        std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
        file.seekp(400);
        file << "damage";
    }
    DiskStore disk(settings(), m_journal);
    EXPECT_FALSE(comes_back(disk, 1));
    EXPECT_TRUE(comes_back(disk, 2)); // it is open, and what is whole of it is of use
    EXPECT_FALSE(fs::exists(path));
    ASSERT_EQ(warnings(), 1u);
    EXPECT_NE(m_journal.entries()[0].message.find("its checksum does not match"), std::string::npos);
    EXPECT_EQ(m_journal.entries()[0].where.file, path.string());
    disk.write(entry(1), shared(page(1)));
    disk.close();
    EXPECT_TRUE(comes_back(disk, 1));
}

TEST_F(Stored, WhatCannotBeWrittenIsToldOnce) {
    if (geteuid() != 0) { // who may write everywhere
        fs::create_directory(m_folder + "/pages");
        fs::permissions(m_folder + "/pages", fs::perms::owner_read | fs::perms::owner_exec);
        DiskStore disk(settings(), m_journal);
        disk.write(entry(1), shared(page(1)));
        disk.write(entry(2), shared(page(2)));
        disk.close();
        EXPECT_EQ(warnings(), 1u);
        fs::permissions(m_folder + "/pages", fs::perms::owner_all);
        fs::remove(m_folder + "/pages");
    }
    std::ofstream(m_folder + "/pages") << "a file";
    Journal journal;
    DiskStore disk(settings(), journal);
    disk.write(entry(1), shared(page(1)));
    disk.close();
    ASSERT_EQ(journal.entries().size(), 1u);
    EXPECT_NE(journal.entries()[0].message.find("the render goes on without it"), std::string::npos);
}

TEST_F(Stored, AFullDiskCostsTheStoreAlone) {
    DiskStore::Settings s = settings();
    s.folder = "/dev/full/pages"; // no folder can be made there
    DiskStore disk(s, m_journal);
    disk.write(entry(1), shared(page(1)));
    EXPECT_TRUE(disk.find(name(1)).empty());
    EXPECT_EQ(warnings(), 1u);
}

TEST_F(Stored, TheOldestGoFirst) {
    for (const uint64_t i : {1, 2, 3, 4}) {
        write({i});
        for (const fs::path& file : packs()) // each a minute older than the next
            fs::last_write_time(file, fs::last_write_time(file) - std::chrono::minutes(1));
    }
    const std::vector<PackInfo> all = packs_in(settings().folder, true);
    ASSERT_EQ(all.size(), 4u);
    for (size_t i = 0; i < 4; i++) {
        EXPECT_EQ(all[i].pages, 1u);
        EXPECT_TRUE(all[i].of_this_build);
        EXPECT_EQ(all[i].problem, "");
        EXPECT_NEAR(all[i].age_s, 60 * (double(i) + 1), 30);
    }
    {
        DiskStore disk(settings(), m_journal); // the first is of use again
        EXPECT_TRUE(comes_back(disk, 1));
    }
    EXPECT_EQ(trim_store(settings().folder, 2 * all[0].bytes), 2u);
    DiskStore disk(settings(), m_journal);
    EXPECT_TRUE(comes_back(disk, 1));
    EXPECT_TRUE(comes_back(disk, 4));
    EXPECT_FALSE(comes_back(disk, 2));
    // What is open when it goes stays of use to whoever has it.
    for (const char* left : {"/yesterday.unfinished", "/now.unfinished"})
        std::ofstream(settings().folder + left) << "x";
    fs::last_write_time(settings().folder + "/yesterday.unfinished",
                        fs::file_time_type::clock::now() - std::chrono::hours(25));
    std::ofstream(settings().folder + "/notes.txt") << "x";
    EXPECT_EQ(trim_store(settings().folder, 0), 3u);
    EXPECT_TRUE(comes_back(disk, 4));
    EXPECT_EQ(packs().size(), 2u); // somebody may be writing the one; the notes are none of ours
    EXPECT_THROW(packs_in(m_folder + "/none", false), Error);
}

TEST_F(Stored, AWriterKeepsTheFolderSmall) {
    DiskStore::Settings s = settings();
    s.pack_bytes = 10'000;
    s.most_bytes = 50'000;
    DiskStore disk(s, m_journal);
    for (uint64_t i = 0; i < 100; i++)
        disk.write(entry(i), shared(page(uint32_t(i))));
    disk.close();
    uint64_t bytes = 0;
    for (const PackInfo& pack : packs_in(s.folder, true)) {
        EXPECT_EQ(pack.problem, "");
        bytes += pack.bytes;
    }
    EXPECT_LE(bytes, s.most_bytes);
    EXPECT_GT(bytes, s.most_bytes / 2);
}

TEST(StoreSettings, OfTheEnvironment) {
    EXPECT_EQ(store_settings_of_environment().folder, "");
    setenv("KANUKA_STORE", "/some/where", 1);
    setenv("KANUKA_STORE_MODE", "read", 1);
    setenv("KANUKA_STORE_SIZE", "1.5G", 1);
    const DiskStore::Settings s = store_settings_of_environment();
    EXPECT_EQ(s.folder, "/some/where");
    EXPECT_FALSE(s.writes);
    EXPECT_EQ(s.most_bytes, 3u << 29);
    setenv("KANUKA_STORE_MODE", "both", 1);
    EXPECT_THROW(store_settings_of_environment(), Error);
    setenv("KANUKA_STORE_MODE", "write", 1);
    setenv("KANUKA_STORE_SIZE", "much", 1);
    EXPECT_THROW(store_settings_of_environment(), Error);
    for (const char* variable : {"KANUKA_STORE", "KANUKA_STORE_MODE", "KANUKA_STORE_SIZE"})
        unsetenv(variable);
}

TEST(ByteSize, IsWrittenWithAUnit) {
    EXPECT_EQ(parse_byte_size("0"), 0u);
    EXPECT_EQ(parse_byte_size("500M"), 500u << 20);
    EXPECT_EQ(parse_byte_size("2G"), 2ull << 30);
    EXPECT_EQ(parse_byte_size("0.5T"), 1ull << 39);
    for (const char* wrong : {"", "G", "-1", "1Q", "1 G", "nan", "1e30"})
        EXPECT_FALSE(parse_byte_size(wrong).has_value()) << wrong;
}

// ---- pages that are damaged on purpose: checksums fit

namespace {

Page forged(const Page& whole, size_t word, uint32_t value) {
    Page page = whole;
    page.words[word] = value;
    page.header().checksum = checksum_of(page.header(), page);
    return page;
}

} // namespace

// What is accepted reads no memory but its own: each word in turn takes values that are likely to do harm.
TEST(PageCheck, ForgedPagesAreRefusedOrHarmless) {
    const auto program = lamp_program();
    for (const bool is_mesh : {false, true}) {
        HandMade made(2, 2, program);
        made.scramble(3);
        made.is_mesh = is_mesh;
        made.mesh.vertices_per_face = 4;
        made.mesh.indices = {0, 1, 4, 3, 1, 2, 5, 4};
        Page whole = encode_one(made, program);
        whole.header().checksum = checksum_of(whole.header(), whole);
        ASSERT_EQ(fault_of(whole, program), nullptr);
        int refused = 0;
        const size_t end = whole.header().emitters_at;
        for (size_t w = 0; w < end; w++)
            for (const uint32_t value :
                 {0u, 1u, 2u, 0x7fffffffu, 0x80000000u, 0xffffffffu, whole.words[w] + 1, whole.words[w] * 2,
                  uint32_t(whole.words.size())}) {
                const Page page = forged(whole, w, value);
                if (fault_of(page, program)) {
                    refused++;
                    continue;
                }
                Store store(page.words.size() + 48);
                store.add_page(page, program, -1);
                for (size_t s = 0; s < store.shapes().size(); s++) {
                    const ShapeRecord& r = store.shapes()[s];
                    const int prims = r.flags & ShapeRecord::Mesh ? r.mv : 1;
                    for (int prim = 0; prim < prims; prim++)
                        for (const float u : {0.0f, 0.6f, 1.0f})
                            (void)store.presence(int(s), prim, u, 0.3f);
                }
            }
        EXPECT_GT(refused, 100);
        EXPECT_STREQ(fault_of(forged(whole, 0, 7), program), "its header is missing");
        Page cut = whole;
        cut.words.resize(5);
        EXPECT_NE(fault_of(cut, program), nullptr);
    }
}

} // namespace kanuka::store
