// Where camera rays start and what their samples count, as kernels read it.
#pragma once

#include <span>

#include "base/projection.h"
#include "base/vec.h"

namespace kanuka::transport {

// The pixel filter. Separable: inverse cumulative tables of |f|, offsets in pixels, and signs of negative
// lobes (empty = none).
struct FilterView {
    std::span<const float> x, y, signs_x, signs_y;
    // Or a table of ny rows of nx cells over its width: masses of |f| from 0 to 1, of rows and of the cells
    // of each row, and signed weights of cells. nx = 0: there are the tables above instead.
    struct Cells {
        int nx = 0, ny = 0;
        const float* rows = nullptr;   // ny + 1
        const float* cells = nullptr;  // (nx + 1) * ny
        const float* weight = nullptr; // nx * ny
        float width[2] = {0, 0};       // in pixels
    };
    Cells cells;

    bool weighted() const { return !signs_x.empty() || !signs_y.empty() || cells.nx > 0; }
};

struct CameraView {
    Projection projection = Projection::Perspective;
    // Film coordinates (base/projection.h): x = left + (right - left) * px / width, y downwards.
    float left, right, top, bottom;
    int width, height;
    float half_angle = 0.5f * Pi; // of fisheyes' image circle, radians
    float render_from_camera[12];
    // A moving camera: MotionSteps + 1 matrices like that, evenly over the shutter; linear in between. Empty
    // = still.
    static constexpr int MotionSteps = 256;
    std::span<const float> motion;
    std::span<const float> shutter_quantiles; // scene::shutter_quantiles; empty = open all the time
    float lens_radius = 0, focal_distance = 0;
    // Iris: a regular polygon of `blades` sides inscribed in the lens, the first corner turned by an angle
    // from x; below 3 = round. Anamorphic lenses see it narrower by `squeeze`.
    int blades = 0;
    float blade_cos = 1, blade_sin = 0, squeeze = 1;
    float near_clip = 0;
    FilterView filter;
};

} // namespace kanuka::transport
