#include "color/color.h"

#include <cmath>

#include "color/daylight.h"
#include "color/spaces.h"

namespace kanuka::color {

namespace {
#include "tables.inc"
} // namespace

const Table& cie_x() {
    return X;
}
const Table& cie_y() {
    return Y;
}
const Table& cie_z() {
    return Z;
}
float cie_y_integral() {
    return YIntegral;
}
const Table& cie_x10() {
    return X10;
}
const Table& cie_y10() {
    return Y10;
}
const Table& cie_z10() {
    return Z10;
}
const Table& illuminant_d65() {
    return D65;
}
const Table& illuminant_d60() {
    return D60;
}
const Table& white_illuminant(Space space) {
    return space == Space::AcesCg || space == Space::Aces2065 ? D60 : D65;
}

constinit const std::array<std::array<float, 3>, 3> rgb_from_xyz = RgbFromXyz, xyz_from_rgb = XyzFromRgb;

Table blackbody(float kelvin) {
    // Planck's law, c2 = h c / k of CODATA 2018 in nm K. Only the shape counts, so it is taken relative to
    // its value in the middle of the range, in logarithms: no temperature overflows.
    constexpr double c2 = 1.438776877e7;
    const double t = kelvin >= 100 ? std::min(double(kelvin), 1e9) : 100.0; // NaN too
    const auto log_planck = [&](double lambda) {
        const double a = c2 / (lambda * t);
        return -5 * std::log(lambda) - (a > 30 ? a : std::log(std::expm1(a)));
    };
    const double middle = log_planck(595);
    std::array<double, LambdaCount> power;
    double y = 0;
    for (int i = 0; i < LambdaCount; i++) {
        power[i] = std::exp(log_planck(LambdaMin + i) - middle);
        y += power[i] * Y[i];
    }
    Table table;
    for (int i = 0; i < LambdaCount; i++)
        table[i] = float(power[i] * YIntegral / y);
    return table;
}

Table daylight(float kelvin) {
    const DaylightMix mix = daylight_mix(kelvin >= float(DaylightMin) ? kelvin : float(DaylightMin));
    std::array<double, LambdaCount> power;
    double y = 0;
    for (int i = 0; i < LambdaCount; i++) {
        power[i] = Daylight0[i] + mix.m1 * Daylight1[i] + mix.m2 * Daylight2[i]; // above 0 at all kelvins
        y += power[i] * Y[i];
    }
    Table table;
    for (int i = 0; i < LambdaCount; i++)
        table[i] = float(power[i] * YIntegral / y);
    return table;
}

Rgb xyz_to_rgb(const Vec3f& xyz) {
    Rgb rgb;
    for (int i = 0; i < 3; i++)
        rgb[i] = fma(rgb_from_xyz[i][0], xyz.x, fma(rgb_from_xyz[i][1], xyz.y, rgb_from_xyz[i][2] * xyz.z));
    return rgb;
}

float luminance(const Rgb& rgb) {
    return fma(xyz_from_rgb[1][0], rgb.x, fma(xyz_from_rgb[1][1], rgb.y, xyz_from_rgb[1][2] * rgb.z));
}

// IEC 61966-2-1:1999, odd about 0 so that negative values survive a round trip.
float srgb_encode(float linear) {
    const float a = std::abs(linear);
    const float e = a <= 0.0031308f ? 12.92f * a : 1.055f * std::pow(a, 1 / 2.4f) - 0.055f;
    return std::copysign(e, linear);
}

float srgb_decode(float encoded) {
    const float a = std::abs(encoded);
    const float l = a <= 0.04045f ? a / 12.92f : std::pow((a + 0.055f) / 1.055f, 2.4f);
    return std::copysign(l, encoded);
}

} // namespace kanuka::color
