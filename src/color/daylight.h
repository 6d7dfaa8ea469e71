// CIE daylight: CIE 15:2018, section 4.1.2; D. B. Judd, D. L. MacAdam, G. Wyszecki, J. Opt. Soc. Am. 54, 1031
// (1964). Shared with the build step.
#pragma once

#include <algorithm>

namespace kanuka::color {

// The constant c2 of Planck's law was 1.4380 when the D illuminants were named; it is 1.4388 now, and their
// temperatures rose with it: D65 is 6504 K.
inline constexpr double DaylightFromNominal = 1.4388 / 1.4380;
inline constexpr double DaylightMin = 4000, DaylightMax = 25000; // K

struct DaylightMix { // S = S0 + m1 S1 + m2 S2
    double x, y, m1, m2;
};

// Temperatures beyond the definition are clamped to it.
inline DaylightMix daylight_mix(double kelvin) {
    const double t = std::clamp(kelvin, DaylightMin, DaylightMax), u = 1000 / t;
    const double x = t <= 7000 ? ((-4.6070 * u + 2.9678) * u + 0.09911) * u + 0.244063
                               : ((-2.0064 * u + 1.9018) * u + 0.24748) * u + 0.237040;
    const double y = -3.000 * x * x + 2.870 * x - 0.275;
    const double n = 0.0241 + 0.2562 * x - 0.7341 * y;
    return {x, y, (-1.3515 - 1.7703 * x + 5.9114 * y) / n, (0.0300 - 31.4424 * x + 30.0717 * y) / n};
}

} // namespace kanuka::color
