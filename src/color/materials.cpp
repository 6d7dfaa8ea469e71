#include "color/materials.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <sstream>

#include "color/spectrum.h"

namespace kanuka::color {

namespace {

#include "data_text.inc"

// Rows "name,number,number,…" of a text.
template <class F>
void for_each_row(const char* text, const F& row) {
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) {
        if (line.empty() || line[0] == '#')
            continue;
        std::istringstream fields(line);
        std::string name, field;
        std::getline(fields, name, ',');
        std::vector<double> numbers;
        while (std::getline(fields, field, ','))
            numbers.push_back(std::stod(field));
        row(name, numbers);
    }
}

bool same(std::string_view a, std::string_view b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](char x, char y) { return std::tolower(x) == std::tolower(y); });
}

struct Alias {
    std::string_view name, key;
};
constexpr Alias MetalAliases[] = {
    {"silver", "Ag"}, {"aluminium", "Al"}, {"aluminum", "Al"}, {"gold", "Au"},     {"chromium", "Cr"},
    {"copper", "Cu"}, {"iron", "Fe"},      {"nickel", "Ni"},   {"platinum", "Pt"}, {"titanium", "Ti"}};
constexpr Alias GlassAliases[] = {{"N-BK7", "BK7"},           {"fused silica", "silica"},
                                  {"quartz glass", "silica"}, {"CaF2", "fluorite"},
                                  {"Al2O3", "sapphire"},      {"H2O", "water"}};

std::string_view key_of(std::string_view name, std::span<const Alias> aliases) {
    for (const Alias& a : aliases)
        if (same(a.name, name))
            return a.key;
    return name;
}

MetalIndex metal_of(const Spectrum& eta, const Spectrum& k) {
    return {eta.table(Spectrum::Ends::Hold), k.table(Spectrum::Ends::Hold)};
}

} // namespace

ComplexIndex MetalIndex::at(double lambda) const {
    const double x = std::clamp(lambda - LambdaMin, 0.0, LambdaCount - 1.0);
    const int i = std::min(int(x), LambdaCount - 2);
    const double t = x - i;
    return {(1 - t) * eta[i] + t * eta[i + 1], (1 - t) * k[i] + t * k[i + 1]};
}

std::optional<MetalIndex> find_metal(std::string_view name) {
    const std::string_view key = key_of(name, MetalAliases);
    Spectrum eta, k;
    for_each_row(MetalsCsv, [&](const std::string& metal, const std::vector<double>& row) {
        if (!same(metal, key))
            return;
        eta.nm.push_back(row[0]), eta.value.push_back(row[1]);
        k.nm.push_back(row[0]), k.value.push_back(row[2]);
    });
    if (eta.nm.empty())
        return std::nullopt;
    return metal_of(eta, k);
}

std::vector<std::string> metal_names() {
    std::vector<std::string> names;
    for_each_row(MetalsCsv, [&](const std::string& metal, const std::vector<double>&) {
        if (names.empty() || names.back() != metal)
            names.push_back(metal);
    });
    return names;
}

MetalIndex read_metal(const std::string& path) {
    const SpectrumColumns c = read_columns(path);
    if (c.columns.size() != 2)
        throw Error({path}, "a complex index has three columns: wavelength, n and k");
    return metal_of(c.column(0), c.column(1));
}

double GlassIndex::eta(double lambda) const {
    const double l2 = lambda * lambda * 1e-6;
    double n2 = 1;
    for (size_t i = 0; i < B.size(); i++)
        n2 += B[i] * l2 / (l2 - C[i]);
    return n2 > 1 && std::isfinite(n2) ? std::sqrt(n2) : 1;
}

Table GlassIndex::table() const {
    Table t;
    for (int i = 0; i < LambdaCount; i++)
        t[i] = float(eta(LambdaMin + i));
    return t;
}

std::optional<GlassIndex> find_glass(std::string_view name) {
    const std::string_view key = key_of(name, GlassAliases);
    std::optional<GlassIndex> found;
    for_each_row(GlassesCsv, [&](const std::string& glass, const std::vector<double>& row) {
        if (!same(glass, key))
            return;
        found.emplace();
        for (size_t i = 0; i + 1 < row.size(); i += 2) {
            found->B.push_back(row[i]);
            found->C.push_back(row[i + 1]);
        }
    });
    return found;
}

std::vector<std::string> glass_names() {
    std::vector<std::string> names;
    for_each_row(GlassesCsv,
                 [&](const std::string& glass, const std::vector<double>&) { names.push_back(glass); });
    return names;
}

double abbe_eta(double n_d, double abbe, double lambda) {
    if (!(abbe > 0))
        return n_d;
    const double b = (n_d - 1) / abbe / (1 / (LineF * LineF) - 1 / (LineC * LineC));
    return std::max(n_d + b * (1 / (lambda * lambda) - 1 / (LineD * LineD)), 1.0);
}

double abbe_number(const GlassIndex& glass) {
    return (glass.eta(LineD) - 1) / (glass.eta(LineF) - glass.eta(LineC));
}

double normal_reflectance(const ComplexIndex& index, double outside) {
    const double a = index.eta - outside, b = index.eta + outside, k2 = index.k * index.k;
    return (a * a + k2) / (b * b + k2);
}

} // namespace kanuka::color
