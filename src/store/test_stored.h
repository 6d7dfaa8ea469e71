// A folder of pages on disk that are told apart by numbers.
#pragma once

#include <filesystem>

#include <gtest/gtest.h>

#include "store/disk_store.h"
#include "store/test_pages.h"

namespace kanuka::store {

namespace fs = std::filesystem;
using namespace testing;

inline Digest name(uint64_t i) {
    return {i, ~i};
}

class Stored : public ::testing::Test {
  protected:
    void SetUp() override {
        m_folder = (fs::temp_directory_path() / "kanuka-store-XXXXXX").string();
        ASSERT_NE(mkdtemp(m_folder.data()), nullptr);
    }
    void TearDown() override { fs::remove_all(m_folder); }

    DiskStore::Settings settings() const {
        DiskStore::Settings s;
        s.folder = m_folder + "/pages";
        return s;
    }
    Page page(uint32_t seed, int size = 4) const {
        HandMade made(size, size, m_program);
        made.scramble(seed);
        return encode_one(made, m_program);
    }
    static std::shared_ptr<const Page> shared(Page page) {
        return std::make_shared<const Page>(std::move(page));
    }
    static StoredPage entry(uint64_t i, uint64_t of_read = 0) {
        StoredPage e;
        e.content = name(i), e.of_read = name(100 + of_read);
        e.reads = std::string("what\0was read", 13) + std::to_string(of_read);
        e.spectra = 3, e.palette = name(7);
        return e;
    }
    void write(std::initializer_list<uint64_t> which) {
        DiskStore disk(settings(), m_journal);
        for (const uint64_t i : which)
            disk.write(entry(i), shared(page(uint32_t(i))));
    }
    std::vector<fs::path> packs() const {
        std::vector<fs::path> found;
        for (const auto& file : fs::directory_iterator(m_folder + "/pages"))
            found.push_back(file.path());
        std::ranges::sort(found);
        return found;
    }
    // Is page `i` there, as it was made?
    bool comes_back(DiskStore& disk, uint64_t i) const {
        for (const StoredPage& stored : disk.find(name(i))) {
            Page back;
            if (disk.read(stored, m_program, back)) {
                EXPECT_EQ(back.words, page(uint32_t(i)).words);
                return true;
            }
        }
        return false;
    }
    size_t warnings() const { return m_journal.entries().size(); }

    grid::LayeringProgram m_program = lamp_program();
    std::string m_folder;
    Journal m_journal;
};

} // namespace kanuka::store
