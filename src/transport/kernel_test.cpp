// The kernel as a machine: lane counts, threads, hits to their inputs, and numbers that are not numbers.
#include <cstring>
#include <gtest/gtest.h>

#include "base/test_statistics.h"
#include "transport/test_scene.h"

namespace kanuka::transport {
namespace {

using namespace testing;

constexpr int Size = 40; // more than one bucket

// Something of everything.
void add_still_life(TestScene& s) {
    const Vec3f x(2, 0, 0), y(0, 2, 0), z(0, 0, 2);
    s.add_quad({0, -1, 3}, z, x, {matte(Rgb(0.8f, 0.7f, 0.6f))});
    s.add_quad({0, 0, 5}, y, x, {matte(Rgb(0.3f, 0.5f, 0.8f)), metal(0.4f, Rgb(0.3f), Rgb(0.5f))});
    s.add_quad({0, 1.5f, 3}, {0.5f, 0, 0}, {0, 0, 0.5f}, {emission(Rgb(6, 5, 4))});
    s.add_sphere({-0.6f, -0.4f, 3}, 0.5f, 32, {glass(0)});
    s.add_sphere({0.6f, -0.4f, 3.2f}, 0.5f, 32, {prism(0.25f, 1.6f, 25)});
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.5f, Size, Size);
    scene::Light point;
    point.kind = scene::Light::Kind::Point;
    point.world_from_light = Transform::translate(-1, 1, 1);
    s.inputs.lights = {constant_sky(Rgb(0.3f)), point};
}

bool same(const std::vector<PixelSums>& a, const std::vector<PixelSums>& b) {
    constexpr size_t Bytes = offsetof(PixelSums, weight) + sizeof(float); // padding follows
    for (size_t i = 0; i < a.size(); i++)
        if (std::memcmp(&a[i], &b[i], Bytes) != 0)
            return false;
    return a.size() == b.size();
}

bool finite(const PixelSums& p) {
    float sum = p.rgb[0] + p.rgb[1] + p.rgb[2] + p.alpha + p.depth;
    for (int c = 0; c < 3; c++)
        sum += p.albedo[c] + p.normal[c] + p.position[c];
    return std::isfinite(sum);
}

} // namespace

TEST(Kernel, KnowsItsWidths) {
    TestScene s;
    add_still_life(s);
    s.finish();
    for (int lanes : {0, 1, 8, 16})
        EXPECT_NE(make_kernel(s.view, lanes), nullptr);
    EXPECT_THROW(make_kernel(s.view, 4), Error);
}

TEST(Kernel, SkiesAreTheSameBitsForAllLaneCounts) {
    TestScene s;
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, Size, Size);
    s.inputs.map = {4, 2, {1, 2, 3, 4, 5, 6, 7, 8, 9, 1, 2, 3, 4, 5, 6, 7, 8, 9, 1, 2, 3, 4, 5, 6}};
    scene::Light sky;
    sky.kind = scene::Light::Kind::Environment;
    sky.texture = "map";
    s.inputs.lights = {sky, constant_sky(Rgb(0.5f, 1, 2))};
    s.finish();
    const auto one = s.render(8, 1);
    EXPECT_TRUE(same(one, s.render(8, 8)));
    EXPECT_TRUE(same(one, s.render(8, 16)));
}

// With rays traced too, and whatever the processor has.
TEST(Kernel, LaneCountsAgree) {
    TestScene s;
    add_still_life(s);
    s.finish();
    const auto one = s.render(16, 1);
    for (int lanes : {8, 16})
        EXPECT_TRUE(same(one, s.render(16, lanes))) << lanes;
}

TEST(Kernel, SameBitsForAnyThreadCount) {
    TestScene s;
    add_still_life(s);
    s.finish();
    std::vector<PixelSums> reference;
    for (int threads : {1, 2, 4, 1})
        tasks::with_threads(threads, [&] {
            const auto pixels = s.render(4, 8);
            if (reference.empty())
                reference = pixels;
            EXPECT_TRUE(same(pixels, reference)) << threads;
        });
}

// A kernel carries nothing over: the same request gives the same, whatever came before.
TEST(Kernel, RequestsAreIndependent) {
    TestScene s;
    add_still_life(s);
    s.finish();
    auto kernel = make_kernel(s.view, 8);
    BatchCounts counts;
    std::vector<PixelSums> a(Size * Size, PixelSums{}), b = a, scratch = a;
    BatchRequest r{0, 0, 32, 32, 5, a.data(), Size};
    kernel->trace(r, counts);
    EXPECT_EQ(counts.paths, 1024u);
    EXPECT_GT(counts.rays, 1024u);
    BatchRequest other{8, 0, 40, 30, 6, scratch.data(), Size};
    kernel->trace(other, counts);
    r.pixels = b.data();
    kernel->trace(r, counts);
    EXPECT_TRUE(same(a, b));
}

TEST(Kernel, PixelsThatTakeNoPartChangeNoOthers) {
    TestScene s;
    add_still_life(s);
    s.finish();
    std::vector<uint8_t> part(Size * Size);
    uint64_t taking = 0;
    for (size_t i = 0; i < part.size(); i++)
        part[i] = i * 7 % 5 < 3;
    for (int y = 0; y < 32; y++)
        for (int x = 4; x < 36; x++)
            taking += part[size_t(y * Size + x)];
    for (const int lanes : {1, 8, 16}) {
        std::vector<PixelSums> all(Size * Size, PixelSums{}), some = all;
        const auto kernel = make_kernel(s.view, lanes);
        for (uint32_t p = 0; p < 6; p++) {
            BatchCounts of_all, of_some;
            BatchRequest r{4, 0, 36, 32, p, all.data(), Size};
            kernel->trace(r, of_all);
            r.pixels = some.data(), r.takes_part = part.data();
            kernel->trace(r, of_some);
            EXPECT_EQ(of_all.paths, 1024u);
            EXPECT_EQ(of_some.paths, taking);
            EXPECT_LT(of_some.rays, of_all.rays);
        }
        for (size_t i = 0; i < part.size(); i++) {
            const PixelSums expected = part[i] ? all[i] : PixelSums{};
            EXPECT_EQ(std::memcmp(&some[i], &expected, sizeof(PixelSums)), 0) << lanes << ", pixel " << i;
            const bool inside = i / Size < 32 && i % Size >= 4 && i % Size < 36;
            EXPECT_EQ(some[i].halves, inside && part[i] ? 3 : 0);
        }
    }
    // None at all is no sample.
    std::fill(part.begin(), part.end(), uint8_t(0));
    std::vector<PixelSums> none(Size * Size, PixelSums{});
    BatchCounts counts;
    BatchRequest r{0, 0, 32, 32, 0, none.data(), Size};
    r.takes_part = part.data();
    make_kernel(s.view, 8)->trace(r, counts);
    EXPECT_EQ(counts.paths + counts.rays, 0u);
    EXPECT_TRUE(same(none, std::vector<PixelSums>(Size * Size, PixelSums{})));
}

TEST(Kernel, SeedsAndProgressionsDiffer) {
    TestScene s;
    add_still_life(s);
    s.finish();
    const auto first = s.render(1, 8);
    s.view.settings.seed = 1;
    EXPECT_FALSE(same(first, s.render(1, 8)));
}

// In a closed room of albedo 1/2 that emits radiance 1, n bounces have radiance 2 - 2^-n.
TEST(Kernel, DepthLimitsBounces) {
    for (int depth : {0, 1, 2, 5}) {
        TestScene s;
        const Vec3f x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
        const std::array<Vec3f, 3> walls[] = {{-z, x, y}, {z, y, x},  {-x, y, z},
                                              {x, z, y},  {-y, z, x}, {y, x, z}};
        for (const auto& [p, a, b] : walls)
            s.add_quad(p, a, b, {matte(Rgb(0.5f)), emission(Rgb(1))});
        s.camera(x, y, z, 1, Size, Size);
        s.inputs.max_depth = depth;
        s.finish();
        const double expected = 2 - std::pow(0.5, depth);
        for (const auto& c : s.estimate(8, 8).channel)
            EXPECT_NEAR(c.mean(), expected, 0.003 * expected + 5 * c.error()) << depth;
    }
}

// Emitters are dark inside, and no path gets out of a closed ball to the sky: but for one in a million that
// starts within rounding of an edge.
TEST(Kernel, ClosedBallsAreDark) {
    TestScene s;
    s.add_sphere({0, 0, 0}, 1, 48, {matte(Rgb(0.8f)), emission(Rgb(1))});
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, Size, Size);
    s.inputs.lights.push_back(constant_sky(Rgb(1)));
    s.finish();
    for (const auto& c : s.estimate(16, 1).channel)
        EXPECT_LT(std::abs(c.mean()), 1e-6);
}

// Wavelengths of a pixel's samples lie between each other: a colour that fills the picture settles much
// faster than by the root of their number.
TEST(Kernel, WavelengthsOfAPixelAreSpread) {
    TestScene s;
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, Size, Size);
    s.inputs.lights = {constant_sky(Rgb(0.7f, 0.01f, 0.01f))};
    s.finish();
    const auto deviation = [&](int progressions) {
        kanuka::testing::RunningMean red;
        for (int seed = 0; seed < 16; seed++) {
            s.view.settings.seed = uint32_t(seed);
            for (const PixelSums& p : s.render(progressions, 8))
                red.add(double(p.rgb[0]));
        }
        EXPECT_NEAR(red.mean(), 0.7, 0.02) << progressions;
        return std::sqrt(red.variance());
    };
    const double of_one = deviation(1);
    EXPECT_LT(deviation(4), 0.3 * of_one); // by the root: a half
    EXPECT_LT(deviation(16), 0.1 * of_one);
    EXPECT_LT(deviation(64), 0.03 * of_one);
}

// ---- what is not a number

TEST(Broken, InfiniteSkiesAreCountedAndDropped) {
    TestScene s;
    s.add_quad({1, 0, 2}, {0, 4, 0}, {1, 0, 0}, {matte(Rgb(0.5f))}); // covers the right half
    s.add_quad({3, 0, 1}, {0, 4, 0}, {0, 0, -1}, {emission(Rgb(2))});
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.4f, Size, Size);
    s.inputs.lights.push_back(constant_sky(Rgb(1)));
    s.inputs.max_depth = 0;
    s.finish();
    s.view.lights.constant.c[3] = std::numeric_limits<float>::infinity();
    const auto pixels = s.render(4, 8);
    EXPECT_EQ(s.nan_samples, uint64_t(4 * Size * Size / 2));
    for (const PixelSums& p : pixels)
        EXPECT_TRUE(finite(p));
}

TEST(Broken, ANaNLightSpoilsOnlyWhatItLights) {
    TestScene s;
    s.add_quad({1, 0, 2}, {0, 4, 0}, {1, 0, 0}, {matte(Rgb(0.5f))});
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.4f, Size, Size);
    scene::Light point;
    point.kind = scene::Light::Kind::Point;
    s.inputs.lights = {point};
    s.finish();
    s.data.lights.analytic[0].c[3] = std::numeric_limits<float>::quiet_NaN();
    const auto pixels = s.render(4, 8);
    EXPECT_GT(s.nan_samples, uint64_t(4 * Size * Size * 2 / 5));
    EXPECT_LE(s.nan_samples, uint64_t(4 * Size * Size / 2));
    for (const PixelSums& p : pixels)
        EXPECT_TRUE(finite(p));
}

// A sample that is dropped is as if it had not been taken: the others' mean stays, and so does alpha.
TEST(Broken, DroppedSamplesDarkenNothing) {
    TestScene s;
    s.add_quad({0, 0, 2}, {0, 4, 0}, {4, 0, 0}, {matte(Rgb(0.5f))});
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.4f, Size, Size);
    s.inputs.max_depth = 1;
    scene::Light faint; // two alike: each is sampled half of the time, and one of them breaks its samples
    faint.kind = scene::Light::Kind::Point;
    faint.amount = Rgb(1e-6f);
    s.inputs.lights = {faint, faint, constant_sky(Rgb(1))};
    s.finish();
    s.data.lights.analytic[1].c[3] = std::numeric_limits<float>::quiet_NaN();
    constexpr int N = 32;
    const auto pixels = s.render(N, 8);
    EXPECT_NEAR(double(s.nan_samples), 0.5 * N * Size * Size, 0.03 * N * Size * Size);
    double sum = 0, dropped = 0;
    for (const PixelSums& p : pixels) {
        EXPECT_EQ(p.weight, N - p.dropped);
        EXPECT_EQ(p.alpha, p.weight);
        EXPECT_EQ(p.hits, p.weight);
        sum += double(p.rgb[1]) / (Size * Size); // over the samples that count
        dropped += double(p.dropped);
    }
    EXPECT_EQ(dropped, double(s.nan_samples));
    EXPECT_NEAR(sum, 0.5, 0.005);
}

TEST(Broken, LightsThatAreNoNumbersAreLeftOut) {
    const float NaN = std::numeric_limits<float>::quiet_NaN(), Inf = std::numeric_limits<float>::infinity();
    TestScene s;
    add_still_life(s);
    scene::Light bad;
    bad.kind = scene::Light::Kind::Spot;
    bad.where = {"scene.rib", 12};
    bad.world_from_light.m[0][3] = double(NaN);
    scene::Light bright = constant_sky(Rgb(Inf));
    s.inputs.lights.insert(s.inputs.lights.begin(), {bad, bright});
    s.finish();
    EXPECT_EQ(s.view.lights.analytic.size(), 1u);
    const auto entries = s.journal.entries();
    ASSERT_EQ(entries.size(), 2u);
    EXPECT_EQ(entries[1].where.line, 12);
    for (const PixelSums& p : s.render(2, 8))
        EXPECT_TRUE(finite(p));
    EXPECT_EQ(s.nan_samples, 0u);
}

// Geometry and inputs that are not numbers leave the rest of the picture as it is.
TEST(Broken, GeometryAndInputs) {
    const float NaN = std::numeric_limits<float>::quiet_NaN(), Inf = std::numeric_limits<float>::infinity();
    TestScene s, clean;
    add_still_life(clean);
    add_still_life(s);
    for (float bad : {NaN, Inf}) {
        s.add_lattice(1, 1, {{-1, -1, 1}, {1, -1, 1}, {-1, bad, 1}, {1, 1, 1}},
                      std::vector<Vec3f>(4, Vec3f(0, 0, -1)), {matte(Rgb(1)), emission(Rgb(3))});
        s.add_quad({0, 3, 3}, {0.1f, 0, 0}, {0, 0, 0.1f}, {emission(Rgb(bad, 1, 1))});
        s.add_lattice(1, 1, {{0, 0, 4}, {1, 0, 4}, {0, 1, 4}, {1, 1, 4}},
                      std::vector<Vec3f>(4, Vec3f(bad, 0, -1)), {metal(bad, Rgb(bad), Rgb(0.5f))});
    }
    s.finish();
    clean.finish();
    double sum[2] = {0, 0};
    for (const PixelSums& p : s.render(8, 8)) {
        ASSERT_TRUE(finite(p));
        sum[0] += double(p.rgb[1]);
    }
    EXPECT_EQ(s.nan_samples, 0u);
    for (const PixelSums& p : clean.render(8, 8))
        sum[1] += double(p.rgb[1]);
    EXPECT_GT(sum[0], 0.5 * sum[1]);
}

} // namespace kanuka::transport
