// The sampler: nets of progressions and of pixels, uniformity, independence of nets and tiles, the same
// points for all lane counts.
#include "base/sampling.h"

#include <algorithm>
#include <array>
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

int pixel(int px, int py, uint32_t seed = 0) {
    return pixel_seed(Int<1>(px), Int<1>(py), seed)[0];
}

Point point(int pixel, int net, uint32_t progression) {
    const Sampler<1> s{Int<1>(pixel), reverse_bits_scalar(progression)};
    Float<1> x, y;
    s.sample_2d(net, x, y);
    return {x[0], y[0]};
}

using Place = std::array<float, 3>;

Place place(int pixel, int net, uint32_t progression) {
    const Sampler<1> s{Int<1>(pixel), reverse_bits_scalar(progression)};
    Float<1> u[3];
    s.sample_3d(net, u[0], u[1], u[2]);
    return {u[0][0], u[1][0], u[2][0]};
}

// Is one of 4^m points in each box of 4^-a by 4^-b by 4^-c, a + b + c = m?
void expect_net(const std::vector<Place>& points, const char* what) {
    int m = 0;
    while ((size_t(1) << (2 * m)) < points.size())
        m++;
    ASSERT_EQ(points.size(), size_t(1) << (2 * m));
    for (int a = 0; a <= m; a++)
        for (int b = 0; a + b <= m; b++) {
            const int digits[3] = {a, b, m - a - b};
            std::vector<int> count(points.size(), 0);
            for (const Place& p : points) {
                size_t box = 0;
                for (size_t k = 0; k < 3; k++)
                    box = (box << (2 * digits[k])) | size_t(p[k] * float(1 << (2 * digits[k])));
                count[box]++;
            }
            ASSERT_EQ(size_t(std::count(count.begin(), count.end(), 1)), points.size())
                << what << ": 4^" << m << " points, " << a << " and " << b << " digits";
        }
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
    for (int column = 0; column < 4; column++)
        for (int net : {0, 1, 2, 3, 10, 101})
            for (int m = 0; m <= 10; m++)
                for (uint32_t run : {0u, 1u, 5u}) {
                    const uint32_t n = 1u << m;
                    std::vector<Point> points;
                    for (uint32_t i = 0; i < n; i++)
                        points.push_back(point(pixel(column, 7), net, run * n + i));
                    for (int k = 0; k <= m; k++) {
                        std::vector<int> count(n, 0);
                        for (const Point& p : points) {
                            const uint32_t column = uint32_t(p.x * float(1u << k));
                            const uint32_t row = uint32_t(p.y * float(1u << (m - k)));
                            count[(row << k) | column]++;
                        }
                        ASSERT_EQ(std::count(count.begin(), count.end(), 1), n)
                            << "pixel " << column << ", net " << net << ", run " << run << " of 2^" << m
                            << ", " << (1 << k) << " columns";
                    }
                }
}

// The third dimension belongs to the net: 4^m samples fill all boxes of base 4.
TEST(Sampler, AlignedRunsAreNetsInThreeDimensions) {
    for (int column : {0, 5, 31})
        for (int net : {0, 3, 5, 102})
            for (int m = 1; m <= 4; m++)
                for (uint32_t run : {0u, 1u, 7u}) {
                    std::vector<Place> points;
                    for (uint32_t i = 0; i < 1u << (2 * m); i++)
                        points.push_back(place(pixel(column, 9), net, (run << (2 * m)) + i));
                    ASSERT_NO_FATAL_FAILURE(expect_net(points, "one pixel"));
                }
}

// So do 4^j samples of each of the pixels of an aligned square of 2^k by 2^k, for all j and k.
TEST(Sampler, SquaresOfPixelsAreNets) {
    for (int net : {0, 5, 103})
        for (int k = 1; k <= TileBits; k++)
            for (int j = 0; j + k <= 5; j++)
                for (int corner : {0, 1, 3}) {
                    const int side = 1 << k, x0 = 48 + corner * side, y0 = 16 + corner / 2 * side;
                    std::vector<Place> points;
                    for (int y = y0; y < y0 + side; y++)
                        for (int x = x0; x < x0 + side; x++)
                            for (uint32_t i = 0; i < 1u << (2 * j); i++)
                                points.push_back(
                                    place(pixel(x, y, 11), net, (uint32_t(corner) << (2 * j)) + i));
                    ASSERT_NO_FATAL_FAILURE(expect_net(points, "a square"));
                }
}

// Over seeds, any one sample of any one pixel is uniform: each pixel is an estimate without bias.
TEST(Sampler, OverSeedsEachSampleIsUniform) {
    constexpr int Tests = 6;
    for (int t = 0; t < Tests; t++) {
        std::vector<Point> points, others;
        for (uint32_t seed = 1 << 16; seed < 2 << 16; seed++) {
            const Place p = place(pixel(37 * t, 11 * t, seed), 3 + t, uint32_t(t * t));
            points.push_back({p[0], p[1]});
            others.push_back({p[1], p[2]});
        }
        EXPECT_GT(uniform_p(points), sidak(1e-3, 2 * Tests)) << "net " << 3 + t;
        EXPECT_GT(uniform_p(others), sidak(1e-3, 2 * Tests)) << "net " << 3 + t;
    }
}

// Single numbers: the first 2^m of a pixel are one in each of 2^m parts.
TEST(Sampler, SingleNumbersFillTheirRange) {
    for (int column = 0; column < 4; column++)
        for (int m = 0; m <= 8; m++) {
            std::vector<int> count(size_t(1) << m, 0);
            for (uint32_t i = 0; i < 1u << m; i++) {
                const Sampler<1> s{Int<1>(pixel(column, 3)), reverse_bits_scalar(i)};
                count[size_t(s.sample_1d(4)[0] * float(1 << m))]++;
            }
            EXPECT_EQ(size_t(std::count(count.begin(), count.end(), 1)), count.size());
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
                points.push_back(point(pixel(x, y), t / 4 * 5, progression));
        EXPECT_GT(uniform_p(points), sidak(1e-3, Tests))
            << "pair " << t / 4 * 5 << ", progression " << progression;
    }
}

// Samples of different tiles, and of different nets of a pixel, know nothing of one another.
TEST(Sampler, TilesAndNetsAreIndependent) {
    constexpr int Tests = 8, Side = 1 << TileBits;
    for (int t = 0; t < Tests; t++) {
        const uint32_t progression = uint32_t(t & 1);
        std::vector<Point> neighbours, nets;
        for (int y = t; y < 256 * Side; y += Side)
            for (int x = 2 * t; x < 256 * Side; x += Side) {
                const Point a = point(pixel(x, y), t, progression);
                const Point b = point(pixel(x + Side, y), t, progression);
                const Point c = point(pixel(x, y), t + 1, progression);
                neighbours.push_back({a.x, b.x});
                nets.push_back({a.y, c.x});
            }
        EXPECT_GT(uniform_p(neighbours), sidak(1e-3, 2 * Tests)) << "tiles, net " << t;
        EXPECT_GT(uniform_p(nets), sidak(1e-3, 2 * Tests)) << "nets " << t << " and " << t + 1;
    }
}

// Within a tile, too, nets are shuffled apart: what they make of one progression of its pixels is no more
// correlated than twice what random points would have.
TEST(Sampler, NetsOfATileAreUncorrelated) {
    constexpr int Tests = 8, Tiles = 1024, Side = 1 << TileBits;
    for (int t = 0; t < Tests; t++) {
        testing::RunningMean sum;
        for (int tile = 0; tile < Tiles; tile++) {
            double s = 0;
            for (int i = 0; i < Side * Side; i++) {
                const int of = pixel(tile * Side + i % Side, t * Side + i / Side);
                const Point a = point(of, t, 0), b = point(of, t + 1 + t % 5, 0);
                s += (t & 1 ? double(a.x) - 0.5 : double(a.y) - 0.5) *
                     (t & 2 ? double(b.x) - 0.5 : double(b.y) - 0.5);
            }
            sum.add(s);
        }
        EXPECT_GT(testing::normal_p(sum.mean() / sum.error()), sidak(1e-3, Tests)) << "nets " << t;
        EXPECT_LT(sum.variance(), 2 * Side * Side / 144.0) << "nets " << t;
    }
}

// Within one pixel, over its progressions, nets are shuffled apart: their correlation is zero on average,
// and in the single pixel not much larger than random points would have it. (Shuffles are nested: bits of the
// two points that come from the same bit of the index go together in blocks. For ideal ones that makes 9/7 of
// random points' variance; the hash makes it 1.6.)
TEST(Sampler, NetsOfAPixelAreUncorrelatedOverProgressions) {
    constexpr int Tests = 16, Pixels = 2048, N = 64;
    for (int t = 0; t < Tests; t++) {
        testing::RunningMean sum;
        for (int column = 0; column < Pixels; column++) {
            const int of = pixel(column << TileBits, t);
            double s = 0;
            for (uint32_t i = 0; i < N; i++) {
                const Point a = point(of, t, i), b = point(of, t + 1 + t % 5, i);
                s += (t & 1 ? double(a.x) - 0.5 : double(a.y) - 0.5) *
                     (t & 2 ? double(b.x) - 0.5 : double(b.y) - 0.5);
            }
            sum.add(s);
        }
        EXPECT_GT(testing::normal_p(sum.mean() / sum.error()), sidak(1e-3, Tests)) << "nets " << t;
        EXPECT_LT(sum.variance(), 2 * N / 144.0) << "nets " << t;
    }
}

// Successive samples of a pixel fill space better than random ones: error of an integral over the square
// falls faster than 1 / sqrt(n).
TEST(Sampler, IntegratesBetterThanRandom) {
    double square_error = 0;
    constexpr int Pixels = 64, N = 1024;
    for (int column = 0; column < Pixels; column++) {
        double sum = 0;
        for (uint32_t i = 0; i < N; i++) {
            const Point p = point(pixel(column << TileBits, 1), 4, i);
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
            const Int<W> of = pixel_seed(Int<W>::lane_index() + Int<W>(base), Int<W>(base / 7), 5);
            const Sampler<W> sampler{of, reversed};
            Float<W> x, y, u0, u1, u2;
            sampler.sample_2d(base % 50, x, y);
            sampler.sample_3d(base % 50, u0, u1, u2);
            const Float<W> single = sampler.sample_1d(base % 50);
            for (int i = 0; i < W; i++) {
                const int one = pixel(base + i, base / 7, 5);
                ASSERT_EQ(of[i], one);
                const Point p = point(one, base % 50, uint32_t(base * 3));
                ASSERT_EQ(x[i], p.x);
                ASSERT_EQ(y[i], p.y);
                const Place q = place(one, base % 50, uint32_t(base * 3));
                ASSERT_EQ(u0[i], q[0]);
                ASSERT_EQ(u1[i], q[1]);
                ASSERT_EQ(u2[i], q[2]);
                ASSERT_EQ(single[i], (Sampler<1>{Int<1>(one), reversed}.sample_1d(base % 50)[0]));
            }
        }
    };
    compare(std::integral_constant<int, 8>());
    compare(std::integral_constant<int, 16>());
}

TEST(Sampler, NetsOfBouncesDoNotOverlap) {
    std::vector<int> used = {int(Net::Filter), int(Net::Wavelength), int(Net::Lens)};
    for (int bounce = 0; bounce < 10; bounce++)
        for (Net net : {Net::Scatter, Net::Roulette, Net::Light, Net::LightMore})
            used.push_back(bounce_net(bounce, net));
    std::sort(used.begin(), used.end());
    EXPECT_EQ(std::adjacent_find(used.begin(), used.end()), used.end());
}

} // namespace kanuka
