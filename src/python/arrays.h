// NumPy arrays to the scene's buffers. They are copied: what Python holds may be resized, truncated (memory
// maps) and written by other threads while it is rendered.
#pragma once

#include "python/bindings.h"

namespace kanuka::python {

struct FloatArray {
    scene::Buffer<float> buffer;
    std::vector<size_t> shape;
};
struct IntArray {
    scene::Buffer<int32_t> buffer;
    std::vector<size_t> shape;
};

// Anything NumPy makes an array of. `what` names it in messages. Throw nb::type_error or nb::value_error.
FloatArray float_array(nb::handle value, const char* what);
IntArray int_array(nb::handle value, const char* what);
// The same, with the shape checked: columns fixed, rows free. Text as in "(N, 3)".
FloatArray float_rows(nb::handle value, size_t columns, const char* what);

Rgb rgb(nb::handle value, const char* what);             // a number or three
Vec3f vec3(nb::handle value, const char* what);          // three numbers
Transform transform(nb::handle value, const char* what); // 4x4 or 3x4, acting on columns; None = identity

// One matrix or (T, 4, 4), and the times that go with them (None = even from 0 to 1).
std::vector<TransformKey> transform_keys(nb::handle value, nb::handle times, const char* what);
// `count` rising numbers; None = even from 0 to 1.
std::vector<double> sample_times(nb::handle times, size_t count, const char* what);

void check_times(nb::handle times); // numbers, or None

std::string shape_text(const std::vector<size_t>& shape);

} // namespace kanuka::python
