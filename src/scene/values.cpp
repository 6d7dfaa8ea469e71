#include "scene/values.h"

namespace kanuka::scene {

int components(Type type) {
    switch (type) {
    case Type::Float:
    case Type::Integer:
    case Type::String:
        return 1;
    case Type::Color:
    case Type::Point:
    case Type::Vector:
    case Type::Normal:
        return 3;
    case Type::HPoint:
        return 4;
    case Type::Matrix:
        return 16;
    }
    return 1;
}

std::string_view name(Type type) {
    constexpr std::string_view names[] = {"float",  "integer", "string", "color", "point",
                                          "vector", "normal",  "hpoint", "matrix"};
    return names[int(type)];
}

std::string_view name(Detail detail) {
    constexpr std::string_view names[] = {"constant", "uniform",     "varying",
                                          "vertex",   "facevarying", "facevertex"};
    return names[int(detail)];
}

size_t Value::items() const {
    const size_t one = size_t(components(type)) * size_t(array_size);
    if (type == Type::String)
        return strings.size() / one;
    if (type == Type::Integer)
        return ints.size() / one;
    return floats.size() / one;
}

const Value* ValueList::find(std::string_view name) const {
    for (const Value& v : values)
        if (v.name == name)
            return &v;
    return nullptr;
}

float ValueList::get_float(std::string_view name, float fallback) const {
    const Value* v = find(name);
    if (!v)
        return fallback;
    if (!v->floats.empty())
        return v->floats[0];
    return v->ints.empty() ? fallback : float(v->ints[0]);
}

int ValueList::get_int(std::string_view name, int fallback) const {
    const Value* v = find(name);
    if (!v)
        return fallback;
    if (!v->ints.empty())
        return v->ints[0];
    return v->floats.empty() ? fallback : int(v->floats[0]);
}

std::string ValueList::get_string(std::string_view name, std::string_view fallback) const {
    const Value* v = find(name);
    return v && !v->strings.empty() ? v->strings[0] : std::string(fallback);
}

Rgb ValueList::get_color(std::string_view name, Rgb fallback) const {
    const Value* v = find(name);
    if (!v || v->floats.empty())
        return fallback;
    if (v->floats.size() < 3)
        return Rgb(v->floats[0]);
    return {v->floats[0], v->floats[1], v->floats[2]};
}

void ValueList::set(Value value) {
    for (Value& v : values)
        if (v.name == value.name) {
            v = std::move(value);
            return;
        }
    values.push_back(std::move(value));
}

} // namespace kanuka::scene
