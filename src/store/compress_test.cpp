// Packs that are not in use, made smaller: the same pages come back.
#include "store/compress.h"

#include <bit>
#include <fstream>

#include "store/test_stored.h"

namespace kanuka::store {

TEST_F(Stored, PagesThatAreNotInUseAreCompressed) {
    {
        DiskStore disk(settings(), m_journal);
        for (const uint64_t i : {1, 2, 3})
            disk.write(entry(i), shared(page(uint32_t(i), 16)));
        StoredPage nothing = entry(4);
        nothing.empty = true;
        disk.write(nothing, shared({}));
    }
    const fs::path plain = packs().at(0);
    const auto used = fs::file_time_type::clock::now() - std::chrono::hours(2);
    fs::last_write_time(plain, used);
    EXPECT_EQ(compress_store(settings().folder, 3 * 3600).packs, 0u); // used an hour too late
    const Compression done = compress_store(settings().folder, 3600);
    EXPECT_EQ(done.packs, 1u);
    ASSERT_EQ(packs().size(), 1u);
    EXPECT_FALSE(fs::exists(plain));
    EXPECT_EQ(done.bytes_after, fs::file_size(packs()[0]));
    EXPECT_LT(done.bytes_after, done.bytes_before);
    EXPECT_LT(std::chrono::abs(fs::last_write_time(packs()[0]) - used), std::chrono::seconds(1));
    EXPECT_EQ(packs_in(settings().folder, true).at(0).compressed_pages, 3u);
    EXPECT_EQ(packs_in(settings().folder, true).at(0).problem, "");
    EXPECT_EQ(compress_store(settings().folder, 3600).packs, 0u); // there is nothing more to do
    DiskStore disk(settings(), m_journal);
    for (const uint64_t i : {1, 2, 3}) {
        ASSERT_EQ(disk.find(name(i)).size(), 1u);
        Page back;
        EXPECT_TRUE(disk.read(disk.find(name(i))[0], m_program, back));
        EXPECT_EQ(back.words, page(uint32_t(i), 16).words);
    }
    ASSERT_EQ(disk.find(name(4)).size(), 1u);
    EXPECT_TRUE(disk.find(name(4))[0].empty);
    EXPECT_EQ(warnings(), 0u);
}

TEST_F(Stored, WhatIsDamagedIsNotCompressed) {
    write({1, 2});
    const fs::path path = packs().at(0);
    {
        std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
        file.seekp(300);
        file.put('!');
    }
    EXPECT_EQ(compress_store(settings().folder, 0).packs, 0u);
    EXPECT_EQ(packs(), std::vector<fs::path>{path});
    EXPECT_THROW(compress_store(m_folder + "/nothing", 0), Error);
}

TEST(Compress, GivesBackWhatItTook) {
    std::vector<uint32_t> words(1000);
    for (size_t i = 0; i < words.size(); i++)
        words[i] = std::bit_cast<uint32_t>(1 + 0.001f * float(i));
    const std::vector<char> packed = compress(words);
    ASSERT_FALSE(packed.empty());
    EXPECT_LT(packed.size(), 3000u);
    std::vector<uint32_t> back(1000), other(999);
    EXPECT_TRUE(decompress(packed, back));
    EXPECT_EQ(back, words);
    EXPECT_FALSE(decompress(packed, other));
    EXPECT_FALSE(decompress({packed.data(), packed.size() / 2}, back));
    EXPECT_TRUE(
        compress(std::vector<uint32_t>(1 << 20)).empty()); // a megabyte of zeros: nobody would believe it
}

} // namespace kanuka::store
