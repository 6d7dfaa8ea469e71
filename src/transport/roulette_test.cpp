// Roulette that fits the scene: what is learned against closed forms; that it changes no mean is in mis_test.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "transport/test_pilot.h"

namespace kanuka::transport {
namespace {

using namespace testing;

constexpr int Across = 64, Down = 32, Samples = RoulettePilot::Samples;

// Paths that lose the part 1 - a of their light at each surface, and escape after it with the probability p
// to where it is white. Batches as a pilot has them, of one row of places each. `light` multiplies all.
std::vector<PilotBatch> walks(double a, double p, double light, uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u;
    std::vector<PilotBatch> batches(size_t(Down * Samples));
    for (PilotBatch& b : batches)
        for (int k = 0; k < Across; k++) {
            PilotBatch::Path path{0, 1};
            double throughput = a;
            for (int bounce = 0;; bounce++, throughput *= a) {
                b.departures.push_back({k, bounce, float(throughput), path});
                path.rays++;
                if (u(random) < p)
                    break;
            }
            path.light = float(throughput * light);
            b.paths.push_back(path);
        }
    return batches;
}

TEST(RoulettePilot, FindsWhatWalksAreWorth) {
    const double a = 0.7, p = 0.3;
    const double mean = p / (1 - a * (1 - p)),
                 square = p / (1 - a * a * (1 - p)); // of a path of throughput 1
    const double variance = a * a * (square - mean * mean), rays = 1 + 1 / p;
    const double factor = RouletteFactors::Margin * std::sqrt(square / (1 / p) / (variance / rays));
    for (double light : {1.0, 1000.0, 1e-4}) {
        const auto learned = learn_roulette(walks(a, p, light, 7), Samples, Across);
        ASSERT_TRUE(learned);
        for (int d = 0; d < 4; d++) // the same in any unit of light
            EXPECT_NEAR(learned->after(d, false), factor, 0.06 * factor) << d << ", " << light;
    }
}

TEST(RoulettePilot, NeverEndsPathsBelowTheirThroughput) {
    // Nearly all light is found at once: what follows is worth next to nothing, as far as the pilot can say.
    std::vector<PilotBatch> batches = walks(0.7, 0.3, 1, 3);
    std::mt19937 random(5);
    for (PilotBatch& b : batches)
        for (PilotBatch::Path& path : b.paths)
            path.light = float(random() % 2);
    for (PilotBatch& b : batches)
        for (PilotBatch::Departure& d : b.departures)
            d.until.light = b.paths[size_t(d.path)].light;
    const auto learned = learn_roulette(batches, Samples, Across);
    ASSERT_TRUE(learned);
    for (const float factor : learned->at)
        EXPECT_EQ(factor, 1.0f);
}

TEST(RoulettePilot, KnowsNothingOfTheDark) {
    EXPECT_FALSE(learn_roulette(walks(0.7, 0.3, 0, 3), Samples, Across));
    std::vector<PilotBatch> batches = walks(0.7, 0.3, 1, 3);
    for (PilotBatch& b : batches)
        b.departures.clear();
    EXPECT_FALSE(learn_roulette(batches, Samples, Across));
}

// A sheet that reflects half of its light to a white sky and sends the other half on to a black floor. From
// the sheet on a path costs one ray and finds 1 or 0, so E[L²] / C is 1/2; whole ones find a or 0 by two
// rays. Four samples of a net go two each way, so their variance is a² / 3, not a² / 4 as that of independent
// ones.
std::optional<RouletteFactors> sheet(double a, int lanes) {
    TestScene s;
    s.add_quad({0, 0, 2}, {0, 100, 0}, {100, 0, 0},
               {matte(Rgb(float(a)), 0.5f), {grid::LobeId::LambertBtdf, {Rgb(float(a))}, 0.5f}});
    s.add_quad({0, 0, 3}, {0, 1e4f, 0}, {1e4f, 0, 0}, {matte(Rgb(0))});
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.5f, 256, 128);
    s.inputs.lights.push_back(constant_sky(Rgb(1)));
    s.finish();
    return learn_by_pilot(s, 256, 128, lanes);
}

TEST(RoulettePilot, FindsWhatASheetIsWorth) {
    const double a = 0.6;
    const auto learned = sheet(a, 8);
    ASSERT_TRUE(learned);
    const double expected = RouletteFactors::Margin * std::sqrt(0.5 / (a * a / 3 / 2));
    EXPECT_NEAR(learned->after(0, false), expected, 0.005 * expected);
    EXPECT_NEAR(learned->after(0, true), expected / RouletteFactors::Margin, 0.005 * expected);
    for (int lanes : {1, 16})
        EXPECT_EQ(sheet(a, lanes)->at, learned->at) << lanes;
}

} // namespace
} // namespace kanuka::transport
