#include "shade/arguments.h"

namespace kanuka::shade {

namespace {

std::string_view name(sl::Type type) {
    return sl::type_name(type);
}

int floats_of(sl::Type type) {
    return sl::components(type);
}

bool is_triple(scene::Type type) {
    return type == scene::Type::Point || type == scene::Type::Vector || type == scene::Type::Normal;
}

// Points, vectors and normals stand for one another: scenes mix them up freely, and the shader's type says
// how the value transforms. Everything else must be what the parameter is.
bool fits(scene::Type value, sl::Type parameter) {
    switch (parameter) {
    case sl::Type::Float:
        return value == scene::Type::Float || value == scene::Type::Integer;
    case sl::Type::Color:
        return value == scene::Type::Color;
    case sl::Type::Point:
    case sl::Type::Vector:
    case sl::Type::Normal:
        return is_triple(value) || (value == scene::Type::HPoint && parameter == sl::Type::Point);
    case sl::Type::Matrix:
        return value == scene::Type::Matrix;
    case sl::Type::String:
    case sl::Type::Shader: // by its handle
        return value == scene::Type::String;
    }
    return false;
}

void transform_matrix(float* values, const Transform& current_from_space) {
    // A shader's matrix is RenderMan's, for row vectors: current rows = rows of the space times
    // current_from_space^T.
    Transform rows;
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++)
            rows.m[size_t(j)][size_t(i)] = values[4 * i + j];
    const Transform current = current_from_space * rows;
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++)
            values[4 * i + j] = float(current.m[size_t(j)][size_t(i)]);
}

void to_current(std::vector<float>& values, sl::Type type, const Transform& current_from_space) {
    if (type == sl::Type::Matrix) {
        for (size_t i = 0; i + 16 <= values.size(); i += 16)
            transform_matrix(&values[i], current_from_space);
        return;
    }
    const Transform inverse =
        type == sl::Type::Normal ? inverse_or_identity(current_from_space) : Transform{};
    for (size_t i = 0; i + 3 <= values.size(); i += 3) {
        Vec3f v(values[i], values[i + 1], values[i + 2]);
        if (type == sl::Type::Point)
            v = current_from_space.point(v);
        else if (type == sl::Type::Vector)
            v = current_from_space.vector(v);
        else if (type == sl::Type::Normal)
            v = current_from_space.normal(v, inverse);
        else
            return;
        values[i] = v.x, values[i + 1] = v.y, values[i + 2] = v.z;
    }
}

std::string declaration(sl::Type type, int array_size) {
    return std::string(name(type)) + (array_size > 0 ? "[" + std::to_string(array_size) + "]" : "");
}

// Plain numbers, which is what a reader makes of a value that nobody declared, are what the shader declares,
// if there are as many. A matrix is its 16 numbers for who declares these.
bool is_meant(const scene::Value& value, const sl::Parameter& parameter) {
    const bool is_plain = value.type == scene::Type::Float ||
                          (value.type == scene::Type::Matrix && parameter.type == sl::Type::Float);
    return is_plain && parameter.type < sl::Type::String && value.floats.size() > 1 &&
           value.floats.size() == size_t(floats_of(parameter.type) * std::max(1, parameter.array_size));
}

std::vector<float> divided_by_w(const std::vector<float>& points) {
    std::vector<float> out;
    for (size_t i = 0; i + 4 <= points.size(); i += 4)
        for (size_t k = 0; k < 3; k++)
            out.push_back(points[i + 3] != 0 ? points[i + k] / points[i + 3] : points[i + k]);
    return out;
}

// The value as an argument in the space it came from; false = reported and skipped.
bool convert(const scene::Value& value, const sl::Parameter& parameter, const std::string& shader,
             const Location& where, Journal& journal, sl::Argument& argument) {
    const std::string expected = declaration(parameter.type, parameter.array_size);
    if (!fits(value.type, parameter.type) && !is_meant(value, parameter)) {
        journal.warning(where,
                        "parameter \"" + parameter.name + "\" of shader \"" + shader + "\" is a " + expected +
                            ", not a " + std::string(scene::name(value.type)) +
                            (value.array_size > 1 ? "[" + std::to_string(value.array_size) + "]" : "") +
                            "; its default is kept. Declare it \"" + expected + " " + parameter.name + "\"");
        return false;
    }
    argument.name = parameter.name;
    argument.floats.assign(value.floats.begin(), value.floats.end());
    argument.strings.assign(value.strings.begin(), value.strings.end());
    if (value.type == scene::Type::Integer)
        argument.floats.assign(value.ints.begin(), value.ints.end());
    if (value.type == scene::Type::HPoint)
        argument.floats = divided_by_w(argument.floats);
    const size_t found =
        parameter.type >= sl::Type::String ? argument.strings.size() : argument.floats.size();
    const size_t one = size_t(floats_of(parameter.type));
    const size_t wanted =
        parameter.resizable ? found / one * one : one * size_t(std::max(1, parameter.array_size));
    if (found < wanted) {
        journal.warning(where, "parameter \"" + parameter.name + "\" of shader \"" + shader + "\" (" +
                                   expected + ") takes " + std::to_string(wanted) + " values, " +
                                   std::to_string(found) + " are given; its default is kept");
        return false;
    }
    if (parameter.type >= sl::Type::String)
        argument.strings.resize(wanted);
    else
        argument.floats.resize(wanted);
    return true;
}

std::string known_names(const sl::Shader& shader) {
    std::string all;
    for (const sl::Parameter& p : shader.parameters())
        all += (all.empty() ? "" : ", ") + p.name;
    return all.empty() ? "it has none" : "it has " + all;
}

void put(std::vector<sl::Argument>& arguments, sl::Argument argument) {
    for (sl::Argument& a : arguments)
        if (a.name == argument.name) {
            a = std::move(argument);
            return;
        }
    arguments.push_back(std::move(argument));
}

} // namespace

bool is_constant(const scene::Value& primvar) {
    return primvar.detail == scene::Detail::Constant ||
           (primvar.detail == scene::Detail::Uniform && primvar.items() == 1);
}

std::vector<sl::Argument> bind_arguments(const sl::Shader& shader, const scene::ShaderRef& ref,
                                         const scene::ValueList& primvars, const Spaces& spaces,
                                         Journal& journal) {
    std::vector<sl::Argument> arguments;
    const auto parameter = [&](const std::string& name) -> const sl::Parameter* {
        for (const sl::Parameter& p : shader.parameters())
            if (p.name == name)
                return &p;
        return nullptr;
    };
    for (const scene::Value& value : ref.parameters.values) {
        const Location& where = value.where.line > 0 ? value.where : ref.where;
        if (value.name.starts_with(':')) // what layers are connected by
            continue;
        const sl::Parameter* p = parameter(value.name);
        if (!p) {
            journal.warning(where, "shader \"" + ref.name + "\" has no parameter \"" + value.name + "\"; " +
                                       known_names(shader));
            continue;
        }
        sl::Argument argument;
        if (!convert(value, *p, ref.name, where, journal, argument))
            continue;
        to_current(argument.floats, p->type, spaces.current_from_shader);
        put(arguments, std::move(argument));
    }
    for (const scene::Value& value : primvars.values) {
        const sl::Parameter* p = parameter(value.name);
        if (!p)
            continue; // a primvar need not be for this shader
        const Location& where = value.where.line > 0 ? value.where : ref.where;
        sl::Argument argument;
        if (is_constant(value)) {
            if (!convert(value, *p, ref.name, where, journal, argument))
                continue;
            to_current(argument.floats, p->type, spaces.current_from_object);
        } else if (!fits(value.type, p->type) || p->type >= sl::Type::String || p->array_size > 0 ||
                   p->resizable) {
            journal.warning(where, "primitive variable \"" + value.name + "\" (" +
                                       std::string(scene::name(value.detail)) + " " +
                                       std::string(scene::name(value.type)) + ") does not fit parameter \"" +
                                       p->name + "\" (" + declaration(p->type, p->array_size) +
                                       ") of shader \"" + ref.name + "\"; it is not used there");
            continue;
        } else {
            argument.name = p->name;
            argument.varying = true;
        }
        put(arguments, std::move(argument));
    }
    return arguments;
}

std::string serialize(const std::vector<sl::Argument>& arguments) {
    std::string bytes;
    for (const sl::Argument& a : arguments) {
        bytes += a.name + '\0' + (a.varying ? 'v' : 'c') + std::to_string(a.floats.size()) + ':';
        bytes.append(reinterpret_cast<const char*>(a.floats.data()), a.floats.size() * sizeof(float));
        for (const std::string& s : a.strings)
            bytes += std::to_string(s.size()) + ':' + s;
        bytes += '\n';
    }
    return bytes;
}

void add_colors(std::vector<sl::Argument>& arguments, const Rgb& given, const DefaultSurface& coverage) {
    if (coverage.varying_color) {
        sl::Argument color;
        color.name = "Cs";
        color.varying = true;
        arguments.push_back(std::move(color));
    }
    sl::Argument opacity;
    opacity.name = "Os";
    opacity.varying = coverage.varying_presence;
    if (!opacity.varying)
        opacity.floats = {given.x, given.y, given.z};
    arguments.push_back(std::move(opacity));
}

} // namespace kanuka::shade
