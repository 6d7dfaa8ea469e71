// Light shaders that files bring without the shaders: what they were like, by what renderers and exporters
// called them.
#pragma once

#include "scene/scene.h"

namespace kanuka::ingest::dialects {

// The standard light shader that is most like it, by what its name and its parameters say, with those of them
// that it has. Null: it is a standard one itself. Without a name: what it would bring is found by tracing.
std::shared_ptr<const scene::ShaderRef::StandIn> stand_in_for_light(const scene::ShaderRef& light);

} // namespace kanuka::ingest::dialects
