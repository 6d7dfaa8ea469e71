// What the kernels read: flat arrays and plain structs, prepared once by SceneData. Nothing here is written
// while tracing.
#pragma once

#include <vector>

#include "bsdf/material.h"
#include "bvh/bvh.h"
#include "scene/scene.h"
#include "store/store.h"

namespace kanuka::transport {

// Quantiles of the wavelength density: lambda(u) is linear between knots, so density and inverse are exact.
struct WavelengthTable {
    static constexpr int Segments = 256;
    std::vector<float> quantile; // Segments + 1 values of l = (lambda - 360) / 470
    float sensor[480][4];        // the sensor's curves at 1 nm, and emitted white; padded
    float lookup_white[480];     // the spectrum of emitted white
};

struct AnalyticLight {
    int kind;                             // scene::Light::Kind
    float c[4];                           // amount, as color::Palette::emission has it
    Vec3f position, axis;                 // axis: the way light travels
    float cos_outer, cos_inner, exponent; // spot
    float cos_angle;                      // distant: cosine of the angular radius; 1 = delta
    float radius;                         // point, spot: 0 = delta
    // scene::LightTable; width 0 = none
    int table, width, height, layers, falloff;
    float angle, nearest, extent;
    float light_from_render[9]; // rows
};

struct EnvironmentMap {
    int width = 0, height = 0;
    std::vector<float> rgb;                   // 3 a texel, rows from +z (theta = 0) down; bounded and finite
    std::vector<float> marginal, conditional; // cumulative, height + 1 and height * (width + 1)
    float total = 0;                          // sum of weights: luminance * sin(theta)
    float environment_from_render[9];         // rows
    bool visible_camera = true;
};

struct ConstantEnvironment {
    bool present = false, visible_camera = false;
    float c[4] = {0, 0, 0, 0};
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
    std::vector<float> motion;
    float lens_radius = 0, focal_distance = 0;
    // Iris: a regular polygon of `blades` sides inscribed in the lens, the first corner turned by an angle
    // from x; below 3 = round. Anamorphic lenses see it narrower by `squeeze`.
    int blades = 0;
    float blade_cos = 1, blade_sin = 0, squeeze = 1;
    float near_clip = 0;
};

struct SceneView {
    const uint32_t* words;
    const float* floats;
    const int32_t* shapes; // ShapeRecord as words
    const store::Emitter* emitters;
    const bvh::Scene* bvh;
    std::vector<bsdf::MaterialCode> materials; // by program
    bool dispersive = false;
    bool instanced = false;
    // Channels of the output variables that displays ask for, three to each; which of them count as colours
    // (filtered with the picture) and not as data (a mean over what was hit).
    std::vector<bool> aov_is_color;

    bsdf::UpliftView uplift;
    WavelengthTable wavelengths;
    float sensor_matrix[9];     // output RGB from the sensor's values
    std::vector<float> spectra; // tables of the palette, 480 floats each; empty = none
    const float* filter_x;      // inverse cumulative tables of the pixel filter, offsets in pixels
    const float* filter_y;
    const float* filter_weight_x; // signs of negative lobes; may be null
    const float* filter_weight_y;
    int filter_size;

    CameraView camera;
    bool moving = false;                  // paths have a time: something moves while the shutter is open
    std::vector<float> shutter_quantiles; // scene::shutter_quantiles; empty = open all the time
    int max_depth = 8;
    int roulette_depth = 4;
    uint32_t seed = 0;

    // Lights: the choices are all emitters together (if any), the environment map,
    // and each analytic light.
    std::vector<AnalyticLight> lights;
    std::vector<float> light_tables;
    EnvironmentMap map;
    ConstantEnvironment constant;
    int choices = 0, emitter_choice = -1, map_choice = -1, first_light_choice = 0;
    // What the environment brings to a surface that sees all of it, and all emitters as one sphere: estimates
    // that decide how often each is asked (LightChoice in lights.h).
    float map_brings = 0, emitter_power = 0, emitter_radius2 = 0;
    Vec3f emitter_center{0, 0, 0};
    std::vector<float> alias_probability; // over emitters, by power
    std::vector<int32_t> alias_other;
    std::vector<float> emitter_density; // chance of the emitter among all, over its area; 0 = not sampled
    std::vector<int32_t> sampled_emitters;

    struct Interior {
        float c[4];
        bool absorbs;
    };
    std::vector<Interior> interiors;
};

} // namespace kanuka::transport
