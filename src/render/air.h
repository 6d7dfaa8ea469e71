// What volume shaders ask of rays: shadows in air, and lights with an extent.
#pragma once

#include <memory>
#include <span>

#include "bvh/bvh.h"
#include "grid/ways.h"
#include "scene/scene.h"
#include "shade/shade.h"
#include "transport/scene_view.h"

namespace kanuka::render {

// Everything must outlive it. `lamps`: those of ShadingSystem::lamps(), linked; `lights`: what the view was
// made from.
std::unique_ptr<grid::Air> make_air(shade::ShadingSystem& shading, const bvh::Scene& bvh,
                                    std::vector<scene::Light> lamps, const transport::SceneView& view,
                                    const std::vector<scene::Light>& lights);

} // namespace kanuka::render
