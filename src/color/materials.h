// What matter does to light: complex refractive indices of metals, indices of glasses. Data in
// color/data, sources there. Lobes take eta and k from here.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "color/color.h"

namespace kanuka::color {

struct ComplexIndex { // n + i k
    double eta, k;
};

struct MetalIndex {
    Table eta, k;                         // at 1 nm
    ComplexIndex at(double lambda) const; // nm; linear, held at the ends
};
std::optional<MetalIndex> find_metal(std::string_view name); // "Au", "gold", …
std::vector<std::string> metal_names();                      // "Ag", "Al", …
// The same from a file of three columns: wavelength, n, k. Throws Error.
MetalIndex read_metal(const std::string& path);

// n^2 = 1 + sum B_i l^2 / (l^2 - C_i), l in micrometres (W. Sellmeier, Ann. Phys. 143, 272, 1871).
struct GlassIndex {
    std::vector<double> B, C;
    double eta(double lambda) const; // nm; at least 1, whatever the coefficients say
    Table table() const;
};
std::optional<GlassIndex> find_glass(std::string_view name); // "BK7", "diamond", …
std::vector<std::string> glass_names();

// A glass that is known by its index at the d line (587.56 nm) and its Abbe number V = (n_d - 1) / (n_F -
// n_C) alone: Cauchy's A + B / l^2 through both. V <= 0: no dispersion.
double abbe_eta(double n_d, double abbe, double lambda);
double abbe_number(const GlassIndex& glass);

// Fresnel reflectance at normal incidence, against an index outside.
double normal_reflectance(const ComplexIndex& index, double outside = 1);

inline constexpr double LineF = 486.1327, LineD = 587.5618, LineC = 656.2725; // nm, in air

} // namespace kanuka::color
