// Tokens of RIB: ASCII, and the binary encodings of RISpec 3.2 appendix C.2, which may be mixed byte by byte.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "ingest/rib/source.h"

namespace kanuka::ingest {

enum class Token : uint8_t { End, Word, Number, String, Open, Close, Floats, Bad };

// What a binary stream has defined so far: requests by code (0314), strings by code (0315, 0316).
struct BinaryDefinitions {
    std::array<std::string_view, 256> requests{};
    std::vector<std::string_view> strings; // null data = not defined
};

// Reads forward over part of a source. peek() finds the next token without consuming it; the reading calls
// consume it. No token is copied: strings without escapes and words are views into the source.
class Lexer {
  public:
    Lexer(std::shared_ptr<const Source> source, size_t begin, size_t end);
    // Part of a source that was read before: an inline archive knows what its file had defined.
    Lexer(std::shared_ptr<const Source> source, size_t begin, size_t end,
          std::shared_ptr<BinaryDefinitions> definitions);
    const std::shared_ptr<BinaryDefinitions>& definitions() const { return m_definitions; }

    Token peek() { return m_peeked ? m_kind : peek_next(); }
    void skip();               // the peeked token, whatever it is
    std::string_view word();   // valid as long as the source
    std::string_view string(); // valid until the next string
    double number(bool* integer = nullptr);
    // Appends the numbers of an array up to its ']' or up to the first thing that is not a number, which
    // stays unread. Call after Open was skipped.
    void numbers(std::vector<float>& out);
    // How many of them were nan, inf or 1.#IND, and became 0. Reset by the caller.
    size_t not_finite = 0;
    // For integers: numbers with a fraction are cut and counted.
    void integers(std::vector<int32_t>& out, size_t& fractions);
    void binary_floats(std::vector<float>& out); // a Floats token: a whole array

    size_t offset() const { return m_token; } // where the peeked token starts
    size_t position() const { return m_at; }
    void seek(size_t offset) { m_at = offset, m_peeked = false; }
    size_t end() const { return m_end; }
    Location where() const { return m_source->locate(m_token); }
    Location where(size_t offset) const { return m_source->locate(offset); }
    const std::shared_ptr<const Source>& source() const { return m_source; }

    // What string() met: 0, or the offset of an opening quote whose string never ended.
    bool unterminated() const { return m_unterminated; }
    char bad_character() const { return m_text[m_token]; }
    void clear_unterminated() { m_unterminated = false; }

    // Decides, for a line break inside a string, whether the next line starts a request: then a closing quote
    // was forgotten. Set by the reader, which knows the requests.
    using IsRequest = bool (*)(std::string_view word);
    IsRequest is_request = nullptr;

    // Where comments lie, if somebody wants them: each once, in order. space_begin() is where the token
    // before the peeked one ended.
    struct Comment {
        size_t begin, end;
    };
    std::vector<Comment>* comments = nullptr;
    size_t space_begin() const { return m_space_begin; }

  private:
    void skip_space();
    Token peek_next();
    Token peek_binary(unsigned char c);
    Token peek_fixed(unsigned char c);
    Token peek_ieee(int bytes);
    Token peek_floats(size_t w);
    Token peek_request();
    Token define_request();
    Token peek_defined_string(int w);
    Token define_string(int w);
    bool take(size_t n) const { return m_end - m_at >= n; }
    uint64_t big_endian(size_t at, int bytes) const;
    bool binary_string(size_t at, std::string_view& out, size_t& after) const;
    bool next_line_is_request(size_t at) const;
    const char* skip_not_finite(const char* p) const;

    std::shared_ptr<const Source> m_source;
    std::string_view m_text;
    size_t m_at, m_end;
    size_t m_token = 0;
    size_t m_space_begin = 0, m_comments_to = 0;
    bool m_peeked = false;
    bool m_unterminated = false;
    Token m_kind = Token::End;
    std::string m_scratch;
    // A binary token, decoded when peeked: it ends at m_binary_end.
    bool m_binary = false;
    size_t m_binary_end = 0;
    double m_binary_number = 0;
    bool m_binary_integer = false;
    std::string_view m_binary_text;
    std::shared_ptr<BinaryDefinitions> m_definitions;
};

} // namespace kanuka::ingest
