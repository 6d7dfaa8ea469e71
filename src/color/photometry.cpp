#include "color/photometry.h"

#include <cmath>
#include <numbers>

#include "color/spectrum.h"

namespace kanuka::color {

std::optional<Unit> find_unit(std::string_view name) {
    struct Name {
        std::string_view name;
        Unit unit;
    };
    static constexpr Name names[] = {{"", Unit::None},           {"lumen", Unit::Lumen}, {"lm", Unit::Lumen},
                                     {"candela", Unit::Candela}, {"cd", Unit::Candela},  {"lux", Unit::Lux},
                                     {"lx", Unit::Lux},          {"nit", Unit::Nit},     {"nits", Unit::Nit},
                                     {"cd/m2", Unit::Nit},       {"watt", Unit::Watt},   {"W", Unit::Watt}};
    for (const Name& n : names)
        if (n.name == name)
            return n.unit;
    return std::nullopt;
}

double luminous_efficacy(const Table& power) {
    double sum = 0;
    for (const float v : power)
        sum += v;
    return sum > 0 ? MaxEfficacy * integrate(power, cie_y()) / sum : 0;
}

std::optional<double> photometric(double amount, Unit unit, const LightMeasure& light, double efficacy) {
    constexpr double pi = std::numbers::pi;
    if (unit == Unit::None)
        return amount;
    switch (light.shape) {
    case LightShape::Point:
        if (unit == Unit::Lumen)
            return amount / light.solid_angle;
        if (unit == Unit::Candela)
            return amount;
        if (unit == Unit::Watt)
            return amount * efficacy / light.solid_angle;
        break;
    case LightShape::Distant:
        if (unit == Unit::Lux)
            return amount;
        if (unit == Unit::Watt)
            return amount * efficacy;
        break;
    case LightShape::Environment:
        if (unit == Unit::Nit)
            return amount;
        if (unit == Unit::Lux)
            return amount / pi;
        if (unit == Unit::Watt)
            return amount * efficacy;
        break;
    case LightShape::Area:
        if (unit == Unit::Nit)
            return amount;
        if (unit == Unit::Lux)
            return amount / pi;
        if (unit == Unit::Lumen)
            return amount / (pi * light.area);
        if (unit == Unit::Candela)
            return amount / light.area;
        if (unit == Unit::Watt)
            return amount * efficacy / (pi * light.area);
        break;
    }
    return std::nullopt;
}

double Exposure::factor() const {
    const double plain = std::exp2(stops);
    return physical() ? plain * shutter * iso / (120 * f_stop * f_stop) : plain;
}

double Exposure::ev100() const {
    return physical() ? std::log2(f_stop * f_stop / shutter * 100 / iso) - stops : -stops;
}

} // namespace kanuka::color
