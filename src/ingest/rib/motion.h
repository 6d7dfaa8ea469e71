// Motion blocks: samples of one request at several times.
#pragma once

#include "ingest/rib/context.h"

namespace kanuka::ingest {

// Requests that change the current transformation, and nothing else.
bool is_transformation(const RequestSpec& spec);

// The motion of something that only its place moves; null where it stands still.
std::shared_ptr<const scene::Motion> moving_place(const std::vector<TransformKey>& keys);

} // namespace kanuka::ingest
