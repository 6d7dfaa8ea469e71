// What tests of shapes and shaders are given: values in one line.
#pragma once

#include "scene/scene.h"

namespace kanuka::scene::testing {

inline Value value(std::string name, Type type, Detail detail, std::vector<float> floats) {
    Value v;
    v.name = std::move(name);
    v.type = type;
    v.detail = detail;
    v.floats = std::move(floats);
    return v;
}

} // namespace kanuka::scene::testing
