// Light shaders to analytic lights.
#pragma once

#include <optional>
#include <vector>

#include "base/error.h"
#include "scene/scene.h"
#include "shade/textures.h"

namespace kanuka::shade {

// One of the standard light shaders by name; others are reported with the names there are, and null is
// returned.
std::optional<scene::Light> make_light(const scene::ShaderRef& ref, const Textures& textures,
                                       Journal& journal);

// Radiance of an area light; also serves the parameters of light shaders: intensity times lightcolor.
Rgb light_amount(const scene::ShaderRef& ref);

// Reports area light shaders that are not known, and parameters that do nothing.
void check_area_light(const scene::ShaderRef& ref, Journal& journal);

} // namespace kanuka::shade
