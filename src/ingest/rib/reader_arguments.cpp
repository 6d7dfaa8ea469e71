// Reading the arguments that the table of requests asks for.

#include <cmath>
#include <cstdio>

#include "ingest/rib/number.h"
#include "ingest/rib/reader.h"

namespace kanuka::ingest {

int Call::i(size_t k) const {
    const double v = args[k].number;
    return v >= 2147483647.0 ? 2147483647 : v <= -2147483648.0 ? -2147483647 - 1 : v == v ? int(v) : 0;
}

std::string Call::handle(size_t k) const {
    if (args[k].is_text)
        return args[k].text;
    char buffer[40];
    std::snprintf(buffer, sizeof buffer, "%.17g", args[k].number);
    return buffer;
}

// "the end of the arguments" stands as it is, names in quotes.
static std::string in_quotes(std::string_view what) {
    return what.find("the ") == 0 ? std::string(what) : "\"" + std::string(what) + "\"";
}

bool Reader::wrong(const char* expected, std::string_view what) {
    m_context.reports.error("arguments of " + m_request, m_lexer->where(),
                            m_request + ": expected " + expected + " for " + in_quotes(what) + ", found " +
                                found() + "; the request was left out" +
                                (m_call.spec ? ". It takes: " + m_call.spec->usage() : ""));
    return false;
}

bool Reader::read_string(std::string& out) {
    const size_t offset = m_lexer->offset();
    m_lexer->clear_unterminated();
    out = m_lexer->string();
    if (!m_lexer->unterminated())
        return true;
    m_lexer->clear_unterminated();
    m_context.reports.error(
        "string not closed", m_lexer->where(offset),
        m_request + ": the string that starts here is not closed; add a \" at its end. The request "
                    "was left out");
    return false;
}

bool Reader::close_array(size_t open, std::string_view what, const char* elements) {
    const Token next = m_lexer->peek();
    if (next == Token::Close) {
        m_lexer->skip();
        return true;
    }
    bool request = next == Token::End;
    if (next == Token::Word) {
        const size_t offset = m_lexer->offset();
        request = find_request(m_lexer->word()) != nullptr;
        m_lexer->seek(offset);
    }
    if (request) {
        m_context.reports.error("array not closed", m_lexer->where(open),
                                m_request + ": the array of " + in_quotes(what) +
                                    " that starts here is not closed before " + found() +
                                    "; add a ]. The request was left out");
        return false;
    }
    m_context.reports.error("array element", m_lexer->where(),
                            m_request + ": an array of " + elements + " is expected for " + in_quotes(what) +
                                ", found " + found() + " in it; the request was left out");
    return false;
}

bool Reader::read_numbers(std::vector<float>& out, std::string_view what) {
    out.clear();
    const Token next = m_lexer->peek();
    const size_t open = m_lexer->offset();
    m_lexer->not_finite = 0;
    if (next == Token::Floats) {
        m_lexer->binary_floats(out);
    } else if (next == Token::Number) {
        m_lexer->numbers(out); // without brackets: all that follow
    } else if (next == Token::Open) {
        m_lexer->skip();
        m_lexer->numbers(out);
        while (m_lexer->peek() == Token::Floats) { // binary arrays may stand in brackets
            m_lexer->binary_floats(out);
            m_lexer->numbers(out);
        }
        if (!close_array(open, what, "numbers"))
            return false;
    } else {
        return wrong("numbers", what);
    }
    if (m_lexer->not_finite > 0)
        m_context.reports.error("not finite", m_lexer->where(open),
                                m_request + ": " + std::to_string(m_lexer->not_finite) +
                                    " of the numbers for " + in_quotes(what) +
                                    " are not finite (nan or inf); 0 was used instead");
    return true;
}

bool Reader::read_integers(std::vector<int32_t>& out, std::string_view what) {
    out.clear();
    size_t fractions = 0;
    const Token next = m_lexer->peek();
    const size_t open = m_lexer->offset();
    if (next == Token::Floats || next == Token::Number || next == Token::Open) {
        if (next == Token::Open)
            m_lexer->skip();
        for (;;) {
            m_lexer->integers(out, fractions);
            if (m_lexer->peek() != Token::Floats)
                break;
            m_floats.clear();
            m_lexer->binary_floats(m_floats);
            for (const float f : m_floats) {
                fractions += f != std::trunc(f);
                out.push_back(f >= 2147483647.0f    ? 2147483647
                              : f <= -2147483648.0f ? -2147483647 - 1
                              : f == f              ? int32_t(f)
                                                    : 0);
            }
            if (next == Token::Floats)
                break;
        }
    } else {
        return wrong("integers", what);
    }
    if (next == Token::Open && !close_array(open, what, "integers"))
        return false;
    if (fractions > 0)
        m_context.reports.warning("fractions", m_lexer->where(open),
                                  m_request + ": " + std::to_string(fractions) + " of the numbers for " +
                                      in_quotes(what) + " are no integers; their fractions were cut");
    return true;
}

bool Reader::read_strings(std::vector<std::string>& out, std::string_view what) {
    out.clear();
    const Token next = m_lexer->peek();
    if (next == Token::String) {
        out.emplace_back();
        return read_string(out.back());
    }
    if (next != Token::Open)
        return wrong("strings", what);
    const size_t open = m_lexer->offset();
    m_lexer->skip();
    while (m_lexer->peek() == Token::String) {
        out.emplace_back();
        if (!read_string(out.back()))
            return false;
    }
    return close_array(open, what, "strings");
}

bool Reader::read_argument(const ArgSpec& spec, Argument& a, bool& in_brackets) {
    const std::string_view what = spec.name;
    a.given = true;
    switch (spec.type) {
    case ArgType::FloatArray:
        return read_numbers(a.floats, what);
    case ArgType::IntegerArray:
        return read_integers(a.ints, what);
    case ArgType::StringArray:
        return read_strings(a.strings, what);
    case ArgType::Floats:
        if (!in_brackets && m_lexer->peek() != Token::Number) {
            if (!read_numbers(a.floats, what))
                return false;
        } else {
            while (a.floats.size() < spec.count && m_lexer->peek() == Token::Number)
                a.floats.push_back(float(m_lexer->number()));
        }
        if (a.floats.size() == spec.count)
            return true;
        m_context.reports.error("arguments of " + m_request, m_call.where,
                                m_request + ": expected " + std::to_string(spec.count) + " numbers (" +
                                    std::string(spec.name) + "), found " + std::to_string(a.floats.size()) +
                                    "; the request was left out");
        return false;
    case ArgType::BasisMatrix:
        if (m_lexer->peek() == Token::String) {
            a.is_text = true;
            return read_string(a.text);
        }
        if (!read_numbers(a.floats, what))
            return false;
        return a.floats.size() == 16 || wrong("the name of a basis or 16 numbers", what);
    default:
        break;
    }
    // Scalars; several may stand in one pair of brackets.
    if (!in_brackets && m_lexer->peek() == Token::Open) {
        m_lexer->skip();
        in_brackets = true;
    }
    const Token next = m_lexer->peek();
    const bool text = spec.type == ArgType::String;
    const bool either = spec.type == ArgType::Handle || spec.type == ArgType::NewHandle;
    if (next == Token::String && (text || either)) {
        a.is_text = true;
        if (!read_string(a.text))
            return false;
    } else if (next == Token::Number && !text) {
        a.number = m_lexer->number();
        if (spec.type == ArgType::Integer && a.number != std::trunc(a.number))
            m_context.reports.warning("fractions", m_lexer->where(),
                                      m_request + ": " + in_quotes(what) +
                                          " must be an integer; the fraction was cut");
    } else {
        return wrong(text ? "a string" : either ? "a number or a string" : "a number", what);
    }
    if (in_brackets && m_lexer->peek() == Token::Close) {
        m_lexer->skip();
        in_brackets = false;
    }
    return true;
}

// Whether an optional argument stands next.
static bool can_start(Token token, ArgType type) {
    switch (type) {
    case ArgType::Float:
    case ArgType::Integer:
    case ArgType::Floats:
        return token == Token::Number || token == Token::Open;
    case ArgType::String:
        return token == Token::String;
    case ArgType::Handle:
    case ArgType::NewHandle:
        return token == Token::String || token == Token::Number;
    default:
        return token == Token::Open || token == Token::Floats;
    }
}

bool Reader::read_arguments(Call& call) {
    bool in_brackets = false;
    const size_t count = call.spec->arg_count();
    for (size_t i = 0; i < count; i++)
        call.args[i].clear();
    call.params.values.clear();
    call.tokens.clear();
    for (size_t i = 0; i < count; i++) {
        const ArgSpec& spec = call.spec->args[i];
        if (spec.optional && !can_start(m_lexer->peek(), spec.type))
            break;
        if (!read_argument(spec, call.args[i], in_brackets))
            return false;
    }
    return !in_brackets || wrong("]", "the end of the arguments");
}

} // namespace kanuka::ingest
