// Answers to attribute(), option(), rendererinfo() and textureinfo(): what a shader may know of the scene.
#pragma once

#include "scene/scene.h"
#include "shade/textures.h"
#include "sl/sl.h"

namespace kanuka::shade {

class PointLights;

// Where the answers come from; null = nothing is known of it.
struct Facts {
    const scene::Attributes* attributes = nullptr;
    const scene::Options* options = nullptr;
    const scene::Camera* camera = nullptr;
    const PointLights* lights = nullptr;
};

// RISpec 3.2, tables 15.1 to 15.4. "Ri:" before a name means the same, "user:…" and "category:name" are the
// scene's own attributes and options.
bool answer(const sl::Query& query, const Facts& facts, Textures& textures);

// All that attribute() may answer, for the key of what is shared.
std::string attribute_key(const scene::Attributes& attributes);

} // namespace kanuka::shade
