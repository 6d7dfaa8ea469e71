// Macros of the preprocessor: their definitions, and the expansion of text that calls them.
#pragma once

#include "sl/parse/token.h"

namespace kanuka::sl {

class Macros {
  public:
    // `written`: all text expanded so far. It counts towards the limit of one compilation.
    Macros(Sources& sources, const std::vector<Token>& written, Diagnostics& diagnostics)
        : m_sources(sources), m_written(written), m_diagnostics(diagnostics) {}

    void define(const std::string& name, const std::string& value);
    // What follows #define. `at`: the place of the directive.
    void define(std::span<const Token> t, Loc at);
    void undefine(std::string_view name) { m_macros.erase(name); }
    bool defined(std::string_view name) const { return m_macros.contains(name); }

    // Expands `in` onto `out`.
    void expand(std::span<const Token> in, std::vector<Token>& out) { expand(in, out, nullptr); }

  private:
    struct Macro {
        bool function = false;
        bool variadic = false; // the last parameter takes all further arguments
        std::vector<std::string_view> parameters;
        std::vector<Token> body;
    };
    using Arguments = std::vector<std::vector<Token>>;

    bool parameters_of(Macro& m, std::span<const Token> t, size_t& i);
    bool hidden(int list, const Macro* macro) const;
    // `at`: the place of the outermost macro, which errors in its expansion point at.
    void expand(std::span<const Token> in, std::vector<Token>& out, const Loc* at);
    bool call(const Macro& macro, const Token& name, std::vector<Token>& work, std::vector<Token>& out,
              Arguments& arguments);
    void builtin(Token& t);
    bool collect(std::vector<Token>& work, Arguments& arguments, const Token& macro, size_t most,
                 std::vector<Token>& consumed);
    void substitute(const Macro& macro, const Arguments& arguments, const Token& call, int hide,
                    std::vector<Token>& work);
    void paste(Token& left, const Token& right, const std::vector<Token>* argument);

    Sources& m_sources;
    const std::vector<Token>& m_written;
    Diagnostics& m_diagnostics;
    std::unordered_map<std::string_view, Macro> m_macros;
    std::vector<std::pair<const Macro*, int>> m_hidden; // linked lists: macro, rest
    bool m_overflow = false;
    // Macro calls within arguments of macro calls: how many, and the tokens that all of them hold.
    int m_level = 0;
    size_t m_held = 0;
    struct Level {
        Macros& macros;
        size_t tokens;
        Level(Macros& m, size_t n) : macros(m), tokens(n) {
            m.m_level++;
            m.m_held += tokens;
        }
        ~Level() {
            macros.m_level--;
            macros.m_held -= tokens;
        }
    };
};

// The tokens as text.
std::string spell(std::span<const Token> tokens);

} // namespace kanuka::sl
