#include <algorithm>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <random>

#include "film/film.h"

namespace kanuka::film {
namespace {

struct Shape {
    const char* name;
    float width;
    std::function<double(double)> f; // written down apart from filter.cpp, from the definitions
    bool negative;
};

std::vector<Shape> shapes() {
    const auto gauss = [](double w) { return [w](double x) { return std::exp(-8 * x * x / (w * w)); }; };
    const auto tent = [](double w) { return [w](double x) { return 1 - 2 * std::abs(x) / w; }; };
    const auto cubic = [](double b, double c, double scale) {
        return [=](double x) {
            const double r = std::abs(x) * scale;
            if (r < 1)
                return ((12 - 9 * b - 6 * c) * r * r * r + (-18 + 12 * b + 6 * c) * r * r + 6 - 2 * b) / 6;
            if (r < 2)
                return ((-b - 6 * c) * r * r * r + (6 * b + 30 * c) * r * r + (-12 * b - 48 * c) * r + 8 * b +
                        24 * c) /
                       6;
            return 0.0;
        };
    };
    return {
        {"box", 1, [](double) { return 1.0; }, false},
        {"box", 3, [](double) { return 1.0; }, false},
        {"triangle", 2, tent(2), false},
        {"triangle", 5, tent(5), false},
        {"gaussian", 2, gauss(2), false},
        {"gaussian", 3.5f, gauss(3.5), false},
        {"catmull-rom", 4, cubic(0, 0.5, 1), true},
        {"catmull-rom", 3, cubic(0, 0.5, 1), true},
        {"mitchell", 4, cubic(1.0 / 3, 1.0 / 3, 1), true},
        {"mitchell", 6, cubic(1.0 / 3, 1.0 / 3, 4.0 / 6), true},
        {"sinc", 4,
         [](double x) { return x == 0 ? 1 : std::sin(M_PI * x) / (M_PI * x) * std::cos(M_PI * x / 8); },
         true},
        {"sinc", 9,
         [](double x) { return x == 0 ? 1 : std::sin(M_PI * x) / (M_PI * x) * std::cos(M_PI * x / 18); },
         true},
        {"blackman-harris", 3.3f,
         [](double x) {
             const double a = 2 * M_PI * x / 3.3;
             return 0.35875 + 0.48829 * std::cos(a) + 0.14128 * std::cos(2 * a) + 0.01168 * std::cos(3 * a);
         },
         false},
    };
}

double integrate(const std::function<double(double)>& f, double a, double b) {
    constexpr int N = 2000;
    double s = 0;
    for (int i = 0; i < N; i++)
        s += f(a + (b - a) * (i + 0.5) / N);
    return s * (b - a) / N;
}

// Upper tail of chi-square by the normal approximation of Wilson and Hilferty.
double chi_square_p(double statistic, int dof) {
    const double z = (std::cbrt(statistic / dof) - (1 - 2.0 / (9 * dof))) / std::sqrt(2.0 / (9 * dof));
    return 0.5 * std::erfc(z / M_SQRT2);
}

} // namespace

TEST(Filter, DensityIsTheAbsoluteKernel) {
    constexpr int Bins = 16, Samples = 100000;
    std::mt19937 generator(3);
    std::uniform_real_distribution<float> u;
    for (const Shape& shape : shapes()) {
        // Different widths show that the axes are not swapped.
        const Filter filter(shape.name, shape.width, 1);
        std::vector<double> expected(Bins), count(Bins);
        const double step = shape.width / Bins;
        double total = 0;
        for (int b = 0; b < Bins; b++)
            total += expected[b] = integrate([&](double x) { return std::abs(shape.f(x)); },
                                             -shape.width / 2 + b * step, -shape.width / 2 + (b + 1) * step);
        for (int i = 0; i < Samples; i++) {
            const Filter::Sample s = filter.sample(u(generator), u(generator));
            ASSERT_LE(std::abs(s.dx), shape.width / 2 * 1.00001f);
            count[std::clamp(int((s.dx + shape.width / 2) / step), 0, Bins - 1)]++;
        }
        // The table has steps of 1/1024 of the mass: bins are pooled until they hold many.
        std::vector<std::pair<double, double>> pools; // expected, found
        double remaining = Samples, pooled_expected = 0, pooled_count = 0;
        for (int b = 0; b < Bins; b++) {
            pooled_expected += expected[b] / total * Samples;
            pooled_count += count[b];
            remaining -= expected[b] / total * Samples;
            if (b + 1 < Bins && (pooled_expected < Samples / 100 || remaining < Samples / 100))
                continue;
            pools.push_back({pooled_expected, pooled_count});
            pooled_expected = pooled_count = 0;
        }
        double statistic = 0;
        const int dof = int(pools.size()) - 1;
        for (const auto& [wanted, found] : pools)
            statistic += (found - wanted) * (found - wanted) / wanted;
        if (dof > 0) {
            EXPECT_GT(chi_square_p(statistic, dof), 1e-3)
                << shape.name << ' ' << shape.width << ": " << statistic;
        }
    }
}

TEST(Filter, WeightsReproduceTheKernel) {
    // The estimate of any picture: constant, slope, curvature.
    for (const Shape& shape : shapes()) {
        const Filter filter(shape.name, shape.width, shape.width);
        const double half = shape.width / 2, area = integrate(shape.f, -half, half);
        const double second = integrate([&](double x) { return x * x * shape.f(x); }, -half, half) / area;
        double mean = 0, first_estimate = 0, second_estimate = 0;
        constexpr int N = 8 * Filter::TableSize;
        for (int i = 0; i < N; i++) {
            const float u = (float(i) + 0.5f) / N;
            const Filter::Sample s = filter.sample(u, 0.5f / Filter::TableSize);
            const double w = s.weight / filter.weight_y()[0];
            mean += w / N;
            first_estimate += w * s.dx / N;
            second_estimate += w * s.dx * s.dx / N;
        }
        EXPECT_NEAR(mean, 1, 1e-5) << shape.name << ' ' << shape.width;
        EXPECT_NEAR(first_estimate, 0, 1e-3 * half) << shape.name << ' ' << shape.width;
        EXPECT_NEAR(second_estimate, second, 2e-3 * half * half) << shape.name << ' ' << shape.width;
        EXPECT_EQ(filter.has_weights(), shape.negative) << shape.name;
    }
}

TEST(Filter, ConstantPictureStaysConstant) {
    std::mt19937 generator(5);
    std::uniform_real_distribution<float> u;
    for (const std::string& name : Filter::names()) {
        const Filter filter(name, 4, 4);
        double sum = 0, squares = 0;
        constexpr int N = 40000;
        for (int i = 0; i < N; i++) {
            const float w = filter.sample(u(generator), u(generator)).weight;
            sum += w;
            squares += double(w) * w;
        }
        const double mean = sum / N, sigma = std::sqrt(std::max(squares / N - mean * mean, 0.0) / N);
        EXPECT_NEAR(mean, 1, 4 * sigma + 1e-6) << name;
    }
}

TEST(Filter, TablesAreTheSample) {
    const Filter filter("mitchell", 4, 5);
    ASSERT_EQ(filter.table_x().size(), size_t(Filter::TableSize + 1));
    ASSERT_EQ(filter.weight_y().size(), size_t(Filter::TableSize));
    EXPECT_TRUE(std::is_sorted(filter.table_x().begin(), filter.table_x().end()));
    EXPECT_NEAR(filter.table_x().front(), -2, 1e-3);
    EXPECT_NEAR(filter.table_x().back(), 2, 1e-3);
    EXPECT_NEAR(filter.table_y().back(), 2.5, 1e-3);
    const Filter::Sample s = filter.sample((100 + 0.25f) / Filter::TableSize, 1 - 0x1p-24f);
    EXPECT_FLOAT_EQ(s.dx, filter.table_x()[100] + 0.25f * (filter.table_x()[101] - filter.table_x()[100]));
    EXPECT_NEAR(s.dy, filter.table_y().back(), 1e-3);
    EXPECT_FLOAT_EQ(s.weight, filter.weight_x()[100] * filter.weight_y().back());
}

// A ring about the middle with a trough about it: no product of two functions, and of both signs.
double ring(double x, double y) {
    const double r = std::hypot(x, y);
    return r < 0.5 ? 0.5 : r < 1 ? 2 - r : r < 1.5 ? -0.3 : 0;
}

TEST(Filter, ValuesInCellsAreDrawnByTheirSizeAndWeighedByTheirSign) {
    constexpr int Nx = 48, Ny = 40, Bins = 8;
    constexpr float Wx = 3, Wy = 4;
    std::vector<float> values;
    double all = 0, total = 0;
    std::vector<double> expected(size_t(Bins * Bins)), found(size_t(Bins * Bins));
    const auto bin = [](double x, double y) {
        const int i = std::clamp(int((x / Wx + 0.5) * Bins), 0, Bins - 1);
        return size_t(std::clamp(int((y / Wy + 0.5) * Bins), 0, Bins - 1) * Bins + i);
    };
    for (int y = 0; y < Ny; y++)
        for (int x = 0; x < Nx; x++) {
            const double px = Wx * ((x + 0.5) / Nx - 0.5), py = Wy * ((y + 0.5) / Ny - 0.5);
            values.push_back(float(ring(px, py)));
            all += std::abs(values.back());
            total += values.back();
            expected[bin(px, py)] += std::abs(values.back());
        }
    const Filter filter(values, Nx, Ny, Wx, Wy);
    EXPECT_TRUE(filter.has_weights());
    constexpr int N = 200000;
    std::mt19937 generator(7);
    std::uniform_real_distribution<float> u;
    double mean = 0;
    for (int i = 0; i < N; i++) {
        const Filter::Sample s = filter.sample(u(generator), u(generator));
        ASSERT_LE(std::abs(s.dx), Wx / 2);
        ASSERT_LE(std::abs(s.dy), Wy / 2);
        found[bin(s.dx, s.dy)]++;
        mean += s.weight / N;
    }
    EXPECT_NEAR(mean, 1, 4 * all / total / std::sqrt(double(N)));
    double statistic = 0;
    int dof = -1;
    for (size_t b = 0; b < expected.size(); b++) {
        const double wanted = expected[b] / all * N;
        if (wanted == 0) {
            EXPECT_EQ(found[b], 0) << b;
            continue;
        }
        statistic += (found[b] - wanted) * (found[b] - wanted) / wanted;
        dof++;
    }
    EXPECT_GT(chi_square_p(statistic, dof), 1e-3) << statistic;
}

TEST(Filter, ValuesThatAreNoFilterAreErrors) {
    const std::vector<float> plus{0, 1, 1, 0}, none{1, -1, 1, -1}, infinite{1, 1, INFINITY, 1};
    EXPECT_FALSE(Filter(plus, 2, 2, 1, 1).has_weights());
    for (const float u : {0.0f, 0.49999f, 0.5f, 1 - 0x1p-24f}) // never where it is 0
        for (const float v : {0.0f, 0.5f, 1 - 0x1p-24f}) {
            const Filter::Sample s = Filter(plus, 2, 2, 1, 1).sample(u, v);
            EXPECT_LE(s.dx * s.dy, 0) << u << ' ' << v;
            EXPECT_EQ(s.weight, 1);
        }
    EXPECT_THROW(Filter(none, 2, 2, 1, 1), Error);
    EXPECT_THROW(Filter(infinite, 2, 2, 1, 1), Error);
    EXPECT_THROW(Filter(plus, 3, 2, 1, 1), Error);
    EXPECT_THROW(Filter(plus, 2, 2, 0, 1), Error);
}

TEST(Filter, NonsenseIsAnError) {
    try {
        Filter("gausian", 2, 2);
        FAIL();
    } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find("gaussian"), std::string::npos);
        EXPECT_NE(std::string(e.what()).find("blackman-harris"), std::string::npos);
    }
    EXPECT_THROW(Filter("box", 0, 1), Error);
    EXPECT_THROW(Filter("box", 1, -1), Error);
    EXPECT_THROW(Filter("box", std::numeric_limits<float>::quiet_NaN(), 1), Error);
    EXPECT_THROW(Filter("box", 1, std::numeric_limits<float>::infinity()), Error);
}

} // namespace kanuka::film
