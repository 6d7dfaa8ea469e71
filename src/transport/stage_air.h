// Air: what lies between what is seen and who sees it. For rays from the camera, and on from smooth lobes;
// others see clear air (docs/transport.md, "Air").
#pragma once

#include "transport/kernel.h"
#include "transport/stage_intersect.h"

namespace kanuka::transport {

// Dims the light of paths that have hit something, and adds what joins them on the way.
void look_through_air(const SceneView& scene, BatchState& batch, PathState& paths, const HitState& hits,
                      const ProgramRuns& runs, int bounce, grid::Ways& ways);

} // namespace kanuka::transport
