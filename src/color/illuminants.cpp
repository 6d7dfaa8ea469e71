#include "color/illuminants.h"

#include <charconv>
#include <cmath>
#include <filesystem>

#include "color/daylight.h"

namespace kanuka::color {

namespace {

#include "data_text.inc"

constexpr const char* LedNames[] = {"LED-B1",  "LED-B2",   "LED-B3", "LED-B4", "LED-B5",
                                    "LED-BH1", "LED-RGB1", "LED-V1", "LED-V2"};

std::string upper(std::string_view s) {
    std::string r(s);
    for (char& c : r)
        c = char(c >= 'a' && c <= 'z' ? c - 'a' + 'A' : c);
    return r;
}

std::optional<double> number(std::string_view s) {
    double v = 0;
    const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), v);
    if (s.empty() || error != std::errc() || end != s.data() + s.size() || !std::isfinite(v))
        return std::nullopt;
    return v;
}

// CIE 15:2018, eq. 4.1: its constant 1.435e7 is that of 1931.
Table illuminant_a() {
    Table t;
    for (int i = 0; i < LambdaCount; i++) {
        const double l = LambdaMin + i;
        t[i] = float(std::pow(560 / l, 5) * std::expm1(1.435e7 / (2848 * 560.0)) /
                     std::expm1(1.435e7 / (2848 * l)));
    }
    return normalized(t);
}

Table checked_daylight(double kelvin, std::string_view name) {
    if (!(kelvin >= DaylightMin && kelvin <= DaylightMax))
        throw Error("\"" + std::string(name) +
                    "\": CIE daylight is defined from 4000 to 25000 K; blackbody:T serves any temperature");
    return daylight(float(kelvin));
}

Table column_of(const char* text, const char* name, size_t column) {
    return normalized(parse_columns(text, name).column(column).table());
}

} // namespace

Table normalized(const Table& power) {
    const double y = integrate(power, cie_y());
    if (!(y > 0))
        return power;
    Table t;
    for (int i = 0; i < LambdaCount; i++)
        t[i] = float(power[i] * double(cie_y_integral()) / y);
    return t;
}

std::optional<Table> find_illuminant(std::string_view given) {
    const std::string name = upper(given);
    if (name == "A")
        return illuminant_a();
    if (name == "E") {
        Table t;
        t.fill(1);
        return t;
    }
    if (name == "D65")
        return illuminant_d65();
    if (name == "D60")
        return illuminant_d60();
    if (const size_t colon = name.find(':'); colon != name.npos) {
        const std::string kind = name.substr(0, colon);
        if (kind != "BLACKBODY" && kind != "DAYLIGHT")
            return std::nullopt;
        std::string rest = name.substr(colon + 1);
        if (!rest.empty() && rest.back() == 'K')
            rest.pop_back();
        const auto kelvin = number(rest);
        if (!kelvin || !(*kelvin >= 100))
            throw Error("\"" + std::string(given) +
                        "\": expected a temperature in kelvin, at least 100, as in blackbody:3200");
        return kind == "DAYLIGHT" ? checked_daylight(*kelvin, given) : blackbody(float(*kelvin));
    }
    if (name.size() >= 3 && name[0] == 'D')
        if (const auto n = number(std::string_view(name).substr(1)))
            return checked_daylight((*n < 1000 ? 100 * *n : *n) * DaylightFromNominal, given);
    for (size_t i = 0; i < std::size(LedNames); i++)
        if (name == LedNames[i])
            return column_of(LedCsv, "cie_led.csv", i);
    if (name[0] == 'F') {
        const auto n = number(std::string_view(name).substr(name.starts_with("FL") ? 2 : 1));
        if (n && *n == std::floor(*n) && *n >= 1 && *n <= 12)
            return column_of(FluorescentCsv, "cie_f.csv", size_t(*n) - 1);
    }
    return std::nullopt;
}

std::vector<std::string> illuminant_names() {
    std::vector<std::string> names{"A", "E", "D50", "D55", "D60", "D65", "D75"};
    for (int i = 1; i <= 12; i++)
        names.push_back("F" + std::to_string(i));
    names.insert(names.end(), std::begin(LedNames), std::end(LedNames));
    return names;
}

NamedSpectrum resolve_spectrum(const std::string& text, std::span<const std::string> folders) {
    if (text.empty())
        throw Error("an empty name; expected a light, or a file with a spectrum");
    if (text.starts_with("nm:")) {
        std::string lines;
        for (const char c : text.substr(3)) // one pair a line
            lines += c == ',' || c == ';' ? '\n' : c;
        return {parse_columns(lines, "the spectrum \"" + text.substr(0, 40) + "\"")
                    .column(0)
                    .table(Spectrum::Ends::Hold),
                false,
                {}};
    }
    if (const auto light = find_illuminant(text))
        return {*light, true, {}};
    std::error_code ignored;
    std::vector<std::string> places{text};
    if (text[0] != '/')
        for (const std::string& folder : folders)
            places.push_back(folder + "/" + text);
    for (const std::string& place : places)
        if (std::filesystem::is_regular_file(place, ignored))
            return {read_spectrum(place).table(Spectrum::Ends::Hold), false, place};
    std::string names;
    for (const std::string& n : illuminant_names())
        names += n + ", ";
    throw Error("there is no spectrum \"" + text + "\": neither a file by that name, nor one of the lights " +
                names + "blackbody:T, daylight:T; nor \"nm: 400 0.1, 700 0.5\"");
}

Table resolve_light(const std::string& text, std::span<const std::string> folders) {
    NamedSpectrum s = resolve_spectrum(text, folders);
    if (s.illuminant)
        return s.table;
    if (!s.file.empty())
        s.table = read_spectrum(s.file).table(Spectrum::Ends::Zero); // what is not measured does not shine
    if (!(integrate(s.table, cie_y()) > 0))
        throw Error("the spectrum \"" + text + "\" has no visible light");
    return normalized(s.table);
}

Vector3 observe(const Table& power) {
    const double n = cie_y_integral();
    return {integrate(power, cie_x()) / n, integrate(power, cie_y()) / n, integrate(power, cie_z()) / n};
}

Chromaticity chromaticity(const Table& power) {
    const Vector3 v = observe(power);
    const double sum = v[0] + v[1] + v[2];
    return sum > 0 ? Chromaticity{v[0] / sum, v[1] / sum} : Chromaticity{0, 0};
}

} // namespace kanuka::color
