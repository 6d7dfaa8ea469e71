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
    EXPECT_NE(failure({Kind::Texture, {path("no.png")}, to}).find("cannot be read"), std::string::npos);
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
}

} // namespace
} // namespace kanuka::shade
