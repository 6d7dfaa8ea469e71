// Shaders of several layers. The last layer is the shader itself; those before it are among its co-shaders
// and run before it, in their order, on the same Ci, Oi, P and N. What a layer leaves in an output parameter
// may become the value of a later one's parameter. Kept as parameters whose names no shader can have:
//
//   ":layers"  the handles of the layers before the last
//   ":NAME"    where parameter NAME has its value from: a handle, and the output's name
#pragma once

#include <algorithm>

#include "scene/scene.h"

namespace kanuka::scene {

inline bool is_connection(const Value& v) {
    return v.name.size() > 1 && v.name[0] == ':' && v.name != ":layers" && v.strings.size() == 2;
}

inline Value texts(std::string name, std::vector<std::string> strings, const Location& where) {
    Value v;
    v.name = std::move(name);
    v.type = Type::String;
    v.array_size = int(strings.size());
    v.strings = std::move(strings);
    v.where = where;
    return v;
}

inline std::vector<std::string> layers(const ShaderRef& shader) {
    const Value* v = shader.parameters.find(":layers");
    return v ? std::vector<std::string>(v->strings.begin(), v->strings.end()) : std::vector<std::string>();
}

// Makes `layer` run before `shader`, after the layers it has. Of one handle the last counts.
inline void add_layer(ShaderRef& shader, ShaderRef layer) {
    std::vector<std::string> all = layers(shader);
    std::erase(all, layer.handle);
    all.push_back(layer.handle);
    shader.parameters.set(texts(":layers", std::move(all), shader.where));
    std::erase_if(shader.coshaders, [&](const ShaderRef& c) { return c.handle == layer.handle; });
    shader.coshaders.push_back(std::move(layer));
}

inline void connect(ShaderRef& shader, const std::string& parameter, const std::string& handle,
                    const std::string& output, const Location& where) {
    shader.parameters.set(texts(":" + parameter, {handle, output}, where));
}

} // namespace kanuka::scene
