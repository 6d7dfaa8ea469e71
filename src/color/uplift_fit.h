// The optimiser behind the uplift table: finds the smooth reflectance that has a wanted colour. Used at build
// time only.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "color/color.h"

namespace kanuka::color {

// sum over 1 nm steps of response[c][i] * reflectance[i] = component c of linear RGB under its white.
using Response = std::array<std::vector<double>, 3>;

// Knots of the largest component v are equidistant in t(v) = v^(1/4) - sqrt(1 - v), dense at both ends, where
// spectra change fastest; from UpliftDarkest, below which q is held constant, to 1.
inline constexpr double UpliftDarkest = 1e-5;
inline double uplift_warp(double v) {
    return std::sqrt(std::sqrt(v)) - std::sqrt(1 - v);
}
inline double uplift_scale(int z, int resolution) {
    const double first = uplift_warp(UpliftDarkest), wanted = first + (1 - first) * z / (resolution - 1);
    double low = UpliftDarkest, high = 1;
    for (int i = 0; i < 60; i++) {
        const double middle = 0.5 * (low + high);
        (uplift_warp(middle) < wanted ? low : high) = middle;
    }
    return z == 0 ? UpliftDarkest : high;
}

// Makes the knots of UpliftTable::coefficients for `resolution`; the planes of z are solved in parallel.
// `residual` is the largest difference between wanted and found colour, relative to the largest component.
// The corners of a `wide` space lie beyond what a smooth reflectance can be: such a knot takes the colour
// between it and the grey of its mean that just can.
std::vector<float> fit_uplift_table(const Response& response, int resolution, bool wide, double& residual);

} // namespace kanuka::color
