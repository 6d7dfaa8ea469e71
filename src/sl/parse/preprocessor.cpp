#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "sl/parse/token.h"

namespace kanuka::sl {

namespace {

constexpr int MaxIncludeDepth = 64;
constexpr size_t MaxTokens = size_t(1) << 22; // macros that double themselves end here

struct Macro {
    bool function = false;
    bool variadic = false; // the last parameter takes all further arguments
    std::vector<std::string_view> parameters;
    std::vector<Token> body;
};

class Preprocessor {
  public:
    Preprocessor(Sources& sources, std::span<const std::string> path, Diagnostics& diagnostics)
        : m_sources(sources), m_path(path), m_diagnostics(diagnostics) {}

    void define(const std::string& name, const std::string& value) {
        const uint32_t file = m_sources.add("<define " + name + ">", value);
        Macro m;
        m.body = lex(m_sources, file, m_diagnostics);
        m.body.pop_back();
        m_macros[m_sources.keep(name)] = std::move(m);
    }

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
                expand(std::span(tokens).subspan(i, end - i), m_out.tokens, nullptr);
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
                value = name == "if"
                            ? condition(rest, t[0].loc)
                            : (!rest.empty() && m_macros.count(rest[0].text) > 0) == (name == "ifdef");
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
            define_directive(rest, t[0].loc);
        } else if (name == "undef") {
            if (!rest.empty())
                m_macros.erase(rest[0].text);
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

    static std::string spell(std::span<const Token> tokens) {
        std::string s;
        for (const Token& t : tokens) {
            if (!s.empty() && t.space_before)
                s += ' ';
            s += t.kind == Token::String ? "\"" + std::string(t.text) + "\"" : std::string(t.text);
        }
        return s;
    }

    void define_directive(std::span<const Token> t, Loc at) {
        if (t.empty() || t[0].kind != Token::Identifier)
            return m_diagnostics.error(t.empty() ? at : t[0].loc, "expected a macro's name after #define");
        Macro m;
        size_t i = 1;
        if (t.size() > 1 && t[1].is("(") && !t[1].space_before) {
            m.function = true;
            i = 2;
            while (i < t.size() && !t[i].is(")")) {
                if (t[i].is("...")) { // "args..." or "..." alone
                    const bool named = i > 2 && t[i - 1].kind == Token::Identifier;
                    m.variadic = true;
                    if (!named)
                        m.parameters.push_back("__VA_ARGS__");
                    i++;
                    continue;
                }
                if (t[i].kind != Token::Identifier)
                    return m_diagnostics.error(t[i].loc, "expected a macro parameter's name");
                m.parameters.push_back(t[i++].text);
                if (i < t.size() && t[i].is(","))
                    i++;
            }
            if (i >= t.size())
                return m_diagnostics.error(t[1].loc, "expected \")\" after the macro's parameters");
            i++;
        }
        m.body.assign(t.begin() + i, t.end());
        for (const Token& b : m.body)
            complain(b, m_diagnostics);
        m_macros[t[0].text] = std::move(m);
    }

    void include(std::span<const Token> t, Loc at, int depth) {
        std::string name;
        std::vector<Token> expanded;
        if (!t.empty() && t[0].kind == Token::Identifier) { // #include MACRO
            expand(t, expanded, nullptr);
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

    bool hidden(int list, const Macro* macro) const {
        for (; list >= 0; list = m_hidden[list].second)
            if (m_hidden[list].first == macro)
                return true;
        return false;
    }

    // Expands `in` onto `out`. `at` is the place of the outermost macro: what errors in its expansion point
    // at.
    void expand(std::span<const Token> in, std::vector<Token>& out, const Loc* at) {
        const Level level(*this, in.size());
        if (m_held > MaxTokens || m_level > MaxLevels) {
            if (!m_overflow)
                m_diagnostics.error(at ? *at : in[0].loc, "macro calls nest too deep in one another");
            m_overflow = true;
            return;
        }
        // Work list, last first; expansions are pushed back and scanned again.
        std::vector<Token> work(in.rbegin(), in.rend());
        while (!work.empty()) {
            Token t = work.back();
            work.pop_back();
            if (at)
                t.loc = *at;
            if (m_out.tokens.size() + out.size() + work.size() > MaxTokens) {
                if (!m_overflow)
                    m_diagnostics.error(t.loc, "macros expand to more than 4 million tokens");
                m_overflow = true;
                return;
            }
            const auto it = t.kind == Token::Identifier ? m_macros.find(t.text) : m_macros.end();
            if (it == m_macros.end() || hidden(t.hide, &it->second)) {
                if (t.kind == Token::Identifier && (t.text == "__LINE__" || t.text == "__FILE__"))
                    builtin(t);
                out.push_back(t);
                continue;
            }
            const Macro& macro = it->second;
            std::vector<std::vector<Token>> arguments;
            if (macro.function) {
                if (work.empty() || !work.back().is("(")) {
                    out.push_back(t);
                    continue;
                }
                std::vector<Token> consumed;
                if (!collect(work, arguments, t, macro.variadic ? macro.parameters.size() : SIZE_MAX,
                             consumed))
                    continue;
                // "float sqr (float x)": a function is defined that a macro has the name of.
                if (defines_function(out, arguments)) {
                    out.push_back(t);
                    work.insert(work.end(), consumed.rbegin(), consumed.rend());
                    continue;
                }
                if (macro.variadic && arguments.size() + 1 == macro.parameters.size())
                    arguments.emplace_back(); // nothing for "..."
                if (arguments.size() != macro.parameters.size() &&
                    !(macro.parameters.empty() && arguments.size() == 1 && arguments[0].empty())) {
                    m_diagnostics.warning(t.loc, "macro " + std::string(t.text) + " takes " +
                                                     std::to_string(macro.parameters.size()) +
                                                     " arguments, found " + std::to_string(arguments.size()) +
                                                     ": it stays as it is, and is a function of that name");
                    out.push_back(t);
                    work.insert(work.end(), consumed.rbegin(), consumed.rend());
                    continue;
                }
            }
            m_hidden.emplace_back(&macro, t.hide);
            substitute(macro, arguments, t, int(m_hidden.size()) - 1, work);
        }
    }

    void builtin(Token& t) {
        if (t.text == "__LINE__") {
            t.kind = Token::Number;
            t.number = float(t.loc.line);
            t.text = m_sources.keep(std::to_string(t.loc.line));
        } else {
            t.kind = Token::String;
            t.text = m_sources.name(t.loc.file);
        }
    }

    // At most `most` arguments: the last has the commas of all further ones.
    bool collect(std::vector<Token>& work, std::vector<std::vector<Token>>& arguments, const Token& macro,
                 size_t most, std::vector<Token>& consumed) {
        consumed.push_back(work.back()); // "("
        work.pop_back();
        arguments.emplace_back();
        for (int depth = 1; !work.empty();) {
            Token a = work.back();
            work.pop_back();
            consumed.push_back(a);
            depth += a.is("(") - a.is(")");
            if (depth == 0)
                return true;
            if (a.is(",") && depth == 1 && arguments.size() < most)
                arguments.emplace_back();
            else
                arguments.back().push_back(a);
        }
        m_diagnostics.error(macro.loc,
                            "expected \")\" after the arguments of macro " + std::string(macro.text));
        return false;
    }

    static bool defines_function(const std::vector<Token>& before,
                                 const std::vector<std::vector<Token>>& arguments) {
        const auto type = [](const Token& t) {
            static constexpr std::string_view Types[] = {"float",   "color",   "point",  "vector",
                                                         "normal",  "matrix",  "string", "void",
                                                         "uniform", "varying", "output"};
            for (std::string_view w : Types)
                if (t.is(w))
                    return true;
            return false;
        };
        return !before.empty() && type(before.back()) && !arguments.empty() && arguments[0].size() > 1 &&
               type(arguments[0][0]) && arguments[0][1].kind == Token::Identifier;
    }

    void substitute(const Macro& macro, const std::vector<std::vector<Token>>& arguments, const Token& call,
                    int hide, std::vector<Token>& work) {
        std::vector<Token> result;
        const auto parameter = [&](const Token& t) -> const std::vector<Token>* {
            for (size_t i = 0; t.kind == Token::Identifier && i < macro.parameters.size(); i++)
                if (macro.parameters[i] == t.text && i < arguments.size())
                    return &arguments[i];
            return nullptr;
        };
        for (size_t i = 0; i < macro.body.size(); i++) {
            const Token& b = macro.body[i];
            const bool pastes = i + 1 < macro.body.size() && macro.body[i + 1].is("##");
            if (b.is("##") && !result.empty() && i + 1 < macro.body.size()) {
                i++;
                paste(result.back(), macro.body[i], parameter(macro.body[i]));
                continue;
            }
            if (b.is("#") && i + 1 < macro.body.size() && parameter(macro.body[i + 1])) {
                Token s = b;
                s.kind = Token::String;
                s.text = m_sources.keep(spell(*parameter(macro.body[++i])));
                result.push_back(s);
            } else if (const auto* a = parameter(b)) {
                if (pastes)
                    result.insert(result.end(), a->begin(), a->end());
                else
                    expand(*a, result, &call.loc);
            } else {
                result.push_back(b);
            }
        }
        for (Token& r : result) {
            r.loc = call.loc;
            r.line_start = false;
            if (r.hide < 0 || !hidden(r.hide, &macro)) {
                // Tokens of arguments keep what hides them, and gain this macro.
                m_hidden.emplace_back(&macro, r.hide < 0 ? m_hidden[hide].second : r.hide);
                r.hide = int(m_hidden.size()) - 1;
            }
        }
        work.insert(work.end(), result.rbegin(), result.rend());
    }

    void paste(Token& left, const Token& right, const std::vector<Token>* argument) {
        std::string text(left.text);
        text += argument ? spell(*argument) : std::string(right.text);
        const uint32_t file = m_sources.add("<pasted>", text);
        const std::vector<Token> tokens = lex(m_sources, file, m_diagnostics);
        const Loc loc = left.loc;
        left = tokens[0];
        left.loc = loc;
        complain(left, m_diagnostics);
    }

    // ---- #if expressions
    // --------------------------------------------------------------------------------------------

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
            value.number = n < t.size() && m_macros.count(t[n].text) ? 1 : 0;
            plain.push_back(value);
            i = n + parens;
        }
        std::vector<Token> expanded;
        expand(plain, expanded, nullptr);
        m_expression = expanded;
        m_at = 0;
        m_depth = 0;
        if (expanded.empty()) {
            m_diagnostics.error(at, "expected a condition");
            return false;
        }
        const double value = binary(0);
        if (m_at < m_expression.size())
            m_diagnostics.error(m_expression[m_at].loc, "\"" + std::string(m_expression[m_at].text) +
                                                            "\" does not belong into a condition of #if");
        return value != 0;
    }

    double primary() {
        if (m_at >= m_expression.size() || ++m_depth > 256)
            return 0;
        const Token t = m_expression[m_at++];
        double value = 0;
        if (t.is("!"))
            value = primary() == 0;
        else if (t.is("-"))
            value = -primary();
        else if (t.is("(")) {
            value = binary(0);
            if (m_at < m_expression.size() && m_expression[m_at].is(")"))
                m_at++;
        } else if (t.kind == Token::Number)
            value = t.number;
        m_depth--;
        return value;
    }

    double binary(int lowest) {
        static const std::vector<std::vector<std::string_view>> levels = {
            {"||"}, {"&&"}, {"==", "!="}, {"<", ">", "<=", ">="}, {"+", "-"}, {"*", "/"}};
        if (lowest == int(levels.size()))
            return primary();
        double a = binary(lowest + 1);
        while (m_at < m_expression.size()) {
            const Token op = m_expression[m_at];
            bool found = false;
            for (std::string_view s : levels[lowest])
                found = found || op.is(s);
            if (!found)
                break;
            m_at++;
            const double b = binary(lowest + 1);
            a = op.is("||")   ? (a != 0 || b != 0)
                : op.is("&&") ? (a != 0 && b != 0)
                : op.is("==") ? a == b
                : op.is("!=") ? a != b
                : op.is("<")  ? a < b
                : op.is(">")  ? a > b
                : op.is("<=") ? a <= b
                : op.is(">=") ? a >= b
                : op.is("+")  ? a + b
                : op.is("-")  ? a - b
                : op.is("*")  ? a * b
                              : (b != 0 ? a / b : 0);
        }
        return a;
    }

    Sources& m_sources;
    std::span<const std::string> m_path;
    Diagnostics& m_diagnostics;
    std::unordered_map<std::string_view, Macro> m_macros;
    std::vector<std::pair<const Macro*, int>> m_hidden; // linked lists: macro, rest
    std::vector<Condition> m_conditions;
    std::vector<uint32_t> m_files; // being read, each included by the one before
    std::vector<Token> m_expression;
    size_t m_at = 0;
    int m_depth = 0;
    bool m_overflow = false;
    // Macro calls within arguments of macro calls: how many, and the tokens that all of them hold.
    static constexpr int MaxLevels = 2000;
    int m_level = 0;
    size_t m_held = 0;
    struct Level {
        Preprocessor& p;
        size_t tokens;
        Level(Preprocessor& preprocessor, size_t n) : p(preprocessor), tokens(n) {
            p.m_level++;
            p.m_held += tokens;
        }
        ~Level() {
            p.m_level--;
            p.m_held -= tokens;
        }
    };
    Preprocessed m_out;
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
