// Prepares what kernels read of media, and finds those that the camera stands in.
#pragma once

#include "transport/scene_view.h"

namespace kanuka::transport {

// Materials, shapes, ray queries and the camera must be there.
void fill_media(SceneView& view, const store::Store& store, int volume_depth, Journal& journal);

} // namespace kanuka::transport
