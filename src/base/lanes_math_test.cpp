// Elementary functions keep the errors that their comments promise, with the same bits for every lane count.
#include "base/lanes_math.h"

#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <vector>

namespace kanuka {
namespace {

// Results of f(x) for all x, one value after another.
template <int W, class F>
std::vector<float> evaluate(const std::vector<float>& x, const F& f) {
    std::vector<float> out(x.size());
    for (size_t i = 0; i + W <= x.size(); i += W)
        f(Float<W>::load(&x[i])).store(&out[i]);
    return out;
}

std::vector<float> spread(float from, float to, int count) {
    std::vector<float> x(static_cast<size_t>(count));
    for (size_t i = 0; i < x.size(); i++)
        x[i] = float(from + (double(to) - from) * double(i) / double(count - 1));
    return x;
}

template <class F>
std::vector<float> same_for_all_widths(const std::vector<float>& x, const F& f) {
    const auto one = evaluate<1>(x, f), eight = evaluate<8>(x, f), sixteen = evaluate<16>(x, f);
    EXPECT_EQ(0, std::memcmp(one.data(), eight.data(), one.size() * 4));
    EXPECT_EQ(0, std::memcmp(one.data(), sixteen.data(), one.size() * 4));
    return one;
}

template <class F, class Reference>
double worst(const std::vector<float>& x, const F& f, const Reference& reference, bool relative) {
    const auto y = same_for_all_widths(x, f);
    double largest = 0;
    for (size_t i = 0; i < x.size(); i++) {
        const double r = reference(double(x[i]));
        largest = std::max(largest, std::abs(double(y[i]) - r) / (relative ? std::abs(r) : 1.0));
    }
    return largest;
}

constexpr int Many = 1 << 20;

} // namespace

TEST(LanesMath, Exp2) {
    const auto f = [](auto x) { return exp2(x); };
    EXPECT_LT(worst(spread(-126, 127, Many), f, [](double x) { return std::exp2(x); }, true), 1e-7);
    EXPECT_LT(worst(spread(-1, 1, Many), f, [](double x) { return std::exp2(x); }, true), 1e-7);
    const auto ends =
        evaluate<1>({0.0f, 1.0f, -126.0f, -127.0f, -1e30f, -std::numeric_limits<float>::infinity()}, f);
    EXPECT_EQ(ends, (std::vector<float>{1.0f, 2.0f, 0x1p-126f, 0, 0, 0}));
}

TEST(LanesMath, Log2) {
    const auto f = [](auto x) { return log2(x); };
    EXPECT_LT(worst(spread(0.5f, 2, Many), f, [](double x) { return std::log2(x); }, false), 2e-7);
    EXPECT_LT(worst(spread(1e-30f, 1e-3f, Many), f, [](double x) { return std::log2(x); }, true), 4e-7);
    EXPECT_LT(worst(spread(3, 1e30f, Many), f, [](double x) { return std::log2(x); }, true), 4e-7);
    EXPECT_EQ(evaluate<1>({1.0f, 2.0f, 0.25f, 0.0f, -1.0f}, f), (std::vector<float>{0, 1, -2, -126, -126}));
}

TEST(LanesMath, Exp) {
    // The argument is multiplied by log2(e) in single precision: the error grows with |x|.
    const auto f = [](auto x) { return exp(x); };
    EXPECT_LT(worst(spread(-10, 0, Many), f, [](double x) { return std::exp(x); }, true), 1.5e-6);
    EXPECT_LT(worst(spread(-1, 1, Many), f, [](double x) { return std::exp(x); }, true), 4e-7);
}

TEST(LanesMath, SineAndCosine) {
    const auto x = spread(0, 1, Many);
    const auto sine = [](auto x) {
        auto s = x, c = x;
        sincos_2pi(x, s, c);
        return s;
    };
    const auto cosine = [](auto x) {
        auto s = x, c = x;
        sincos_2pi(x, s, c);
        return c;
    };
    constexpr double TwoPi = 6.283185307179586;
    EXPECT_LT(worst(x, sine, [](double x) { return std::sin(TwoPi * x); }, false), 3e-7);
    EXPECT_LT(worst(x, cosine, [](double x) { return std::cos(TwoPi * x); }, false), 3e-7);
}

TEST(LanesMath, Turn) {
    constexpr double TwoPi = 6.283185307179586;
    std::mt19937 g(2);
    std::normal_distribution<float> normal;
    std::vector<float> y, x;
    for (int i = 0; i < Many; i++) {
        const float scale = std::exp2(float(int(g() % 60)) - 30);
        y.push_back(normal(g) * scale), x.push_back(normal(g) * scale);
    }
    for (float a : {0.0f, -0.0f, 1.0f, -1.0f})
        for (float b : {0.0f, -0.0f, 1.0f, -1.0f})
            y.push_back(a), x.push_back(b);
    std::vector<float> out[3];
    const auto all = [&](auto width, std::vector<float>& out) {
        constexpr int W = decltype(width)::value;
        out.resize(x.size());
        for (size_t i = 0; i + W <= x.size(); i += W)
            turn_of(Float<W>::load(&y[i]), Float<W>::load(&x[i])).store(&out[i]);
    };
    all(std::integral_constant<int, 1>(), out[0]);
    all(std::integral_constant<int, 8>(), out[1]);
    all(std::integral_constant<int, 16>(), out[2]);
    EXPECT_EQ(0, std::memcmp(out[0].data(), out[1].data(), x.size() * 4));
    EXPECT_EQ(0, std::memcmp(out[0].data(), out[2].data(), x.size() * 4));
    double largest = 0;
    for (size_t i = 0; i < x.size(); i++) {
        ASSERT_GE(out[0][i], 0.0f);
        ASSERT_LT(out[0][i], 1.0f);
        const double r = std::atan2(double(y[i]), double(x[i])) / TwoPi;
        const double d = std::abs(double(out[0][i]) - (r < 0 ? r + 1 : r));
        if (x[i] != 0 || y[i] != 0)
            largest = std::max(largest, std::min(d, 1 - d)); // 0 and 1 are the same azimuth
    }
    EXPECT_LT(largest, 1e-6);
}

TEST(LanesMath, ArcCosine) {
    const auto f = [](auto x) { return acos_over_pi(x); };
    const auto exact = [](double x) { return std::acos(x) / 3.141592653589793; };
    EXPECT_LT(worst(spread(-1, 1, Many), f, exact, false), 1e-6);
    // The ends, where acos is steep: 1 - x counts in single precision.
    EXPECT_LT(worst(spread(0.9999f, 1, Many), f, exact, false), 1e-6);
    EXPECT_EQ(evaluate<1>({1.0f, -1.0f, 2.0f, -2.0f}, f), (std::vector<float>{0, 1, 0, 1}));
}

TEST(LanesMath, CoordinateFramesAreOrthonormal) {
    std::mt19937 g(3);
    std::normal_distribution<float> normal;
    float worst = 0;
    for (int i = 0; i < 20000; i++) {
        const Vec3f d = i < 2 ? Vec3f(0, 0, i ? 1 : -1) : normalize(Vec3f(normal(g), normal(g), normal(g)));
        const auto n = Vec3<Float<1>>(Float<1>(d.x), Float<1>(d.y), Float<1>(d.z));
        Vec3<Float<1>> t, b;
        coordinate_frame(n, t, b);
        const auto c = cross(t, b);
        for (float e : {dot(t, n)[0], dot(b, n)[0], dot(t, b)[0], length(t)[0] - 1, length(b)[0] - 1,
                        c.x[0] - d.x, c.y[0] - d.y, c.z[0] - d.z})
            worst = std::max(worst, std::abs(e));
    }
    EXPECT_LT(worst, 1e-6f);
}

} // namespace kanuka
