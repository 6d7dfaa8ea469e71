#include "ingest/rib/writer.h"

#include <bit>
#include <charconv>
#include <cmath>
#include <utility>

namespace kanuka::ingest {

namespace {

constexpr size_t LineLength = 100;
constexpr size_t BufferSize = size_t(1) << 18;

// Integers up to 2^53 are themselves; all else is a float in the scene.
bool is_integer(double v) {
    return v == std::trunc(v) && std::abs(v) <= 9007199254740992.0 && !(v == 0 && std::signbit(v));
}

size_t format_number(char* to, double v) {
    if (is_integer(v))
        return size_t(std::to_chars(to, to + 32, int64_t(v)).ptr - to);
    const double limit = double(std::numeric_limits<float>::max());
    const float f = v > limit ? float(limit) : v < -limit ? -float(limit) : float(v);
    return size_t(std::to_chars(to, to + 32, std::isfinite(f) ? f : 0.0f).ptr - to);
}

bool is_structure(const std::string& line) {
    return line.starts_with("##");
}

} // namespace

void Writer::flush() {
    settle();
    m_output.write(m_buffer);
    m_buffer.clear();
    m_line = 0;
}

// ---- tokens -----------------------------------------------------------------------------------------

void Writer::separate(size_t length) {
    if (m_buffer.size() == m_line)
        return;
    const char last = m_buffer.back();
    if (m_buffer.size() - m_line + length > LineLength && last != '[') {
        m_buffer += '\n';
        m_line = m_buffer.size();
    } else if (last != '[') {
        m_buffer += ' ';
    }
}

void Writer::big_endian(uint64_t value, int bytes) {
    for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8)
        m_buffer += char(value >> shift & 255);
}

static int bytes_of(uint64_t v) {
    return v < 256 ? 1 : v < 65536 ? 2 : v < 16777216 ? 3 : 4;
}

void Writer::verbatim(std::string_view text) {
    if (!m_loose && binary() && !m_buffer.empty() && m_buffer.back() != '\n')
        m_buffer += '\n';
    m_buffer += text;
    m_loose = text.empty() ? m_loose : text.back() != '\n';
    m_line = m_buffer.size();
}

void Writer::settle() {
    if (std::exchange(m_loose, false))
        end_line();
}

void Writer::end_line() {
    m_buffer += '\n';
    m_line = m_buffer.size();
}

void Writer::request(std::string_view name) {
    settle();
    if (!binary()) {
        m_buffer += name;
        return;
    }
    const RequestSpec* spec = find_request(name);
    if (!spec || m_requests.size() >= 256) { // unknown to the table: as a word
        m_buffer += '\n';
        m_buffer += name;
        m_buffer += ' ';
        return;
    }
    const auto [entry, first] = m_requests.emplace(spec->name, int(m_requests.size()));
    if (first) {
        m_buffer += '\314';
        m_buffer += char(entry->second);
        string_bytes(name);
    }
    m_buffer += '\246';
    m_buffer += char(entry->second);
}

void Writer::number(double v) {
    if (!binary()) {
        char text[40];
        const size_t n = format_number(text, v);
        separate(n);
        m_buffer.append(text, n);
        return;
    }
    if (is_integer(v) && std::abs(v) < 2147483648.0) {
        const auto i = int64_t(v);
        const int bytes = i >= -128 && i < 128           ? 1
                          : i >= -32768 && i < 32768     ? 2
                          : i >= -8388608 && i < 8388608 ? 3
                                                         : 4;
        m_buffer += char(0200 + bytes - 1);
        big_endian(uint64_t(i), bytes);
    } else if (is_integer(v)) {
        m_buffer += '\245';
        big_endian(std::bit_cast<uint64_t>(v), 8);
    } else {
        const double limit = double(std::numeric_limits<float>::max());
        const float f = v > limit ? float(limit) : v < -limit ? -float(limit) : float(v);
        m_buffer += '\244';
        big_endian(std::bit_cast<uint32_t>(std::isfinite(f) ? f : 0.0f), 4);
    }
}

void Writer::string_bytes(std::string_view text) {
    if (text.size() < 16) {
        m_buffer += char(0220 + text.size());
    } else {
        const int bytes = bytes_of(text.size());
        m_buffer += char(0240 + bytes - 1);
        big_endian(text.size(), bytes);
    }
    m_buffer += text;
}

void Writer::string(std::string_view text) {
    if (binary()) {
        string_bytes(text);
        return;
    }
    separate(text.size() + 2);
    m_buffer += '"';
    for (const char c : text) {
        const auto code = static_cast<unsigned char>(c);
        switch (c) {
        case '"':
        case '\\':
            m_buffer += '\\';
            m_buffer += c;
            break;
        case '\n':
            m_buffer += "\\n";
            break;
        case '\r':
            m_buffer += "\\r";
            break;
        case '\t':
            m_buffer += "\\t";
            break;
        default:
            if (code < 32 || code == 127) {
                m_buffer += '\\';
                m_buffer += char('0' + (code >> 6));
                m_buffer += char('0' + (code >> 3 & 7));
                m_buffer += char('0' + (code & 7));
            } else {
                m_buffer += c;
            }
        }
    }
    m_buffer += '"';
}

void Writer::token(std::string_view text) {
    if (!binary()) {
        string(text);
        return;
    }
    const auto known = m_tokens.find(std::string(text));
    uint32_t code;
    if (known != m_tokens.end()) {
        code = known->second;
    } else if (m_tokens.size() >= 65536) {
        string_bytes(text);
        return;
    } else {
        code = uint32_t(m_tokens.size());
        m_tokens.emplace(std::string(text), code);
        m_buffer += code < 256 ? '\315' : '\316';
        big_endian(code, code < 256 ? 1 : 2);
        string_bytes(text);
    }
    m_buffer += code < 256 ? '\317' : '\320';
    big_endian(code, code < 256 ? 1 : 2);
}

void Writer::open() {
    if (!binary())
        separate(1);
    m_buffer += '[';
}

void Writer::close() {
    m_buffer += ']';
}

void Writer::end_request() {
    if (!binary())
        m_buffer += '\n';
    m_line = m_buffer.size();
    if (m_buffer.size() > BufferSize)
        flush();
}

void Writer::comment(std::string_view text) {
    settle();
    std::string line(text);
    while (!line.empty() && (line.back() == ' ' || line.back() == '\r' || line.back() == '\n'))
        line.pop_back();
    if (binary() && !m_buffer.empty() && is_structure(line) && m_buffer.back() != '\n')
        m_buffer += '\n'; // structure hints begin a line
    m_buffer += line;
    end_line();
}

void Writer::numbers(const float* values, size_t count, bool brackets) {
    if (binary() && brackets) {
        const int bytes = bytes_of(count);
        m_buffer += char(0310 + bytes - 1);
        big_endian(count, bytes);
        const size_t at = m_buffer.size();
        m_buffer.resize(at + 4 * count);
        for (size_t i = 0; i < count; i++) {
            const uint32_t bits = __builtin_bswap32(std::bit_cast<uint32_t>(values[i]));
            __builtin_memcpy(m_buffer.data() + at + 4 * i, &bits, 4);
        }
        return;
    }
    if (brackets)
        open();
    for (size_t i = 0; i < count; i++) {
        number(double(values[i]));
        if (m_buffer.size() > 4 * BufferSize) { // of a large array: the line goes on
            const std::string line = m_buffer.substr(m_line);
            m_buffer.resize(m_line);
            flush();
            m_buffer = line;
        }
    }
    if (brackets)
        close();
}

// ---- calls ------------------------------------------------------------------------------------------

void Writer::argument(const ArgSpec& spec, const Argument& a) {
    switch (spec.type) {
    case ArgType::None:
        return;
    case ArgType::Float:
    case ArgType::Integer:
        number(a.number);
        return;
    case ArgType::String:
        string(a.text);
        return;
    case ArgType::Handle:
    case ArgType::NewHandle:
        if (a.is_text)
            string(a.text);
        else
            number(a.number);
        return;
    case ArgType::Floats:
        numbers(a.floats.data(), a.floats.size(), spec.count == 16);
        return;
    case ArgType::BasisMatrix:
        if (a.is_text)
            string(a.text);
        else
            numbers(a.floats.data(), a.floats.size(), true);
        return;
    case ArgType::FloatArray:
        numbers(a.floats.data(), a.floats.size(), true);
        return;
    case ArgType::IntegerArray:
        open();
        for (const int32_t i : a.ints)
            number(i);
        close();
        return;
    case ArgType::StringArray:
        open();
        for (const std::string& s : a.strings)
            string(s);
        close();
        return;
    }
}

static std::string inline_declaration(const scene::Value& v) {
    std::string s(name(v.detail));
    s += " " + std::string(name(v.type));
    if (v.array_size > 1)
        s += "[" + std::to_string(v.array_size) + "]";
    return s + " " + v.name;
}

void Writer::parameter(std::string_view text, const scene::Value& value) {
    token(text);
    if (!value.strings.empty()) {
        open();
        for (const std::string& s : value.strings)
            string(s);
        close();
    } else if (!value.ints.empty()) {
        open();
        for (const int32_t i : value.ints)
            number(i);
        close();
    } else {
        numbers(value.floats.data(), value.floats.size(), true);
    }
}

void Writer::call(const Call& call) {
    const RequestSpec& spec = *call.spec;
    request(spec.name);
    for (size_t i = 0; i < spec.arg_count(); i++) {
        if (spec.args[i].optional && !call.args[i].given)
            break;
        argument(spec.args[i], call.args[i]);
    }
    for (size_t i = 0; i < call.params.values.size(); i++) {
        const scene::Value& value = call.params.values[i];
        if (i < call.tokens.size())
            parameter(call.tokens[i], value);
        else
            parameter(inline_declaration(value), value);
    }
    end_request();
}

} // namespace kanuka::ingest
