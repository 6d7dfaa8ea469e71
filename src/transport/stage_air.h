// Air: what lies between what is seen and who sees it. For rays from the camera, and on from smooth lobes;
// others see clear air (docs/transport.md, "Air").
#pragma once

#include "transport/kernel.h"
#include "transport/stage_intersect.h"

namespace kanuka::transport {

// Attenuates the throughput of paths that have hit something, and adds what is scattered in before the hit.
void apply_air(const SceneView& scene, BatchState& batch, PathQueue& paths, const HitState& hits,
               const ProgramRuns& runs, int bounce, grid::AirSegments& segments);

} // namespace kanuka::transport
