// Coordinate systems of ScopedCoordinateSystem: attributes, so that they end with their block and primitives
// take them along. Row by row, world_from_named.
#pragma once

#include "scene/scene.h"

namespace kanuka::scene {

inline std::string coordinate_system_name(std::string_view name) {
    return "coordinatesystem:" + std::string(name);
}

inline bool is_coordinate_system(const Value& v) {
    return v.type == Type::Matrix && v.floats.size() == 16 && v.name.starts_with("coordinatesystem:");
}

inline Value matrix_value(std::string name, const Transform& t) {
    Value v;
    v.name = std::move(name);
    v.type = Type::Matrix;
    std::vector<float> m;
    for (const auto& row : t.m)
        for (const double x : row)
            m.push_back(float(x));
    v.floats = std::move(m);
    return v;
}

inline Transform matrix_of(const Value& v) {
    Transform t;
    for (size_t i = 0; i < 16 && i < v.floats.size(); i++)
        t.m[i / 4][i % 4] = double(v.floats[i]);
    return t;
}

} // namespace kanuka::scene
