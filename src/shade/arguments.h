// Binds values of a scene to a shader's parameters.
#pragma once

#include <string>
#include <vector>

#include "base/error.h"
#include "scene/scene.h"
#include "shade/default_surface.h"
#include "shade/spaces.h"
#include "sl/sl.h"

namespace kanuka::shade {

// A shader's values: those of its ShaderRef, overridden by the primitive's primvars of the same name. A
// constant primvar (or one with a single value a primitive) becomes a value, any other is marked to be found
// on the grid. Values that do not fit are reported where they stand and skipped, so the parameter keeps its
// default. Points, vectors, normals and matrices of the ShaderRef are in shader space, those of primvars in
// object space (RISpec 3.2, "Shaders"): both leave in current space.
std::vector<sl::Argument> bind_arguments(const sl::Shader& shader, const scene::ShaderRef& ref,
                                         const scene::ValueList& primvars, const Spaces& spaces,
                                         Journal& journal);

// A primvar that has one value for the whole primitive.
bool is_constant(const scene::Value& primvar);

// The compiler wants to know which of Cs and Os the grids will carry, and whether the surface is opaque: then
// it keeps no presence.
void add_colors(std::vector<sl::Argument>& arguments, const Rgb& opacity, const DefaultSurface& coverage);

// The bytes an argument list stands for: equal strings, equal arguments.
std::string serialize(const std::vector<sl::Argument>& arguments);

} // namespace kanuka::shade
