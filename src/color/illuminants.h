// Illuminants by name or from a file, and what a spectrum of light is worth in lumen.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "color/matrix3.h"
#include "color/spectrum.h"

namespace kanuka::color {

// A named light, scaled to Y = 1; none = there is no such name. Names, capitals or not:
//   A, E                          CIE illuminant A (2856 K), equal energy
//   D50 D55 D65 D75, D6000, …     CIE daylight of a nominal temperature (x 1.4388 / 1.4380)
//   F1 … F12 (FL1 …)              CIE fluorescent lamps
//   LED-B1 … LED-B5, LED-BH1, LED-RGB1, LED-V1, LED-V2   CIE LED lamps
//   blackbody:T  daylight:T       T in kelvin
// Throws Error where a temperature is not a number, or beyond what daylight is defined for.
std::optional<Table> find_illuminant(std::string_view name);
std::vector<std::string> illuminant_names(); // those without a parameter

// What a name in a scene means: a named light, "nm: 400 0.1, 500 0.7, …" (numbers in place), or a file,
// looked for as it is named, then in the folders. Lights are scaled to Y = 1; others are as they are given.
// Throws Error that lists what there is.
struct NamedSpectrum {
    Table table;
    bool illuminant;  // named; else given by numbers
    std::string file; // where from; empty = no file
};
NamedSpectrum resolve_spectrum(const std::string& text, std::span<const std::string> folders);
// The same as light: Y = 1. Throws Error where the spectrum has none.
Table resolve_light(const std::string& text, std::span<const std::string> folders);

Table normalized(const Table& power); // to Y = 1; all zero stays
Vector3 observe(const Table& power);  // XYZ, 1931 observer, over its integral of y
struct Chromaticity {
    double x, y;
};
Chromaticity chromaticity(const Table& power);

} // namespace kanuka::color
