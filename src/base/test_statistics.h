// Statistics for tests: p-values of chi-square and normal deviates, corrected for how many are looked at.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace kanuka::testing {

// Q(a, x), the upper regularised incomplete gamma function: series below a + 1, Lentz's continued fraction
// above (Abramowitz and Stegun 6.5.29 and 6.5.31).
inline double upper_gamma(double a, double x) {
    if (!(x > 0))
        return 1;
    const double scale = std::exp(-x + a * std::log(x) - std::lgamma(a));
    if (x < a + 1) {
        double term = 1 / a, sum = term;
        for (double n = a + 1; std::abs(term) > 1e-16 * std::abs(sum); n++)
            sum += term *= x / n;
        return std::clamp(1 - sum * scale, 0.0, 1.0);
    }
    constexpr double Tiny = 1e-300;
    double b = x + 1 - a, c = 1 / Tiny, d = 1 / b, h = d;
    for (int i = 1; i < 10000; i++) {
        const double an = -i * (i - a);
        b += 2;
        d = an * d + b;
        d = 1 / (std::abs(d) < Tiny ? Tiny : d);
        c = b + an / c;
        c = std::abs(c) < Tiny ? Tiny : c;
        h *= d * c;
        if (std::abs(d * c - 1) < 1e-15)
            break;
    }
    return std::clamp(scale * h, 0.0, 1.0);
}

inline double chi_square_p(double statistic, int degrees_of_freedom) {
    return upper_gamma(0.5 * degrees_of_freedom, 0.5 * statistic);
}

// Chance of a standard normal deviate at least as large as |z|.
inline double normal_p(double z) {
    return std::erfc(std::abs(z) * std::sqrt(0.5));
}

// The level for each of n tests so that all of them together err with probability `level`.
inline double sidak(double level, int n) {
    return -std::expm1(std::log1p(-level) / n);
}

struct ChiSquare {
    double p;
    int degrees_of_freedom;
    double impossible; // seen where nothing is expected
};

// Pearson's test of counts against expectations. Cells that expect little are pooled, smallest first. Both
// lists hold everything that can happen, so one degree of freedom goes, and `lost` further ones.
inline ChiSquare chi_square(const std::vector<double>& seen, const std::vector<double>& expected,
                            int lost = 0) {
    std::vector<size_t> order(seen.size());
    for (size_t i = 0; i < order.size(); i++)
        order[i] = i;
    std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return expected[a] < expected[b]; });
    double pooled_seen = 0, pooled_expected = 0, statistic = 0, impossible = 0;
    int cells = 0;
    const auto add = [&](double s, double e) {
        statistic += (s - e) * (s - e) / e;
        cells++;
    };
    for (size_t i : order) {
        if (expected[i] <= 1e-6)
            impossible += seen[i];
        if (expected[i] < 5 || (pooled_expected > 0 && pooled_expected < 5)) {
            pooled_seen += seen[i];
            pooled_expected += expected[i];
        } else
            add(seen[i], expected[i]);
    }
    if (pooled_expected > 1e-6)
        add(pooled_seen, pooled_expected);
    const int freedom = std::max(cells - 1 - lost, 1);
    return {chi_square_p(statistic, freedom), freedom, impossible};
}

// Mean and the error of it, from values added one by one (Welford 1962).
class RunningMean {
  public:
    void add(double x) {
        m_count++;
        const double d = x - m_mean;
        m_mean += d / double(m_count);
        m_sum += d * (x - m_mean);
    }
    double mean() const { return m_mean; }
    double variance() const { return m_count > 1 ? m_sum / double(m_count - 1) : 0; }
    double error() const { return m_count > 1 ? std::sqrt(variance() / double(m_count)) : 0; }
    uint64_t count() const { return m_count; }

  private:
    uint64_t m_count = 0;
    double m_mean = 0, m_sum = 0;
};

} // namespace kanuka::testing
