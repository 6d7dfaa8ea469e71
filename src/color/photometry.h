// Physical amounts of light and of exposure. Radiance of Y = 1 in the renderer is one candela per square
// metre wherever a light's amount has a unit.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "color/color.h"

namespace kanuka::color {

// More of a light or a picture is not kept: the square of this is still a number.
inline constexpr float LargestRadiance = 1e15f;

// lm, cd, lx = lm / m^2, nit = cd / m^2, W
enum class Unit { None, Lumen, Candela, Lux, Nit, Watt };
std::optional<Unit> find_unit(std::string_view name); // lumen lm candela cd lux lx nit nits watt W

inline constexpr double MaxEfficacy = 683; // lm / W, at 555 nm (540 THz; SI 2019: 683.002 at 1931's V)
// Lumen that a watt of this light is: 683 lm/W * integral(V S) / integral(S), over 360 to 830 nm.
double luminous_efficacy(const Table& power);

// What an amount in a unit is worth in the quantity that a light is defined by. `solid_angle`: steradians
// that the light fills at full intensity (4 pi for a point; a spot's falloff integrated). `area`: of an
// emitting surface, m^2, one side.
enum class LightShape { Point, Distant, Environment, Area };
struct LightMeasure {
    LightShape shape;
    double solid_angle = 4 * 3.14159265358979323846;
    double area = 0;
};
// Candela (point), lux (distant), nit (environment, area) from the amount. None where the unit does not
// measure such a light.
//   Point:       lm: / solid angle; cd: as it is; W: efficacy / solid angle
//   Distant:     lx: as it is; W: efficacy (irradiance, W / m^2)
//   Environment: nit: as it is; lx: / pi (all the sky on level ground); W: efficacy (radiance, W / m^2 / sr)
//   Area:        nit: as it is; lx: / pi (exitance); lm: / (pi area); cd: / area (straight on); W: efficacy
//                / (pi area)
std::optional<double> photometric(double amount, Unit unit, const LightMeasure& light, double efficacy);

// Exposure of a camera with physical light. ISO 12232's saturation-based speed: a luminance L makes the focal
// plane exposure H = q L t / N^2, q = 0.65, and the sensor is full at 78 / S lx s. So a pixel is
// H / (78 / S) = L t S / (120 N^2).
struct Exposure {
    double f_stop = 0, shutter = 0, iso = 100; // N, t in s, S; 0 = not given
    double stops = 0;                          // on top; alone, a plain 2^stops
    bool physical() const { return f_stop > 0 && shutter > 0; }
    double factor() const; // what pixels are multiplied by; 1 where nothing is given
    double ev100() const;  // log2(N^2 / t * 100 / S), less the stops
};

} // namespace kanuka::color
