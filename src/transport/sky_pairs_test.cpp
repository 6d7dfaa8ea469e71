// Pairs of directions that search the sky: closed forms, that they change no mean, and where a pilot wants
// them.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "transport/test_pilot.h"

namespace kanuka::transport {
namespace {

using namespace testing;

// No roulette: with pairs at all bounces, and without.
constexpr float Never = 1e6f;
constexpr RouletteFactors Pairs{{Never, Never, Never, Never, Never, Never, Never, Never}, 0xff};
constexpr RouletteFactors Alone{{Never, Never, Never, Never, Never, Never, Never, Never}, 0};

void expect_same_means(const TestScene::Estimate& a, const TestScene::Estimate& b, const std::string& what) {
    for (int c = 0; c < 3; c++)
        EXPECT_NEAR(a.channel[c].mean(), b.channel[c].mean(),
                    1e-4 * b.channel[c].mean() + 4.5 * std::hypot(a.channel[c].error(), b.channel[c].error()))
            << what << ", channel " << c;
}

// A floor at the foot of a black wall sees half of the sky, of which one of two directions that lie opposite
// to each other is: all samples are the mean.
TEST(SkyPairs, HalfASkyHasNoNoise) {
    const float albedo = 0.6f;
    for (const bool pairs : {true, false}) {
        TestScene s;
        s.add_quad({0, 0, 2}, {0, 10, 0}, {10, 0, 0}, {matte(Rgb(albedo))});
        s.add_quad({0.5f, 0, 0}, {0, 1e5f, 0}, {0, 0, 1e5f}, {matte(Rgb(0))});
        s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.01f, Size, Size);
        s.inputs.camera.left = 0.2499f, s.inputs.camera.right = 0.24995f; // 1e-4 to 2e-4 from the wall
        s.inputs.lights.push_back(constant_sky(Rgb(1)));
        s.finish();
        s.view.settings.first_pairs = pairs;
        double squares = 0;
        for (const PixelSums& p : s.render(1, 8))
            squares += std::pow(double(p.rgb[1]) - albedo / 2, 2) / (Size * Size);
        if (pairs)
            EXPECT_LT(std::sqrt(squares), 0.02 * albedo);
        else // one sample is all or nothing
            EXPECT_GT(std::sqrt(squares), 0.4 * albedo);
    }
}

// Lobes under a sky that is hidden in part: diffuse and rough ones; or of all kinds, and a lamp beside it.
enum class Yard { Diffuse, Plain, Dispersive };
TestScene::Estimate yard(const RouletteFactors* factors, Yard kind, const char* integrator = "path") {
    const bool dispersive = kind == Yard::Dispersive;
    TestScene s;
    const Vec3f x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
    s.add_quad({0, -1, 3}, z * 4.0f, x * 4.0f,
               {matte(Rgb(0.6f, 0.3f, 0.2f)), metal(0.5f, Rgb(0.2f, 0.4f, 0.5f), Rgb(0.5f))});
    s.add_quad({0, 0, 5}, y * 2.0f, x * 4.0f, {matte(Rgb(0.3f, 0.5f, 0.8f))});
    s.add_quad({-1, 0, 3}, y, z, {matte(Rgb(0.2f), 0.5f), {grid::LobeId::LambertBtdf, {Rgb(0.7f)}, 0.5f}});
    if (kind != Yard::Diffuse) {
        s.add_sphere({0.6f, -0.4f, 3}, 0.5f, 24, {dispersive ? prism(0.3f, 1.5f, 20) : glass(0.2f)});
        s.add_sphere({-0.5f, -0.5f, 3.4f}, 0.4f, 24, {metal(0)});
        s.add_quad({0, 2, 3}, {0.5f, 0, 0}, {0, 0, 0.5f}, {emission(Rgb(6, 5, 4))});
    }
    s.camera(x, y, z, 0.5f, Size, Size);
    s.inputs.lights.push_back(constant_sky(Rgb(0.5f, 0.7f, 1)));
    s.inputs.max_depth = 6;
    s.inputs.integrator = IntegratorChoice::parse(integrator);
    s.finish();
    EXPECT_EQ(s.view.settings.keeps_ratios, dispersive);
    s.view.settings.roulette = factors;
    return s.estimate(16, 24);
}
TEST(SkyPairs, ChangeNoMean) {
    for (const Yard kind : {Yard::Diffuse, Yard::Plain, Yard::Dispersive}) {
        const auto pairs = yard(&Pairs, kind);
        expect_same_means(pairs, yard(&Alone, kind), std::to_string(int(kind)));
        EXPECT_EQ(pairs.nan_samples, 0u);
        if (kind == Yard::Diffuse)
            expect_same_means(pairs, yard(nullptr, kind, "reference"), "reference");
    }
}

TEST(SkyPairs, NothingThatTheSkyIsNotLinkedToHasThem) {
    TestScene s;
    s.links.lit_sets = 1;
    s.add_quad({0, 0, 2}, {0, 10, 0}, {10, 0, 0}, {matte(Rgb(0.6f))});
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.5f, Size, Size);
    s.inputs.lights.push_back(constant_sky(Rgb(1)));
    s.inputs.lights.back().lit_sets = 2;
    s.finish();
    ASSERT_TRUE(s.view.lights.linked);
    s.view.settings.roulette = &Pairs;
    for (const PixelSums& p : s.render(4, 8))
        EXPECT_EQ(p.rgb[1], 0.0f);
}

// ---- where they pay

// Paths of one bounce that find the sky or do not, the one of a pair as the other or not as it; beside that
// they find as much of something else, of the variance `other`.
std::vector<PilotBatch> bounces(bool opposite, double other) {
    constexpr int Across = 64, Down = 32;
    std::mt19937 random(11);
    std::normal_distribution<double> normal;
    std::vector<PilotBatch> batches(size_t(Down * RoulettePilot::Samples));
    for (PilotBatch& b : batches)
        for (int k = 0; k < Across; k++) {
            const bool open = random() % 2 == 0;
            const float more = float(4 + std::sqrt(other) * normal(random));
            PilotBatch::Departure d{k, 0, 0.5f, {more, 1}};
            d.sky = open ? 1.0f : 0.0f, d.other_sky = (open != opposite) ? 1.0f : 0.0f;
            b.departures.push_back(d);
            b.paths.push_back({more + d.sky, 2});
        }
    return batches;
}
uint32_t pairs_of(bool opposite, double other) {
    const auto learned = learn_roulette(bounces(opposite, other), RoulettePilot::Samples, 64);
    EXPECT_TRUE(learned);
    return learned->sky_pairs;
}
TEST(RoulettePilot, PairsThatCancelAreWorthARay) {
    // They take 1/4 off a variance of 1/4 + other, of which half counts, for three rays instead of two: up to
    // (V / 2 - 1 / 4) 3 = (V / 2) 2, V = 3 / 2.
    EXPECT_EQ(pairs_of(true, 0), 1u);
    EXPECT_EQ(pairs_of(true, 1.05), 1u);
    EXPECT_EQ(pairs_of(true, 1.5), 0u);
}
TEST(RoulettePilot, PairsThatFindTheSameAreWorthNothing) {
    EXPECT_EQ(pairs_of(false, 0), 0u);
    EXPECT_EQ(pairs_of(false, 1), 0u);
}
TEST(RoulettePilot, OfAPairOneHalfGoesOn) {
    // V = other, which is all that is left; behind the bounce there is 1/2 or nothing: E[L²] = 1/8, for one
    // ray of three.
    const double other = 0.5;
    const auto learned = learn_roulette(bounces(true, other), RoulettePilot::Samples, 64);
    ASSERT_TRUE(learned);
    const double throughput = 0.5,
                 expected = RouletteFactors::Margin / throughput * std::sqrt(0.125 / (other / 3));
    EXPECT_NEAR(learned->after(0, false), expected, 0.03 * expected);
}

// What a pilot finds in a scene. A wall stands on the floor, or does not; all of it is in a box, or is not.
std::optional<RouletteFactors> found(bool wall, bool box, int lanes) {
    TestScene s;
    s.add_quad({0, 0, 2}, {0, 10, 0}, {10, 0, 0}, {matte(Rgb(0.6f))});
    if (wall)
        for (int k = -3; k <= 3; k++)
            s.add_quad({float(k) * 0.25f, 0, 1.9f}, {0, 10, 0}, {0, 0, 0.1f}, {matte(Rgb(0.6f))});
    if (box) {
        s.add_quad({0, 0, -1}, {20, 0, 0}, {0, 20, 0}, {matte(Rgb(0.5f))});
        s.add_quad({0, 0, 4}, {0, 20, 0}, {20, 0, 0}, {matte(Rgb(0.5f))});
        for (const float side : {-1.0f, 1.0f}) {
            s.add_quad({12 * side, 0, 1}, {0, 20 * side, 0}, {0, 0, 20}, {matte(Rgb(0.5f))});
            s.add_quad({0, 12 * side, 1}, {0, 0, 20 * side}, {20, 0, 0}, {matte(Rgb(0.5f))});
        }
        s.add_quad({0, 4, 0.5f}, {0, 0.5f, 0}, {-0.5f, 0, 0}, {emission(Rgb(5))});
    }
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.4f, 256, 128);
    s.inputs.lights.push_back(constant_sky(Rgb(1)));
    s.finish();
    return learn_by_pilot(s, 256, 128, lanes);
}
TEST(RoulettePilot, WantsPairsWhereTheSkyIsHiddenInPart) {
    const auto wall = found(true, false, 8);
    ASSERT_TRUE(wall);
    EXPECT_TRUE(wall->pairs_sky(0));
    for (const int lanes : {1, 16}) {
        const auto same = found(true, false, lanes);
        ASSERT_TRUE(same);
        EXPECT_EQ(same->sky_pairs, wall->sky_pairs) << lanes;
        EXPECT_EQ(same->at, wall->at) << lanes;
    }
    const auto open = found(false, false, 8), closed = found(true, true, 8);
    ASSERT_TRUE(open);
    EXPECT_EQ(open->sky_pairs, 0u);
    ASSERT_TRUE(closed);
    EXPECT_EQ(closed->sky_pairs, 0u);
}

} // namespace
} // namespace kanuka::transport
