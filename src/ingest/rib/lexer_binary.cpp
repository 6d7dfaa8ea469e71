// The binary encodings of RIB, RISpec 3.2 appendix C.2. All numbers are big-endian.
//
//   0200 + 4d + w   a signed number of w + 1 bytes, d of them behind the point
//   0220 + n        a string of n bytes, n < 16              0240 + w   a string, its length in w + 1 bytes
//   0244, 0245      an IEEE float, double                    0246 c     the request defined as code c
//   0310 + w        an array of floats, its length in w + 1 bytes
//   0314 c string   defines request code c
//   0315 + w        code (w + 1 bytes), string: defines a string
//   0317 + w        code (w + 1 bytes): the string so defined

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "ingest/rib/lexer.h"

namespace kanuka::ingest {

uint64_t Lexer::big_endian(size_t at, int bytes) const {
    uint64_t v = 0;
    for (int i = 0; i < bytes; i++)
        v = v << 8 | static_cast<unsigned char>(m_text[at + size_t(i)]);
    return v;
}

// A string in binary or in quotes (without escapes: definitions are made by writers).
bool Lexer::binary_string(size_t at, std::string_view& out, size_t& after) const {
    if (at >= m_end)
        return false;
    const auto c = static_cast<unsigned char>(m_text[at]);
    if (c == '"') {
        const size_t close = m_text.substr(0, m_end).find('"', at + 1);
        if (close == std::string_view::npos)
            return false;
        out = m_text.substr(at + 1, close - at - 1);
        after = close + 1;
        return true;
    }
    size_t length = 0, start = 0;
    if (c >= 0220 && c < 0240) {
        length = c - 0220u;
        start = at + 1;
    } else if (c >= 0240 && c < 0244) {
        const size_t w = c - 0240u + 1;
        if (m_end - at < 1 + w)
            return false;
        length = big_endian(at + 1, int(w));
        start = at + 1 + w;
    } else {
        return false;
    }
    if (length > m_end - start)
        return false;
    out = m_text.substr(start, length);
    after = start + length;
    return true;
}

// A signed number with a fixed point.
Token Lexer::peek_fixed(unsigned char c) {
    const int bytes = (c & 3) + 1, behind = (c >> 2) & 3;
    if (!take(size_t(bytes) + 1))
        return Token::Bad;
    const int shift = 64 - 8 * bytes; // sign extension
    const auto v = int64_t(big_endian(m_at + 1, bytes) << shift) >> shift;
    m_binary_number = double(v) / double(int64_t(1) << (8 * behind));
    m_binary_integer = behind == 0;
    m_binary_end = m_at + 1 + size_t(bytes);
    return Token::Number;
}

// An IEEE number of 4 or 8 bytes.
Token Lexer::peek_ieee(int bytes) {
    if (!take(size_t(bytes) + 1))
        return Token::Bad;
    const uint64_t bits = big_endian(m_at + 1, bytes);
    m_binary_number = bytes == 4 ? double(std::bit_cast<float>(uint32_t(bits))) : std::bit_cast<double>(bits);
    m_binary_integer = false;
    m_binary_end = m_at + 1 + size_t(bytes);
    return Token::Number;
}

// An array of floats, whose length is in w bytes.
Token Lexer::peek_floats(size_t w) {
    if (!take(1 + w))
        return Token::Bad;
    const size_t count = big_endian(m_at + 1, int(w));
    if (count > (m_end - m_at - 1 - w) / 4)
        return Token::Bad;
    m_binary_end = m_at + 1 + w + 4 * count;
    return Token::Floats;
}

Token Lexer::peek_request() {
    if (!take(2))
        return Token::Bad;
    m_binary_text = m_definitions->requests[static_cast<unsigned char>(m_text[m_at + 1])];
    m_binary_end = m_at + 2;
    return m_binary_text.empty() ? Token::Bad : Token::Word;
}

Token Lexer::define_request() {
    std::string_view name;
    size_t after;
    if (!take(2) || !binary_string(m_at + 2, name, after))
        return Token::Bad;
    const auto letter = [](char x) { return (x >= 'A' && x <= 'Z') || (x >= 'a' && x <= 'z') || x == '_'; };
    const bool word = !name.empty() && letter(name[0]) && std::ranges::all_of(name, [&](char x) {
        return letter(x) || (x >= '0' && x <= '9') || x == ':';
    });
    // What is no word names no request.
    m_definitions->requests[static_cast<unsigned char>(m_text[m_at + 1])] = word ? name : std::string_view();
    m_at = after;
    return Token::End;
}

// A string by its code, which is in w bytes.
Token Lexer::peek_defined_string(int w) {
    if (!take(1 + size_t(w)))
        return Token::Bad;
    const size_t code = big_endian(m_at + 1, w);
    m_binary_end = m_at + 1 + size_t(w);
    if (code >= m_definitions->strings.size() || !m_definitions->strings[code].data())
        return Token::Bad;
    m_binary_text = m_definitions->strings[code];
    return Token::String;
}

Token Lexer::define_string(int w) {
    std::string_view text;
    size_t after;
    if (!take(1 + size_t(w)) || !binary_string(m_at + 1 + size_t(w), text, after))
        return Token::Bad;
    const size_t code = big_endian(m_at + 1, w);
    if (code >= m_definitions->strings.size())
        m_definitions->strings.resize(w == 1 ? 256 : 65536);
    m_definitions->strings[code] = text.data() ? text : std::string_view("");
    m_at = after;
    return Token::End;
}

// Decodes the token at m_at. Definitions are taken in, m_at moves on, and End is returned.
Token Lexer::peek_binary(unsigned char c) {
    m_binary = true;
    m_binary_end = m_at + 1;
    if (c < 0220)
        return peek_fixed(c);
    if (c < 0244)
        return binary_string(m_at, m_binary_text, m_binary_end) ? Token::String : Token::Bad;
    if (c == 0244 || c == 0245)
        return peek_ieee(c == 0244 ? 4 : 8);
    if (c == 0246)
        return peek_request();
    if (c >= 0310 && c < 0314)
        return peek_floats(c - 0310u + 1);
    if (c == 0314)
        return define_request();
    if (c == 0315 || c == 0316)
        return define_string(c - 0315 + 1);
    if (c == 0317 || c == 0320)
        return peek_defined_string(c - 0317 + 1);
    return Token::Bad; // 0247 to 0307 and 0321 to 0377 are reserved
}

// Turns the bytes of each around, makes 0 of nan and inf, and counts those. Without a branch, so that several
// go at a time.
__attribute__((optimize("O3"))) static uint32_t take_floats(const char* from, size_t count, float* to) {
    constexpr uint32_t Exponent = 0x7f800000;
    uint32_t not_finite = 0;
    for (size_t i = 0; i < count; i++) {
        uint32_t bits;
        std::memcpy(&bits, from + 4 * i, 4);
        bits = __builtin_bswap32(bits);
        const uint32_t bad = (bits & Exponent) == Exponent;
        not_finite += bad;
        bits &= bad - 1;
        std::memcpy(to + i, &bits, 4);
    }
    return not_finite;
}

void Lexer::binary_floats(std::vector<float>& out) {
    const size_t w = static_cast<unsigned char>(m_text[m_at]) - 0310u + 1;
    const size_t count = big_endian(m_at + 1, int(w));
    const char* p = m_text.data() + m_at + 1 + w;
    const size_t base = out.size();
    out.resize(base + count);
    not_finite += take_floats(p, count, out.data() + base);
    m_at = m_binary_end;
    m_peeked = false;
}

} // namespace kanuka::ingest
