// Pages: encoding, folding, files and what breaks them.
#include "store/test_pages.h"

#include <cfloat>
#include <cstdio>
#include <gtest/gtest.h>

#include "base/tasks.h"
#include "color/color.h"
#include "store/page_check.h"
#include "store/quantize.h"

namespace kanuka::store {
namespace {

using namespace testing;

constexpr float Inf = std::numeric_limits<float>::infinity(), NaN = std::numeric_limits<float>::quiet_NaN();

// The words of slot table entry `word` of a resident shape.
struct Entry {
    uint32_t base, stride;
};
Entry entry(const Store& store, int shape, int word) {
    const ShapeRecord& s = store.shapes()[size_t(shape)];
    const uint32_t* t = store.words(s) + s.slot_table + 2 * word;
    return {t[0], t[1]};
}

} // namespace

TEST(Encode, ConstantInputsFoldExactly) {
    const auto program = lamp_program();
    HandMade made(3, 2, program);
    for (int i = 0; i < made.grid.vertices(); i++) {
        made.at(0, 0, i) = 0.123456f, made.at(0, 1, i) = 0.3f, made.at(0, 2, i) = 0.987654f;
        made.at(1, 0, i) = 0.1234567f;
    }
    made.set_uniform(2, {3, 2, 1});
    made.set_uniform(3, {0.7654321f, 0, 0});
    Store store;
    store.add_page(encode_one(made, program), program, -1);
    // Words: reflectance, {weight, presence}, radiance.
    const Entry reflectance = entry(store, 0, 0), pair = entry(store, 0, 1), radiance = entry(store, 0, 2),
                normal = entry(store, 0, 3);
    for (const Entry& e : {reflectance, pair, radiance, normal})
        EXPECT_EQ(e.stride, 0u);
    const auto c = color::uplift({0.123456f, 0.3f, 0.987654f});
    for (uint32_t k = 0; k < 3; k++)
        EXPECT_EQ(store.floats(0)[reflectance.base + k], c[k]);
    EXPECT_EQ(store.floats(0)[reflectance.base + 3], 1.0f);
    EXPECT_EQ(store.floats(0)[pair.base], 0.1234567f);
    EXPECT_EQ(store.floats(0)[pair.base + 1], 0.7654321f);
    EXPECT_EQ(store.floats(0)[radiance.base + 3], 6.0f); // twice the largest
    EXPECT_EQ(store.floats(0)[normal.base + 2], 1.0f);
    EXPECT_EQ(store.presence(0, 0, 0.3f, 0.4f), 0.7654321f);
    EXPECT_TRUE(store.shapes()[0].flags & ShapeRecord::FlatNormal);
}

// Tables of variants lie behind the normal's; what does not vary is there once.
TEST(Encode, VariantsHaveTablesAndWordsOfTheirOwn) {
    auto program = lamp_program();
    HandMade made(3, 2, program);
    made.scramble(5);
    const Page plain = encode_one(made, program);
    for (float shade : {0.25f, 0.75f}) {
        made.inputs.variants.push_back(made.inputs.slots);
        made.inputs.variants.back()[0] = {true, Vec3f(shade), {}};
    }
    program.variants = 3;
    Page page = encode_one(made, program);
    EXPECT_EQ(page.header().micropolygons, plain.header().micropolygons);
    page.header().checksum = checksum_of(page.header(), page);
    EXPECT_EQ(fault_of(page, program), nullptr);
    program.variants = 4; // a table more than there is
    EXPECT_STREQ(fault_of(page, program), "its shapes do not fit");
    program.variants = 3;
    Store store;
    store.add_page(page, program, -1);
    const int words = 3, first = words + 1; // the normal's
    EXPECT_EQ(entry(store, 0, 0).stride, 1u);
    for (int k = 0; k < 2; k++) {
        const Entry reflectance = entry(store, 0, first + k * words);
        EXPECT_EQ(reflectance.stride, 0u);
        const auto c = color::uplift(Rgb(k ? 0.75f : 0.25f));
        EXPECT_EQ(store.floats(0)[reflectance.base], c[0]);
        EXPECT_EQ(entry(store, 0, first + k * words + 1).stride, 1u); // weights are the same, and there again
    }
}

TEST(Encode, WholeFloatsStayAsTheyAre) {
    auto program = lamp_program();
    for (int k = 0; k < 2; k++)
        program.slots.push_back(
            {grid::InputType::Float, grid::Storage::Full, -FLT_MAX, FLT_MAX, false, "aov.x"});
    HandMade made(3, 2, program);
    for (int i = 0; i < made.grid.vertices(); i++)
        made.at(4, 0, i) = -1e20f * float(i);
    made.at(4, 0, 5) = NaN;
    made.set_uniform(5, {123456.789f, 0, 0});
    uint64_t bad = 0;
    Store store;
    store.add_page(encode_one(made, program, &bad), program, -1);
    EXPECT_EQ(bad, 1u);
    const Entry varying = entry(store, 0, 3), constant = entry(store, 0, 4);
    EXPECT_EQ(varying.stride, 1u);
    for (uint32_t i = 0; i < 12; i++)
        EXPECT_EQ(store.floats(0)[varying.base + i], i == 5 ? 0.0f : -1e20f * float(i));
    EXPECT_EQ(constant.stride, 0u);
    EXPECT_EQ(store.floats(0)[constant.base], 123456.789f);
}

// Those of lobes are unit vectors, of any length as shaders have them. Where there is none, it is the
// surface's.
TEST(Encode, NormalsOfLobes) {
    constexpr float Inf = std::numeric_limits<float>::infinity();
    auto program = lamp_program();
    for (int k = 0; k < 2; k++)
        program.slots.push_back(
            {grid::InputType::Normal, grid::Storage::Unit, -Inf, Inf, false, "coat.normal"});
    HandMade made(3, 2, program);
    for (int i = 0; i < made.grid.vertices(); i++)
        for (int c = 0; c < 3; c++)
            made.at(4, c, i) = float(i + 1) * (c == 0 ? -0.6f : c == 1 ? 0.0f : 0.8f);
    for (int c = 0; c < 3; c++)
        made.at(4, c, 2) = 0, made.at(4, c, 7) = NaN;
    made.set_uniform(5, {0, 0, 0});
    uint64_t bad = 0;
    Store store;
    store.add_page(encode_one(made, program, &bad), program, -1);
    EXPECT_EQ(bad, 3u);
    const Entry varying = entry(store, 0, 3), constant = entry(store, 0, 4);
    EXPECT_EQ(varying.stride, 1u);
    for (uint32_t i = 0; i < 12; i++) {
        const Vec3f n = from_oct32(store.words(0)[varying.base + i]);
        const Vec3f expected = i == 2 || i == 7 ? Vec3f(0, 0, 1) : Vec3f(-0.6f, 0, 0.8f);
        for (int c = 0; c < 3; c++)
            EXPECT_NEAR(n[c], expected[c], 1e-4f) << i;
    }
    EXPECT_EQ(constant.stride, 0u);
    for (uint32_t c = 0; c < 3; c++)
        EXPECT_EQ(store.floats(0)[constant.base + c], 0.0f); // at hits it is the surface's, which may vary
}

TEST(Encode, AreaLightsKeepTheirCone) {
    auto program = lamp_program();
    HandMade made(1, 1, program);
    uint64_t bad = 0;
    Store whole;
    whole.add_page(encode_one(made, program, &bad), program, -1);
    program.emission_cosine = 0.5f;
    Store cone;
    cone.add_page(encode_one(made, program, &bad), program, -1);
    EXPECT_EQ(whole.emitters()[0].flags >> 1, 0u);
    EXPECT_NEAR(float(cone.emitters()[0].flags >> 1) / Emitter::ConeUnit, 0.5f, 1e-4f);
    EXPECT_EQ(cone.emitters()[0].flags & 1, whole.emitters()[0].flags & 1);
    // The integral of the cosine over the cone, in parts of pi.
    EXPECT_NEAR(cone.emitters()[0].power, 0.75f * whole.emitters()[0].power, 1e-5f);
}

TEST(Encode, VaryingInputsComeBackWithinTheirStep) {
    const auto program = lamp_program();
    HandMade made(7, 5, program);
    made.scramble(1);
    Store store;
    store.add_page(encode_one(made, program), program, -1);
    for (int i = 0; i < made.grid.vertices(); i++) {
        const auto word = [&](int w) {
            const Entry e = entry(store, 0, w);
            EXPECT_EQ(e.stride, 1u);
            return store.words(0)[e.base + uint32_t(i)];
        };
        const Rgb r = from_rgb9e5(word(0)), l = from_rgb9e5(word(2));
        for (int c = 0; c < 3; c++) {
            EXPECT_NEAR(r[c], made.at(0, c, i), 1 / 511.0f);
            EXPECT_NEAR(l[c], made.at(2, c, i), 1 / 511.0f);
        }
        EXPECT_NEAR(from_half(uint16_t(word(1))), made.at(1, 0, i), 0x1p-11f);
        EXPECT_NEAR(from_half(uint16_t(word(1) >> 16)), made.at(3, 0, i), 0x1p-11f);
        EXPECT_LT(length(from_oct32(word(3)) - normalize(made.grid.normal(i))), 1e-4f);
    }
}

TEST(Encode, OneVertexThatDiffersKeepsAWordVarying) {
    const auto program = lamp_program();
    HandMade made(3, 3, program);
    made.at(3, 0, made.grid.vertices() - 1) = 0.25f;
    Store store;
    store.add_page(encode_one(made, program), program, -1);
    EXPECT_EQ(entry(store, 0, 0).stride, 0u);
    EXPECT_EQ(entry(store, 0, 1).stride, 1u); // weight shares presence's word
    EXPECT_EQ(store.presence(0, 0, 1, 1), 0.25f);
    EXPECT_EQ(store.presence(0, 0, 0, 0), 0.5f);
}

// Area times luminance, whatever it is: emitters keep whole floats.
TEST(Encode, EmittersOfAnyRadiance) {
    const auto program = lamp_program();
    for (int decade = -2; decade <= 14; decade++) {
        const float radiance = std::pow(10.0f, float(decade));
        for (const bool varies : {false, true}) {
            HandMade made(1, 1, program);
            for (int i = 0; i < 4; i++) {
                made.at(3, 0, i) = 1;
                for (int c = 0; c < 3; c++)
                    made.at(2, c, i) = varies ? radiance * (0.5f + 0.25f * float(i + i / 2)) : radiance;
            }
            // Triangles of vertices 0, 1, 2 and 3, 2, 1.
            const double mean = varies ? (0.5 + 0.75 + 1.25 + 1.5 + 1.25 + 0.75) / 6 : 1;
            const ShadedGrid shaded[] = {made.shaded()};
            uint64_t bad = 0, lost = 0;
            Store store;
            store.add_page(encode(shaded, program, bad, nullptr, &lost), program, -1);
            double power = 0;
            for (const Emitter& e : store.emitters())
                power += double(e.power);
            EXPECT_NEAR(power / double(radiance), mean, 1e-4 * mean) << decade;
            EXPECT_EQ(bad + lost, 0u);
        }
    }
    HandMade made(1, 1, program);
    for (int i = 0; i < 4; i++)
        made.at(2, 1, i) = 1e20f;
    const ShadedGrid shaded[] = {made.shaded()};
    uint64_t bad = 0, lost = 0;
    encode(shaded, program, bad, nullptr, &lost);
    EXPECT_EQ(bad, 0u);
    EXPECT_GT(lost, 0u);
}

TEST(Encode, BadInputsAreReplacedAndCounted) {
    const auto program = lamp_program();
    HandMade made(2, 2, program);
    made.at(0, 1, 4) = NaN;
    made.at(1, 0, 2) = 7; // out of range, but a number: clamped
    made.at(2, 0, 5) = Inf;
    made.at(3, 0, 3) = -Inf;
    uint64_t bad = 0;
    Store store;
    store.add_page(encode_one(made, program, &bad), program, -1);
    EXPECT_GE(bad, 3u);
    EXPECT_EQ(from_rgb9e5(store.words(0)[entry(store, 0, 0).base + 4]).y, 0.0f);
    EXPECT_EQ(from_half(uint16_t(store.words(0)[entry(store, 0, 1).base + 2])), 1.0f);
    EXPECT_EQ(from_half(uint16_t(store.words(0)[entry(store, 0, 1).base + 3] >> 16)), 0.0f);
    for (const Emitter& e : store.emitters())
        EXPECT_TRUE(std::isfinite(e.c0 + e.c1 + e.c2 + e.scale + e.power + e.area));
    // A constant infinity folds to a number too.
    HandMade hot(1, 1, program);
    hot.set_uniform(2, {Inf, NaN, 1});
    store.add_page(encode_one(hot, program, &bad), program, -1);
    EXPECT_GT(bad, 0u);
    EXPECT_TRUE(std::isfinite(store.emitters().back().power));
    EXPECT_GT(store.emitters().back().power, 0.0f);
}

TEST(Encode, BadNormalsTakeTheirNeighbours) {
    const auto program = lamp_program();
    HandMade made(2, 2, program);
    const auto set = [&](int i, Vec3f n) {
        for (int c = 0; c < 3; c++)
            made.grid.N[size_t(c * made.grid.stride + i)] = n[c];
    };
    set(0, {0, 0, 0}); // a pole: what comes first has no vertex before it
    set(1, {1, 0, 0});
    set(2, {NaN, 0, 1});
    set(3, {0, 3e30f, 0}); // finite, though its square is not
    set(4, {0, 1e-30f, 0});
    uint64_t bad = 0;
    Store store;
    store.add_page(encode_one(made, program, &bad), program, -1);
    const auto normal = [&](uint32_t i) { return from_oct32(store.words(0)[entry(store, 0, 3).base + i]); };
    EXPECT_EQ(normal(0), Vec3f(1, 0, 0));
    EXPECT_EQ(normal(2), Vec3f(1, 0, 0));
    EXPECT_EQ(normal(3), Vec3f(0, 1, 0));
    EXPECT_EQ(normal(4), Vec3f(0, 1, 0));
    EXPECT_EQ(bad, 2u);
    // None at all, given as zeros: no complaint. All of them useless: one each.
    for (const auto& [value, expected] : {std::pair{0.0f, 0u}, {NaN, 9u}, {Inf, 9u}}) {
        for (int i = 0; i < 9; i++)
            set(i, Vec3f(value));
        store.add_page(encode_one(made, program, &bad), program, -1);
        EXPECT_EQ(bad, expected);
        EXPECT_FALSE(store.shapes().back().flags & ShapeRecord::HasNormals);
    }
}

TEST(Encode, SameWordsForAnyThreadCount) {
    const auto program = lamp_program();
    std::vector<HandMade> made;
    for (int i = 0; i < 40; i++) {
        made.emplace_back(1 + i % 9, 1 + i % 5, program);
        if (i % 3)
            made.back().scramble(uint32_t(i));
    }
    std::vector<ShadedGrid> shaded;
    for (const HandMade& m : made)
        shaded.push_back(m.shaded());
    const auto run = [&](int threads) {
        Page page;
        uint64_t bad = 0;
        tasks::with_threads(threads, [&] { page = encode(shaded, program, bad); });
        return page.words;
    };
    const auto one = run(1);
    for (int threads : {2, 4})
        EXPECT_EQ(one, run(threads));
    EXPECT_EQ(one, run(1));
}

TEST(Store, ProgramsAndInteriorsAreShared) {
    Store store;
    const auto program = lamp_program();
    auto other = program;
    other.presence = -1;
    const HandMade made(1, 1, program);
    for (const auto& of : {program, program, other, program})
        store.add_page(encode_one(made, of), of, -1);
    EXPECT_EQ(store.programs().size(), 2u);
    EXPECT_EQ(store.shapes()[1].program, store.shapes()[0].program);
    EXPECT_NE(store.shapes()[2].program, store.shapes()[0].program);
    EXPECT_EQ(store.shapes()[3].program, store.shapes()[0].program);
    Interior water;
    water.ior = 1.33f;
    EXPECT_EQ(store.add_interior(water), store.add_interior(water));
    EXPECT_NE(store.add_interior(water), store.add_interior(Interior()));
}

TEST(Store, SecondPageReadsAsTheFirst) {
    const auto program = lamp_program();
    HandMade made(4, 4, program);
    made.scramble(5);
    const Page page = encode_one(made, program);
    Store store;
    store.add_page(page, program, -1);
    store.add_page(page, program, -1);
    const auto &a = store.shapes()[0], &b = store.shapes()[1];
    EXPECT_EQ(a.positions % 3, 0);
    EXPECT_EQ(b.positions % 3, 0);
    EXPECT_NE(a.positions, b.positions);
    EXPECT_EQ(0, std::memcmp(store.words(0) + a.positions, store.words(0) + b.positions, 75 * 4));
    for (int w = 0; w < 4; w++) {
        const Entry x = entry(store, 0, w), y = entry(store, 1, w);
        EXPECT_NE(x.base, y.base);
        EXPECT_EQ(0, std::memcmp(store.words(0) + x.base, store.words(0) + y.base, 25 * 4));
    }
    EXPECT_EQ(b.emitter, 32);
    EXPECT_EQ(store.emitters().size(), 64u);
}

TEST(Store, PagesBeyondAWindowLieInTheNext) {
    const auto program = lamp_program();
    HandMade made(4, 4, program);
    made.scramble(5);
    const Page page = encode_one(made, program);
    Store large, small(size_t(page.header().emitters_at) * 5 / 2); // two pages a window
    for (int i = 0; i < 5; i++) {
        large.add_page(page, program, -1);
        small.add_page(page, program, -1);
    }
    ASSERT_EQ(large.programs().size(), 1u);
    ASSERT_EQ(small.programs().size(), 3u); // the same one in three windows
    const int expected[] = {0, 0, 1, 1, 2};
    for (int i = 0; i < 5; i++) {
        const ShapeRecord &a = large.shapes()[size_t(i)], &b = small.shapes()[size_t(i)];
        EXPECT_EQ(small.window(b.program), expected[i]);
        EXPECT_EQ(0, std::memcmp(large.words(a) + a.positions, small.words(b) + b.positions, 75 * 4));
        for (int w = 0; w < 4; w++) {
            const Entry x = entry(large, i, w), y = entry(small, i, w);
            EXPECT_EQ(x.stride, y.stride);
            EXPECT_EQ(0, std::memcmp(large.words(a) + x.base, small.words(b) + y.base, 25 * 4));
        }
        EXPECT_EQ(large.presence(i, 0, 0.3f, 0.8f), small.presence(i, 0, 0.3f, 0.8f));
        EXPECT_EQ(a.emitter, b.emitter);
    }
    Store tiny(size_t(page.header().emitters_at) - 1);
    EXPECT_THROW(tiny.add_page(page, program, -1), Error);
    EXPECT_TRUE(tiny.shapes().empty());
}

} // namespace kanuka::store
