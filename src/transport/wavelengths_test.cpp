#include "transport/wavelengths.h"

#include <gtest/gtest.h>

#include <cmath>

#include "color/illuminants.h"

namespace kanuka::transport {
namespace {

using color::make_sensor;
using color::Observer;
using color::Space;

// The table of densities in proportion to the curves' sum: what make_wavelengths() starts with.
WavelengthTable plain(const color::Sensor& sensor) {
    std::vector<double> cumulative{0};
    for (size_t i = 1; i < color::LambdaCount; i++) {
        double sum = 0.02;
        for (size_t c = 0; c < 3; c++)
            sum += double(sensor.importance[c][i]);
        cumulative.push_back(cumulative.back() + sum);
    }
    WavelengthTable table{};
    for (size_t k = 0, i = 0; k <= WavelengthTable::Segments; k++) {
        const double target = cumulative.back() * double(k) / WavelengthTable::Segments;
        while (i + 2 < cumulative.size() && cumulative[i + 1] < target)
            i++;
        table.quantile.push_back(
            float((double(i) + (target - cumulative[i]) / (cumulative[i + 1] - cumulative[i])) /
                  (color::LambdaCount - 1)));
    }
    return table;
}

TEST(Wavelengths, QuantilesRiseFromEndToEnd) {
    const color::Table& white = color::illuminant_d65();
    const auto table = make_wavelengths(make_sensor(Observer::Cie1931, white, Space::Rec709), white);
    EXPECT_EQ(table.quantile.front(), 0);
    EXPECT_EQ(table.quantile.back(), 1);
    // None so rare that it would be a firefly: a density of a fiftieth of the mean, or little less.
    for (size_t k = 1; k < table.quantile.size(); k++) {
        EXPECT_GT(table.quantile[k], table.quantile[k - 1]);
        EXPECT_LT((table.quantile[k] - table.quantile[k - 1]) * WavelengthTable::Segments, 1 / 0.012f);
    }
}

TEST(Wavelengths, FourSeeWhiteNearlyAlike) {
    for (const Observer observer : {Observer::Cie1931, Observer::Cie1964})
        for (const Space space : {Space::Rec709, Space::AcesCg, Space::Rec2020}) {
            const color::Table& white =
                space == Space::AcesCg ? color::illuminant_d60() : color::illuminant_d65();
            const color::Sensor sensor = make_sensor(observer, white, space);
            const auto noise = color_noise(make_wavelengths(sensor, white), sensor, white);
            const auto before = color_noise(plain(sensor), sensor, white);
            for (size_t c = 0; c < 3; c++)
                EXPECT_LT(noise[c], 0.02) << int(observer) << ' ' << int(space) << ' ' << c;
            EXPECT_LT(noise[0] + noise[1] + noise[2], 0.4 * (before[0] + before[1] + before[2]));
        }
}

TEST(Wavelengths, CamerasToo) {
    color::SpectrumColumns bells;
    bells.columns.resize(3);
    for (int l = 380; l <= 780; l += 5) {
        bells.nm.push_back(l);
        const auto bell = [&](double at, double width) {
            return std::exp(-(l - at) * (l - at) / (2 * width * width));
        };
        bells.columns[0].push_back(bell(600, 35));
        bells.columns[1].push_back(bell(540, 40));
        bells.columns[2].push_back(bell(460, 30));
    }
    const color::Table& white = color::illuminant_d65();
    const color::Sensor sensor = color::make_camera(bells, "bells", white, Space::Rec709);
    const auto noise = color_noise(make_wavelengths(sensor, white), sensor, white),
               before = color_noise(plain(sensor), sensor, white);
    EXPECT_LT(noise[0] + noise[1] + noise[2], 0.5 * (before[0] + before[1] + before[2]));
}

// Tables are kept for the next render: of each sensor its own, however many there have been.
TEST(Wavelengths, EachSensorItsOwn) {
    const color::Table& white = color::illuminant_d65();
    const auto sensor = [&](int k) {
        color::Sensor s = make_sensor(Observer::Cie1931, white, Space::Rec709);
        for (size_t i = 0; i < color::LambdaCount; i++)
            s.importance[1][i] *= float(k);
        return s;
    };
    std::vector<std::vector<float>> first;
    for (int k = 0; k < 12; k++)
        first.push_back(make_wavelengths(sensor(k), white).quantile);
    for (int k = 11; k >= 0; k--) {
        EXPECT_EQ(make_wavelengths(sensor(k), white).quantile, first[size_t(k)]) << k;
        EXPECT_EQ(make_wavelengths(sensor(k), white).quantile, first[size_t(k)]) << k;
    }
    EXPECT_NE(first[0], first[11]);
    EXPECT_NE(make_wavelengths(sensor(1), color::illuminant_d60()).quantile, first[1]);
}

} // namespace
} // namespace kanuka::transport
