// Reading parameter lists: tokens with their declarations, and values of the declared types.

#include <algorithm>
#include <cmath>
#include <cstring>

#include "ingest/rib/reader.h"

namespace kanuka::ingest {

using scene::Type;
using scene::Value;

// A copy for the scene.
template <class T>
scene::Buffer<T> Reader::kept(const std::vector<T>& values) {
    // Large pages: the system's work for a page counts where so little is done with it. Scenes of more than a
    // few are given blocks that the allocator maps by themselves: among its other pieces, blocks of a page
    // would part what is free into pieces that the next scene cannot use. What is not written takes no
    // memory.
    constexpr size_t FirstBlock = size_t(1) << 18, MappedBlock = size_t(64) << 20, Small = 4096;
    const size_t bytes = values.size() * sizeof(T);
    if (bytes > Small || bytes == 0)
        return std::vector<T>(values);
    if (!m_block || m_block->used + bytes > m_block->size)
        m_block = std::make_shared<Block>(!m_block                    ? FirstBlock
                                          : m_block->size < LargePage ? 2 * m_block->size
                                                                      : MappedBlock);
    auto* const to = reinterpret_cast<T*>(m_block->bytes + m_block->used);
    std::memcpy(to, values.data(), bytes);
    m_block->used += bytes;
    return {to, values.size(), m_block};
}

// A space or bracket in the token means an inline declaration.
static bool is_inline_declaration(std::string_view token) {
    return std::ranges::any_of(token, [](char c) { return c == ' ' || c == '\t' || c == '\n' || c == '['; });
}

bool Reader::read_parameters(Call& call) {
    if (call.spec->params == Params::None)
        return true;
    if (m_lexer->peek() == Token::String)
        call.params.values.reserve(std::clamp<size_t>(m_parameters_before, 1, 8));
    while (m_lexer->peek() == Token::String)
        if (!(m_sink ? read_as_written(call) : read_parameter(call)))
            return false;
    m_parameters_before = call.params.values.size();
    return true;
}

// What kind of token a value is made of: Number, String, Floats, or Close where it is empty.
Token Reader::kind_of_value() {
    Token kind = m_lexer->peek();
    const size_t open = m_lexer->offset();
    if (kind == Token::Open) {
        m_lexer->skip();
        kind = m_lexer->peek();
        m_lexer->seek(open);
        m_lexer->peek();
    }
    return kind;
}

// For a sink: the token and the values as they stand. Whether numbers are integers is all that declarations
// are needed for.
bool Reader::read_as_written(Call& call) {
    Value value;
    value.where = m_lexer->where();
    if (!read_string(m_token))
        return false;
    std::string problem;
    const auto parsed =
        is_inline_declaration(m_token) ? parse_declaration(m_token, true, problem) : std::nullopt;
    const Declaration* declared = parsed ? &parsed->declaration : m_declarations.find(m_token);
    value.name = parsed ? parsed->name : std::string_view(m_token);
    const std::string token = m_token;
    const Token kind = kind_of_value();
    if (kind == Token::String) {
        if (!read_strings(m_strings, value.name))
            return false;
        value.type = Type::String;
        value.strings = std::vector<std::string>(m_strings);
    } else if (kind == Token::Word || kind == Token::End || kind == Token::Bad) {
        m_context.reports.error("parameter without value", value.where,
                                m_request + ": the parameter \"" + token + "\" has no value; found " +
                                    found());
        return false;
    } else if (declared && declared->type == Type::Integer) {
        if (!read_integers(m_ints, value.name))
            return false;
        value.type = Type::Integer;
        value.ints = kept(m_ints);
    } else {
        if (!read_numbers(m_floats, value.name))
            return false;
        value.floats = kept(m_floats);
    }
    call.params.values.push_back(std::move(value));
    call.tokens.push_back(token);
    return true;
}

// The value is made where it will lie. One of the same name takes its place.
bool Reader::read_parameter(Call& call) {
    std::vector<Value>& values = call.params.values;
    const size_t at = values.size();
    values.emplace_back();
    m_take_value = false;
    const bool good = read_parameter(call, values[at]);
    if (!good || !m_take_value) {
        values.pop_back();
        return good;
    }
    for (size_t i = 0; i < at; i++)
        if (values[i].name == values[at].name) {
            values[i] = std::move(values[at]);
            values.pop_back();
            break;
        }
    return true;
}

bool Reader::read_parameter(Call& call, Value& value) {
    value.where = m_lexer->where();
    if (!read_string(m_token))
        return false;
    if (is_inline_declaration(m_token)) {
        std::string problem;
        const auto parsed = parse_declaration(m_token, true, problem);
        if (!parsed) {
            m_context.reports.error("declaration", value.where,
                                    m_request + ": \"" + m_token + "\" was left out: " + problem);
            m_context.reports.at(
                Severity::Info, "declaration form", {},
                "an inline declaration is \"class type[size] name\", as in \"varying float[2] st\"");
            return read_undeclared(call, value); // consumes the value; the caller drops it for want of a name
        }
        value.name = parsed->name;
        const Declaration declaration = parsed->declaration;
        return read_value(call, value, declaration);
    }
    value.name = m_token;
    if (const Declaration* declaration = m_declarations.find(m_token))
        return read_value(call, value, *declaration);
    return read_undeclared(call, value);
}

bool Reader::colors_of_samples(const Call& call, const Value& value, std::vector<float>& numbers) {
    const std::vector<float>& rgb = m_context.options.rgb_from_samples;
    if (rgb.empty())
        return true;
    const size_t n = rgb.size() / 3, colors = numbers.size() / n;
    if (numbers.size() % n != 0) {
        m_context.reports.error("color samples", value.where,
                                std::string(call.spec->name) + ": \"" + value.name + "\": colors have " +
                                    std::to_string(n) + " numbers since ColorSamples, found " +
                                    std::to_string(numbers.size()) + "; the parameter was left out");
        return false;
    }
    std::vector<float> converted(3 * colors, 0.0f);
    for (size_t c = 0; c < colors; c++)
        for (size_t i = 0; i < n; i++)
            for (size_t k = 0; k < 3; k++)
                converted[3 * c + k] += numbers[n * c + i] * rgb[3 * i + k];
    numbers = std::move(converted);
    return true;
}

bool Reader::read_value(Call& call, Value& value, const Declaration& declaration) {
    value.type = declaration.type;
    value.detail = declaration.detail;
    value.array_size = declaration.array_size;
    const Token next = m_lexer->peek();
    const bool text = declaration.type == Type::String;
    if (next != Token::Open && next != Token::Floats && next != Token::Number && next != Token::String) {
        m_context.reports.error("parameter without value", value.where,
                                m_request + ": the parameter \"" + value.name + "\" has no value; found " +
                                    found());
        return false;
    }
    // A value of the wrong kind: strings for numbers or the other way round. It is read as what it is, and
    // dropped.
    const Token kind = kind_of_value();
    if ((kind == Token::String) != text && kind != Token::Close) {
        m_context.reports.error("type of value", value.where,
                                m_request + ": \"" + value.name + "\" is declared as " +
                                    std::string(name(value.type)) + ", found " +
                                    (text ? "numbers" : "strings") +
                                    "; the parameter was left out. Declare it otherwise if that is meant");
        return kind == Token::String ? read_strings(m_strings, value.name)
                                     : read_numbers(m_floats, value.name);
    }
    size_t found;
    if (text) {
        if (!read_strings(m_strings, value.name))
            return false;
        found = m_strings.size();
        value.strings = std::vector<std::string>(m_strings);
    } else if (declaration.type == Type::Integer) {
        if (!read_integers(m_ints, value.name))
            return false;
        found = m_ints.size();
        value.ints = kept(m_ints);
    } else {
        if (!read_numbers(m_floats, value.name))
            return false;
        if (value.type == Type::Color && !colors_of_samples(call, value, m_floats))
            return true;
        found = m_floats.size();
        value.floats = kept(m_floats);
    }
    const size_t components = size_t(scene::components(value.type));
    if (declaration.open_array && found % components == 0) {
        if (found == 0) // an empty array says nothing
            return true;
        value.array_size = int(found / components);
        m_take_value = true;
        return true;
    }
    if (call.spec->params == Params::Primitive || fit_value(call, value, found))
        m_take_value = true;
    return true;
}

// Parameters of shaders, options and attributes hold one element of their type.
bool Reader::fit_value(const Call& call, Value& value, size_t found) {
    const size_t components = size_t(scene::components(value.type));
    const size_t needed = components * size_t(value.array_size);
    if (found == needed)
        return true;
    const bool loose = call.spec->params != Params::Shader;
    if (loose && found > 0 && found % components == 0) {
        value.array_size = int(found / components); // options of other renderers, declared or not
        return true;
    }
    const std::string message = m_request + ": \"" + value.name + "\": expected " + std::to_string(needed) +
                                " values (" + std::string(name(value.type)) +
                                (value.array_size > 1 ? "[" + std::to_string(value.array_size) + "]" : "") +
                                "), found " + std::to_string(found);
    if (found < needed) {
        m_context.reports.error("too few values", value.where, message + "; the parameter was left out");
        return false;
    }
    m_context.reports.warning("too many values", value.where, message + "; the last ones were not used");
    if (value.type == Type::String)
        value.strings = std::vector<std::string>(m_strings.begin(), m_strings.begin() + long(needed));
    else if (value.type == Type::Integer)
        value.ints = std::vector<int32_t>(m_ints.begin(), m_ints.begin() + long(needed));
    else
        value.floats = std::vector<float>(m_floats.begin(), m_floats.begin() + long(needed));
    return true;
}

// A token that nobody declared: options and attributes of other renderers, misspelled parameters.
bool Reader::read_undeclared(Call& call, Value& value) {
    const Token kind = kind_of_value();
    if (kind == Token::String) {
        if (!read_strings(m_strings, value.name))
            return false;
        value.type = Type::String;
        value.array_size = int(std::max<size_t>(m_strings.size(), 1));
        value.strings = std::vector<std::string>(m_strings);
    } else if (kind == Token::Number || kind == Token::Floats || kind == Token::Close) {
        if (!read_numbers(m_floats, value.name))
            return false;
        bool whole = call.spec->params == Params::Option || call.spec->params == Params::Attribute;
        for (const float f : m_floats)
            whole = whole && f == std::trunc(f) && std::abs(f) < 1e6f;
        value.array_size = int(std::max<size_t>(m_floats.size(), 1));
        if (whole) {
            value.type = Type::Integer;
            value.ints = std::vector<int32_t>(m_floats.begin(), m_floats.end());
        } else {
            value.floats = kept(m_floats);
        }
    } else {
        m_context.reports.error("parameter without value", value.where,
                                m_request + ": the parameter \"" + m_token + "\" has no value; found " +
                                    found());
        return false;
    }
    if (value.name.empty())
        return true; // its declaration could not be read, which was said
    const std::string_view nearest = m_declarations.nearest(value.name);
    const std::string mend = "; declare it: \"uniform " + std::string(name(value.type)) + " " + value.name +
                             "\"" +
                             (nearest.empty() ? "" : " (or is \"" + std::string(nearest) + "\" meant?)");
    if (call.spec->params == Params::Primitive) {
        if (value.array_size != 1) {
            m_context.reports.once(Severity::Error, "undeclared primvar " + value.name, value.where,
                                   m_request + ": \"" + value.name + "\" is not declared and was left out" +
                                       mend);
            return true;
        }
        value.detail = scene::Detail::Constant;
    }
    // Of several numbers the shader knows what they are: shade/arguments.cpp.
    const bool several = value.array_size > 1 && value.strings.empty();
    if ((call.spec->params == Params::Shader && !several) || call.spec->params == Params::Primitive)
        m_context.reports.once(
            Severity::Warning, "undeclared parameter " + value.name, value.where,
            m_request + ": \"" + value.name + "\" is not declared and was taken for a " +
                std::string(name(value.type)) +
                (value.array_size > 1 ? "[" + std::to_string(value.array_size) + "]" : "") + mend);
    m_take_value = true;
    return true;
}

} // namespace kanuka::ingest
