// Values that shaders are given by edits: under the types that their parameters have.
#pragma once

#include "scene/editor.h"
#include "scene/schema/lights.h"

namespace kanuka::scene {

// "float[3]", "color".
std::string type_of(const Value& value);
// Under the type that it has in the list, as far as the value fits it; one that is not given there yet has
// that of the value. Or says why not, and changes nothing.
Fault put_parameter(ValueList& list, Value value);
// Gives a value of a standard light shader the type that it has there, or says why it cannot be.
Fault take_as_light_parameter(const LightKind& kind, Value& value);
// By which attributes of primitives mean it.
bool is_link_of_lights(std::string_view rib_name);

} // namespace kanuka::scene
