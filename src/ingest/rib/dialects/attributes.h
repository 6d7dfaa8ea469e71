// Attributes as other renderers spell them, read into the fields that they mean. Shaders may ask for all of
// them by the names that the file has.
#pragma once

#include <string_view>

#include "ingest/rib/state.h"

namespace kanuka::ingest::dialects {

// What was set by the name "category:parameter", and is kept among the user's attributes.
void attribute(AttributeState& to, std::string_view name);

// A value for a declared attribute, from how files write it: lists of names come as one text too, parted by
// blanks or commas; bounds may be negative.
void adapt(const scene::AttributeParameter& row, scene::Setting& value);

} // namespace kanuka::ingest::dialects
