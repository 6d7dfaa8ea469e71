// Pictures of many tiles.
#include "shade/udim.h"

#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>

#include "shade/test_support.h"
#include "shade/textures.h"

namespace kanuka::shade {
namespace {

using test::Lookup;

struct Udim : testing::Test {
    test::TemporaryFolder folder;
    Journal journal;
    Textures textures{{folder.str()}, size_t(64) << 20, journal};

    void write(const std::string& name, std::vector<float> color) const {
        OIIO::ImageBuf picture(OIIO::ImageSpec(32, 32, 3, OIIO::TypeDesc::FLOAT));
        OIIO::ImageBufAlgo::fill(picture, color);
        ASSERT_TRUE(picture.write((folder.path / name).string())) << picture.geterror();
    }
    // The first channel; v = 1 - t, as artists have it.
    std::vector<float> look(const std::string& name, const std::vector<std::pair<float, float>>& sv) {
        std::vector<float> s, t;
        for (const auto& [a, v] : sv)
            s.push_back(a), t.push_back(1 - v);
        Lookup lookup(name, s, t, 0.001f);
        textures.lookup(lookup.request, Location{"scene.rib", 1, 1});
        return {lookup.result.begin(), lookup.result.begin() + std::ptrdiff_t(s.size())};
    }
};

TEST_F(Udim, TilesAreNumberedAlongRowsOfTen) {
    write("a.1001.exr", {1, 0, 0}), write("a.1002.exr", {2, 0, 0});
    write("a.1011.exr", {3, 0, 0}), write("a.1023.exr", {4, 0, 0});
    EXPECT_EQ(look("a.<UDIM>.exr", {{0.5f, 0.5f}, {1.5f, 0.5f}, {0.5f, 1.5f}, {2.25f, 2.75f}}),
              (std::vector<float>{1, 2, 3, 4}));
    EXPECT_TRUE(journal.entries().empty());
    write("b_u1_v1.exr", {1, 0, 0}), write("b_u2_v1.exr", {2, 0, 0}), write("b_u1_v2.exr", {3, 0, 0});
    EXPECT_EQ(look("b_<UVTILE>.exr", {{0.5f, 0.5f}, {1.5f, 0.5f}, {0.5f, 1.5f}}),
              (std::vector<float>{1, 2, 3}));
}

// A tile shows its picture upright, and all of it.
TEST_F(Udim, ATileIsLookedUpInItsOwnCoordinates) {
    OIIO::ImageBuf picture(OIIO::ImageSpec(64, 64, 3, OIIO::TypeDesc::FLOAT));
    for (int y = 0; y < 64; y++)
        for (int x = 0; x < 64; x++)
            picture.setpixel(x, y,
                             OIIO::cspan<float>({(float(x) + 0.5f) / 64, 1 - (float(y) + 0.5f) / 64, 0}));
    ASSERT_TRUE(picture.write((folder.path / "c.1012.exr").string()));
    Lookup lookup("c.<UDIM>.exr", {1.25f, 1.75f}, {1 - 1.125f, 1 - 1.625f}, 0.001f);
    textures.lookup(lookup.request, Location{"scene.rib", 1, 1});
    EXPECT_NEAR(lookup.result[0], 0.25f, 1e-3f);
    EXPECT_NEAR(lookup.result[1], 0.75f, 1e-3f);
    EXPECT_NEAR(lookup.result[2], 0.125f, 1e-3f);
    EXPECT_NEAR(lookup.result[3], 0.625f, 1e-3f);
}

TEST_F(Udim, PointsOnABorderBelongToWhereTheOthersAre) {
    write("a.1001.exr", {1, 0, 0}), write("a.1002.exr", {2, 0, 0});
    EXPECT_EQ(look("a.<UDIM>.exr", {{0.5f, 0.5f}, {1, 0.5f}}), (std::vector<float>{1, 1}));
    EXPECT_EQ(look("a.<UDIM>.exr", {{1.5f, 0.5f}, {1, 0.5f}}), (std::vector<float>{2, 2}));
    // By themselves: the tile that begins there, if there is one.
    EXPECT_EQ(look("a.<UDIM>.exr", {{1, 0.5f}}), (std::vector<float>{2}));
    EXPECT_EQ(look("a.<UDIM>.exr", {{2, 0.5f}, {0.5f, 1}, {2, 1}, {0, 0}}), (std::vector<float>{2, 1, 2, 1}));
    EXPECT_TRUE(journal.entries().empty());
}

TEST_F(Udim, ATileThatIsMissingIsToldByItsName) {
    write("a.1001.exr", {1, 0, 0});
    EXPECT_EQ(look("a.<UDIM>.exr", {{0.5f, 0.5f}, {1.5f, 0.5f}}), (std::vector<float>{1, 0.5f}));
    ASSERT_EQ(journal.entries().size(), 1u);
    EXPECT_NE(journal.entries()[0].message.find("a.1002.exr"), std::string::npos)
        << journal.entries()[0].message;
}

TEST_F(Udim, PointsThatAreNowhereHaveATileToo) {
    write("a.1001.exr", {1, 0, 0});
    const float nan = std::numeric_limits<float>::quiet_NaN(), huge = 1e30f;
    for (const auto& place : {std::pair{nan, nan}, {-3.0f, -huge}, {-huge, 0.5f}})
        EXPECT_EQ(look("a.<UDIM>.exr", {place}), (std::vector<float>{1}));
    look("a.<UDIM>.exr", {{huge, huge}});
}

TEST_F(Udim, TheirIdentityIsThatOfAllTiles) {
    write("a.1001.exr", {1, 0, 0});
    const Digest one = textures.identity("a.<UDIM>.exr");
    write("a.1002.exr", {1, 0, 0}), write("a.10022.exr", {1, 0, 0}), write("b.1001.exr", {1, 0, 0});
    const Digest two = textures.identity("a.<UDIM>.exr");
    EXPECT_NE(one, two);
    EXPECT_EQ(textures.identity("a.<UDIM>.exr"), two);
    EXPECT_EQ(tile_files("a.<UDIM>.exr", std::vector{folder.str()}).size(), 2u);
    EXPECT_EQ(textures.info("a.<UDIM>.exr")->width, 32);
}

} // namespace
} // namespace kanuka::shade
