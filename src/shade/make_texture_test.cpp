#include "shade/make_texture.h"

#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <OpenImageIO/imageio.h>
#include <cmath>
#include <functional>

#include "shade/search.h"
#include "shade/test_support.h"
#include "shade/textures.h"

namespace kanuka::shade {
namespace {

using Kind = TextureMaking::Kind;

struct MakeTexture : testing::Test {
    test::TemporaryFolder folder;
    std::string path(const char* name) const { return (folder.path / name).string(); }

    void write(const char* name, int width, int height, OIIO::TypeDesc format, int channels,
               const std::function<float(int x, int y, int c)>& value) {
        OIIO::ImageBuf picture(OIIO::ImageSpec(width, height, channels, format));
        std::vector<float> pixel(size_t(channels), 0.0f);
        for (int y = 0; y < height; y++)
            for (int x = 0; x < width; x++) {
                for (int c = 0; c < channels; c++)
                    pixel[size_t(c)] = value(x, y, c);
                picture.setpixel(x, y, pixel.data(), channels);
            }
        ASSERT_TRUE(picture.write(path(name))) << picture.geterror();
    }
    std::string failure(const TextureMaking& making) {
        try {
            make_texture(making);
        } catch (const Error& e) {
            return e.what();
        }
        return {};
    }
};

TEST_F(MakeTexture, IsTiledMipMappedAndSaysHowItWraps) {
    write("wood.png", 200, 100, OIIO::TypeDesc::UINT8, 3, [](int, int, int) { return 0.5f; });
    make_texture({Kind::Texture, {path("wood.png")}, path("wood.tex"), "clamp", "periodic", "gaussian"});
    const auto file = OIIO::ImageInput::open(path("wood.tex"));
    ASSERT_TRUE(file) << OIIO::geterror();
    EXPECT_STREQ(file->format_name(), "openexr");
    EXPECT_EQ(file->spec().tile_width, 64);
    EXPECT_EQ(file->spec().format, OIIO::TypeDesc::HALF);
    EXPECT_EQ(file->spec().get_string_attribute("wrapmodes"), "clamp,periodic");
    int levels = 0;
    while (file->seek_subimage(0, levels))
        levels++;
    EXPECT_EQ(levels, 8); // 200 100 50 25 12 6 3 1
}

// Lookups see what the picture itself would show: colours decoded, then filtered as light.
TEST_F(MakeTexture, LooksAsItsPicture) {
    const auto stripes = [](int x, int, int c) { return c == 3 ? 0.5f : float(x % 2) * 0.5f; };
    write("stripes.png", 64, 64, OIIO::TypeDesc::UINT8, 4, stripes);
    make_texture({Kind::Texture, {path("stripes.png")}, path("stripes.tx"), "periodic", "periodic"});
    Journal journal;
    Textures textures({folder.str()}, size_t(64) << 20, journal);
    textures.set_space(color::Space::AcesCg); // what was sRGB's is brought there, made or not
    float result[2][4];
    const float s = 0.5f, zero = 0, wide = 1;
    int k = 0;
    for (const char* name : {"stripes.png", "stripes.tx"}) {
        sl::TextureRequest request{};
        request.file = name;
        request.s = request.t = &s;
        request.dsdu = request.dtdv = &wide, request.dtdu = request.dsdv = &zero;
        request.count = 1, request.channels = 4, request.width = 1;
        request.result = result[k++], request.result_stride = 1;
        textures.lookup(request, {});
    }
    EXPECT_EQ(journal.error_count(), 0u);
    for (int c = 0; c < 4; c++)
        EXPECT_NEAR(result[1][c], result[0][c], 2e-3f) << c;
    EXPECT_NEAR(result[1][1], 0.5f * std::pow((128 / 255.0f + 0.055f) / 1.055f, 2.4f), 5e-3f);
}

TEST_F(MakeTexture, FiltersAndNumbersOfThePictureAreKept) {
    const auto dot = [](int x, int y, int) { return x == 16 && y == 16 ? 1000.0f : 0.0f; };
    write("dot.exr", 32, 32, OIIO::TypeDesc::FLOAT, 1, dot);
    double spread[2];
    int k = 0;
    for (const char* filter : {"box", "gaussian"}) {
        make_texture({Kind::Texture, {path("dot.exr")}, path("dot.tex"), "black", "black", filter});
        OIIO::ImageBuf level(path("dot.tex"), 0, 1);
        ASSERT_TRUE(level.read(0, 1, true, OIIO::TypeDesc::FLOAT));
        int lit = 0;
        for (int y = 0; y < 16; y++)
            for (int x = 0; x < 16; x++)
                lit += level.getchannel(x, y, 0, 0) > 1;
        spread[k++] = lit;
        OIIO::ImageBuf top(path("dot.tex"));
        EXPECT_EQ(top.nativespec().format, OIIO::TypeDesc::FLOAT);
        EXPECT_EQ(top.getchannel(16, 16, 0, 0), 1000);
    }
    EXPECT_EQ(spread[0], 1);
    EXPECT_GT(spread[1], 1);
}

// A dot in the middle of a texel of the second level spreads as the filter says, at the width that was asked
// for.
TEST_F(MakeTexture, WidthsOfFiltersAreHonoured) {
    write("dot.exr", 64, 64, OIIO::TypeDesc::FLOAT, 1,
          [](int x, int y, int) { return x / 2 == 16 && y / 2 == 16 ? 1.0f : 0.0f; });
    const auto level = [&](const char* filter, float s, float t, const char* wrap = "black") {
        make_texture({Kind::Texture, {path("dot.exr")}, path("dot.tex"), wrap, wrap, filter, 90, s, t});
        OIIO::ImageBuf b(path("dot.tex"), 0, 1);
        EXPECT_TRUE(b.read(0, 1, true, OIIO::TypeDesc::FLOAT));
        return b;
    };
    const auto reach = [&](const OIIO::ImageBuf& b, int dx, int dy) { // texels beside the dot that know of it
        int n = 0;
        while (n < 12 && std::abs(b.getchannel(16 + (n + 1) * dx, 16 + (n + 1) * dy, 0, 0)) > 1e-6f)
            n++;
        return n;
    };
    struct Case {
        const char* filter;
        float s, t;
        int across, down;
    };
    // A texel knows of the dot's texels, a quarter of one from its middle, if they lie within half the width.
    for (const Case& c : {Case{"box", 1, 1, 0, 0},
                          {"box", 3, 1, 1, 0},
                          {"box", 1, 5, 0, 2},
                          {"gaussian", 2, 2, 1, 1},
                          {"gaussian", 6, 4, 3, 2},
                          {"triangle", 4, 2, 2, 1},
                          {"mitchell", 8, 4, 4, 2},
                          {"sinc", 6, 6, 3, 3},
                          {"bessel", 6, 4, 3, 2},
                          {"catmull-rom", 4, 4, 2, 2},
                          {"disk", 3, 3, 1, 1}}) {
        const OIIO::ImageBuf b = level(c.filter, c.s, c.t);
        EXPECT_EQ(reach(b, 1, 0), c.across) << c.filter << " " << c.s;
        EXPECT_EQ(reach(b, -1, 0), c.across) << c.filter << " " << c.s;
        EXPECT_EQ(reach(b, 0, 1), c.down) << c.filter << " " << c.t;
        double sum = 0;
        for (int y = 0; y < 32; y++)
            for (int x = 0; x < 32; x++)
                sum += double(b.getchannel(x, y, 0, 0));
        EXPECT_NEAR(sum, 1, 1e-4) << c.filter; // what is there stays
    }
    EXPECT_NEAR(level("box", 3, 3).getchannel(17, 16, 0, 0), 1.0 / 9, 1e-6);
    EXPECT_LT(level("sinc", 6, 6).getchannel(17, 16, 0, 0) * level("sinc", 6, 6).getchannel(18, 16, 0, 0), 0);
}

TEST_F(MakeTexture, FiltersReachAroundTheEdges) {
    write("edge.exr", 30, 16, OIIO::TypeDesc::FLOAT, 1, [](int x, int, int) { return x < 2 ? 1.0f : 0.0f; });
    const auto last = [&](const char* wrap) {
        make_texture({Kind::Texture, {path("edge.exr")}, path("edge.tex"), wrap, "clamp", "box", 90, 3, 1});
        OIIO::ImageBuf b(path("edge.tex"), 0, 1);
        EXPECT_TRUE(b.read(0, 1, true, OIIO::TypeDesc::FLOAT));
        return b.getchannel(14, 3, 0, 0);
    };
    EXPECT_NEAR(last("periodic"), 1.0f / 3, 1e-6f);
    EXPECT_EQ(last("clamp"), 0);
    EXPECT_EQ(last("mirror"), 0);
    EXPECT_EQ(last("black"), 0);
}

// Faces painted with the direction that each texel looks along come back by direction.
TEST_F(MakeTexture, CubeFacesMeetAtTheirEdges) {
    struct Axes {
        float f[3], u[3], r[3];
    };
    // Forward, up, right: RISpec's six views; right is up x forward in a left-handed space.
    const Axes axes[6] = {{{1, 0, 0}, {0, 1, 0}, {0, 0, -1}}, {{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                          {{0, 1, 0}, {0, 0, -1}, {1, 0, 0}}, {{0, -1, 0}, {0, 0, 1}, {1, 0, 0}},
                          {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}},  {{0, 0, -1}, {0, 1, 0}, {-1, 0, 0}}};
    for (float fov : {90.0f, 95.0f}) {
        TextureMaking making{Kind::CubeFaces, {}, path("room.env"), "black", "black", "box", fov};
        const float extent = std::tan(fov * Pi / 360);
        for (int k = 0; k < 6; k++) {
            const std::string name = std::to_string(k) + ".exr";
            write(name.c_str(), 64, 64, OIIO::TypeDesc::FLOAT, 3, [&](int x, int y, int c) {
                const float s = ((float(x) + 0.5f) / 32 - 1) * extent,
                            t = (1 - (float(y) + 0.5f) / 32) * extent;
                float d[3], n = 0;
                for (int i = 0; i < 3; i++) {
                    d[i] = axes[k].f[i] + s * axes[k].r[i] + t * axes[k].u[i];
                    n += d[i] * d[i];
                }
                return 0.5f + 0.5f * d[c] / std::sqrt(n);
            });
            making.pictures.push_back(path(name.c_str()));
        }
        make_texture(making);
        Journal journal;
        Textures textures({folder.str()}, size_t(64) << 20, journal);
        EXPECT_TRUE(textures.info("room.env")->environment);
        for (int i = 0; i < 200; i++) {
            const float z = 1 - (float(i) + 0.5f) / 100, phi = 2.4f * float(i), r = std::sqrt(1 - z * z);
            const float d[3] = {r * std::cos(phi), r * std::sin(phi), z};
            float result[3];
            sl::TextureRequest request{};
            request.file = "room.env";
            request.count = 1, request.channels = 3;
            request.result = result, request.result_stride = 1;
            textures.lookup_environment(request, d, d + 1, d + 2, {});
            for (int c = 0; c < 3; c++)
                EXPECT_NEAR(result[c], 0.5f + 0.5f * d[c], 0.02f) << d[0] << " " << d[1] << " " << d[2];
        }
    }
}

TEST_F(MakeTexture, WhatCannotBeIsSaid) {
    write("a.exr", 8, 8, OIIO::TypeDesc::HALF, 1, [](int, int, int) { return 1.0f; });
    const std::string a = path("a.exr"), to = path("a.tex");
    EXPECT_NE(failure({Kind::Texture, {path("no.png")}, to}).find("there is no picture"), std::string::npos);
    folder.write("text.png", "no picture");
    EXPECT_NE(failure({Kind::Texture, {path("text.png")}, to}).find("cannot be read"), std::string::npos);
    EXPECT_NE(failure({Kind::Texture, {a}, to, "wrap"}).find("no wrap mode \"wrap\""), std::string::npos);
    EXPECT_NE(failure({Kind::Texture, {a}, to, "black", "black", "soft"}).find("there are box"),
              std::string::npos);
    EXPECT_NE(failure({Kind::CubeFaces, {a}, to}).find("of six; there are 1"), std::string::npos);
    EXPECT_NE(failure({Kind::Texture, {a}, path("no/a.tex")}).find("cannot be written"), std::string::npos);
}

TEST_F(MakeTexture, ScenesMakeTheirsAndPicturesStandForWhatCannotBeMade) {
    write("a.exr", 8, 8, OIIO::TypeDesc::HALF, 1, [](int, int, int) { return 1.0f; });
    scene::ValueList options;
    const auto ask = [&](const std::string& texture, const char* filter) {
        scene::Value v = test::text("maketexture:" + texture, "");
        v.strings = std::vector<std::string>{"a.exr", "texture", "black", "black", filter};
        v.where = {"s.rib", 3, 1};
        options.set(v);
    };
    const std::string good = path("good.tex"), bad = path("bad.tex");
    ask(good, "box");
    ask(bad, "soft");
    Journal journal;
    const auto made = make_textures(options, {folder.str()}, journal);
    EXPECT_EQ(made.at(good), good);
    EXPECT_TRUE(std::filesystem::exists(good));
    EXPECT_EQ(made.at(bad), path("a.exr"));
    ASSERT_EQ(journal.entries().size(), 1u);
    EXPECT_EQ(journal.entries()[0].where.str(), "s.rib:3:1");

    // Of six pictures none stands for the whole, nor does one that has the name by chance.
    scene::Value cube = test::text("maketexture:room", "");
    cube.strings = std::vector<std::string>{"a.exr",  "a.exr", "a.exr", "a.exr", "a.exr",
                                            "no.exr", "cube",  "black", "black", "box"};
    write("room.exr", 8, 8, OIIO::TypeDesc::HALF, 1, [](int, int, int) { return 1.0f; });
    scene::ValueList more;
    more.set(cube);
    Textures textures({folder.str()}, 1 << 20, journal);
    EXPECT_TRUE(textures.info("room"));
    Textures without({folder.str()}, 1 << 20, journal);
    without.set_made(make_textures(more, {folder.str()}, journal));
    EXPECT_FALSE(without.info("room"));
}

// Display "pic.tif" of a frame before is pic.exr, "env.xp" is env.xp.exr.
TEST_F(MakeTexture, PicturesOfOtherFramesAreFoundByTheNamesOfTheirDisplays) {
    for (const char* name : {"pic.exr", "env.xp.exr", "dof.exr"})
        write(name, 8, 8, OIIO::TypeDesc::HALF, 1, [](int, int, int) { return 1.0f; });
    Journal journal;
    const auto make = [&](const std::string& picture) {
        scene::ValueList options;
        scene::Value v = test::text("maketexture:" + path("it.tex"), "");
        v.strings = std::vector<std::string>{picture, "texture", "black", "black", "box"};
        options.set(v);
        return make_textures(options, {folder.str()}, journal).size();
    };
    EXPECT_EQ(make("pic.tif"), 1u);
    EXPECT_EQ(make("env.xp"), 1u);
    EXPECT_TRUE(journal.entries().empty());
    EXPECT_EQ(make("dof.0154"), 0u) << "another frame than dof.exr";
    ASSERT_EQ(journal.entries().size(), 1u);
    const std::string said = journal.entries()[0].message;
    EXPECT_NE(said.find("there is no picture \"dof.0154\" in \"" + folder.str() + "\""), std::string::npos)
        << said;
    EXPECT_NE(said.find("render that frame first"), std::string::npos);
}

} // namespace
} // namespace kanuka::shade
