#include "shade/textures.h"

#include <OpenImageIO/half.h>
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <atomic>
#include <barrier>
#include <cmath>
#include <malloc.h>
#include <thread>

#include "shade/linear_input.h"
#include "shade/shade.h"
#include "shade/test_support.h"

namespace kanuka::shade {
namespace {

using test::Lookup;

struct TexturesTest : testing::Test {
    test::TemporaryFolder folder;
    Journal journal;
    Textures textures{{folder.str()}, size_t(64) << 20, journal};
    Location where{"scene.rib", 4, 2};

    // Left half `left`, right half `right`.
    void write(const std::string& name, OIIO::TypeDesc format, std::vector<float> left,
               std::vector<float> right, int size = 64) {
        OIIO::ImageBuf picture(OIIO::ImageSpec(size, size, int(left.size()), format));
        OIIO::ImageBufAlgo::fill(picture, left, OIIO::ROI(0, size / 2, 0, size));
        OIIO::ImageBufAlgo::fill(picture, right, OIIO::ROI(size / 2, size, 0, size));
        ASSERT_TRUE(picture.write((folder.path / name).string())) << picture.geterror();
    }
};

TEST_F(TexturesTest, WhatFollowsTheLastDotMayBeAFramesNumber) {
    write("walk.exr", OIIO::TypeDesc::HALF, {1, 0, 0}, {1, 0, 0});
    write("walk.0002.exr", OIIO::TypeDesc::HALF, {0, 1, 0}, {0, 1, 0});
    Lookup numbered("walk.0002", {0.25f}, {0.5f}), suffixed("walk.tif", {0.25f}, {0.5f});
    textures.lookup(numbered.request, where);
    textures.lookup(suffixed.request, where);
    EXPECT_EQ(numbered.result, (std::vector<float>{0, 1, 0}));
    EXPECT_EQ(suffixed.result, (std::vector<float>{1, 0, 0}));
}

TEST_F(TexturesTest, EightBitColoursAreDecodedToLinearLight) {
    write("color.png", OIIO::TypeDesc::UINT8, {0.5f, 0.25f, 1}, {0, 0, 0});
    write("color.jpg", OIIO::TypeDesc::UINT8, {0.5f, 0.5f, 0.5f}, {0, 0, 0});
    Lookup png("color.png", {0.25f}, {0.5f}), jpg("color.jpg", {0.25f}, {0.5f});
    textures.lookup(png.request, where);
    textures.lookup(jpg.request, where);
    const float half_encoded = std::pow((128 / 255.0f + 0.055f) / 1.055f, 2.4f);
    EXPECT_NEAR(png.result[0], half_encoded, 2e-3f);
    EXPECT_NEAR(png.result[1], 0.0513f, 1e-3f);
    EXPECT_NEAR(png.result[2], 1, 1e-3f);
    EXPECT_NEAR(jpg.result[0], half_encoded, 5e-3f);
}

TEST_F(TexturesTest, DataIsNotDecoded) {
    write("height.png", OIIO::TypeDesc::UINT8, {0.5f}, {0}); // one channel: heights
    write("linear.exr", OIIO::TypeDesc::HALF, {0.5f, 2, 8}, {0, 0, 0});
    Lookup height("height.png", {0.25f}, {0.5f}), exr("linear.exr", {0.25f}, {0.5f});
    textures.lookup(height.request, where);
    textures.lookup(exr.request, where);
    for (int c = 0; c < 3; c++)
        EXPECT_NEAR(height.result[size_t(c)], 128 / 255.0f, 1e-3f) << "grey serves as a colour";
    EXPECT_NEAR(exr.result[0], 0.5f, 1e-3f);
    EXPECT_NEAR(exr.result[2], 8, 1e-2f);
}

TEST_F(TexturesTest, TheShadersColourspaceGoesOverThePictures) {
    write("normals.png", OIIO::TypeDesc::UINT8, {0.5f, 0.5f, 1}, {0, 0, 0});
    write("height.png", OIIO::TypeDesc::UINT8, {0.5f}, {0});
    const auto looked_up = [&](const char* file, const char* space) {
        Lookup lookup(file, {0.25f}, {0.5f});
        lookup.request.space = space;
        textures.lookup(lookup.request, where);
        return lookup.result[0];
    };
    constexpr float Code = 128 / 255.0f;
    const float light = std::pow((Code + 0.055f) / 1.055f, 2.4f);
    for (int again = 0; again < 2; again++) { // in one cache, in any order
        EXPECT_NEAR(looked_up("normals.png", "raw"), Code, 1e-3f);
        EXPECT_NEAR(looked_up("normals.png", nullptr), light, 2e-3f);
        EXPECT_NEAR(looked_up("normals.png", "auto"), light, 2e-3f);
        EXPECT_NEAR(looked_up("height.png", "srgb"), light, 2e-3f);
        EXPECT_NEAR(looked_up("height.png", "raw"), Code, 1e-3f);
    }
    EXPECT_TRUE(journal.entries().empty());
    EXPECT_NEAR(looked_up("normals.png", "rgb"), light, 2e-3f);
    ASSERT_EQ(journal.entries().size(), 1u);
    EXPECT_NE(journal.entries()[0].message.find("no colorspace \"rgb\""), std::string::npos);
}

TEST_F(TexturesTest, AlphaIsNotDecoded) {
    write("leaf.png", OIIO::TypeDesc::UINT8, {0.2f, 0.2f, 0.2f, 0.5f}, {0, 0, 0, 0});
    Lookup leaf("leaf.png", {0.25f}, {0.5f}, 0, 4);
    textures.lookup(leaf.request, where);
    EXPECT_NEAR(leaf.result[3], 128 / 255.0f, 2e-3f);
}

TEST_F(TexturesTest, FiltersLightNotCodesOverTheFootprint) {
    write("steps.png", OIIO::TypeDesc::UINT8, {1, 1, 1}, {0, 0, 0});
    Lookup sharp("steps.png", {0.25f, 0.75f}, {0.5f, 0.5f}, 1 / 64.0f), wide("steps.png", {0.5f}, {0.5f}, 1);
    textures.lookup(sharp.request, where);
    textures.lookup(wide.request, where);
    EXPECT_NEAR(sharp.result[0], 1, 1e-3f);
    EXPECT_NEAR(sharp.result[1], 0, 1e-3f);
    EXPECT_NEAR(wide.result[0], 0.5f, 0.03f) << "half of the light; codes would give 0.21";
    EXPECT_GT(textures.bytes(), 0u);
}

TEST_F(TexturesTest, TopRowIsTZeroAndPlainPicturesRepeat) {
    OIIO::ImageBuf picture(OIIO::ImageSpec(8, 8, 3, OIIO::TypeDesc::HALF));
    OIIO::ImageBufAlgo::fill(picture, {1.0f, 1.0f, 1.0f}, OIIO::ROI(0, 8, 0, 4));
    OIIO::ImageBufAlgo::fill(picture, {0.0f, 0.0f, 0.0f}, OIIO::ROI(0, 8, 4, 8));
    ASSERT_TRUE(picture.write((folder.path / "top.exr").string()));
    Lookup repeat("top.exr", {0.5f, 3.5f}, {0.25f, -2.75f}), black("top.exr", {3.5f}, {0.25f});
    black.request.wrap = "black";
    textures.lookup(repeat.request, where);
    textures.lookup(black.request, where);
    EXPECT_NEAR(repeat.result[0], 1, 1e-3f);
    EXPECT_NEAR(repeat.result[1], 1, 1e-3f);
    EXPECT_NEAR(black.result[0], 0, 1e-3f);
}

TEST_F(TexturesTest, MissingFilesAreReportedOnceForWhoAsks) {
    Lookup lookup("nowhere.tx", {0, 0.5f}, {0, 0.5f});
    textures.lookup(lookup.request, where);
    textures.lookup(lookup.request, where);
    const auto entries = journal.entries();
    ASSERT_EQ(entries.size(), 1u);
    EXPECT_EQ(entries[0].where.str(), "scene.rib:4:2");
    EXPECT_NE(entries[0].message.find("\"nowhere.tx\" is not found; searched in \"" + folder.str()),
              std::string::npos);
    for (float v : lookup.result)
        EXPECT_EQ(v, 0.5f);
}

TEST_F(TexturesTest, ChannelsThatAFileHasNotAreFilled) {
    write("three.exr", OIIO::TypeDesc::HALF, {0.25f, 0.5f, 1}, {0.25f, 0.5f, 1});
    write("one.exr", OIIO::TypeDesc::HALF, {0.75f}, {0.75f});
    const auto read = [&](const char* file, int first, int channels) {
        Lookup lookup(file, {0.5f}, {0.5f}, 0, channels);
        lookup.request.first_channel = first;
        lookup.request.fill = 0.125f;
        textures.lookup(lookup.request, where);
        return lookup.result;
    };
    EXPECT_EQ(read("three.exr", 3, 1), (std::vector<float>{0.125f}));
    EXPECT_EQ(read("three.exr", 1000000, 3), (std::vector<float>{0.125f, 0.125f, 0.125f}));
    EXPECT_EQ(read("three.exr", 2147483647, 3), (std::vector<float>{0.125f, 0.125f, 0.125f}));
    EXPECT_EQ(read("three.exr", 2, 3), (std::vector<float>{1, 0.125f, 0.125f}));
    EXPECT_EQ(read("three.exr", -1, 1), (std::vector<float>{0.25f}));
    EXPECT_EQ(read("one.exr", 0, 3), (std::vector<float>{0.75f, 0.75f, 0.75f})) << "grey serves as a colour";
    EXPECT_EQ(read("one.exr", 1, 3), (std::vector<float>{0.125f, 0.125f, 0.125f}));
    EXPECT_TRUE(read("three.exr", 0, 0).empty());
    EXPECT_TRUE(journal.entries().empty());
}

TEST_F(TexturesTest, CoordinatesAndFootprintsOfAnySize) {
    write("dots.png", OIIO::TypeDesc::UINT8, {1, 1, 1}, {0, 0, 0});
    const float any[] = {1e9f, -1e9f, 1e30f, -3.4e38f, INFINITY, NAN};
    for (const char* wrap : {"black", "clamp", "periodic", "mirror"})
        for (const float x : any)
            for (const float y : any) {
                Lookup lookup("dots.png", {x, 0.5f, x}, {0.5f, x, y}, y);
                lookup.request.wrap = wrap;
                lookup.request.blur = x, lookup.request.width = y;
                textures.lookup(lookup.request, where);
                for (const float v : lookup.result)
                    ASSERT_TRUE(v >= 0 && v <= 1) << v;
            }
}

// 120 bytes that claim 67 million pixels a row: refused before anything is allocated.
TEST_F(TexturesTest, HeadersThatClaimTooMuchAreRefused) {
    const auto little = [](uint32_t value, int bytes) {
        std::string out;
        for (int i = 0; i < bytes; i++)
            out += char(value >> (8 * i));
        return out;
    };
    const auto bmp = [&](uint32_t width, uint32_t height) {
        return "BM" + little(120, 4) + little(0, 4) + little(54, 4) + little(40, 4) + little(width, 4) +
               little(height, 4) + little(1, 2) + little(24, 2) + std::string(24 + 66, 'x');
    };
    folder.write("wide.bmp", bmp(0x4000008, 4));
    folder.write("both.bmp", bmp(60000, 60000));
    for (const char* name : {"wide.bmp", "both.bmp"}) {
        Lookup lookup(name, {0.5f}, {0.5f});
        textures.lookup(lookup.request, where);
        EXPECT_EQ(lookup.result, (std::vector<float>{0.5f, 0.5f, 0.5f}));
        EXPECT_FALSE(read_latlong((folder.path / name).string(), color::Space::Rec709, 0, where, journal));
    }
    for (const Journal::Entry& e : journal.entries())
        EXPECT_NE(e.message.find("it claims "), std::string::npos) << e.message;
    EXPECT_EQ(journal.entries().size(), 4u);
}

// The window that a picture says it is a part of is covered with tiles, and those are counted in an int.
TEST_F(TexturesTest, DisplayWindowsThatClaimTooMuchAreRefused) {
    struct Window {
        int x, y, width, height;
    };
    const std::vector<Window> windows = {{0, -16777216, 8388608, 16777224},
                                         {0, 0, 1 << 23, 1 << 24},
                                         {0, 0, 2097152, 2097152},
                                         {-900000000, 0, 16, 16},
                                         {0, 0, 900000000, 16}}; // more is not written
    for (const Window& w : windows) {
        const std::string name =
            std::to_string(w.width) + "_" + std::to_string(w.x) + "_" + std::to_string(w.y) + ".exr";
        OIIO::ImageSpec spec(16, 8, 3, OIIO::TypeDesc::HALF);
        spec.full_x = w.x, spec.full_y = w.y, spec.full_width = w.width, spec.full_height = w.height;
        OIIO::ImageBuf picture(spec);
        ASSERT_TRUE(picture.write((folder.path / name).string())) << picture.geterror();
        Lookup look(name, {0.25f}, {0.5f});
        textures.lookup(look.request, where);
        for (const float x : look.result)
            EXPECT_TRUE(std::isfinite(x)) << name;
    }
    // What is a part of a larger one, as render regions are, is read.
    OIIO::ImageSpec spec(16, 8, 3, OIIO::TypeDesc::HALF);
    spec.x = 100, spec.y = 50, spec.full_width = 4096, spec.full_height = 2160;
    OIIO::ImageBuf part(spec);
    const float red[3] = {1, 0, 0};
    OIIO::ImageBufAlgo::fill(part, red);
    ASSERT_TRUE(part.write((folder.path / "part.exr").string())) << part.geterror();
    Lookup look("part.exr", {108.0f / 4096}, {54.0f / 2160});
    textures.lookup(look.request, where);
    EXPECT_EQ(look.result[0], 1);
    EXPECT_EQ(look.result[1], 0);
    size_t refused = 0;
    for (const Journal::Entry& e : journal.entries())
        refused += e.message.find("it claims ") != std::string::npos;
    EXPECT_EQ(refused, windows.size());
}

TEST_F(TexturesTest, BrokenFilesAreReported) {
    folder.write("broken.png", "this is no picture");
    Lookup lookup("broken.png", {0.5f}, {0.5f});
    textures.lookup(lookup.request, where);
    ASSERT_EQ(journal.entries().size(), 1u);
    EXPECT_NE(journal.entries()[0].message.find("broken.png\" cannot be read"), std::string::npos)
        << journal.entries()[0].message;
    EXPECT_EQ(lookup.result[0], 0.5f);
}

TEST_F(TexturesTest, FilesOfOtherRenderersAreSaidToBe) {
    folder.write("wood.tex", std::string("\x01\x02texture of somebody's own", 20));
    folder.write("sun.shd", "Aqsis ZFile 1.8 and so on");
    const auto said = [&](const char* name) {
        Lookup lookup(name, {0.5f}, {0.5f});
        textures.lookup(lookup.request, where);
        for (const Journal::Entry& e : journal.entries())
            if (e.message.find(name) != std::string::npos)
                return e.message;
        return std::string();
    };
    EXPECT_NE(said("wood.tex").find("is in a format that only the renderer reads that made it"),
              std::string::npos);
    EXPECT_NE(said("sun.shd").find("is a depth file for shadow maps"), std::string::npos);
    // Who asks whether it is there gets no for an answer, and is told why.
    const size_t before = journal.entries().size();
    EXPECT_FALSE(textures.info("wood.tex"));
    ASSERT_EQ(journal.entries().size(), before + 1);
    EXPECT_FALSE(textures.info("nowhere.tex"));
    EXPECT_EQ(journal.entries().size(), before + 1);
}

TEST_F(TexturesTest, AMadeTexturesNameFindsThePictureItWasMadeFrom) {
    write("grid.tif", OIIO::TypeDesc::FLOAT, {1, 0, 0}, {1, 0, 0});
    EXPECT_EQ(textures.find("grid.tx"), folder.str() + "/grid.tif");
    EXPECT_EQ(textures.find("grid.tif.tx"), folder.str() + "/grid.tif");
    EXPECT_EQ(textures.find("other.tx"), "");
}

TEST_F(TexturesTest, NotANumberReadsAPicturesCorner) {
    write("color.exr", OIIO::TypeDesc::HALF, {0.25f, 0.5f, 1}, {0.25f, 0.5f, 1});
    const float nan = std::nanf(""), infinity = HUGE_VALF;
    Lookup lookup("color.exr", {nan, infinity}, {0.5f, nan}, nan);
    textures.lookup(lookup.request, where);
    EXPECT_NEAR(lookup.result[0], 0.25f, 1e-3f);
    EXPECT_NEAR(lookup.result[1], 0.25f, 1e-3f);
}

TEST_F(TexturesTest, EnvironmentPoleIsPlusZ) {
    OIIO::ImageBuf picture(OIIO::ImageSpec(64, 32, 3, OIIO::TypeDesc::HALF));
    OIIO::ImageBufAlgo::fill(picture, {1.0f, 0.0f, 0.0f}, OIIO::ROI(0, 64, 0, 16));
    OIIO::ImageBufAlgo::fill(picture, {0.0f, 0.0f, 1.0f}, OIIO::ROI(0, 64, 16, 32));
    ASSERT_TRUE(picture.write((folder.path / "sky.exr").string()));
    const float x[] = {0, 0.6f, 0}, y[] = {0, 0, 0}, z[] = {1, 0.8f, -1};
    Lookup lookup("sky.exr", {0, 0, 0}, {0, 0, 0});
    textures.lookup_environment(lookup.request, x, y, z, where);
    EXPECT_NEAR(lookup.result[0], 1, 1e-2f);
    EXPECT_NEAR(lookup.result[1], 1, 1e-2f);
    EXPECT_NEAR(lookup.result[2], 0, 1e-2f);
    EXPECT_NEAR(lookup.result[3 * 2 + 2], 1, 1e-2f);
}

// Green of sRGB in ACEScg, by its published matrix (S-2014-004; Bradford from D65 to ACES's white).
TEST_F(TexturesTest, LatLongOfCodesIsBroughtToTheSpace) {
    write("sky.png", OIIO::TypeDesc::UINT8, {0, 1, 0}, {0, 1, 0});
    const auto sky =
        read_latlong((folder.path / "sky.png").string(), color::Space::AcesCg, 0, where, journal);
    ASSERT_TRUE(sky);
    EXPECT_NEAR(sky->rgb[0], 0.3395f, 2e-3f);
    EXPECT_NEAR(sky->rgb[1], 0.9164f, 2e-3f);
    EXPECT_NEAR(sky->rgb[2], 0.1096f, 2e-3f);
}

TEST_F(TexturesTest, LatLongIsReadWholeLinearAndShrunk) {
    write("sky.png", OIIO::TypeDesc::UINT8, {0.5f, 0.5f, 0.5f}, {0, 1, 0});
    const std::string path = (folder.path / "sky.png").string();
    const auto full = read_latlong(path, color::Space::Rec709, 0, where, journal),
               small = read_latlong(path, color::Space::Rec709, 4, where, journal);
    ASSERT_TRUE(full && small);
    EXPECT_EQ(full->width, 64);
    EXPECT_EQ(small->width, 4);
    EXPECT_EQ(small->height, 4);
    for (const auto& picture : {*full, *small}) {
        EXPECT_NEAR(picture.rgb[0], 0.2159f, 1e-3f);
        EXPECT_NEAR(picture.rgb[size_t(picture.width) * 3 - 2], 1, 1e-3f);
    }
    folder.write("broken.exr", "no");
    EXPECT_FALSE(
        read_latlong((folder.path / "broken.exr").string(), color::Space::Rec709, 0, where, journal));
    EXPECT_EQ(journal.entries().size(), 1u);
}

TEST_F(TexturesTest, ManyThreadsReadTheSame) {
    write("steps.png", OIIO::TypeDesc::UINT8, {0.8f, 0.4f, 0.1f}, {0.1f, 0.2f, 0.9f}, 256);
    std::vector<float> s, t;
    for (int i = 0; i < 4096; i++)
        s.push_back(float((i * 7919) % 4096) / 4096), t.push_back(float((i * 104729) % 4096) / 4096);
    Lookup one("steps.png", s, t, 0.01f);
    std::vector<Lookup> many;
    for (int i = 0; i < 4; i++)
        many.emplace_back("steps.png", s, t, 0.01f);
    std::vector<std::thread> threads;
    for (Lookup& l : many)
        threads.emplace_back([&, file = std::string("steps.png")] {
            l.request.file = file.c_str(); // moved with its vector
            textures.lookup(l.request, where);
        });
    for (auto& thread : threads)
        thread.join();
    textures.lookup(one.request, where);
    for (const Lookup& l : many)
        EXPECT_EQ(l.result, one.result);
}

// Threads outlive caches, and a cache may stand where another stood: what it finds for a thread is its own.
// Freed memory is overwritten, so that what is looked up there falls.
TEST_F(TexturesTest, ThreadsOutliveCaches) {
    constexpr int Caches = 50;
    write("plain.exr", OIIO::TypeDesc::FLOAT, {0.8f, 0.4f, 0.1f}, {0.1f, 0.2f, 0.9f});
    mallopt(M_PERTURB, 0xa5);
    std::unique_ptr<Textures> cache;
    std::barrier step(2);
    std::thread worker([&] {
        for (int i = 0; i < Caches; i++) {
            step.arrive_and_wait();
            Lookup l("plain.exr", {0.1f, 0.9f}, {0.5f, 0.5f});
            cache->lookup(l.request, where);
            EXPECT_FLOAT_EQ(l.result[0], 0.8f) << i;
            EXPECT_TRUE(cache->info("plain.exr"));
            step.arrive_and_wait();
        }
    });
    for (int i = 0; i < Caches; i++) {
        cache = std::make_unique<Textures>(std::vector<std::string>{folder.str()}, size_t(64) << 20, journal);
        step.arrive_and_wait();
        step.arrive_and_wait();
        cache.reset();
    }
    worker.join();
    mallopt(M_PERTURB, 0);
}

// A cache's threads share a reader: whoever reads has the level that it asked for, of one value each here.
TEST_F(TexturesTest, ReadersServeManyThreads) {
    constexpr int Size = 256, Tile = 16, Levels = 5, Threads = 4, Reads = 4000;
    const std::string name = (folder.path / "levels.tif").string();
    const auto value = [](int level) { return uint8_t(40 * level + 30); };
    {
        auto out = OIIO::ImageOutput::create(name);
        for (int level = 0; level < Levels; level++) {
            const int size = Size >> level;
            OIIO::ImageSpec spec(size, size, 3, OIIO::TypeDesc::UINT8);
            spec.tile_width = spec.tile_height = Tile;
            spec.attribute("oiio:ColorSpace", "sRGB");
            spec.attribute("textureformat", "Plain Texture");
            ASSERT_TRUE(
                out->open(name, spec, level ? OIIO::ImageOutput::AppendSubimage : OIIO::ImageOutput::Create));
            const std::vector<uint8_t> pixels(size_t(size * size * 3), value(level));
            ASSERT_TRUE(out->write_image(OIIO::TypeDesc::UINT8, pixels.data())) << out->geterror();
        }
        out->close();
    }
    LinearInput input;
    OIIO::ImageSpec spec;
    ASSERT_TRUE(input.open(name, spec)) << input.geterror();
    ASSERT_EQ(spec.format, OIIO::TypeDesc::HALF); // decoded through the reader's own buffer
    ASSERT_TRUE(input.seek_subimage(0, Levels - 1));
    std::atomic<int> wrong{0};
    std::vector<std::thread> threads;
    for (int k = 0; k < Threads; k++)
        threads.emplace_back([&, k] {
            std::vector<half> tile(size_t(Tile * Tile * 3));
            for (int i = 0; i < Reads; i++) {
                const int level = (i * 7 + k * 3) % Levels, tiles = (Size >> level) / Tile;
                const int x = i * 5 % tiles * Tile, y = (i * 11 + k) % tiles * Tile;
                bool right = input.read_native_tile(0, level, x, y, 0, tile.data());
                const float expected = std::pow((float(value(level)) / 255 + 0.055f) / 1.055f, 2.4f);
                for (const half& h : tile)
                    right = right && std::abs(float(h) - expected) < 1e-3f;
                wrong += !right;
            }
        });
    for (auto& thread : threads)
        thread.join();
    EXPECT_EQ(wrong, 0) << input.geterror();
}

} // namespace
} // namespace kanuka::shade
