// A material that is shaded several times, for instances that differ: the variable "variant" counts from 0.
#pragma once

#include <memory>
#include <vector>

#include "shade/shade.h"

namespace kanuka::shade {

// The primitive with "variant" as a variable of its own.
scene::Primitive with_variant(const scene::Primitive& primitive, float variant);
// The primitive with variables that instances bring, but for those that it has itself. "variant" is of shapes
// that have variants, which ask for it in any case.
scene::Primitive with_variables(const scene::Primitive& primitive, const scene::ValueList& variables);

// Lobes' inputs are those of each; all else is as the first has it: displacement, normals, presence, what it
// emits and what is inside. Those whose layers differ from the first's are shaded as the first, and told.
std::shared_ptr<const Material> make_variants(const scene::Primitive& primitive,
                                              std::vector<std::shared_ptr<const Material>> materials,
                                              Journal& journal);

} // namespace kanuka::shade
