// Where hero wavelengths are drawn (Wilkie et al. 2014, Hero Wavelength Spectral Sampling), and what the
// sensor sees there.
#pragma once

#include <array>
#include <vector>

#include "color/sensor.h"

namespace kanuka::transport {

// Quantiles of the wavelength density: lambda(u) is linear between knots, so density and inverse are exact.
struct WavelengthTable {
    static constexpr int Segments = 256;
    std::vector<float> quantile; // Segments + 1 values of l = (lambda - 360) / 470
    float sensor[480][4];        // the sensor's curves at 1 nm, and emitted white; padded
    float lookup_white[480];     // the spectrum of emitted white
};

// A path carries wavelengths at u, u + 1/4, u + 1/2 and u + 3/4 (modulo 1) of the quantiles. With densities p
// there, white light of 1 comes out in channel c as W_c(u) = sum R_c(lambda_k) / (4 p(lambda_k)), whose mean
// is 1; R_c is the curve of the output, which may be negative. What W_c varies is colour noise that every
// path has, so the density is one that keeps it nearly constant: the sum of the sensor's curves (the usual
// choice) to start with, then knots of it are moved up and down as long as that lowers the variance of W over
// the channels. Never below a fiftieth of its mean: rare wavelengths would be fireflies. white: the spectrum
// of emitted white, at 1 nm.
WavelengthTable make_wavelengths(const color::Sensor& sensor, const color::Table& white);

// Variance of W_c over u.
std::array<double, 3> color_noise(const WavelengthTable& table, const color::Sensor& sensor,
                                  const color::Table& white);

} // namespace kanuka::transport
