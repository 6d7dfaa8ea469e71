// From what the pixels gathered to a picture: channels, filter weights, exposure.
#pragma once

#include "film/film.h"
#include "render/accumulator.h"
#include "render/aovs.h"
#include "render/camera.h"
#include "render/color_setup.h"

namespace kanuka::render {

// R G B A come first, of linear light; then the layers that every picture has, and the output variables.
// `filter_weighted`: the samples' weights differ (transport::SceneView).
film::Picture develop(const Accumulator& gathered, const scene::Options& options, const PlacedCamera& camera,
                      const ColorSetup& color, const Aovs& aovs, bool filter_weighted);

} // namespace kanuka::render
