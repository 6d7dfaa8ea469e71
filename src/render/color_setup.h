// The colour options of a scene, made ready: what its RGB means, what sees it, how bright the picture is.
#pragma once

#include <memory>

#include "base/error.h"
#include "color/palette.h"
#include "color/photometry.h"
#include "color/sensor.h"
#include "scene/scene.h"

namespace kanuka::render {

struct ColorSetup {
    std::unique_ptr<color::Palette> palette;
    color::Sensor sensor;
    color::Exposure exposure;
    std::vector<std::string> folders; // where spectra are looked for
    color::Table white;               // that the picture shows as white
};

// What options name and is not there is reported; the default stands in for it.
ColorSetup make_color_setup(const scene::Scene& scene, const scene::Options& options, Journal& journal);

} // namespace kanuka::render
