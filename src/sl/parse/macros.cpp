#include "sl/parse/macros.h"

#include <cstdint>

namespace kanuka::sl {

namespace {

constexpr size_t MaxTokens = size_t(1) << 22; // macros that double themselves end here
constexpr int MaxLevels = 2000;

bool defines_function(const std::vector<Token>& before, const std::vector<std::vector<Token>>& arguments) {
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

} // namespace

std::string spell(std::span<const Token> tokens) {
    std::string s;
    for (const Token& t : tokens) {
        if (!s.empty() && t.space_before)
            s += ' ';
        s += t.kind == Token::String ? "\"" + std::string(t.text) + "\"" : std::string(t.text);
    }
    return s;
}

void Macros::define(const std::string& name, const std::string& value) {
    const uint32_t file = m_sources.add("<define " + name + ">", value);
    Macro m;
    m.body = lex(m_sources, file, m_diagnostics);
    m.body.pop_back();
    m_macros[m_sources.keep(name)] = std::move(m);
}

// The parameters in "( a, b, … )" from t[1] on; i becomes the index after them.
bool Macros::parameters_of(Macro& m, std::span<const Token> t, size_t& i) {
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
        if (t[i].kind != Token::Identifier) {
            m_diagnostics.error(t[i].loc, "expected a macro parameter's name");
            return false;
        }
        m.parameters.push_back(t[i++].text);
        if (i < t.size() && t[i].is(","))
            i++;
    }
    if (i >= t.size()) {
        m_diagnostics.error(t[1].loc, "expected \")\" after the macro's parameters");
        return false;
    }
    i++;
    return true;
}

void Macros::define(std::span<const Token> t, Loc at) {
    if (t.empty() || t[0].kind != Token::Identifier)
        return m_diagnostics.error(t.empty() ? at : t[0].loc, "expected a macro's name after #define");
    Macro m;
    size_t i = 1;
    if (t.size() > 1 && t[1].is("(") && !t[1].space_before && !parameters_of(m, t, i))
        return;
    m.body.assign(t.begin() + i, t.end());
    for (const Token& b : m.body)
        complain(b, m_diagnostics);
    m_macros[t[0].text] = std::move(m);
}

bool Macros::hidden(int list, const Macro* macro) const {
    for (; list >= 0; list = m_hidden[list].second)
        if (m_hidden[list].first == macro)
            return true;
    return false;
}

void Macros::builtin(Token& t) {
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
bool Macros::collect(std::vector<Token>& work, std::vector<std::vector<Token>>& arguments, const Token& macro,
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
    m_diagnostics.error(macro.loc, "expected \")\" after the arguments of macro " + std::string(macro.text));
    return false;
}

// Takes the arguments of a macro with parameters off `work`. False if this is no call of it after all: then
// the name is on `out`.
bool Macros::call(const Macro& macro, const Token& name, std::vector<Token>& work, std::vector<Token>& out,
                  Arguments& arguments) {
    std::vector<Token> consumed;
    const auto stays = [&] {
        out.push_back(name);
        work.insert(work.end(), consumed.rbegin(), consumed.rend());
        return false;
    };
    if (work.empty() || !work.back().is("("))
        return stays();
    if (!collect(work, arguments, name, macro.variadic ? macro.parameters.size() : SIZE_MAX, consumed))
        return false;
    // "float sqr (float x)": a function is defined that a macro has the name of.
    if (defines_function(out, arguments))
        return stays();
    if (macro.variadic && arguments.size() + 1 == macro.parameters.size())
        arguments.emplace_back(); // nothing for "..."
    if (arguments.size() == macro.parameters.size() ||
        (macro.parameters.empty() && arguments.size() == 1 && arguments[0].empty()))
        return true;
    m_diagnostics.warning(name.loc, "macro " + std::string(name.text) + " takes " +
                                        std::to_string(macro.parameters.size()) + " arguments, found " +
                                        std::to_string(arguments.size()) +
                                        ": it stays as it is, and is a function of that name");
    return stays();
}

void Macros::expand(std::span<const Token> in, std::vector<Token>& out, const Loc* at) {
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
        if (m_written.size() + out.size() + work.size() > MaxTokens) {
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
        Arguments arguments;
        if (macro.function && !call(macro, t, work, out, arguments))
            continue;
        m_hidden.emplace_back(&macro, t.hide);
        substitute(macro, arguments, t, int(m_hidden.size()) - 1, work);
    }
}

void Macros::substitute(const Macro& macro, const std::vector<std::vector<Token>>& arguments,
                        const Token& call, int hide, std::vector<Token>& work) {
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

void Macros::paste(Token& left, const Token& right, const std::vector<Token>* argument) {
    std::string text(left.text);
    text += argument ? spell(*argument) : std::string(right.text);
    const uint32_t file = m_sources.add("<pasted>", text);
    const std::vector<Token> tokens = lex(m_sources, file, m_diagnostics);
    const Loc loc = left.loc;
    left = tokens[0];
    left.loc = loc;
    complain(left, m_diagnostics);
}

} // namespace kanuka::sl
