// Colour as spectra: wavelengths, observers, illuminants, uplift of RGB, colour spaces. Tables are data, sources named.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "base/vec.h"

namespace kanuka::color {

inline constexpr float LambdaMin = 360, LambdaMax = 830; // nm
inline constexpr int LambdaCount = 471;                  // samples of a table at 1 nm

using Table = std::array<float, LambdaCount>; // value at 360, 361, …, 830 nm

// CIE 1931 2-degree observer, 1 nm. Source in color/data.
const Table& cie_x();
const Table& cie_y();
const Table& cie_z();
float cie_y_integral(); // sum of cie_y over 1 nm steps, about 106.857

// Relative spectral power, scaled so that it has luminance Y = 1 when integrated as XYZ = integral(S cmf) / cie_y_integral.
const Table& illuminant_d65();
Table blackbody(float kelvin);

// Uplift (Jakob and Hanika 2019): S(lambda) = 1/2 + x / (2 sqrt(1 + x^2)), x = c0 l^2 + c1 l + c2, with
// l = (lambda - 360) / 470, for linear Rec.709 in [0, 1]^3 under D65. The table is made at build time by an optimiser of
// our own and trilinearly interpolated, laid out for the transport kernels:
//   three tables, by which component is largest; each [z][y][x][3]: z = index of the largest component in `scale`,
//   x, y = the other two divided by it: for the largest component m, x is component (m + 1) % 3, y is (m + 2) % 3.
struct UpliftTable {
    int resolution = 0;
    std::vector<float> scale;        // `resolution` values of the largest component, rising from 0 to 1
    std::vector<float> coefficients; // 3 * resolution^3 * 3
};
const UpliftTable& uplift_table();
std::array<float, 3> uplift(const Rgb& rgb); // clamps to [0, 1]; exact grey for r = g = b
float uplift_eval(const std::array<float, 3>& c, float lambda);

// XYZ (Y = 1 is D65 white) to and from linear Rec.709, D65.
extern const std::array<std::array<float, 3>, 3> rgb_from_xyz, xyz_from_rgb;
Rgb xyz_to_rgb(const Vec3f& xyz);
float luminance(const Rgb& rgb);
float srgb_encode(float linear), srgb_decode(float encoded);

} // namespace kanuka::color
