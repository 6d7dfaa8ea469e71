#include "base/paged_memory.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>
#include <vector>

#include "base/error.h"
#include "base/large_pages.h"
#include "base/mapped_file.h"
#include "base/tasks.h"

namespace kanuka {
namespace {

constexpr uint64_t MB = uint64_t(1) << 20;

uint64_t resident() {
    std::ifstream statm("/proc/self/statm");
    uint64_t addresses = 0, pages = 0;
    statm >> addresses >> pages;
    return pages * 4096;
}

// Of 512 MB of words a quarter is in memory at once: between two pieces of work the bound holds, however busy
// the machine is, but for what a piece brings. That is at most a folio of the system's, 2 MB, for each word
// it reads.
TEST(PagedMemory, WhatIsLargeComesAndGoes) {
    const uint64_t bound = resident() + 128 * MB;
    const paged_memory::Hold hold({bound, {}});
    LargeVector<uint64_t> words(512 * MB / 8);
    uint64_t most = 0, wrong = 0;
    const auto between = [&] {
        paged_memory::keep_within_bound();
        most = std::max(most, resident());
    };
    for (size_t i = 0; i < words.size(); i++) {
        words[i] = i * 0x9e3779b97f4a7c15;
        if (i % (MB / 8) == 0)
            between();
    }
    EXPECT_GE(paged_memory::counts().bytes, 512 * MB);
    uint32_t h = 1;
    for (int k = 0; k < 64000; k++) { // here and there, as rays do
        h = h * 1664525 + 1013904223;
        const size_t i = (uint64_t(h) * words.size()) >> 32;
        wrong += words[i] != i * 0x9e3779b97f4a7c15;
        if (k % 16 == 0)
            between();
    }
    EXPECT_EQ(wrong, 0u);
    EXPECT_LT(most, bound);
    EXPECT_GT(paged_memory::counts().given_back, 256 * MB);
}

// Every page is written by some thread while others are given back: no write is lost.
TEST(PagedMemory, NoWriteIsLost) {
    const paged_memory::Hold hold({resident() + 16 * MB, {}});
    LargeVector<uint32_t> words(128 * MB / 4);
    for (uint32_t round = 1; round <= 3; round++) {
        tasks::parallel_for(words.size() / 1024, [&](size_t page) {
            for (size_t i = page * 1024; i < (page + 1) * 1024; i++)
                words[i] += round * uint32_t(i);
        });
    }
    size_t wrong = 0;
    for (size_t i = 0; i < words.size(); i++)
        wrong += words[i] != 6 * uint32_t(i);
    EXPECT_EQ(wrong, 0u);
}

TEST(PagedMemory, WithoutABoundNothingIsPaged) {
    EXPECT_EQ(paged_memory::allocate(8 * MB), nullptr);
    EXPECT_EQ(paged_memory::reserve(8 * MB), nullptr);
    int nothing = 0;
    EXPECT_FALSE(paged_memory::release(&nothing));
    {
        const paged_memory::Hold none({0, {}});
        EXPECT_EQ(paged_memory::allocate(8 * MB), nullptr);
    }
}

// What was allocated under a bound stays where it is, and is released after it.
TEST(PagedMemory, OutlivesItsBound) {
    LargeVector<uint32_t> words;
    {
        const paged_memory::Hold hold({64 * MB, {}});
        words.assign(4 * MB, 7);
    }
    const uint64_t bytes = paged_memory::counts().bytes;
    EXPECT_GE(bytes, 16 * MB);
    words.push_back(8); // grows into memory that stays
    EXPECT_EQ(words[3 * MB], 7u);
    EXPECT_LT(paged_memory::counts().bytes, bytes);
}

// A file that is mapped counts with the rest, and comes again when it has no name any more.
TEST(PagedMemory, MappedFilesComeAndGo) {
    std::string path = (std::filesystem::path("/var/tmp") / "kanuka-mapped-XXXXXX").string();
    const int handle = mkstemp(path.data());
    ASSERT_GE(handle, 0);
    std::vector<uint64_t> words(MB / 8);
    for (uint64_t m = 0; m < 128; m++) {
        for (size_t i = 0; i < words.size(); i++)
            words[i] = (m * words.size() + i) * 0x9e3779b97f4a7c15;
        ASSERT_EQ(write(handle, words.data(), MB), ssize_t(MB));
    }
    const uint64_t bound = resident() + 64 * MB;
    const paged_memory::Counts before = paged_memory::counts();
    {
        const paged_memory::Hold hold({bound, {}});
        const MappedFile mapped(handle, 128 * MB);
        ASSERT_EQ(mapped.bytes().size(), 128 * MB);
        EXPECT_EQ(paged_memory::counts().bytes, before.bytes); // it needs no room on the disk
        std::filesystem::remove(path);
        close(handle);
        const uint64_t* const found = reinterpret_cast<const uint64_t*>(mapped.bytes().data());
        uint64_t most = 0, wrong = 0;
        for (int round = 0; round < 3; round++)
            for (size_t i = 0; i < 16 * MB; i++) {
                wrong += found[i] != i * 0x9e3779b97f4a7c15;
                if (i % (MB / 8) == 0) {
                    paged_memory::keep_within_bound();
                    most = std::max(most, resident());
                }
            }
        EXPECT_EQ(wrong, 0u);
        EXPECT_LT(most, bound);
        EXPECT_GT(paged_memory::counts().given_back - before.given_back, 128 * MB);
    }
    EXPECT_EQ(paged_memory::counts().bytes, before.bytes);
    EXPECT_TRUE(MappedFile().empty());
    EXPECT_TRUE(MappedFile(-1, 8).empty());
}

TEST(PagedMemory, ReservedSpaceNeedsRoom) {
    const paged_memory::Hold hold({256 * MB, {}});
    char* const p = static_cast<char*>(paged_memory::reserve(uint64_t(8) << 30));
    ASSERT_NE(p, nullptr);
    const uint64_t before = paged_memory::counts().bytes;
    ASSERT_TRUE(paged_memory::make_room(p, 3 * MB));
    p[3 * MB - 1] = 5;
    const uint64_t there = paged_memory::counts().bytes - before;
    EXPECT_GE(there, 3 * MB);
    EXPECT_LE(there, 70 * MB); // by steps
    EXPECT_EQ(p[3 * MB - 1], 5);
    EXPECT_TRUE(paged_memory::release(p));
    EXPECT_FALSE(paged_memory::release(p));
}

TEST(PagedMemory, AFullDiskIsNoEnd) {
    const paged_memory::Hold hold({64 * MB, {}});
    const paged_memory::Counts before = paged_memory::counts();
    EXPECT_EQ(paged_memory::allocate(uint64_t(1) << 50), nullptr); // no disk has a petabyte
    EXPECT_GT(paged_memory::counts().refused, before.refused);
    EXPECT_EQ(paged_memory::counts().bytes, before.bytes);
}

// What is mapped needs no open file: scenes have thousands of arrays.
TEST(PagedMemory, KeepsFewFilesOpen) {
    rlimit before;
    getrlimit(RLIMIT_NOFILE, &before);
    rlimit few = before;
    few.rlim_cur = 64;
    setrlimit(RLIMIT_NOFILE, &few);
    {
        const paged_memory::Hold hold({64 * MB, {}});
        const uint64_t bytes = paged_memory::counts().bytes;
        std::vector<LargeVector<uint8_t>> arrays(128);
        for (auto& array : arrays)
            array.resize(2 * MB);
        EXPECT_EQ(paged_memory::counts().bytes - bytes, 256 * MB);
    }
    setrlimit(RLIMIT_NOFILE, &before);
}

TEST(PagedMemory, FoldersThatCannotServe) {
    EXPECT_THROW(paged_memory::Hold({64 * MB, "/nowhere/at/all"}), Error);
    if (std::filesystem::exists("/dev/shm")) { // files there are memory
        EXPECT_THROW(paged_memory::Hold({64 * MB, "/dev/shm"}), Error);
    }
}

TEST(PagedMemory, SizesOfTheEnvironment) {
    setenv("KANUKA_MEMORY", "1.5G", 1);
    EXPECT_EQ(memory_budget_of_environment().bytes, 3 * 512 * MB);
    setenv("KANUKA_MEMORY", "much", 1);
    EXPECT_THROW(memory_budget_of_environment(), Error);
    unsetenv("KANUKA_MEMORY");
    EXPECT_EQ(memory_budget_of_environment().bytes, 0u);
}

} // namespace
} // namespace kanuka
