// Files that lights name, read before light is sampled.
#pragma once

#include "base/error.h"
#include "color/spaces.h"
#include "transport/scene_data.h"

namespace kanuka::render {

// The latitude-longitude picture of the first environment light that has one, in the scene's space.
void load_environment(transport::SceneInputs& in, color::Space space, Journal& journal);
// Pictures on quads, photometric profiles of points and spots.
void load_tables(transport::SceneInputs& in, color::Space space, Journal& journal);

} // namespace kanuka::render
