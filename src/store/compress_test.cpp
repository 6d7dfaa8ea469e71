// Packs that are not in use, made smaller: the same pages come back.
#include "store/compress.h"

#include <bit>
#include <cmath>
#include <fstream>
#include <random>

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

// Positions along a curve, halves that grow, bytes at random, and what overflows: each piece has its own
// predictor, and all words come back to the bit.
TEST(Compress, ChoosesAPredictorForEachPiece) {
    std::mt19937 random(5);
    std::vector<uint32_t> words;
    for (int i = 0; i < 30000; i++)
        words.push_back(std::bit_cast<uint32_t>(std::sin(0.001f * float(i / 3)) + float(i % 3)));
    const size_t positions = compress(words).size();
    EXPECT_LT(positions, 4 * words.size() / 2);
    for (uint32_t i = 0; i < 30000; i++)
        words.push_back((3 * i & 0xffff) | (0xffff - (5 * i & 0xffff)) << 16);
    EXPECT_LT(compress(words).size(), positions + 30000);
    for (int i = 0; i < 30000; i++)
        words.push_back(random() & 0x00ff00ff);
    for (int i = 0; i < 7001; i++)
        words.push_back(i % 2 ? 0xffffffff : uint32_t(i % 3));
    const std::vector<char> packed = compress(words);
    EXPECT_LT(packed.size(), positions + 30000 + 66000);
    std::vector<uint32_t> back(words.size());
    ASSERT_TRUE(decompress(packed, back));
    EXPECT_EQ(back, words);
    for (size_t n = 1; n < 12; n++) { // shorter than what lies before
        const std::vector<uint32_t> few(n, 7);
        std::vector<uint32_t> same(n);
        if (const std::vector<char> small = compress(few); !small.empty()) {
            EXPECT_TRUE(decompress(small, same));
            EXPECT_EQ(same, few);
        }
    }
}

} // namespace kanuka::store
