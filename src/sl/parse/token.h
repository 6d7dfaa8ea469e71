// Tokens and the preprocessor: source text to the token stream that the parser reads.
#pragma once

#include <span>
#include <utility>

#include "sl/parse/source.h"

namespace kanuka::sl {

struct Token {
    enum Kind : uint8_t { End, Identifier, Number, String, Punctuation };
    Kind kind = End;
    bool line_start = false; // first of its line
    bool space_before = false;
    int hide = -1; // preprocessor: macros that must not expand here
    float number = 0;
    std::string_view text; // strings: their value, escapes resolved
    Loc loc;
    const char* wrong =
        nullptr; // what is wrong with it, said where it is used: text that #if skips may be anything

    bool is(std::string_view s) const { return (kind == Identifier || kind == Punctuation) && text == s; }
};

// One file's tokens, ending in End. Comments are noted in the sources. Malformed tokens are reported by who
// uses them: complain().
std::vector<Token> lex(Sources& sources, uint32_t file, Diagnostics& diagnostics);

void complain(const Token& token, Diagnostics& diagnostics);

struct Pragma {
    Loc loc;
    std::vector<Token> tokens;
};

struct Preprocessed {
    std::vector<Token> tokens; // ends in End
    std::vector<Pragma> pragmas;
    uint64_t hash = 0; // of all tokens and their places
};

// C's preprocessor, as far as shaders use it: #include, #define (with arguments, also "...", # and ##),
// #undef, #if and friends, #pragma (kept), #error, #line ignored.
Preprocessed preprocess(Sources& sources, uint32_t file, std::span<const std::string> include_path,
                        std::span<const std::pair<std::string, std::string>> defines,
                        Diagnostics& diagnostics);

} // namespace kanuka::sl
