// From what the pixels gathered to a picture: channels, filter weights, exposure.
#pragma once

#include <array>
#include <map>
#include <string>

#include "film/film.h"
#include "render/accumulator.h"
#include "render/aovs.h"
#include "render/camera.h"
#include "render/color_setup.h"

namespace kanuka::render {

// What a picture is made with beside the sums: kept with them, it makes the picture without the scene.
struct Development {
    int full_width = 0, full_height = 0;
    color::Space space = color::Space::Rec709;
    float exposure = 1, white_luminance = 0;
    std::array<double, 3> origin{}; // of render space, in the world
    Vec3f eye, forward{0, 0, 1};
    bool filter_weighted = false; // the samples' weights differ (transport::SceneView)
    bool imager = false;          // a shader changes the picture, which is the scene's
    Layers layers;
    std::map<std::string, std::string> metadata;
    // How the scene would have it written as a PNG.
    float exposure_gain = 1, exposure_gamma = 1;
    std::string display;
};

Development development(const scene::Options& options, const PlacedCamera& camera, const ColorSetup& color,
                        const Aovs& aovs, bool filter_weighted);

// R G B A come first, of linear light; then the layers that every picture has, and the output variables.
film::Picture develop(const Accumulator& gathered, const Development& how);

} // namespace kanuka::render
