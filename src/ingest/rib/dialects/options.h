// Options as other renderers spell them, read into the fields that they mean.
#pragma once

#include <optional>
#include <string>

#include "scene/scene.h"

namespace kanuka::ingest::dialects {

// What was set by the name "category:parameter". Returns what is wrong with it; nothing is set then.
std::optional<std::string> option(scene::Options& to, std::string_view name, const scene::Value& value);

} // namespace kanuka::ingest::dialects
