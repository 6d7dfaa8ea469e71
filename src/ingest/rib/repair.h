// Leaves out single faces and curves that cannot be, so that one slip of an exporter does not cost the whole
// mesh.
#pragma once

#include "ingest/rib/call.h"
#include "ingest/rib/reports.h"
#include "scene/scene.h"

namespace kanuka::ingest {

// Faces of fewer than three vertices or with indices that P does not have, and curves of unfit length, go
// with their uniform and per-corner values. What is wrong throughout stays, for scene::fault_of to name.
void drop_bad_parts(Call& call, scene::Geometry& geometry, size_t positions, Reports& reports);

} // namespace kanuka::ingest
