// Samples far brighter than the rest of their pixels, explained.
#pragma once

#include "base/stats.h"
#include "scene/scene.h"
#include "transport/kernel.h"
#include "transport/scene_view.h"

namespace kanuka::render {

// The worst samples once more, each alone, and what their paths did.
std::vector<Stats::Firefly> explain_fireflies(const transport::BatchCounts& found, transport::Kernel& kernel,
                                              const transport::SceneView& view, const scene::Scene& scene);

} // namespace kanuka::render
