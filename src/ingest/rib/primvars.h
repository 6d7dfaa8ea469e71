// Primitive variables against the geometry that they are on.
#pragma once

#include "ingest/rib/call.h"
#include "ingest/rib/reports.h"
#include "scene/scene.h"

namespace kanuka::ingest {

// Makes call.params fit `geometry`: Pz becomes P, faces and curves that cannot be are left out, a variable
// with too many values is cut, one with too few or of an unfit kind is dropped, all reported. False: the
// primitive itself cannot stand, which was reported.
bool check_primvars(Call& call, scene::Geometry& geometry, Reports& reports);

} // namespace kanuka::ingest
