// Python values to the scene model's typed values: shader parameters, primvars.
#pragma once

#include <span>

#include <nanobind/ndarray.h>

#include "python/bindings.h"

namespace kanuka::python {

// Neither empty nor a text; memory views do not give items of every format.
bool is_sequence_of_objects(nb::handle value);
// A parameter of a shader from a Python value: number -> float, text -> string, three numbers -> color, 4x4
// -> matrix, other sequences -> arrays. A key may carry a declaration as in RIB: "point center", "uniform
// float[2] range".
scene::Value parameter(const std::string& key, nb::handle value);
scene::ValueList parameters(const nb::dict& values);

// How many values each detail has on a mesh; the count of a primvar's rows tells its detail, the finest
// first.
struct DetailCount {
    scene::Detail detail;
    size_t count;
};
// `what` names it in messages; empty = by its key.
scene::Value primvar(const std::string& key, nb::handle value, std::span<const DetailCount> counts,
                     const std::string& what = "");

bool holds_texts(nb::handle value); // a text, or a list of texts, or of lists of them
// A text of instances, or one for each; of an array lists of them.
scene::Value texts_of_instances(const std::string& key, nb::handle value, size_t instances);

// A copy, as NumPy has it.
template <class T>
nb::object array_of(const T* data, std::vector<size_t> shape) {
    size_t count = 1;
    for (const size_t n : shape)
        count *= n;
    auto* copy = new std::vector<T>(data, data + count);
    const nb::capsule owner(copy, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
    return nb::cast(nb::ndarray<nb::numpy, T>(copy->data(), shape.size(), shape.data(), owner));
}

// One float, integer or string as it is; more of them as an array or a list.
nb::object value_of(const scene::Value& value);
// A parameter as parameter() takes it: an array of the shape that it has, matrices acting on columns.
nb::object parameter_of(const scene::Value& value);
// Another value of a parameter that has one: under its type, where the key says none.
scene::Value parameter_like(const scene::Value& before, const std::string& key, nb::handle value);

// A value of Python's as one of ours; `expected` is what is said where it is none: "displacement: expected a
// Shader".
template <class T>
T as(nb::handle value, const std::string& expected) {
    T result{};
    if (!nb::try_cast(value, result))
        throw nb::type_error(
            (expected + ", got " + nb::cast<std::string>(value.type().attr("__name__"))).c_str());
    return result;
}

} // namespace kanuka::python
