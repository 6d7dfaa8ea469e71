#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <spng.h>

#include "film/film.h"
#include "film/test_files.h"

namespace kanuka::film {
namespace {

struct Decoded {
    spng_ihdr header{};
    bool srgb = false;
    std::vector<uint8_t> bytes;
};

Decoded decode(const std::string& path) {
    const std::vector<char> file = read_file(path);
    Decoded d;
    spng_ctx* png = spng_ctx_new(0);
    EXPECT_EQ(spng_set_png_buffer(png, file.data(), file.size()), 0);
    EXPECT_EQ(spng_get_ihdr(png, &d.header), 0);
    uint8_t intent;
    d.srgb = spng_get_srgb(png, &intent) == 0;
    size_t size = 0;
    EXPECT_EQ(spng_decoded_image_size(png, SPNG_FMT_PNG, &size), 0);
    d.bytes.resize(size);
    EXPECT_EQ(spng_decode_image(png, d.bytes.data(), size, SPNG_FMT_PNG, 0), 0);
    spng_ctx_free(png);
    return d;
}

Picture pixels(std::vector<std::pair<const char*, std::vector<float>>> channels) {
    Picture p;
    p.width = int(channels[0].second.size());
    p.height = 1;
    for (auto& [name, data] : channels)
        p.channels.push_back({name, true, data});
    return p;
}

constexpr float NaN = std::numeric_limits<float>::quiet_NaN(), Inf = std::numeric_limits<float>::infinity();

} // namespace

TEST(Png, TransferAndRounding) {
    const TestDirectory dir;
    const std::string path = dir.file("a.png");
    // 0.5 -> 187.5..., 0.18 -> 117.7, 0.001 -> 3.3, by IEC 61966-2-1.
    write_png(path,
              pixels({{"R", {0, 1, 0.5f, 0.18f}},
                      {"G", {0.001f, 2, -1, NaN}},
                      {"B", {Inf, -Inf, 0.0031308f, 0.215f}}}),
              1, 1);
    const Decoded d = decode(path);
    EXPECT_EQ(d.header.width, 4u);
    EXPECT_EQ(d.header.height, 1u);
    EXPECT_EQ(d.header.bit_depth, 8);
    EXPECT_EQ(d.header.color_type, SPNG_COLOR_TYPE_TRUECOLOR);
    EXPECT_TRUE(d.srgb);
    EXPECT_EQ(d.bytes, (std::vector<uint8_t>{0, 3, 255, 255, 255, 0, 188, 0, 10, 118, 0, 128}));
    EXPECT_EQ(dir.names().size(), 1u);
}

TEST(Png, GainThenGamma) {
    const TestDirectory dir;
    const std::string path = dir.file("a.png");
    const Picture p = pixels({{"R", {0.25f}}, {"G", {0.0625f}}, {"B", {1}}});
    write_png(path, p, 2, 1);
    EXPECT_EQ(decode(path).bytes, (std::vector<uint8_t>{188, 99, 255}));
    write_png(path, p, 1, 2); // square roots: 0.5, 0.25
    EXPECT_EQ(decode(path).bytes, (std::vector<uint8_t>{188, 137, 255}));
}

// RISpec's quantiser: 255 (gain c)^(1 / gamma), and nothing on top.
TEST(Png, TheGammaOfExposureTakesThePlaceOfSrgb) {
    const TestDirectory dir;
    const std::string path = dir.file("a.png");
    const std::vector<float> values = {0.02f, 0.18f, 0.45f};
    const Picture p = pixels({{"R", {values[0]}}, {"G", {values[1]}}, {"B", {values[2]}}});
    const auto quantised = [&](double gain, double gamma) {
        std::vector<uint8_t> bytes;
        for (const float v : values)
            bytes.push_back(uint8_t(std::lround(255 * std::min(std::pow(gain * double(v), 1 / gamma), 1.0))));
        return bytes;
    };
    for (const double gamma : {1.8, 2.2, 0.5}) {
        const PngEncoding e = png_encoding("srgb", float(gamma));
        write_png(path, p, 1.5f, e.gamma, e.display);
        EXPECT_EQ(decode(path).bytes, quantised(1.5, gamma)) << gamma;
        EXPECT_FALSE(decode(path).srgb);
    }
    const PngEncoding linear = png_encoding("linear", 1);
    write_png(path, p, 1, linear.gamma, linear.display);
    EXPECT_EQ(decode(path).bytes, quantised(1, 1));
    // Left at 1, or where another display is asked for, it is the display's curve.
    EXPECT_EQ(png_encoding("srgb", 1).display, color::Display::Srgb);
    EXPECT_EQ(png_encoding("rec709", 2.2f).display, color::Display::Rec709);
    EXPECT_EQ(png_encoding("rec709", 2.2f).gamma, 1);
}

TEST(Png, AlphaIsStraight) {
    const TestDirectory dir;
    const std::string path = dir.file("a.png");
    write_png(path,
              pixels({{"R", {0.25f, 0.5f, 0.3f, 1}},
                      {"G", {0.5f, 0, 0.3f, NaN}},
                      {"B", {0, 0, 0.3f, 0}},
                      {"A", {0.5f, 1, 0, NaN}}}),
              1, 1);
    const Decoded d = decode(path);
    EXPECT_EQ(d.header.color_type, SPNG_COLOR_TYPE_TRUECOLOR_ALPHA);
    EXPECT_EQ(d.bytes, (std::vector<uint8_t>{188, 255, 0, 128, 188, 0, 0, 255, 0, 0, 0, 0, 0, 0, 0, 0}));
}

TEST(Png, OneChannelIsGrey) {
    const TestDirectory dir;
    const std::string path = dir.file("a.png");
    write_png(path, pixels({{"Z", {0.5f, 7}}}), 1, 1);
    const Decoded d = decode(path);
    EXPECT_EQ(d.header.color_type, SPNG_COLOR_TYPE_GRAYSCALE);
    EXPECT_EQ(d.bytes, (std::vector<uint8_t>{188, 255}));
}

TEST(Png, ErrorsAreOutputErrors) {
    const TestDirectory dir;
    const auto code = [&](const std::string& path, const Picture& p, float gain, float gamma) {
        try {
            write_png(path, p, gain, gamma);
            return ExitCode::Ok;
        } catch (const Error& e) {
            return e.code();
        }
    };
    const Picture good = pixels({{"R", {0}}, {"G", {0}}, {"B", {0}}});
    EXPECT_EQ(code(dir.file("none/a.png"), good, 1, 1), ExitCode::Output);
    EXPECT_EQ(code(dir.file("a.png"), good, 1, 0), ExitCode::Output);
    EXPECT_EQ(code(dir.file("a.png"), good, NaN, 1), ExitCode::Output);
    EXPECT_EQ(code(dir.file("a.png"), pixels({{"X", {0}}, {"Y", {0}}}), 1, 1), ExitCode::Output);
    Picture ragged = good;
    ragged.channels[2].data.clear();
    EXPECT_EQ(code(dir.file("a.png"), ragged, 1, 1), ExitCode::Output);
    EXPECT_EQ(code(dir.file("a.png"), Picture(), 1, 1), ExitCode::Output);
    EXPECT_TRUE(dir.names().empty());
}

} // namespace kanuka::film
