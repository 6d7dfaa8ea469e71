// What can be set for a primitive, beside its shaders and the requests of RenderMan: scene::Attributes, a row
// each.
#pragma once

#include "scene/scene.h"
#include "scene/schema/parameter.h"

namespace kanuka::scene {

using AttributeParameter = Parameter<Attributes>;

std::span<const AttributeParameter> attribute_parameters();
const AttributeParameter* find_attribute(std::string_view name); // null = there is none
const AttributeParameter*
find_rib_attribute(std::string_view rib_name); // "category:name", as Attribute has it

} // namespace kanuka::scene
