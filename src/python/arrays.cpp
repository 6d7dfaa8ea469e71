#include "python/arrays.h"

#include <nanobind/ndarray.h>

#include "python/arguments.h"

namespace kanuka::python {

std::string shape_text(const std::vector<size_t>& shape) {
    std::string text = "(";
    for (size_t i = 0; i < shape.size(); i++)
        text += (i ? ", " : "") + std::to_string(shape[i]);
    return text + (shape.size() == 1 ? ",)" : ")");
}

template <class T>
static void read(nb::handle value, const char* dtype, const char* what, scene::Buffer<T>& buffer,
                 std::vector<size_t>& shape) {
    using Array = nb::ndarray<const T, nb::c_contig, nb::device::cpu>;
    if (value.is_none()) // NumPy would make a NaN of it
        wrong_argument(what, "ArrayLike", value);
    Array array;
    bool own = false;
    try {
        // Returns its argument where type and layout are right already.
        const nb::object even = nb::module_::import_("numpy").attr("ascontiguousarray")(value, dtype);
        own = !even.is(value) && even.attr("base").is_none();
        array = nb::cast<Array>(even);
    } catch (nb::python_error& error) {
        throw nb::type_error(
            (std::string(what) + ": not an array of " + dtype + ": " + error.what()).c_str());
    }
    for (size_t i = 0; i < array.ndim(); i++)
        shape.push_back(array.shape(i));
    if (!own) {
        buffer = std::vector<T>(array.data(), array.data() + array.size());
        return;
    }
    // A copy already, which nobody else knows. The ndarray holds a reference to it; its last copy takes the
    // interpreter's lock to let go.
    auto owner = std::make_shared<Array>(array);
    buffer = scene::Buffer<T>(owner->data(), owner->size(), owner);
}

FloatArray float_array(nb::handle value, const char* what) {
    FloatArray array;
    read<float>(value, "float32", what, array.buffer, array.shape);
    return array;
}

IntArray int_array(nb::handle value, const char* what) {
    IntArray array;
    read<int32_t>(value, "int32", what, array.buffer, array.shape);
    return array;
}

FloatArray float_rows(nb::handle value, size_t columns, const char* what) {
    FloatArray array = float_array(value, what);
    if (array.shape.size() != 2 || array.shape[1] != columns)
        throw nb::value_error((std::string(what) + ": expected shape (N, " + std::to_string(columns) +
                               "), got " + shape_text(array.shape))
                                  .c_str());
    return array;
}

Vec3f vec3(nb::handle value, const char* what) {
    const FloatArray array = float_array(value, what);
    if (array.buffer.size() != 3)
        throw nb::value_error(
            (std::string(what) + ": expected three numbers, got shape " + shape_text(array.shape)).c_str());
    return {array.buffer[0], array.buffer[1], array.buffer[2]};
}

Rgb rgb(nb::handle value, const char* what) {
    const FloatArray array = float_array(value, what);
    return array.buffer.size() == 1 ? Rgb(array.buffer[0]) : vec3(value, what);
}

using Doubles = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;

static Doubles doubles(nb::handle value, const char* what) {
    try {
        return nb::cast<Doubles>(nb::module_::import_("numpy").attr("ascontiguousarray")(value, "float64"));
    } catch (nb::python_error& error) {
        throw nb::type_error((std::string(what) + ": not an array of numbers: " + error.what()).c_str());
    }
}

static Transform matrix(const double* rows, size_t count) {
    Transform result;
    for (size_t row = 0; row < count; row++)
        for (size_t column = 0; column < 4; column++)
            result.m[row][column] = rows[row * 4 + column];
    return result;
}

Transform transform(nb::handle value, const char* what) {
    if (value.is_none())
        return {};
    const Doubles array = doubles(value, what);
    if (array.ndim() != 2 || array.shape(1) != 4 || (array.shape(0) != 3 && array.shape(0) != 4))
        throw nb::value_error(
            (std::string(what) + ": expected a 4x4 or 3x4 matrix that acts on columns").c_str());
    return matrix(array.data(), array.shape(0));
}

std::vector<double> sample_times(nb::handle times, size_t count, const char* what) {
    std::vector<double> result(count);
    if (times.is_none()) {
        for (size_t i = 0; i < count; i++)
            result[i] = count > 1 ? double(i) / double(count - 1) : 0;
        return result;
    }
    const Doubles array = doubles(times, "times");
    if (array.ndim() != 1 || array.shape(0) != count)
        throw nb::value_error((std::string("times: expected ") + std::to_string(count) +
                               " numbers, as many as " + what + " has")
                                  .c_str());
    std::copy_n(array.data(), count, result.begin());
    for (size_t i = 1; i < count; i++)
        if (!(result[i - 1] < result[i]))
            throw nb::value_error("times: they must rise");
    return result;
}

void check_times(nb::handle times) {
    if (!times.is_none())
        doubles(times, "times");
}

std::vector<TransformKey> transform_keys(nb::handle value, nb::handle times, const char* what) {
    if (value.is_none())
        return {{0, {}}};
    const Doubles array = doubles(value, what);
    if (array.ndim() == 2)
        return {{0, transform(value, what)}};
    if (array.ndim() != 3 || array.shape(0) < 1 || array.shape(2) != 4 ||
        (array.shape(1) != 3 && array.shape(1) != 4))
        throw nb::value_error((std::string(what) +
                               ": expected a 4x4 or 3x4 matrix that acts on columns, or one for "
                               "each time: (T, 4, 4)")
                                  .c_str());
    const std::vector<double> at = sample_times(times, array.shape(0), what);
    std::vector<TransformKey> keys;
    for (size_t i = 0; i < at.size(); i++)
        keys.push_back({at[i], matrix(array.data() + i * array.shape(1) * 4, array.shape(1))});
    return keys;
}

} // namespace kanuka::python
