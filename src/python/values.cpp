#include "python/values.h"

#include <nanobind/stl/vector.h>

#include "python/arguments.h"
#include "python/arrays.h"
#include "scene/text_column.h"

namespace kanuka::python {

using scene::Detail;
using scene::Type;

namespace {

// "[class] [type[n]] name", RISpec's inline declaration; all but the name may be left out.
struct Declaration {
    std::optional<Detail> detail;
    std::optional<Type> type;
    std::optional<int> array_size;
    std::string name;
};

Declaration parse_declaration(const std::string& key) {
    std::vector<std::string> words;
    for (size_t i = 0; i < key.size();) {
        const size_t begin = key.find_first_not_of(' ', i);
        if (begin == std::string::npos)
            break;
        const size_t end = std::min(key.find(' ', begin), key.size());
        words.push_back(key.substr(begin, end - begin));
        i = end;
    }
    if (words.empty())
        throw nb::value_error("a parameter needs a name");
    Declaration result;
    result.name = words.back();
    words.pop_back();
    for (std::string word : words) {
        if (const size_t bracket = word.find('['); bracket != std::string::npos) {
            result.array_size = std::max(1, std::atoi(word.c_str() + bracket + 1));
            word.resize(bracket);
        }
        bool known = false;
        for (int d = 0; d <= int(Detail::FaceVertex); d++)
            if (word == scene::name(Detail(d)))
                result.detail = Detail(d), known = true;
        for (int t = 0; t <= int(Type::Matrix); t++)
            if (word == scene::name(Type(t)) || (word == "int" && Type(t) == Type::Integer))
                result.type = Type(t), known = true;
        if (!known)
            throw nb::value_error(
                ("\"" + key + "\": \"" + word +
                 "\" is neither a class (constant, uniform, varying, vertex, facevarying) nor a type "
                 "(float, integer, string, color, point, vector, normal, hpoint, matrix)")
                    .c_str());
    }
    return result;
}

bool is_text(nb::handle value) {
    return nb::isinstance<nb::str>(value);
}

bool is_list_of_text(nb::handle value) {
    return is_sequence_of_objects(value) && is_text(value[0]);
}

std::string_view text_of(nb::handle value, const std::string& key) {
    Py_ssize_t size = 0;
    const char* text = is_text(value) ? PyUnicode_AsUTF8AndSize(value.ptr(), &size) : nullptr;
    if (!text) {
        PyErr_Clear();
        throw nb::type_error((key + ": expected a text, or a list of texts").c_str());
    }
    return {text, size_t(size)};
}

// As RenderMan has it: for vectors that are rows. Of whole matrices.
scene::Buffer<float> transposed(const scene::Buffer<float>& matrices) {
    std::vector<float> rows(matrices.size());
    for (size_t i = 0; i < rows.size(); i++)
        rows[i] = matrices[i / 16 * 16 + i % 4 * 4 + i / 4 % 4];
    return rows;
}

} // namespace

bool is_sequence_of_objects(nb::handle value) {
    if (!nb::isinstance<nb::sequence>(value) || is_text(value) || PyMemoryView_Check(value.ptr()))
        return false;
    const Py_ssize_t size = PySequence_Size(value.ptr());
    PyErr_Clear(); // NumPy's arrays of no dimension have none
    return size > 0;
}

scene::Value parameter(const std::string& key, nb::handle value) {
    const Declaration declared = parse_declaration(key);
    scene::Value result;
    result.name = declared.name;
    result.detail = declared.detail.value_or(Detail::Uniform);

    if (nb::isinstance<Spectrum>(value)) { // a colour by its text
        result.type = Type::String;
        result.array_size = 1;
        result.strings = std::vector<std::string>{spectrum_text(value, key.c_str())};
        return result;
    }
    if (is_text(value) || is_list_of_text(value)) {
        auto strings =
            is_text(value)
                ? std::vector<std::string>{nb::cast<std::string>(value)}
                : as<std::vector<std::string>>(value, key + ": expected a text, or a list of texts");
        result.type = Type::String;
        result.array_size = declared.array_size.value_or(int(strings.size()));
        result.strings = std::move(strings);
        return result;
    }
    if (declared.type == Type::String)
        throw nb::value_error((key + ": expected a text, or a list of texts").c_str());
    if (declared.type == Type::Integer) {
        const IntArray array = int_array(value, key.c_str());
        result.type = Type::Integer;
        result.array_size = declared.array_size.value_or(int(array.buffer.size()));
        result.ints = array.buffer;
        return result;
    }
    const FloatArray array = float_array(value, key.c_str());
    const size_t count = array.buffer.size();
    if (count == 0)
        throw nb::value_error((key + ": an empty value").c_str());
    Type guess = Type::Float;
    if (!array.shape.empty() && array.shape.back() == 3)
        guess = Type::Color;
    else if (array.shape == std::vector<size_t>{4, 4})
        guess = Type::Matrix;
    result.type = declared.type.value_or(guess);
    const size_t one = size_t(scene::components(result.type));
    if (count % one != 0)
        throw nb::value_error((key + ": " + std::string(scene::name(result.type)) + " takes " +
                               std::to_string(one) + " numbers a value, got " + std::to_string(count))
                                  .c_str());
    result.array_size = declared.array_size.value_or(int(count / one));
    result.floats = array.buffer;
    if (result.type == Type::Matrix)
        result.floats = transposed(array.buffer);
    return result;
}

scene::ValueList parameters(const nb::dict& values) {
    scene::ValueList list;
    for (auto [key, value] : values)
        list.set(parameter(argument<std::string>(key, "a parameter's name"), value));
    return list;
}

scene::Value primvar(const std::string& key, nb::handle value, std::span<const DetailCount> counts,
                     const std::string& what) {
    const std::string& told = what.empty() ? key : what;
    const Declaration declared = parse_declaration(key);
    const bool in_list = is_list_of_text(value) && nb::len(value) == 1;
    if (is_text(value) || in_list)
        return parameter("constant string " + declared.name,
                         in_list ? nb::object(value[0]) : nb::borrow(value));
    if (declared.type == Type::String)
        throw nb::value_error((key + ": a string primvar is one text, for all of the primitive").c_str());
    const FloatArray array = float_array(value, told.c_str());
    const size_t rows = array.shape.empty() ? 1 : array.shape[0];
    const size_t columns = rows ? array.buffer.size() / rows : 0;

    scene::Value result;
    result.name = declared.name;
    if (declared.type == Type::Integer)
        result.ints = int_array(value, key.c_str()).buffer;
    else
        result.floats = array.buffer;
    const auto guess = [&] {
        if (declared.name == "N")
            return Type::Normal;
        return columns == 3 ? Type::Color : columns == 16 ? Type::Matrix : Type::Float;
    };
    result.type = declared.type.value_or(guess());
    if (result.type == Type::Matrix && array.shape == std::vector<size_t>{4, 4}) {
        result.floats = transposed(array.buffer);
        result.detail = Detail::Constant;
        return result;
    }
    // A bare list of three numbers is one color (or point, …), unless there are three vertices and it says
    // nothing.
    const bool three = array.shape.size() == 1 && rows == 3;
    const bool color_by_name = !declared.type && (declared.name == "Cs" || declared.name == "Os");
    if (three && (color_by_name || (declared.type && scene::components(*declared.type) == 3)) &&
        declared.detail.value_or(Detail::Constant) == Detail::Constant) {
        result.detail = Detail::Constant;
        result.type = declared.type.value_or(Type::Color);
        result.array_size = 1;
        return result;
    }
    const size_t one = size_t(scene::components(result.type));
    result.array_size = declared.array_size.value_or(int(std::max<size_t>(1, columns / one)));
    if (columns != one * size_t(result.array_size))
        throw nb::value_error((told + ": shape " + shape_text(array.shape) +
                               " does not hold values of type " + std::string(scene::name(result.type)) +
                               (result.array_size > 1 ? "[" + std::to_string(result.array_size) + "]" : ""))
                                  .c_str());
    if (result.type == Type::Matrix)
        result.floats = transposed(array.buffer);
    std::string expected;
    for (const DetailCount& c : counts) {
        if (rows == c.count && declared.detail.value_or(c.detail) == c.detail) {
            result.detail = c.detail;
            return result;
        }
        expected += (expected.empty() ? "" : ", ") + std::to_string(c.count) + " (" +
                    std::string(scene::name(c.detail)) + ")";
    }
    throw nb::value_error(
        (told + ": " + std::to_string(rows) + " values fit nothing here; one of " + expected).c_str());
}

bool holds_texts(nb::handle value) {
    return is_text(value) || is_list_of_text(value) ||
           (is_sequence_of_objects(value) && is_list_of_text(value[0]));
}

scene::Value texts_of_instances(const std::string& key, nb::handle value, size_t instances) {
    const Declaration declared = parse_declaration(key);
    if (declared.type.value_or(Type::String) != Type::String)
        throw nb::value_error((key + ": expected numbers, got texts").c_str());
    const bool is_nested = !is_text(value) && !is_text(value[0]);
    const size_t width = declared.array_size ? size_t(*declared.array_size)
                         : is_nested         ? nb::len(nb::object(value[0]))
                                             : 1;
    const bool is_one = is_text(value) || (!is_nested && width > 1);
    if (const size_t count = is_one ? 1 : nb::len(value); count != 1 && count != instances)
        throw nb::value_error((key + ": " + std::to_string(count) + " values fit nothing here; one of " +
                               std::to_string(instances) + " (uniform), 1 (constant)")
                                  .c_str());
    scene::TextColumn column(width);
    const auto add = [&](nb::handle one) {
        if (is_text(one) && width == 1) {
            const std::string_view text = text_of(one, key);
            return column.add(std::span(&text, 1));
        }
        const auto texts = as<std::vector<std::string>>(one, key + ": expected lists of texts");
        if (texts.size() != width)
            throw nb::value_error((key + ": expected " + std::to_string(width) + " texts a value, got " +
                                   std::to_string(texts.size()))
                                      .c_str());
        column.add(std::span(texts));
    };
    if (is_one)
        add(value);
    else
        for (const nb::handle each : value)
            add(each);
    scene::Value result;
    result.name = declared.name;
    result.type = Type::String;
    result.array_size = int(width);
    column.move_to(result);
    return result;
}

scene::Value parameter_like(const scene::Value& before, const std::string& key, nb::handle value) {
    scene::Value given = parameter(key, value);
    if (key.find(' ') != std::string::npos || given.type == Type::String || before.type == Type::String)
        return given;
    if (before.type == Type::Integer && given.type == Type::Float) { // beyond what floats can hold
        const nb::object array = nb::module_::import_("numpy").attr("asarray")(value);
        const auto kind = nb::cast<std::string>(array.attr("dtype").attr("kind"));
        return kind == "i" || kind == "u" ? parameter("integer " + key, value) : given;
    }
    // The numbers of matrices change their order.
    const bool is_matrix = before.type == Type::Matrix && given.floats.size() == before.floats.size();
    if ((before.type == Type::Matrix || given.type == Type::Matrix) && before.type != given.type &&
        (is_matrix || before.type != Type::Matrix))
        return parameter((is_matrix ? "matrix " : "float ") + key, value);
    return given;
}

nb::object parameter_of(const scene::Value& v) {
    const size_t one = size_t(scene::components(v.type)), count = v.floats.size() / one;
    if (v.floats.empty() || (one == 1 && v.array_size == 1))
        return value_of(v);
    std::vector<float> numbers(v.floats.begin(), v.floats.end());
    std::vector<size_t> shape;
    if (v.array_size != 1)
        shape.push_back(count);
    if (v.type == Type::Matrix) {
        for (size_t i = 0; i < numbers.size(); i++)
            numbers[i] = v.floats[i / 16 * 16 + i % 4 * 4 + i / 4 % 4];
        shape.push_back(4);
        shape.push_back(4);
    } else if (one > 1) {
        shape.push_back(one);
    }
    return array_of(numbers.data(), shape);
}

nb::object value_of(const scene::Value& v) {
    if (!v.strings.empty()) {
        if (v.strings.size() == 1)
            return nb::cast(v.strings[0]);
        return nb::cast(std::vector<std::string>(v.strings.begin(), v.strings.end()));
    }
    if (!v.ints.empty())
        return v.ints.size() == 1 ? nb::cast(v.ints[0]) : array_of(v.ints.data(), {v.ints.size()});
    if (v.floats.size() == 1)
        return nb::cast(v.floats[0]);
    return array_of(v.floats.data(), {v.floats.size()});
}

} // namespace kanuka::python
