#include "ingest/rib/lexer.h"

#include <bit>
#include <cmath>
#include <cstring>

#include "ingest/rib/number.h"

namespace kanuka::ingest {

namespace {

enum : uint8_t { Space = 1, WordStart = 2, WordPart = 4, NumberStart = 8 };

constexpr std::array<uint8_t, 256> make_classes() {
    std::array<uint8_t, 256> c{};
    for (const unsigned char s : {' ', '\t', '\n', '\r', '\f', '\v', '\0'})
        c[s] |= Space;
    for (int i = 'a'; i <= 'z'; i++)
        c[size_t(i)] |= WordStart | WordPart;
    for (int i = 'A'; i <= 'Z'; i++)
        c[size_t(i)] |= WordStart | WordPart;
    c['_'] |= WordStart | WordPart;
    for (int i = '0'; i <= '9'; i++)
        c[size_t(i)] |= WordPart | NumberStart;
    for (const unsigned char s : {'+', '-', '.'})
        c[s] |= NumberStart;
    c[':'] |= WordPart;
    return c;
}
constexpr std::array<uint8_t, 256> Classes = make_classes();

inline bool is(char c, uint8_t what) {
    return Classes[static_cast<unsigned char>(c)] & what;
}

} // namespace

Lexer::Lexer(std::shared_ptr<const Source> source, size_t begin, size_t end)
    : Lexer(std::move(source), begin, end, std::make_shared<BinaryDefinitions>()) {}

Lexer::Lexer(std::shared_ptr<const Source> source, size_t begin, size_t end,
             std::shared_ptr<BinaryDefinitions> definitions)
    : m_source(std::move(source)), m_text(m_source->text()), m_at(begin), m_end(std::min(end, m_text.size())),
      m_definitions(std::move(definitions)) {}

void Lexer::skip_space() {
    const char* p = m_text.data() + m_at;
    const char* const end = m_text.data() + m_end;
    for (;;) {
        while (p < end && is(*p, Space))
            p++;
        if (p == end || *p != '#')
            break;
        const char* const start = p;
        while (p < end && *p != '\n' && *p != '\r') // old files end lines by a carriage return alone
            p++;
        if (comments && size_t(start - m_text.data()) >= m_comments_to) {
            comments->push_back({size_t(start - m_text.data()), size_t(p - m_text.data())});
            m_comments_to = comments->back().end;
        }
    }
    m_at = size_t(p - m_text.data());
}

Token Lexer::peek_next() {
    m_space_begin = m_at;
    for (;;) {
        m_binary = false; // what follows a definition may be text
        // Binary tokens stand without space between them.
        if (m_at >= m_end || is(m_text[m_at], Space) || m_text[m_at] == '#')
            skip_space();
        m_token = m_at;
        m_peeked = true;
        if (m_at >= m_end)
            return m_kind = Token::End;
        const char c = m_text[m_at];
        if (is(c, NumberStart))
            return m_kind = Token::Number;
        if (is(c, WordStart))
            return m_kind = Token::Word;
        if (c == '"' || c == '\'') // PRMan takes both
            return m_kind = Token::String;
        if (c == '[')
            return m_kind = Token::Open;
        if (c == ']')
            return m_kind = Token::Close;
        if (static_cast<unsigned char>(c) >= 0200) {
            const size_t before = m_at;
            m_kind = peek_binary(static_cast<unsigned char>(c));
            if (m_kind == Token::End && m_at > before)
                continue; // a definition, no token
            return m_kind;
        }
        return m_kind = Token::Bad;
    }
}

void Lexer::skip() {
    switch (peek()) {
    case Token::Word:
        word();
        break;
    case Token::String:
        string();
        break;
    case Token::Number:
        number();
        break;
    case Token::End:
        break;
    default:
        m_at = m_binary ? m_binary_end : m_at + 1;
    }
    m_peeked = false;
}

std::string_view Lexer::word() {
    m_peeked = false;
    if (m_binary) {
        m_at = m_binary_end;
        return m_binary_text;
    }
    size_t p = m_at;
    while (p < m_end && is(m_text[p], WordPart))
        p++;
    const std::string_view w = m_text.substr(m_at, p - m_at);
    m_at = p;
    return w;
}

bool Lexer::next_line_is_request(size_t at) const {
    while (at < m_end && is(m_text[at], Space))
        at++;
    size_t p = at;
    while (p < m_end && is(m_text[p], WordPart))
        p++;
    return is_request && p > at && is_request(m_text.substr(at, p - at));
}

std::string_view Lexer::string() {
    m_peeked = false;
    if (m_binary) {
        m_at = m_binary_end;
        return m_binary_text;
    }
    // Step 1: strings without escapes need no copy.
    const char quote = m_text[m_at];
    size_t p = m_at + 1;
    const size_t start = p;
    while (p < m_end && m_text[p] != quote && m_text[p] != '\\' && m_text[p] != '\n')
        p++;
    if (p < m_end && m_text[p] == quote) {
        m_at = p + 1;
        return m_text.substr(start, p - start);
    }
    // Step 2: the rest, with C's escapes. A backslash before a line break joins the lines (RISpec appendix
    // C.1).
    m_scratch.assign(m_text.substr(start, p - start));
    while (p < m_end && m_text[p] != quote) {
        char c = m_text[p];
        if (c == '\n' && next_line_is_request(p)) {
            m_unterminated = true;
            m_at = p;
            return m_scratch;
        }
        if (c != '\\' || p + 1 >= m_end) {
            m_scratch += c;
            p++;
            continue;
        }
        c = m_text[++p];
        if (c >= '0' && c <= '7') {
            int code = 0, n = 0;
            for (; n < 3 && p < m_end && m_text[p] >= '0' && m_text[p] <= '7'; n++, p++)
                code = code * 8 + (m_text[p] - '0');
            m_scratch += char(code);
            continue;
        }
        p++;
        switch (c) {
        case 'n':
            m_scratch += '\n';
            break;
        case 'r':
            m_scratch += '\r';
            break;
        case 't':
            m_scratch += '\t';
            break;
        case 'b':
            m_scratch += '\b';
            break;
        case 'f':
            m_scratch += '\f';
            break;
        case '\n':
            break;
        case '\r':
            p += p < m_end && m_text[p] == '\n' ? 1 : 0;
            break;
        default:
            m_scratch += c; // \\, \", and any other character stands for itself
        }
    }
    if (p >= m_end) {
        // Nothing closes it: take its own line as the string, so that the lines after it are read.
        m_unterminated = true;
        const size_t newline = m_text.substr(0, m_end).find('\n', start);
        p = newline == std::string_view::npos ? m_end : newline;
        m_scratch.assign(m_text.substr(start, p - start));
        m_at = p;
        return m_scratch;
    }
    m_at = p + 1;
    return m_scratch;
}

double Lexer::number(bool* integer) {
    m_peeked = false;
    if (m_binary) {
        m_at = m_binary_end;
        if (integer)
            *integer = m_binary_integer;
        return m_binary_number;
    }
    const ScannedNumber n = scan_number(m_text.data() + m_at, m_text.data() + m_end);
    if (!n.end) { // a lone sign or point
        m_at++;
        if (integer)
            *integer = false;
        return 0;
    }
    m_at = size_t(n.end - m_text.data());
    if (integer)
        *integer = n.integer;
    return n.value;
}

// "nan", "-inf", "-nan(ind)", "1.#QNAN", "-1.#IND00": where C libraries left them in a file. Null = none of
// these.
const char* Lexer::skip_not_finite(const char* p) const {
    const char* const end = m_text.data() + m_end;
    const char* q = p + (p < end && (*p == '-' || *p == '+'));
    const auto matches = [&](std::string_view word) {
        for (size_t i = 0; i < word.size(); i++)
            if (q + i >= end || (q[i] | 0x20) != word[i])
                return false;
        return true;
    };
    const bool word = matches("nan") || matches("inf");
    const bool microsoft = end - q > 3 && *q == '1' && q[1] == '.' && q[2] == '#';
    if (!word && !microsoft)
        return nullptr;
    while (q < end && (is(*q, WordPart | NumberStart) || *q == '#' || *q == '(' || *q == ')'))
        q++;
    return q;
}

void Lexer::numbers(std::vector<float>& out) {
    m_peeked = false;
    const char* const end = m_text.data() + m_end;
    for (;;) {
        const char* p = m_text.data() + m_at;
        // The inner loop of every large file: spaces and numbers alone.
        for (;;) {
            while (p < end && is(*p, Space))
                p++;
            if (p == end || !is(*p, NumberStart))
                break;
            const ScannedNumber n = scan_number(p, end);
            if (!n.end || (n.end < end && *n.end == '#'))
                break;
            out.push_back(to_float(n, p));
            p = n.end;
        }
        m_at = size_t(p - m_text.data());
        const Token next = peek();
        if (next != Token::Number && next != Token::Word)
            return;
        p = m_text.data() + m_at;
        if (m_binary) {
            if (next == Token::Word)
                return;
            out.push_back(float(number()));
        } else if (const char* after = skip_not_finite(p)) {
            out.push_back(0);
            not_finite++;
            m_at = size_t(after - m_text.data());
        } else if (next == Token::Number && scan_number(p, end).end) {
            out.push_back(float(number())); // with a comment glued to it
        } else {
            return;
        }
        if (!std::isfinite(out.back())) {
            out.back() = 0;
            not_finite++;
        }
        m_peeked = false;
    }
}

void Lexer::integers(std::vector<int32_t>& out, size_t& fractions) {
    m_peeked = false;
    const char* const end = m_text.data() + m_end;
    const auto add = [&](double v) {
        fractions += v != std::trunc(v);
        v = v < -2147483648.0 ? -2147483648.0 : v > 2147483647.0 ? 2147483647.0 : v;
        out.push_back(int32_t(v));
    };
    for (;;) {
        const char* p = m_text.data() + m_at;
        for (;;) {
            while (p < end && is(*p, Space))
                p++;
            if (p == end || !is(*p, NumberStart))
                break;
            // Up to nine digits and then a space: no need of floating point.
            uint32_t v = 0;
            const char* q = p;
            if (ShortNumber n; end - p >= 32 && scan_short(p, n) && !n.point && n.length <= 9) {
                v = uint32_t(n.mantissa);
                q += n.length;
            } else {
                while (q < end && unsigned(*q - '0') < 10 && q - p < 9)
                    v = v * 10 + unsigned(*q++ - '0');
            }
            if (q > p && (q == end || is(*q, Space) || *q == ']')) {
                out.push_back(int32_t(v));
                p = q;
                continue;
            }
            const ScannedNumber n = scan_number(p, end);
            if (!n.end)
                break;
            add(n.value);
            p = n.end;
        }
        m_at = size_t(p - m_text.data());
        const Token next = peek();
        if (next != Token::Number || (!m_binary && !scan_number(m_text.data() + m_at, end).end))
            return;
        if (m_binary)
            add(number());
        m_peeked = false;
    }
}

} // namespace kanuka::ingest
