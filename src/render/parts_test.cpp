#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "base/error.h"
#include "render/checkpoint.h"
#include "render/development_record.h"

using namespace kanuka;
using namespace kanuka::render;

namespace {

constexpr Window Pixels{3, 5, 40, 29}; // buckets at the right and below are cut
constexpr size_t AovSums = 6;
constexpr Digest Key{1, 2};

// A number of a pixel and progression, as a sample is; sums of such round.
float value(int x, int y, uint32_t progression, size_t channel) {
    const Digest d = digest_of(x, y, progression, uint64_t(channel));
    return std::ldexp(float(d.low >> 40), int(d.high % 8) - 24);
}

// What a kernel does to a bucket.
void trace(Accumulator& gathered, size_t bucket, int to) {
    while (gathered.bucket(bucket).done < to) {
        transport::BatchRequest r = gathered.request(bucket);
        const int end = std::min(to, block_end(gathered.bucket(bucket).done));
        for (r.progression = uint32_t(gathered.bucket(bucket).done); int(r.progression) < end;
             r.progression++)
            for (int y = r.y0; y < r.y1; y++)
                for (int x = r.x0; x < r.x1; x++) {
                    const size_t pixel = size_t(y) * size_t(r.stride) + size_t(x);
                    transport::PixelSums& p = r.pixels[pixel];
                    if (r.progression == r.first)
                        p.id = float(x + 1);
                    p.rgb[0] += value(x, y, r.progression, 0), p.weight += 1;
                    p.position[2] += value(x, y, r.progression, 1);
                    for (size_t a = 0; a < AovSums; a++)
                        r.aovs[pixel * AovSums + a] += value(x, y, r.progression, 2 + a);
                }
        gathered.finish(bucket, end);
    }
}

Accumulator traced(int first, std::initializer_list<int> steps) {
    Accumulator gathered(Pixels, AovSums, false, first);
    for (const int to : steps)
        for (size_t b = 0; b < gathered.buckets(); b++)
            trace(gathered, b, to);
    return gathered;
}

Development how() {
    Development d;
    d.full_width = 64, d.full_height = 48;
    d.space = color::Space::AcesCg;
    d.exposure = 0.5f, d.origin = {1, 2, 3};
    d.layers.names = {"glow"}, d.layers.kinds = {{3, true}}, d.layers.expressions = {"CL"};
    d.metadata = {{"kanuka.scene", "a.rib"}, {"kanuka.seed", "7"}};
    d.display = "srgb";
    return d;
}

bool same(const Accumulator& a, const Accumulator& b) {
    std::vector<float> of_a(AovSums), of_b(AovSums);
    for (int y = 0; y < Pixels.height(); y++)
        for (int x = 0; x < Pixels.width(); x++) {
            const transport::PixelSums p = a.pixel(x, y), q = b.pixel(x, y);
            a.aovs_of(x, y, of_a), b.aovs_of(x, y, of_b);
            if (std::memcmp(&p, &q, sizeof p) != 0 || of_a != of_b ||
                a.samples_at(x, y) != b.samples_at(x, y))
                return false;
        }
    return true;
}

class Parts : public ::testing::Test {
  protected:
    void SetUp() override { ASSERT_NE(mkdtemp(m_folder.data()), nullptr); }
    void TearDown() override { std::filesystem::remove_all(m_folder); }
    std::string path(const std::string& name) const { return m_folder + "/" + name; }
    std::string saved(const std::string& name, const Accumulator& gathered, Digest key = Key) const {
        save_checkpoint(path(name), key, how(), gathered);
        return path(name);
    }
    // What merging says against it.
    std::string refusal(const std::vector<std::string>& paths) const {
        try {
            merge_checkpoints(paths);
        } catch (const Error& e) {
            return e.what();
        }
        return "";
    }

  private:
    std::string m_folder = (std::filesystem::temp_directory_path() / "kanuka-parts-XXXXXX").string();
};

} // namespace

TEST_F(Parts, AreWholeBlocks) {
    for (const Part& part : {Part{0, 64}, Part{64, 256}, Part{128, 200}, Part{0, 200}})
        EXPECT_NO_THROW(check_part(part, 200));
    for (const Part& part : {Part{1, 64}, Part{0, 100}, Part{64, 64}, Part{-64, 64}, Part{0, 0}})
        EXPECT_THROW(check_part(part, 200), Error);
    try {
        check_part({10, 120}, 200);
    } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find("The nearest: 0 to 127"), std::string::npos) << e.what();
        EXPECT_EQ(e.code(), ExitCode::Usage);
    }
}

TEST_F(Parts, StepsChangeNoBit) {
    const Accumulator whole = traced(0, {300});
    EXPECT_TRUE(same(whole, traced(0, {1, 63, 64, 65, 130, 192, 299, 300})));
    EXPECT_FALSE(same(whole, traced(0, {299})));
    const transport::PixelSums p = whole.pixel(0, 0);
    EXPECT_EQ(p.weight, 300);
    EXPECT_EQ(p.id, 4); // of x = 3
    double sum = 0;
    for (uint32_t k = 0; k < 300; k++)
        sum += double(value(3, 5, k, 0));
    EXPECT_NEAR(p.rgb[0], sum, 1e-5 * sum);
}

TEST_F(Parts, JoinToTheBitsOfTheWhole) {
    const Accumulator whole = traced(0, {448});
    const std::vector<std::vector<int>> shares = {
        {448}, {256, 448}, {64, 448}, {64, 128, 192, 256, 320, 384, 448}, {192, 256, 448}};
    for (const std::vector<int>& ends : shares) {
        std::vector<std::string> files;
        for (int first = 0; const int end : ends) {
            files.push_back(saved("part" + std::to_string(first), traced(first, {(first + end) / 2, end})));
            first = end;
        }
        std::ranges::reverse(files);
        const Checkpoint all = merge_checkpoints(files);
        EXPECT_EQ(all.gathered.least_done(), 448);
        EXPECT_TRUE(same(all.gathered, whole)) << ends.size();
        EXPECT_EQ(all.how.metadata, how().metadata);
        // And what was joined can be joined, and gone on with.
        Accumulator on(Pixels, AovSums, false, 0), straight = traced(0, {448, 500});
        resume_checkpoint(saved("all", all.gathered), Key, nullptr, on);
        for (size_t b = 0; b < on.buckets(); b++)
            trace(on, b, 500);
        EXPECT_TRUE(same(on, straight));
    }
}

TEST_F(Parts, InTheMiddleJoinToAPart) {
    const std::vector<std::string> files = {saved("b", traced(64, {192})), saved("c", traced(192, {256}))};
    const Checkpoint middle = merge_checkpoints(files);
    EXPECT_TRUE(same(middle.gathered, traced(64, {256})));
    EXPECT_THROW(middle.picture(), Error);
    const Checkpoint all = merge_checkpoints({saved("middle", middle.gathered), saved("a", traced(0, {64}))});
    EXPECT_TRUE(same(all.gathered, traced(0, {256})));
    EXPECT_EQ(all.picture().metadata.at("kanuka.progressions"), "256");
}

TEST_F(Parts, TheLastMayBeUnderWay) {
    Accumulator last = traced(128, {150}), whole = traced(0, {150});
    for (size_t b : {size_t(1), size_t(4)})
        trace(last, b, 200), trace(whole, b, 200);
    const std::string a = saved("a", traced(0, {128})), b = saved("b", last);
    EXPECT_TRUE(same(merge_checkpoints({b, a}).gathered, whole));
    const std::string none = saved("none", Accumulator(Pixels, AovSums, false, 64));
    EXPECT_TRUE(same(merge_checkpoints({none, b, a}).gathered, whole));
    const std::string said = refusal({b, a, saved("c", traced(256, {320}))});
    EXPECT_NE(said.find("progressions 150 to 255 of the picture are missing"), std::string::npos) << said;
    EXPECT_NE(said.find("not finished"), std::string::npos) << said;
}

TEST_F(Parts, ThatDoNotFitAreNamed) {
    const std::string a = saved("a", traced(0, {128})), b = saved("b", traced(64, {192})),
                      c = saved("c", traced(192, {256})), other = saved("other", traced(128, {192}), {1, 3});
    EXPECT_NE(refusal({a, b}).find("b: progressions 64 to 127 are in " + a), std::string::npos)
        << refusal({a, b});
    EXPECT_NE(refusal({a, a}).find("progressions 0 to 127 are in"), std::string::npos) << refusal({a, a});
    EXPECT_NE(refusal({c, a}).find("progressions 128 to 191 of the picture are missing"), std::string::npos)
        << refusal({c, a});
    EXPECT_NE(refusal({a, other}).find("other: the checkpoint is of another picture than " + a),
              std::string::npos)
        << refusal({a, other});
    save_checkpoint(path("adaptive"), Key, how(), Accumulator(Pixels, AovSums, true, 0));
    EXPECT_NE(refusal({path("adaptive"), path("adaptive")}).find("adaptively"), std::string::npos);
    EXPECT_NE(refusal({a, path("none")}).find("cannot be opened"), std::string::npos);
}

TEST_F(Parts, OfAnotherVersionOrDamagedAreRefused) {
    const std::string a = saved("a", traced(0, {64})), b = saved("b", traced(64, {192}));
    std::ifstream in(b, std::ios::binary);
    const std::string whole{std::istreambuf_iterator<char>(in), {}};
    const auto refused = [&](std::string bytes) {
        std::ofstream(path("damaged"), std::ios::binary) << bytes;
        return refusal({a, path("damaged")});
    };
    std::string old = whole;
    old[4] = 2; // the version before
    EXPECT_NE(refused(old).find("damaged: the checkpoint is of another version of Kanuka; remove it"),
              std::string::npos);
    for (size_t k = 0; k < 300; k++) {
        const size_t at = k < 100 ? k : digest_of(k).low % whole.size();
        std::string one = whole;
        one[at] = char(one[at] ^ (1 << k % 8));
        EXPECT_NE(refused(one), "") << at;
        EXPECT_NE(refused(whole.substr(0, at)), "") << at;
    }
    EXPECT_NE(refused(whole + "x"), "");
    EXPECT_EQ(refused(whole), "");
}

TEST_F(Parts, WhatDevelopsThemIsKeptWithThem) {
    const std::string bytes = packed(how());
    Development back;
    ASSERT_TRUE(unpack(bytes, back));
    EXPECT_EQ(packed(back), bytes);
    EXPECT_EQ(back.layers.expressions, how().layers.expressions);
    for (size_t n = 0; n < bytes.size(); n++) {
        Development none;
        EXPECT_FALSE(unpack(bytes.substr(0, n), none)) << n;
    }
    EXPECT_FALSE(unpack(bytes + "x", back));
}
