// What turns spectra into a picture's numbers: an observer or a camera, balanced to a white, to an RGB space.
#pragma once

#include <span>

#include "color/illuminants.h"
#include "color/spaces.h"

namespace kanuka::color {

struct Sensor {
    std::array<Table, 3> curves;     // sums over 1 nm of power times these are the sensor's values
    std::array<Table, 3> importance; // their sum, where wavelengths are worth drawing; unscaled, >= 0
    std::array<std::array<float, 3>, 3> output_from_sensor;
    Space output = Space::Rec709;
    // What the power of a light at 1 nm becomes.
    Rgb see(const Table& power) const;
};

enum class Observer { Cie1931, Cie1964 };
std::optional<Observer> find_observer(std::string_view name); // "1931", "2", "1964", "10"

// The white light comes out as (1, 1, 1) where it has Y = 1 (1931), adapted by Bradford to the output's
// white. Output Xyz is not adapted: the observer's own tristimulus values.
Sensor make_sensor(Observer observer, const Table& white, Space output);

// A camera from its measured sensitivities: columns wavelength, red, green, blue (relative; what is not
// measured is 0). White balance multiplies the three so that the white light gives equal values. A matrix
// brings them to the observer's XYZ, adapted to the output's white: least squares over training reflectances
// under the white light, with white kept exactly. No matrix makes all colours right, for a camera is no
// observer: pairs of spectra that match for the one differ for the other. Throws Error.
Sensor make_camera(const SpectrumColumns& sensitivities, const std::string& name, const Table& white,
                   Space output, std::span<const Table> training = {});
// Smooth reflectances of 5 x 5 x 5 Rec.709 colours, which serve where no others are given.
const std::vector<Table>& default_training();

} // namespace kanuka::color
