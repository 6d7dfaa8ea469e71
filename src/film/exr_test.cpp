#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <ImfArray.h>
#include <ImfChannelList.h>
#include <ImfDeepFrameBuffer.h>
#include <ImfDeepScanLineOutputFile.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfTileDescriptionAttribute.h>
#include <ImfTiledOutputFile.h>

#include "film/atomic_file.h"
#include "film/film.h"
#include "film/test_files.h"

namespace kanuka::film {
namespace {

Picture sample(int width = 37, int height = 23) {
    Picture p;
    p.width = width;
    p.height = height;
    p.full_width = width + 20;
    p.full_height = height + 10;
    p.x0 = 5;
    p.y0 = 3;
    for (const char* name : {"R", "G", "B", "A", "albedo.R", "N.X", "Z", "id"}) {
        Picture::Channel c{name, std::string(name) != "Z" && std::string(name) != "id", {}};
        for (int i = 0; i < width * height; i++) // exact in half
            c.data.push_back(float((i * 7 + int(name[0])) % 512) / 64 - 1);
        p.channels.push_back(c);
    }
    p.find("Z")->data.front() = 1234.56789f;
    p.find("id")->data.back() = 16777215;
    p.metadata = {
        {"comments", "a render"}, {"kanuka.version", "0.1.0"}, {"kanuka.scene", "päth/ώ.rib\nline"}};
    return p;
}

void expect_same(const Picture& a, const Picture& b) {
    EXPECT_EQ(a.width, b.width);
    EXPECT_EQ(a.height, b.height);
    EXPECT_EQ(a.x0, b.x0);
    EXPECT_EQ(a.y0, b.y0);
    EXPECT_EQ(a.full_width, b.full_width);
    EXPECT_EQ(a.full_height, b.full_height);
    ASSERT_EQ(a.channels.size(), b.channels.size());
    for (const auto& c : a.channels) {
        const Picture::Channel* other = b.find(c.name);
        ASSERT_TRUE(other) << c.name;
        EXPECT_EQ(c.half, other->half) << c.name;
        EXPECT_EQ(c.data, other->data) << c.name;
    }
}

// Passes for a picture or an Input error; anything else that leaves, or a crash, fails.
bool readable(const std::string& path) {
    try {
        const Picture p = read_exr(path);
        for (const auto& c : p.channels)
            EXPECT_EQ(c.data.size(), size_t(p.width) * p.height);
        return true;
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), ExitCode::Input);
        EXPECT_EQ(e.where().file, path);
        return false;
    }
}

ExitCode write_error(const std::string& path, const Picture& picture) {
    try {
        write_exr(path, picture);
        return ExitCode::Ok;
    } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find(path), std::string::npos) << e.what();
        return e.code();
    }
}

// One scan-line or tiled picture of one constant channel, written by the library itself.
void write_plain(const std::string& path, Imf::Compression compression, bool tiled, Imf::PixelType type,
                 int w, int h) {
    Imf::Header header(w, h);
    header.compression() = compression;
    header.channels().insert("Y", Imf::Channel(type));
    std::vector<uint32_t> words(size_t(w) * h);
    for (size_t i = 0; i < words.size(); i++) {
        const float f = float(i % 50);
        const uint32_t u = uint32_t(i % 50);
        const half hf(f);
        std::memcpy(&words[i],
                    type == Imf::UINT    ? (const void*)&u
                    : type == Imf::FLOAT ? (const void*)&f
                                         : &hf,
                    type == Imf::HALF ? 2 : 4);
    }
    Imf::FrameBuffer frame;
    frame.insert("Y", Imf::Slice(type, (char*)words.data(), 4, size_t(w) * 4));
    if (tiled) {
        header.setTileDescription(Imf::TileDescription(16, 8));
        Imf::TiledOutputFile out(path.c_str(), header);
        out.setFrameBuffer(frame);
        out.writeTiles(0, out.numXTiles() - 1, 0, out.numYTiles() - 1);
    } else {
        Imf::OutputFile out(path.c_str(), header);
        out.setFrameBuffer(frame);
        out.writePixels(h);
    }
}

} // namespace

TEST(Exr, RoundTrip) {
    const TestDirectory dir;
    const Picture p = sample();
    write_exr(dir.file("a.exr"), p);
    const Picture q = read_exr(dir.file("a.exr"));
    expect_same(p, q);
    for (const auto& [name, value] : p.metadata)
        EXPECT_EQ(q.metadata.at(name), value);
    EXPECT_EQ(dir.names(), std::vector<std::string>{"a.exr"});
    EXPECT_FALSE(p.find("nothing"));
    EXPECT_EQ(q.find("Z")->data.front(), 1234.56789f);
}

TEST(Exr, DisplayWindowIsTheDataWindowUnlessGiven) {
    const TestDirectory dir;
    Picture p = sample(4, 3);
    p.full_width = p.full_height = p.x0 = p.y0 = 0;
    write_exr(dir.file("a.exr"), p);
    const Picture q = read_exr(dir.file("a.exr"));
    EXPECT_EQ(q.full_width, 4);
    EXPECT_EQ(q.full_height, 3);
}

TEST(Exr, HalfClampsFiniteValuesOnly) {
    const TestDirectory dir;
    Picture p = sample(2, 2);
    const float inf = std::numeric_limits<float>::infinity();
    p.find("R")->data = {1e6f, -1e30f, inf, std::numeric_limits<float>::quiet_NaN()};
    write_exr(dir.file("a.exr"), p);
    const auto r = read_exr(dir.file("a.exr")).find("R")->data;
    EXPECT_EQ(r[0], 65504);
    EXPECT_EQ(r[1], -65504);
    EXPECT_EQ(r[2], inf);
    EXPECT_TRUE(std::isnan(r[3]));
}

TEST(Exr, MetadataCannotBreakTheFile) {
    const TestDirectory dir;
    Picture p = sample(2, 2);
    p.metadata = {{"channels", "x"},
                  {"compression", "none"},
                  {"type", "deepscanline"},
                  {"dataWindow", "1"},
                  {"tiles", "1"},
                  {"preview", "1"},
                  {"", "empty"},
                  {std::string(300, 'k'), "long"}};
    write_exr(dir.file("a.exr"), p);
    const Picture q = read_exr(dir.file("a.exr"));
    expect_same(p, q);
    EXPECT_EQ(q.metadata.at("kanuka.compression"), "none");
    EXPECT_EQ(q.metadata.at(std::string(255, 'k')), "long");
}

TEST(Exr, ReplacesAndLeavesNothingBehind) {
    const TestDirectory dir;
    write_exr(dir.file("a.exr"), sample(3, 3));
    write_exr(dir.file("a.exr"), sample(5, 4));
    EXPECT_EQ(read_exr(dir.file("a.exr")).width, 5);
    EXPECT_EQ(dir.names().size(), 1u);
}

TEST(Exr, WhatCannotBeWrittenIsAnOutputError) {
    const TestDirectory dir;
    EXPECT_EQ(write_error(dir.file("none/a.exr"), sample()), ExitCode::Output);
    EXPECT_EQ(write_error(dir.file(""), sample()), ExitCode::Output);
    std::filesystem::create_directory(dir.file("folder.exr"));
    EXPECT_EQ(write_error(dir.file("folder.exr"), sample()), ExitCode::Output);
    Picture p = sample();
    p.channels[1].data.pop_back();
    EXPECT_EQ(write_error(dir.file("a.exr"), p), ExitCode::Output);
    p = sample();
    p.channels.push_back(p.channels[0]);
    EXPECT_EQ(write_error(dir.file("a.exr"), p), ExitCode::Output);
    p.channels.clear();
    EXPECT_EQ(write_error(dir.file("a.exr"), p), ExitCode::Output);
    EXPECT_EQ(write_error(dir.file("a.exr"), Picture()), ExitCode::Output);
    EXPECT_EQ(dir.names(), std::vector<std::string>{"folder.exr"});
}

TEST(Exr, FullDiskLeavesTheOldPicture) {
    const TestDirectory dir;
    write_exr(dir.file("a.exr"), sample(3, 3));
    // A file-size limit stands for the full disk. In a child: the limit cannot be lifted again.
    const auto fill_the_disk = [&] {
        signal(SIGXFSZ, SIG_IGN);
        rlimit limit;
        limit.rlim_cur = limit.rlim_max = 4096;
        setrlimit(RLIMIT_FSIZE, &limit);
        std::mt19937 generator;
        Picture noise = sample(100, 100);
        for (auto& channel : noise.channels)
            for (float& v : channel.data)
                v = float(generator());
        _exit(int(write_error(dir.file("a.exr"), noise)));
    };
    EXPECT_EXIT(fill_the_disk(), testing::ExitedWithCode(int(ExitCode::Output)), "");
    EXPECT_EQ(dir.names(), std::vector<std::string>{"a.exr"});
    EXPECT_EQ(read_exr(dir.file("a.exr")).width, 3);
}

TEST(AtomicFile, AppearsOnCommitOnly) {
    const TestDirectory dir;
    {
        AtomicFile file(dir.file("a.exr"));
        file.write("half", 4);
        const auto names = dir.names();
        ASSERT_EQ(names.size(), 1u);
        EXPECT_EQ(names[0].front(), '.');
        EXPECT_TRUE(names[0].ends_with(".part")) << names[0];
        EXPECT_NE(names[0].find(std::to_string(getpid())), std::string::npos);
        AtomicFile other(dir.file("a.exr")); // at the same time
        EXPECT_NE(other.temporary(), file.temporary());
    }
    EXPECT_TRUE(dir.names().empty());
    AtomicFile file(dir.file("b"));
    file.write("abcd", 4);
    file.seek(1);
    file.write("X", 1);
    file.commit();
    EXPECT_EQ(read_file(dir.file("b")), (std::vector<char>{'a', 'X', 'c', 'd'}));
    const std::string longest(255, 'n');
    AtomicFile long_name(dir.file(longest));
    long_name.commit();
    EXPECT_TRUE(std::filesystem::exists(dir.file(longest)));
}

TEST(ExrRead, EveryCompressionTypeAndLayout) {
    const TestDirectory dir;
    const std::string path = dir.file("a.exr");
    for (const auto compression : {Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION, Imf::ZIPS_COMPRESSION,
                                   Imf::ZIP_COMPRESSION, Imf::PIZ_COMPRESSION})
        for (const bool tiled : {false, true})
            for (const auto type : {Imf::HALF, Imf::FLOAT, Imf::UINT}) {
                write_plain(path, compression, tiled, type, 70, 300);
                const Picture p = read_exr(path);
                ASSERT_EQ(p.channels.size(), 1u);
                EXPECT_EQ(p.channels[0].half, type == Imf::HALF);
                for (size_t i = 0; i < p.channels[0].data.size(); i++)
                    ASSERT_EQ(p.channels[0].data[i], float(i % 50))
                        << compression << tiled << type << ' ' << i;
            }
}

TEST(ExrRead, WhatIsNotAPictureSaysSo) {
    const TestDirectory dir;
    const std::string path = dir.file("a.exr");
    EXPECT_FALSE(readable(dir.file("missing.exr")));
    EXPECT_FALSE(readable(dir.file("")));
    write_file(path, {});
    EXPECT_FALSE(readable(path));
    write_file(path, std::vector<char>(1000, 'x'));
    EXPECT_FALSE(readable(path));

    Imf::Header subsampled(8, 8);
    subsampled.channels().insert("BY", Imf::Channel(Imf::HALF, 2, 2));
    Imf::OutputFile(path.c_str(), subsampled);
    EXPECT_FALSE(readable(path));

    Imf::Header deep(8, 8);
    deep.channels().insert("Z", Imf::Channel(Imf::FLOAT));
    deep.setType(Imf::DEEPSCANLINE);
    deep.compression() = Imf::ZIPS_COMPRESSION;
    Imf::DeepScanLineOutputFile(path.c_str(), deep);
    EXPECT_FALSE(readable(path));
}

TEST(ExrRead, FirstPartOfSeveral) {
    const TestDirectory dir;
    const std::string path = dir.file("a.exr");
    std::vector<Imf::Header> headers(2, Imf::Header(6, 5));
    std::vector<float> values(30, 2.5f);
    for (int i = 0; i < 2; i++) {
        headers[i].setName(i ? "second" : "first");
        headers[i].setType(Imf::SCANLINEIMAGE);
        headers[i].channels().insert(i ? "S" : "F", Imf::Channel(Imf::FLOAT));
    }
    {
        Imf::MultiPartOutputFile out(path.c_str(), headers.data(), 2);
        for (int i = 0; i < 2; i++) {
            Imf::FrameBuffer frame;
            frame.insert(i ? "S" : "F", Imf::Slice(Imf::FLOAT, (char*)values.data(), 4, 24));
            Imf::OutputPart part(out, i);
            part.setFrameBuffer(frame);
            part.writePixels(5);
        }
    }
    const Picture p = read_exr(path);
    ASSERT_EQ(p.channels.size(), 1u);
    EXPECT_EQ(p.channels[0].name, "F");
    EXPECT_EQ(p.channels[0].data, values);
}

TEST(ExrRead, HugeClaimsFailFast) {
    const TestDirectory dir;
    const std::string path = dir.file("a.exr");
    write_plain(path, Imf::ZIP_COMPRESSION, false, Imf::HALF, 16, 16);
    const std::vector<char> good = read_file(path);
    const std::string key("dataWindow\0box2i\0\x10\0\0\0", 21);
    const auto at = std::search(good.begin(), good.end(), key.begin(), key.end());
    ASSERT_NE(at, good.end());
    const size_t box = size_t(at - good.begin()) + key.size();
    const int32_t extremes[] = {0,
                                -1,
                                1 << 30,
                                std::numeric_limits<int32_t>::max(),
                                std::numeric_limits<int32_t>::min(),
                                100000,
                                -100000,
                                (1 << 20) - 1};
    for (int field = 0; field < 4; field++)
        for (const int32_t value : extremes) {
            std::vector<char> bad = good;
            std::memcpy(&bad[box + size_t(field) * 4], &value, 4);
            if (bad == good)
                continue;
            write_file(path, bad);
            const auto start = std::chrono::steady_clock::now();
            // A wider picture over the same bytes may be read, as may one row: what is there is there.
            const bool impossible = value >= 1 << 30 || value == std::numeric_limits<int32_t>::min() ||
                                    (field == 1 && value < -1000) || (field == 3 && value > 1000);
            EXPECT_FALSE(readable(path) && impossible) << field << ' ' << value;
            EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5))
                << field << ' ' << value;
        }
}

TEST(ExrRead, EveryTruncation) {
    const TestDirectory dir;
    const std::string path = dir.file("a.exr");
    write_exr(path, sample(11, 40));
    const std::vector<char> good = read_file(path);
    for (size_t size = 0; size < good.size(); size += size < 1200 ? 1 : 7) {
        write_file(path, {good.begin(), good.begin() + std::ptrdiff_t(size)});
        EXPECT_FALSE(readable(path)) << size;
    }
}

// Mutations of good files: bytes, 32-bit words set to extremes, runs removed and doubled. KANUKA_FUZZ sets
// how many.
TEST(ExrRead, MutatedFiles) {
    const TestDirectory dir;
    const std::string path = dir.file("a.exr");
    std::vector<std::vector<char>> seeds;
    write_exr(path, sample(19, 33));
    seeds.push_back(read_file(path));
    for (const auto compression :
         {Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION, Imf::ZIPS_COMPRESSION, Imf::PIZ_COMPRESSION,
          Imf::PXR24_COMPRESSION, Imf::B44A_COMPRESSION, Imf::DWAA_COMPRESSION})
        for (const bool tiled : {false, true}) {
            write_plain(path, compression, tiled, Imf::HALF, 40, 36);
            seeds.push_back(read_file(path));
        }
    const char* wanted = std::getenv("KANUKA_FUZZ");
    const int rounds = wanted ? std::atoi(wanted) : 1500;
    std::mt19937 generator(rounds == 1500 ? 1u : std::random_device()());
    const auto random = [&](size_t below) {
        return std::uniform_int_distribution<size_t>(0, below - 1)(generator);
    };
    int read = 0;
    for (int round = 0; round < rounds; round++) {
        std::vector<char> bytes = seeds[size_t(round) % seeds.size()];
        // Headers matter most: half of all mutations hit the first 400 bytes.
        const auto place = [&] {
            return random(random(2) ? std::min<size_t>(bytes.size(), 400) : bytes.size());
        };
        for (size_t n = 1 + random(4); n > 0; n--) {
            const size_t at = place();
            switch (random(4)) {
            case 0:
                bytes[at] = char(random(256));
                break;
            case 1: {
                static const int32_t words[] = {0,       -1,  1,      0x7fffffff, int32_t(0x80000000),
                                                0x10000, 255, 1 << 24};
                if (at + 4 <= bytes.size())
                    std::memcpy(&bytes[at], &words[random(8)], 4);
                break;
            }
            case 2:
                bytes.erase(bytes.begin() + std::ptrdiff_t(at),
                            bytes.begin() + std::ptrdiff_t(std::min(bytes.size(), at + 1 + random(40))));
                break;
            default: {
                const std::vector<char> run(bytes.begin() + std::ptrdiff_t(at),
                                            bytes.begin() +
                                                std::ptrdiff_t(std::min(bytes.size(), at + 1 + random(40))));
                bytes.insert(bytes.begin() + std::ptrdiff_t(at), run.begin(), run.end());
            }
            }
            if (bytes.empty())
                bytes.push_back(0);
        }
        write_file(path, bytes);
        read += readable(path);
    }
    // Some mutations hit pixels or names alone, and most do not.
    EXPECT_GT(read, 0);
    EXPECT_LT(read, rounds);
}

} // namespace kanuka::film
