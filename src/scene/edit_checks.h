// What edits may not bring in: readers mend what they read, an edit is refused.
#pragma once

#include "scene/editor.h"

namespace kanuka::scene {

Fault fault_of(const Transform& transform);
Fault fault_of(const Placement& placement);
Fault fault_of(const Shape& shape);
Fault fault_of(const Places& places);
// `solids`, `groups_before`: how many there are of those that it may mean by number.
Fault fault_of(const Primitive& primitive, size_t solids);
Fault fault_of(const Variation& variation, size_t instances);
Fault fault_of(const Group::Instances& instances, size_t groups_before);
Fault fault_of(const Group& group, size_t groups_before);

} // namespace kanuka::scene
