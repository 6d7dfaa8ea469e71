// The sampler: nets, uniformity, independence of pairs, the same points for all lane counts.
#include "base/sampling.h"

#include <gtest/gtest.h>
#include <vector>

#include "base/test_statistics.h"

namespace kanuka {
namespace {

using testing::chi_square;
using testing::sidak;

struct Point {
    float x, y;
};

int pixel_hash(int px, int py) {
    return hash_bits(Int<1>(px) ^ hash_bits(Int<1>(py ^ 0x7f4a7c15)))[0];
}

Point point(int pixel, int pair, uint32_t progression) {
    const Sampler<1> s{Int<1>(pixel), reverse_bits_scalar(progression)};
    Float<1> x, y;
    s.sample_2d(pair, x, y);
    return {x[0], y[0]};
}

// 16 x 16 histogram against equal counts.
double uniform_p(const std::vector<Point>& points, int lost = 0) {
    std::vector<double> seen(256, 0.0);
    for (const Point& p : points)
        seen[size_t(int(p.y * 16) * 16 + int(p.x * 16))]++;
    return chi_square(seen, std::vector<double>(256, double(points.size()) / 256), lost).p;
}

} // namespace

TEST(Sampler, ReversesBits) {
    for (int bit = 0; bit < 32; bit++)
        EXPECT_EQ(reverse_bits_scalar(1u << bit), 1u << (31 - bit));
    EXPECT_EQ(reverse_bits_scalar(0x12345678u), 0x1e6a2c48u);
}

TEST(Sampler, UnitValuesStayBelowOne) {
    EXPECT_EQ(to_unit(Int<1>(0))[0], 0.0f);
    EXPECT_EQ(to_unit(Int<1>(-1))[0], 1 - 0x1p-24f);
    EXPECT_EQ(to_unit(Int<1>(int(0x80000000u)))[0], 0.5f);
}

// Every run of 2^m points that starts at a multiple of 2^m has one point in each elementary interval: (0, m,
// 2)-nets.
TEST(Sampler, AlignedRunsAreNets) {
    for (int pixel = 0; pixel < 4; pixel++)
        for (int pair : {0, 1, 2, 3, 10, 101})
            for (int m = 0; m <= 10; m++)
                for (uint32_t run : {0u, 1u, 5u}) {
                    const uint32_t n = 1u << m;
                    std::vector<Point> points;
                    for (uint32_t i = 0; i < n; i++)
                        points.push_back(point(pixel_hash(pixel, 7), pair, run * n + i));
                    for (int k = 0; k <= m; k++) {
                        std::vector<int> count(n, 0);
                        for (const Point& p : points) {
                            const uint32_t column = uint32_t(p.x * float(1u << k));
                            const uint32_t row = uint32_t(p.y * float(1u << (m - k)));
                            count[(row << k) | column]++;
                        }
                        ASSERT_EQ(std::count(count.begin(), count.end(), 1), n)
                            << "pixel " << pixel << ", pair " << pair << ", run " << run << " of 2^" << m
                            << ", " << (1 << k) << " columns";
                    }
                }
}

// Over pixels, any one sample is uniform: that is what makes an estimate without bias at any count.
TEST(Sampler, OverPixelsEachSampleIsUniform) {
    constexpr int Tests = 12;
    for (int t = 0; t < Tests; t++) {
        const uint32_t progression = uint32_t(t % 4 == 3 ? 1000 : t % 4);
        std::vector<Point> points;
        for (int y = 0; y < 256; y++)
            for (int x = 0; x < 256; x++)
                points.push_back(point(pixel_hash(x, y), t / 4 * 5, progression));
        EXPECT_GT(uniform_p(points), sidak(1e-3, Tests))
            << "pair " << t / 4 * 5 << ", progression " << progression;
    }
}

// Samples of neighbouring pixels, and of different pairs of a pixel, know nothing of one another.
TEST(Sampler, NeighboursAndPairsAreIndependent) {
    constexpr int Tests = 8;
    for (int t = 0; t < Tests; t++) {
        const uint32_t progression = uint32_t(t & 1);
        std::vector<Point> neighbours, pairs;
        for (int y = 0; y < 256; y++)
            for (int x = 0; x < 256; x++) {
                const Point a = point(pixel_hash(x, y), t, progression);
                const Point b = point(pixel_hash(x + 1, y), t, progression);
                const Point c = point(pixel_hash(x, y), t + 1, progression);
                neighbours.push_back({a.x, b.x});
                pairs.push_back({a.y, c.x});
            }
        EXPECT_GT(uniform_p(neighbours), sidak(1e-3, 2 * Tests)) << "neighbours, pair " << t;
        EXPECT_GT(uniform_p(pairs), sidak(1e-3, 2 * Tests)) << "pairs " << t << " and " << t + 1;
    }
}

// Within one pixel, over its progressions, pairs are shuffled apart: their correlation is zero on average,
// and in the single pixel not much larger than random points would have it. (Shuffles are nested: bits of the
// two points that come from the same bit of the index go together in blocks. For ideal ones that makes 9/7 of
// random points' variance; the hash makes it 1.6.)
TEST(Sampler, PairsOfAPixelAreUncorrelatedOverProgressions) {
    constexpr int Tests = 16, Pixels = 2048, N = 64;
    for (int t = 0; t < Tests; t++) {
        testing::RunningMean sum;
        for (int pixel = 0; pixel < Pixels; pixel++) {
            double s = 0;
            for (uint32_t i = 0; i < N; i++) {
                const Point a = point(pixel_hash(pixel, t), t, i),
                            b = point(pixel_hash(pixel, t), t + 1 + t % 5, i);
                s += (t & 1 ? double(a.x) - 0.5 : double(a.y) - 0.5) *
                     (t & 2 ? double(b.x) - 0.5 : double(b.y) - 0.5);
            }
            sum.add(s);
        }
        EXPECT_GT(testing::normal_p(sum.mean() / sum.error()), sidak(1e-3, Tests)) << "pairs " << t;
        EXPECT_LT(sum.variance(), 2 * N / 144.0) << "pairs " << t;
    }
}

// Successive samples of a pixel fill space better than random ones: error of an integral over the square
// falls faster than 1 / sqrt(n).
TEST(Sampler, IntegratesBetterThanRandom) {
    double square_error = 0;
    constexpr int Pixels = 64, N = 1024;
    for (int pixel = 0; pixel < Pixels; pixel++) {
        double sum = 0;
        for (uint32_t i = 0; i < N; i++) {
            const Point p = point(pixel_hash(pixel, 1), 4, i);
            sum += double(p.x) * p.x * p.y; // mean 1/6, variance 1/15 - 1/36
        }
        square_error += (sum / N - 1.0 / 6) * (sum / N - 1.0 / 6) / Pixels;
    }
    const double random = (1.0 / 15 - 1.0 / 36) / N;
    EXPECT_LT(square_error, random / 1000); // a net's variance falls with n^3
}

TEST(Sampler, SameForAllLaneCounts) {
    const auto compare = [](auto width) {
        constexpr int W = decltype(width)::value;
        for (int base = 0; base < 4096; base += W) {
            const uint32_t reversed = reverse_bits_scalar(uint32_t(base * 3));
            const Int<W> pixel = hash_bits(Int<W>::lane_index() + Int<W>(base));
            Float<W> x, y;
            Sampler<W>{pixel, reversed}.sample_2d(base % 50, x, y);
            for (int i = 0; i < W; i++) {
                const Point p = point(hash_bits(Int<1>(base + i))[0], base % 50, uint32_t(base * 3));
                ASSERT_EQ(x[i], p.x);
                ASSERT_EQ(y[i], p.y);
            }
        }
    };
    compare(std::integral_constant<int, 8>());
    compare(std::integral_constant<int, 16>());
}

TEST(Sampler, DimensionsOfBouncesDoNotOverlap) {
    std::vector<int> used = {int(Dimension::Filter), int(Dimension::Wavelength), int(Dimension::Lens)};
    for (int bounce = 0; bounce < 10; bounce++)
        for (Dimension d : {Dimension::LobeRoulette, Dimension::Direction, Dimension::LightChoice,
                            Dimension::LightPosition})
            used.push_back(bounce_dimension(bounce, d));
    std::sort(used.begin(), used.end());
    EXPECT_EQ(std::adjacent_find(used.begin(), used.end()), used.end());
}

} // namespace kanuka
