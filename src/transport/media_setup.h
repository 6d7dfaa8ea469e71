// Prepares what kernels read of media, and finds those that the camera stands in.
#pragma once

#include "transport/scene_data.h"

namespace kanuka::transport {

// All of MediaView but for air. Geometry, camera and settings must be there.
void fill_media(SceneData& data, const store::Store& store, int volume_depth, Journal& journal);

} // namespace kanuka::transport
