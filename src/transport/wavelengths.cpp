#include "transport/wavelengths.h"

#include <algorithm>
#include <deque>
#include <mutex>
#include <utility>

#include "bsdf/spectral.h"

namespace kanuka::transport {

namespace {

constexpr int Count = color::LambdaCount; // 1 nm apart
constexpr int Knots = 24;
constexpr int Combs = 64; // values of u that W is looked at for, within a quarter
constexpr double Floor = 0.02;

// The curves of the output under white light, each of mean 1. A channel that does not see white counts not.
struct Output {
    std::array<std::array<double, Count>, 3> curve;
    std::array<bool, 3> sees;

    Output(const color::Sensor& sensor, const color::Table& white) {
        for (size_t c = 0; c < 3; c++) {
            double mean = 0;
            for (size_t i = 0; i < Count; i++) {
                curve[c][i] = 0;
                for (size_t k = 0; k < 3; k++)
                    curve[c][i] += double(sensor.output_from_sensor[c][k]) * double(sensor.curves[k][i]) *
                                   double(white[i]);
                mean += curve[c][i] / Count;
            }
            sees[c] = mean > 0;
            for (double& x : curve[c])
                x = sees[c] ? x / mean : 0;
        }
    }
};

// Densities at 1 nm, linear between, and their sums.
struct Density {
    std::array<double, Count> at;
    std::array<double, Count> cumulative;

    void sum() {
        cumulative[0] = 0;
        for (size_t i = 1; i < Count; i++)
            cumulative[i] = cumulative[i - 1] + 0.5 * (at[i - 1] + at[i]);
    }
    // Places where the sums reach (k + offset) / n of the whole, k = 0 to n - 1, in nm from the first.
    template <class F>
    void quantiles(int n, double offset, F&& found) const {
        size_t i = 0;
        for (int k = 0; k < n; k++) {
            const double target = cumulative.back() * (k + offset) / n;
            while (i + 2 < Count && cumulative[i + 1] < target)
                i++;
            found(k, i, (target - cumulative[i]) / (cumulative[i + 1] - cumulative[i]));
        }
    }
};

// Mean over u of W_c^2; of a channel that sees nothing, 0.
std::array<double, 3> second_moments(const Output& output, const Density& density) {
    constexpr int Wavelengths = bsdf::Wavelengths;
    std::array<std::array<double, 3>, Combs> w{};
    density.quantiles(Combs * Wavelengths, 0.5, [&](int k, size_t i, double f) {
        const double p = (density.at[i] + f * (density.at[i + 1] - density.at[i])) * (Count - 1) /
                         density.cumulative.back() * Wavelengths;
        for (size_t c = 0; c < 3; c++)
            w[size_t(k % Combs)][c] +=
                (output.curve[c][i] + f * (output.curve[c][i + 1] - output.curve[c][i])) / p;
    });
    std::array<double, 3> moments{};
    for (const auto& values : w)
        for (size_t c = 0; c < 3; c++)
            moments[c] += values[c] * values[c] / Combs;
    return moments;
}

// Moves knots, one at a time, by factors that shrink.
class Search {
  public:
    Search(const Output& output, const color::Sensor& sensor) : m_output(output) {
        std::array<double, Count> sum;
        double mean = 0;
        for (size_t i = 0; i < Count; i++) {
            sum[i] = double(sensor.importance[0][i] + sensor.importance[1][i] + sensor.importance[2][i]);
            mean += sum[i] / Count;
        }
        for (size_t k = 0; k < Knots; k++)
            m_knots[k] = std::max(sum[k * (Count - 1) / (Knots - 1)] / mean, Floor);
    }

    Density best() {
        double least = cost();
        for (double factor = 1.25; factor > 1.005;) {
            bool better = false;
            for (double& knot : m_knots)
                for (const double moved : {knot * factor, std::max(knot / factor, Floor)}) {
                    const double before = std::exchange(knot, moved), now = cost();
                    if (now < least - 1e-7) {
                        least = now, better = true;
                        break;
                    }
                    knot = before;
                }
            if (!better)
                factor = 1 + (factor - 1) / 2;
        }
        spread();
        return m_density;
    }

  private:
    void spread() {
        for (size_t i = 0; i < Count; i++) {
            const double x = double(i) * (Knots - 1) / (Count - 1);
            const size_t k = std::min(size_t(x), size_t(Knots - 2));
            m_density.at[i] = m_knots[k] + (x - double(k)) * (m_knots[k + 1] - m_knots[k]);
        }
        m_density.sum();
    }
    double cost() {
        spread();
        const auto m = second_moments(m_output, m_density);
        return (m[0] + m[1] + m[2]) / 3;
    }

    const Output& m_output;
    std::array<double, Knots> m_knots;
    Density m_density;
};

} // namespace

static WavelengthTable find_wavelengths(const color::Sensor& sensor, const color::Table& white) {
    const Output output(sensor, white);
    const Density density = Search(output, sensor).best();
    WavelengthTable table;
    table.quantile.resize(WavelengthTable::Segments + 1);
    density.quantiles(WavelengthTable::Segments, 0, [&](int k, size_t i, double f) {
        table.quantile[size_t(k)] = float((double(i) + f) / (Count - 1));
    });
    table.quantile.back() = 1;
    for (size_t i = 0; i < 480; i++) {
        const size_t j = std::min(i, size_t(Count - 1));
        for (size_t c = 0; c < 3; c++)
            table.sensor[i][c] = sensor.curves[c][j];
        table.sensor[i][3] = table.lookup_white[i] = white[j];
    }
    return table;
}

WavelengthTable make_wavelengths(const color::Sensor& sensor, const color::Table& white) {
    // The search takes as long as all else that a small picture takes, and most renders of a process see
    // alike.
    struct Known {
        color::Sensor sensor;
        color::Table white;
        WavelengthTable table;
    };
    constexpr size_t Most = 8;
    static std::mutex mutex;
    static std::deque<Known> known; // the last that were asked for
    const std::lock_guard lock(mutex);
    for (const Known& k : known)
        if (k.sensor.curves == sensor.curves && k.sensor.importance == sensor.importance &&
            k.sensor.output_from_sensor == sensor.output_from_sensor && k.white == white)
            return k.table;
    known.push_front({sensor, white, find_wavelengths(sensor, white)});
    known.resize(std::min(known.size(), Most));
    return known.front().table;
}

std::array<double, 3> color_noise(const WavelengthTable& table, const color::Sensor& sensor,
                                  const color::Table& white) {
    constexpr int Wavelengths = bsdf::Wavelengths, Each = 16, Steps = WavelengthTable::Segments * Each;
    const Output output(sensor, white);
    std::array<double, 3> sum{}, squares{};
    for (int comb = 0; comb < Steps / Wavelengths; comb++) {
        std::array<double, 3> w{};
        for (int k = 0; k < Wavelengths; k++) {
            const int step = comb + k * Steps / Wavelengths;
            const double a = double(table.quantile[size_t(step / Each)]),
                         b = double(table.quantile[size_t(step / Each + 1)]);
            const double x = (a + (step % Each + 0.5) / Each * (b - a)) * (Count - 1);
            const size_t i = std::min(size_t(x), size_t(Count - 2));
            for (size_t c = 0; c < 3; c++)
                w[c] +=
                    (output.curve[c][i] + (x - double(i)) * (output.curve[c][i + 1] - output.curve[c][i])) *
                    (b - a) * WavelengthTable::Segments / Wavelengths;
        }
        for (size_t c = 0; c < 3; c++)
            sum[c] += w[c], squares[c] += w[c] * w[c];
    }
    const double n = double(Steps) / Wavelengths;
    return {squares[0] / n - sum[0] * sum[0] / (n * n), squares[1] / n - sum[1] * sum[1] / (n * n),
            squares[2] / n - sum[2] * sum[2] / (n * n)};
}

} // namespace kanuka::transport
