// What the kernels read: spans and plain structs over what SceneData and the store own. Nothing here is
// written while tracing.
#pragma once

#include <cstdint>
#include <limits>
#include <span>

#include "bsdf/spectral.h"
#include "transport/camera_view.h"
#include "transport/geometry_view.h"
#include "transport/integrator.h"
#include "transport/lights_view.h"
#include "transport/media_view.h"
#include "transport/path_expression.h"

namespace kanuka::transport {

class FootprintLog;
struct RouletteFactors;

inline constexpr float Unclamped = std::numeric_limits<float>::infinity();

// Between RGB, spectra and the sensor.
struct SpectraView {
    bsdf::UpliftView uplift;
    // WavelengthTable
    std::span<const float> wavelengths; // quantiles
    std::span<const float> sensor;      // four values a nanometre
    std::span<const float> white;
    float sensor_matrix[9];        // output RGB from the sensor's values
    std::span<const float> tables; // of the palette, 480 floats each; empty = none
};

struct SettingsView {
    IntegratorChoice integrator;
    uint32_t seed = 0;
    float clamp_direct = Unclamped, clamp_indirect = Unclamped; // most radiance of one contribution
    int max_depth = 8;                                          // surface events of a path
    int volume_depth = 1024;                                    // events inside of media
    int light_samples = 1;                     // of a surface hit, of each of LightsView::samples
    int roulette_depth = 4;                    // where none has been learned
    const RouletteFactors* roulette = nullptr; // from progression 1 on; null = none have been learned
    // In progression 0: the first bounce searches the sky along pairs of directions.
    bool first_pairs = false;
    // false: paths end where they come from anything but the camera and smooth lobes
    bool interreflection = true;
    // Densities differ between wavelengths: something disperses, or scatters inside.
    bool keeps_ratios = false;
    // Channels of the output variables that displays ask for, three to each; which of them count as colours
    // (filtered with the picture) and not as data (a mean over what was hit).
    std::span<const uint8_t> aov_is_color;
    FootprintLog* footprints = nullptr;           // null = nobody asks for them
    const PathExpressions* expressions = nullptr; // their channels are the last of those; null = none
};

struct SceneView {
    GeometryView geometry;
    LightsView lights;
    MediaView media;
    CameraView camera;
    SpectraView spectra;
    SettingsView settings;

    int last_step() const {
        return media.tracked ? settings.max_depth + settings.volume_depth : settings.max_depth;
    }
};

} // namespace kanuka::transport
