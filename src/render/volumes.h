// Volumes on their way to the store: a closed box that light passes as it comes, and how thick it is inside.
#pragma once

#include "scene/scene.h"
#include "store/store.h"

namespace kanuka::render {

// The box, with the attributes and constant primvars of the Volume; without its motion.
scene::Primitive boundary_of(const scene::Primitive& primitive, const scene::Volume& volume);

// What a Volume is made of whose surface shader says nothing of its inside: smoke of its colour, with an
// extinction of its opacity a metre, where its density is 1.
std::shared_ptr<const scene::Attributes> as_smoke(const scene::Attributes& attributes);

// Values of a lattice, largest 1, and what they have been divided by. Null = the same everywhere: `most` is
// its density.
struct Thickness {
    std::shared_ptr<store::DensityField> field;
    float most = 1;
    float mean = 1;
    size_t bad = 0; // values below zero or not finite, which are taken as 0
};
Thickness thickness_of(const scene::Primitive& primitive, const scene::Volume& volume,
                       const Transform& render_from_object);

} // namespace kanuka::render
