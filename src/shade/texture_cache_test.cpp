// Tiled files that stand for plain pictures: whether one was there changes no bit.
#include "shade/texture_cache.h"

#include <OpenImageIO/imagebuf.h>
#include <fstream>

#include "color/color.h"
#include "shade/test_support.h"
#include "shade/textures.h"

namespace kanuka::shade {
namespace {

namespace fs = std::filesystem;
using test::Lookup;

struct TextureCacheTest : testing::Test {
    test::TemporaryFolder folder;
    Journal journal;
    const std::string kept = (folder.path / "kept").string();

    TextureCacheTest() { setenv("KANUKA_TEXTURE_CACHE", kept.c_str(), 1); }
    ~TextureCacheTest() override {
        unsetenv("KANUKA_TEXTURE_CACHE");
        unsetenv("KANUKA_TEXTURE_CACHE_SIZE");
    }

    // Red rises with s, green with t, in 8 bits; blue is `blue`.
    void write(const std::string& name, int width = 1024, int height = 512, float blue = 0.5f) const {
        OIIO::ImageBuf picture(OIIO::ImageSpec(width, height, 3, OIIO::TypeDesc::UINT8));
        for (int y = 0; y < height; y++)
            for (int x = 0; x < width; x++)
                picture.setpixel(
                    x, y, OIIO::cspan<float>({float(x) / float(width), float(y) / float(height), blue}));
        ASSERT_TRUE(picture.write((folder.path / name).string())) << picture.geterror();
    }
    std::vector<float> look(Textures& textures, const char* space = "raw", float footprint = 0.02f) const {
        std::vector<float> s, t;
        for (int i = 0; i < 64; i++)
            s.push_back(float(i * 37 % 64) / 64 + 0.003f), t.push_back(float(i * 11 % 64) / 64 + 0.001f);
        Lookup lookup("wood.png", s, t, footprint);
        lookup.request.space = space;
        textures.lookup(lookup.request, Location{"scene.rib", 1, 1});
        return lookup.result;
    }
    std::vector<float> look_anew(uint64_t made, const char* space = "raw", float footprint = 0.02f) {
        Textures textures({folder.str()}, size_t(64) << 20, journal);
        const std::vector<float> values = look(textures, space, footprint);
        EXPECT_EQ(textures.made(), made);
        return values;
    }
    std::vector<fs::path> files() const {
        std::vector<fs::path> all;
        for (const CachedFile& file : cached_files(kept, ""))
            all.push_back(file.path);
        return all;
    }
};

TEST_F(TextureCacheTest, AreMadeOnceAndShowThePicture) {
    write("wood.png");
    const std::vector<float> first = look_anew(1);
    ASSERT_EQ(files().size(), 1u);
    EXPECT_TRUE(files()[0].filename().string().starts_with("wood.")) << files()[0];
    EXPECT_TRUE(files()[0].string().ends_with(TextureFiles.suffix)) << files()[0];
    EXPECT_EQ(look_anew(0), first);
    for (size_t i = 0; i < 64; i++) {
        const float s = float(i * 37 % 64) / 64 + 0.003f, t = float(i * 11 % 64) / 64 + 0.001f;
        if (s < 0.03f || s > 0.97f || t < 0.03f || t > 0.97f)
            continue; // the filter reaches the other end
        EXPECT_NEAR(first[i], s, 0.004f);
        EXPECT_NEAR(first[64 + i], t, 0.004f);
        EXPECT_NEAR(first[128 + i], 0.5f, 0.003f);
    }
    EXPECT_TRUE(journal.entries().empty());
}

TEST_F(TextureCacheTest, SpacesHaveFilesOfTheirOwn) {
    write("wood.png");
    const std::vector<float> raw = look_anew(1), light = look_anew(1, "srgb");
    EXPECT_EQ(files().size(), 2u);
    EXPECT_NEAR(raw[128], 128.0f / 255, 1e-3f);
    EXPECT_NEAR(light[128], color::srgb_decode(128.0f / 255), 1e-3f);
    EXPECT_EQ(look_anew(0, "srgb"), light);
}

// OpenImageIO would print a line for each, since OpenEXR has no place for it.
TEST_F(TextureCacheTest, ProfilesOfPicturesStayWithThem) {
    OIIO::ImageSpec spec(1024, 512, 3, OIIO::TypeDesc::UINT8);
    const std::vector<unsigned char> profile(64, 7);
    spec.attribute("ICCProfile", OIIO::TypeDesc(OIIO::TypeDesc::UINT8, 64), profile.data());
    OIIO::ImageBuf picture(spec);
    ASSERT_TRUE(picture.write((folder.path / "wood.tif").string())) << picture.geterror();
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    look_anew(1); // "wood.png" stands for it
    EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST_F(TextureCacheTest, SmallOnesAreReadAsTheyAre) {
    write("wood.png", 256, 256);
    look_anew(0);
    EXPECT_TRUE(files().empty());
}

TEST_F(TextureCacheTest, APictureThatIsPaintedAnewHasAnotherFile) {
    write("wood.png");
    look_anew(1);
    write("wood.png", 1024, 512, 0.75f);
    EXPECT_NEAR(look_anew(1)[128], 0.75f, 0.003f);
}

TEST_F(TextureCacheTest, WhereTheFolderCannotBeWrittenTheBitsAreTheSame) {
    write("wood.png");
    const std::vector<float> first = look_anew(1);
    fs::remove_all(kept);
    std::ofstream(kept) << "in the way";
    EXPECT_EQ(look_anew(1), first);
    ASSERT_EQ(journal.entries().size(), 1u);
    EXPECT_NE(journal.entries()[0].message.find("KANUKA_TEXTURE_CACHE"), std::string::npos);
}

// Cut short, of zeros, or not OpenEXR at all.
TEST_F(TextureCacheTest, DamagedFilesAreMadeAgainWhileTheyAreRead) {
    write("wood.png");
    const std::vector<float> first = look_anew(1);
    const fs::path file = files()[0];
    const auto size = fs::file_size(file);
    for (const double part : {0.9, 0.5, 0.01, 0.0}) {
        fs::resize_file(file, uintmax_t(double(size) * part));
        EXPECT_EQ(look_anew(1), first) << part;
        EXPECT_EQ(fs::file_size(file), size);
        EXPECT_EQ(look_anew(0), first) << part;
    }
    std::ofstream(file) << "no picture";
    EXPECT_EQ(look_anew(1), first);
    const std::vector<float> fine = look_anew(0, "raw", 1e-4f);
    {
        std::fstream middle(file, std::ios::in | std::ios::out | std::ios::binary);
        middle.seekp(std::streamoff(size / 4));
        const std::string zeros(size / 2, '\0');
        middle.write(zeros.data(), std::streamsize(zeros.size()));
    }
    EXPECT_EQ(look_anew(1, "raw", 1e-4f), fine);
    ASSERT_FALSE(journal.entries().empty());
    for (const Journal::Entry& entry : journal.entries())
        EXPECT_NE(entry.message.find("damaged"), std::string::npos) << entry.message;
}

TEST_F(TextureCacheTest, TheOneThatWasNotUsedForLongestGoes) {
    write("wood.png");
    setenv("KANUKA_TEXTURE_CACHE_SIZE", "1K", 1); // less than a file
    Textures textures({folder.str()}, size_t(64) << 20, journal);
    const std::vector<float> first = look(textures);
    EXPECT_EQ(textures.made(), 2u) << "its file went before it was read";
    setenv("KANUKA_TEXTURE_CACHE_SIZE", "1G", 1);
    EXPECT_EQ(look_anew(files().empty() ? 1 : 0), first);
}

} // namespace
} // namespace kanuka::shade
