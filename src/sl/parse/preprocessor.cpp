#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "sl/parse/condition.h"
#include "sl/parse/macros.h"

namespace kanuka::sl {

namespace {

constexpr int MaxIncludeDepth = 64;
class Preprocessor {
  public:
    Preprocessor(Sources& sources, std::span<const std::string> path, Diagnostics& diagnostics)
        : m_sources(sources), m_path(path), m_diagnostics(diagnostics),
          m_macros(sources, m_out.tokens, diagnostics) {}

    void define(const std::string& name, const std::string& value) { m_macros.define(name, value); }

    void file(uint32_t index, int depth) {
        const std::vector<Token> tokens = lex(m_sources, index, m_diagnostics);
        const size_t conditions = m_conditions.size();
        m_files.push_back(index);
        size_t i = 0;
        while (tokens[i].kind != Token::End) {
            if (tokens[i].line_start && tokens[i].is("#")) {
                size_t end = i + 1;
                while (!tokens[end].line_start)
                    end++;
                directive(std::span(tokens).subspan(i + 1, end - i - 1), tokens[i].loc, depth);
                i = end;
                continue;
            }
            // Text up to the next directive is expanded as a whole: a macro call may run over lines.
            size_t end = i;
            while (tokens[end].kind != Token::End && !(tokens[end].line_start && tokens[end].is("#")))
                end++;
            if (active()) {
                for (size_t k = i; k < end; k++)
                    complain(tokens[k], m_diagnostics);
                m_macros.expand(std::span(tokens).subspan(i, end - i), m_out.tokens);
            }
            i = end;
        }
        while (m_conditions.size() > conditions) {
            m_diagnostics.error(m_conditions.back().loc, "this conditional has no #endif in its file");
            m_conditions.pop_back();
        }
        m_files.pop_back();
        if (depth == 0)
            m_out.tokens.push_back(tokens.back());
    }

    Preprocessed finish() {
        uint64_t h = 0xcbf29ce484222325ull;
        const auto mix = [&h](uint64_t x) { h = (h ^ x) * 0x100000001b3ull, h ^= h >> 29; };
        for (const Token& t : m_out.tokens) {
            mix(t.kind);
            for (char c : t.text)
                mix(uint8_t(c));
            mix(t.loc.line * 4096ull + t.loc.column);
        }
        m_out.hash = h;
        return std::move(m_out);
    }

  private:
    struct Condition {
        Loc loc;
        bool active, taken, outer, had_else;
    };
    bool active() const { return m_conditions.empty() || m_conditions.back().active; }

    void directive(std::span<const Token> t, Loc at, int depth) {
        if (t.empty())
            return;
        const std::string_view name = t[0].text;
        const std::span<const Token> rest = t.subspan(1);
        if (name == "if" || name == "ifdef" || name == "ifndef") {
            bool value = false;
            if (active())
                value = name == "if" ? condition(rest, t[0].loc)
                                     : (!rest.empty() && m_macros.defined(rest[0].text)) == (name == "ifdef");
            m_conditions.push_back({at, active() && value, value, active(), false});
        } else if (name == "elif" || name == "else" || name == "endif") {
            if (m_conditions.empty())
                return m_diagnostics.error(at, "#" + std::string(name) + " without #if");
            Condition& c = m_conditions.back();
            if (name == "endif") {
                m_conditions.pop_back();
            } else if (c.had_else) {
                m_diagnostics.error(at, "#" + std::string(name) + " after #else");
            } else {
                const bool value = c.outer && !c.taken && (name == "else" || condition(rest, t[0].loc));
                c.active = value;
                c.taken = c.taken || value;
                c.had_else = name == "else";
            }
        } else if (!active()) {
            return;
        } else if (name == "define") {
            m_macros.define(rest, t[0].loc);
        } else if (name == "undef") {
            if (!rest.empty())
                m_macros.undefine(rest[0].text);
        } else if (name == "include") {
            include(rest, t[0].loc, depth);
        } else if (name == "pragma") {
            m_out.pragmas.push_back({at, std::vector<Token>(rest.begin(), rest.end())});
        } else if (name == "error") {
            m_diagnostics.error(at, "#error " + spell(rest));
        } else if (name == "warning") {
            m_diagnostics.warning(at, "#warning " + spell(rest));
        } else if (name != "line" && name != "ident" && name != "sccs" && t[0].kind != Token::Number) {
            m_diagnostics.error(t[0].loc,
                                "\"#" + std::string(name) +
                                    "\" is not a directive; expected include, define, undef, if, ifdef, "
                                    "ifndef, elif, else, endif, pragma or error");
        }
    }

    void include(std::span<const Token> t, Loc at, int depth) {
        std::string name;
        std::vector<Token> expanded;
        if (!t.empty() && t[0].kind == Token::Identifier) { // #include MACRO
            m_macros.expand(t, expanded);
            t = expanded;
        }
        if (!t.empty() && t[0].kind == Token::String)
            name = t[0].text;
        else if (t.size() > 2 && t[0].is("<"))
            for (size_t i = 1; i < t.size() && !t[i].is(">"); i++)
                name += t[i].text;
        if (name.empty())
            return m_diagnostics.error(at, "expected \"file\" or <file> after #include");
        if (depth >= MaxIncludeDepth)
            return m_diagnostics.error(at, "#include nests deeper than " + std::to_string(MaxIncludeDepth) +
                                               " files: does a file include itself?");
        std::vector<std::filesystem::path> tried;
        const std::filesystem::path given(name);
        if (given.is_absolute()) {
            tried.push_back(given);
        } else {
            // Beside the file that asks, beside those that include it, then the folders of -I.
            const auto add = [&](const std::filesystem::path& folder) {
                const std::filesystem::path p = (folder / given).lexically_normal();
                if (std::find(tried.begin(), tried.end(), p) == tried.end())
                    tried.push_back(p);
            };
            for (size_t k = m_files.size(); k-- > 0;)
                add(std::filesystem::path(m_sources.name(m_files[k])).parent_path());
            for (const std::string& folder : m_path)
                add(folder);
        }
        for (const auto& path : tried) {
            std::ifstream in(path, std::ios::binary);
            std::error_code ec;
            if (!in || std::filesystem::is_directory(path, ec))
                continue;
            std::ostringstream text;
            text << in.rdbuf();
            return file(m_sources.add(path.string(), text.str()), depth + 1);
        }
        std::string where;
        for (const auto& path : tried)
            where += "\n  " + path.string();
        m_diagnostics.error(t[0].loc, "cannot find the file \"" + name + "\"; looked for" + where +
                                          "\nAdd the folder that has it: -I FOLDER of kanuka shader, or the "
                                          "shader search path of a scene");
    }

    bool condition(std::span<const Token> t, Loc at) {
        std::vector<Token> plain;
        for (size_t i = 0; i < t.size(); i++) { // defined X, before macros expand
            if (!t[i].is("defined")) {
                plain.push_back(t[i]);
                continue;
            }
            const bool parens = i + 1 < t.size() && t[i + 1].is("(");
            const size_t n = i + (parens ? 2 : 1);
            Token value = t[i];
            value.kind = Token::Number;
            value.number = n < t.size() && m_macros.defined(t[n].text) ? 1 : 0;
            plain.push_back(value);
            i = n + parens;
        }
        std::vector<Token> expanded;
        m_macros.expand(plain, expanded);
        if (expanded.empty()) {
            m_diagnostics.error(at, "expected a condition");
            return false;
        }
        return evaluate_condition(expanded, m_diagnostics) != 0;
    }

    Sources& m_sources;
    std::span<const std::string> m_path;
    Diagnostics& m_diagnostics;
    Preprocessed m_out;
    Macros m_macros;
    std::vector<Condition> m_conditions;
    std::vector<uint32_t> m_files; // being read, each included by the one before
};

} // namespace

Preprocessed preprocess(Sources& sources, uint32_t file, std::span<const std::string> include_path,
                        std::span<const std::pair<std::string, std::string>> defines,
                        Diagnostics& diagnostics) {
    Preprocessor p(sources, include_path, diagnostics);
    p.define("KANUKA", "1");
    for (const auto& [name, value] : defines)
        p.define(name, value.empty() ? "1" : value);
    p.file(file, 0);
    return p.finish();
}

} // namespace kanuka::sl
