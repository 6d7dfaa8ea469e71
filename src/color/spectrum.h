// A measured spectrum: values at any wavelengths, linear between them. From a file, or from text in place.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "color/color.h"

namespace kanuka::color {

struct Spectrum {
    std::vector<double> nm, value; // rising wavelengths, at least one

    // Beyond the ends: 0 (light, sensors), or the nearest end's value (reflectances, indices).
    enum class Ends { Zero, Hold };
    double at(double lambda, Ends ends = Ends::Zero) const;
    Table table(Ends ends = Ends::Zero) const; // at 1 nm; negative values are 0
};

// Columns of numbers: wavelength, then one value or more. Lines of text, CSV, tabs or semicolons; # ; // and
// words begin a comment or a heading. Wavelengths all below 20 are micrometres. IES TM-27 (.spdx) too: its
// SpectralData elements. Rows may stand in any order; a wavelength that comes twice, or a number that is not
// finite, is an error. Throws Error with file, line and what would do.
struct SpectrumColumns {
    std::vector<double> nm;
    std::vector<std::vector<double>> columns; // each as long as nm
    Spectrum column(size_t i) const { return {nm, columns[i]}; }
};
SpectrumColumns parse_columns(std::string_view text, const std::string& name);
SpectrumColumns read_columns(const std::string& path);
Spectrum read_spectrum(const std::string& path); // its first column

// Sums over 1 nm steps.
double integrate(const Table& s, const Table& curve);

} // namespace kanuka::color
