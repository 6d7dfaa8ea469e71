// What a scene holds, in numbers: for `kanuka info`, statistics, tests.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "scene/scene.h"

namespace kanuka::scene {

struct Summary {
    std::string file;
    size_t primitives = 0; // declared outside groups
    size_t groups = 0, group_primitives = 0;
    size_t instances = 0; // top level
    size_t moving_primitives = 0, moving_instances = 0;
    size_t instanced_primitives = 0;       // primitives that the instances stand for, through all levels
    std::map<std::string, size_t> by_kind; // all declared primitives, groups' included
    size_t control_points = 0, faces = 0, curves = 0;
    size_t value_bytes = 0;                                           // of all primvars and indices
    Bounds3f bounds;                                                  // scene/bounds.h
    std::map<std::string, size_t> surfaces, displacements, interiors; // shader name → primitives that use it
    std::map<std::string, size_t> light_shaders;
    size_t lights = 0, area_light_primitives = 0;
    size_t attribute_states = 0; // distinct ones
    std::vector<std::string> coordinate_systems;
    Options options;
    Camera camera;
};

Summary summarize(const Scene& scene);
std::string to_json(const Summary& summary, int indent = 2);
std::string to_text(const Summary& summary); // for people, ending in a newline

} // namespace kanuka::scene
