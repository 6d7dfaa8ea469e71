// LDR-FLIP: the difference a viewer sees when flipping between two pictures.
#pragma once

#include <array>
#include <vector>

#include "base/vec.h"

namespace kanuka::film {

// Three planes of width * height.
struct Planes {
    int width = 0, height = 0;
    std::array<std::vector<float>, 3> c;
    Planes(int width, int height);
};

inline constexpr float FlipPixelsPerDegree = 67.0206f; // 0.7 m from a 0.7 m wide display of 3840 pixels

// Both in linear Rec.709, finite, clamped to [0, 1] inside. One value in [0, 1] a pixel.
std::vector<float> flip(const Planes& reference, const Planes& test,
                        float pixels_per_degree = FlipPixelsPerDegree);

// Colours for values in [0, 1], linear Rec.709: black through violet and orange to a pale yellow, lightness
// rising evenly.
Rgb heat(float value);

} // namespace kanuka::film
