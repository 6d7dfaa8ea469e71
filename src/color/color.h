// Colour as spectra: wavelengths, observers, illuminants, uplift of RGB, colour spaces. Tables are data,
// sources named.
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
// CIE 1964 10-degree observer, 1 nm.
const Table& cie_x10();
const Table& cie_y10();
const Table& cie_z10();

// Relative spectral power, scaled to luminance Y = 1, where XYZ = integral(S cmf) / cie_y_integral.
const Table& illuminant_d65();
const Table& illuminant_d60(); // daylight of nominally 6000 K, which stands for the white of ACES
Table blackbody(float kelvin); // clamped to at least 100 K
Table daylight(float kelvin);  // CIE daylight; clamped to 4000 to 25000 K
// Others are in illuminants.h.

// Uplift (Jakob and Hanika 2019): S(lambda) = 1/2 + x / (2 sqrt(1 + x^2)), x = c0 l^2 + c1 l + c2, with
// l = (lambda - 360) / 470, for linear Rec.709 in [0, 1]^3 under D65. The table is made at build time by an
// optimiser of our own. It holds q = c sqrt(mean (1 - mean)), mean = (r + g + b) / 3, less the q of grey,
// which is (0, 0, mean - 1/2): q stays finite and smooth where c runs to infinity. It serves colours with
// mean <= 1/2; a brighter one is 1 minus its complement. The lookup, for n = resolution (uplift() is the
// reference, and transport's lanes take the same steps):
//   1. Clamp r, g, b to [0, 1] (NaN is 0). Where mean > 1/2, take 1 - r, 1 - g, 1 - b; negate q at the end.
//   2. m = index of the largest component (the first of equals), v its value; a, b = components (m + 1) % 3
//      and (m + 2) % 3 divided by v (by 1 where v = 0). Divided, not times 1 / v: x / x must be 1.
//   3. X = (n - 1) sqrt(a), Y = (n - 1) sqrt(b) and, without a search,
//      Z = z_factor (sqrt(sqrt(v)) - sqrt(1 - v)) + z_offset, at least 0. Cells are x = min(int(X), n - 2),
//      weights w1 = min(X - x, 1), w0 = 1 - w1; a mix is w0 q0 + w1 q1, so that w1 = 1 is exact.
//   4. q = (0, 0, mean - 1/2) + trilinear mix of coefficients[(((m n + z) n + y) n + x) 3 + 0, 1, 2].
//   5. c = q / sqrt(max(mean (1 - mean), 1e-30)), mean of the clamped (and perhaps complemented) components.
// Greys have X = Y = n - 1, where the table is 0: their spectrum is constant, of the value asked for, and
// black and white come out as 0 and 1. Greys are not a case apart: colours near them have spectra near
// theirs.
struct UpliftTable {
    int resolution = 0;
    float z_factor = 0, z_offset = 0;
    std::vector<float> scale;        // value of the largest component at each z, rising to 1
    std::vector<float> coefficients; // 3 * resolution^3 * 3
};
enum class Space; // spaces.h; those with colours of scenes have a table of their own, for their own white
const UpliftTable &uplift_table(), &uplift_table(Space space);
std::array<float, 3> uplift(const Rgb& rgb); // c0, c1, c2; clamps to [0, 1]
std::array<float, 3> uplift(const Rgb& rgb, const UpliftTable& table);
// S(lambda), no cancellation in the dark: s = sqrt(1 + x^2), h = 1/2 / (s (s + |x|)), S = x < 0 ? h : 1 - h.
float uplift_eval(const std::array<float, 3>& c, float lambda);

// XYZ (Y = 1 is D65 white) to and from linear Rec.709. White is illuminant_d65()'s: it maps to (1, 1, 1).
extern const std::array<std::array<float, 3>, 3> rgb_from_xyz, xyz_from_rgb;
Rgb xyz_to_rgb(const Vec3f& xyz);
float luminance(const Rgb& rgb);
float srgb_encode(float linear), srgb_decode(float encoded);

} // namespace kanuka::color
