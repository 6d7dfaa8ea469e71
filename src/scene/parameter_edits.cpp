#include "scene/parameter_edits.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace kanuka::scene {

namespace {

size_t stored(const Value& v) {
    return v.type == Type::String    ? v.strings.size()
           : v.type == Type::Integer ? v.ints.size()
                                     : v.floats.size();
}
size_t needed(const Value& v) {
    return size_t(components(v.type)) * size_t(std::max(v.array_size, 1));
}
bool has_floats(Type type) {
    return type != Type::String && type != Type::Integer;
}
bool is_one_text(const Value& v) {
    return v.type == Type::String && v.strings.size() == 1;
}

Fault wrong_type(const Value& parameter, const Value& value) {
    return value.name + ": expected a " + type_of(parameter) + ", got a " + type_of(value) +
           "; it is declared \"" + type_of(parameter) + " " + value.name + "\"";
}

// The numbers of a value as whole ones, or as floats.
Fault take_whole(Value& value) {
    std::vector<int32_t> ints;
    for (const float x : value.floats) {
        if (!(std::abs(x) < 2147483648.0f) || x != std::floor(x)) {
            char number[32];
            std::snprintf(number, sizeof number, "%g", double(x));
            return value.name + ": expected a whole number, got " + number;
        }
        ints.push_back(int32_t(x));
    }
    value.type = Type::Integer;
    value.ints = std::move(ints);
    value.floats = {};
    return std::nullopt;
}
void take_floats(Value& value) {
    value.floats = std::vector<float>(value.ints.begin(), value.ints.end());
    value.type = Type::Float;
    value.ints = {};
}

// As the parameter is declared. What differs is in the names that doors have for one thing: three numbers are
// a colour or a point, and an array to those who cannot say so.
Fault take_as(const Value& parameter, Value& value) {
    const bool spectrum = parameter.type == Type::Color && needed(parameter) == 3 && is_one_text(value),
               back = is_one_text(parameter) && value.type == Type::Color && needed(value) == 3;
    if (spectrum || back) // of a colour: by its text, or as it is
        return std::nullopt;
    if (parameter.type == Type::String || value.type == Type::String) {
        if (parameter.type != value.type || parameter.array_size != value.array_size)
            return wrong_type(parameter, value);
        return std::nullopt;
    }
    const bool matrices = (parameter.type == Type::Matrix) != (value.type == Type::Matrix) &&
                          value.type == Type::Matrix; // whose numbers are not in the order that is read
    if (needed(parameter) != needed(value) || matrices)
        return wrong_type(parameter, value);
    if (parameter.type == Type::Integer && has_floats(value.type)) {
        if (Fault fault = take_whole(value))
            return fault;
    } else if (has_floats(parameter.type) && value.type == Type::Integer) {
        take_floats(value);
    }
    value.type = parameter.type;
    value.array_size = parameter.array_size;
    return std::nullopt;
}

// A value that is not what it says it is.
Fault fault_of_count(const Value& value) {
    if (value.array_size >= 1 && stored(value) == needed(value))
        return std::nullopt;
    return value.name + ": expected " + std::to_string(needed(value)) +
           (value.type == Type::String ? " texts" : " numbers") + " (\"" + type_of(value) + " " + value.name +
           "\"), got " + std::to_string(stored(value));
}

} // namespace

std::string type_of(const Value& value) {
    const std::string type(name(value.type));
    return value.array_size == 1 ? type : type + "[" + std::to_string(value.array_size) + "]";
}

Fault put_parameter(ValueList& list, Value value) {
    Fault fault = fault_of_count(value);
    const Value* before = list.find(value.name);
    if (!fault && before)
        fault = take_as(*before, value);
    if (!fault)
        list.set(std::move(value));
    return fault;
}

Fault take_as_light_parameter(const LightKind& kind, Value& value) {
    if (Fault fault = fault_of_count(value))
        return fault;
    const auto is = [&](std::initializer_list<std::string_view> names) {
        return std::ranges::find(names, value.name) != names.end();
    };
    // What is made of several parameters, or counts otherwise than its row does.
    Value parameter;
    parameter.name = value.name;
    parameter.type = is({"lightcolor"})                   ? Type::Color
                     : is({"from", "to", "sundirection"}) ? Type::Point
                                                          : Type::Float;
    const bool apart =
        parameter.type != Type::Float || is({"intensity", "coneangle", "conedeltaangle", "decay"});
    const auto row = std::ranges::find_if(light_parameters(), [&](const LightParameter& r) {
        return r.is_of(kind) && is_word_of(value.name, r.rib);
    });
    if (!apart && row != light_parameters().end()) {
        const Fault fault = row->refused(setting_of(value));
        return fault ? Fault(value.name + fault->substr(std::string_view(row->name).size())) : std::nullopt;
    }
    if (value.type == Type::String)
        return wrong_type(parameter, value);
    if (Fault fault = take_as(parameter, value))
        return fault;
    if (!std::ranges::all_of(value.floats, [](float x) { return std::isfinite(x); }))
        return value.name + ": expected finite numbers";
    return std::nullopt;
}

bool is_link_of_lights(std::string_view rib_name) {
    return std::ranges::any_of(light_parameters(), [&](const LightParameter& row) {
        return row.links && is_word_of(rib_name, row.rib);
    });
}

} // namespace kanuka::scene
