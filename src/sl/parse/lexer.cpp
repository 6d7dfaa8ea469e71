#include <charconv>
#include <cmath>

#include "sl/parse/token.h"

namespace kanuka::sl {

namespace {

bool is_name_start(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}
bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

class Lexer {
  public:
    Lexer(Sources& sources, uint32_t file, Diagnostics& diagnostics)
        : m_sources(sources), m_diagnostics(diagnostics), m_file(file), m_text(sources.text(file)) {}

    std::vector<Token> run() {
        std::vector<Token> tokens;
        tokens.reserve(m_text.size() / 4 + 16);
        bool line_start = true;
        for (;;) {
            m_fresh_line = false;
            const bool space = skip_space();
            line_start = line_start || m_fresh_line;
            Token t;
            t.line_start = line_start;
            t.space_before = space;
            t.loc = {m_file, m_line, uint32_t(m_pos - m_line_start) + 1};
            line_start = false;
            if (m_pos >= m_text.size()) {
                t.line_start = true;
                tokens.push_back(t);
                return tokens;
            }
            scan(t);
            tokens.push_back(t);
        }
    }

  private:
    char at(size_t offset = 0) const {
        return m_pos + offset < m_text.size() ? m_text[m_pos + offset] : '\0';
    }

    void newline() {
        m_line++;
        m_line_start = m_pos;
    }

    bool skip_space() {
        const size_t begin = m_pos;
        while (m_pos < m_text.size()) {
            const char c = at();
            if (c == '\n') {
                m_pos++;
                newline();
                m_fresh_line = true;
            } else if (const size_t splice = c == '\\' ? line_splice() : 0; splice > 0) {
                m_pos += splice; // a continued line stays one line for directives
                newline();
            } else if (c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v' || c == '\x1a') {
                m_pos++;
            } else if (c == '/' && at(1) == '/') {
                const size_t start = m_pos;
                m_pos = std::min(m_text.find('\n', m_pos), m_text.size());
                while (m_pos < m_text.size() && continued_before(m_pos)) { // the comment goes on
                    m_pos++;
                    newline();
                    m_pos = std::min(m_text.find('\n', m_pos), m_text.size());
                }
                m_sources.note_comment(m_file, m_line, m_text.substr(start + 2, m_pos - start - 2));
            } else if (c == '/' && at(1) == '*') {
                block_comment();
            } else {
                break;
            }
        }
        return m_pos != begin;
    }

    // Length of a backslash and the end of its line, 0 = it does not end the line. Blanks between them are
    // invisible to who wrote them.
    size_t line_splice() const {
        size_t n = 1;
        while (at(n) == ' ' || at(n) == '\t' || at(n) == '\r')
            n++;
        return at(n) == '\n' ? n + 1 : 0;
    }

    // Is there a backslash before this end of a line?
    bool continued_before(size_t end) const {
        if (end > 0 && m_text[end - 1] == '\r')
            end--;
        return end > 0 && m_text[end - 1] == '\\';
    }

    void block_comment() {
        const Loc start{m_file, m_line, uint32_t(m_pos - m_line_start) + 1};
        const size_t begin = m_pos;
        m_pos += 2;
        while (m_pos < m_text.size() && !(at() == '*' && at(1) == '/')) {
            m_pos++;
            if (m_text[m_pos - 1] == '\n')
                newline();
        }
        if (m_pos >= m_text.size()) {
            m_diagnostics.error(start, "this comment has no end: expected \"*/\"");
            return;
        }
        m_pos += 2;
        m_sources.note_comment(m_file, m_line, m_text.substr(begin + 2, m_pos - begin - 4));
    }

    void scan(Token& t) {
        const size_t begin = m_pos;
        const char c = at();
        if (is_name_start(c)) {
            while (is_name_start(at()) || is_digit(at()))
                m_pos++;
            t.kind = Token::Identifier;
            t.text = m_text.substr(begin, m_pos - begin);
        } else if (is_digit(c) || (c == '.' && is_digit(at(1)))) {
            number(t);
        } else if (c == '"') {
            string(t);
        } else {
            static constexpr std::string_view Long[] = {"...", "<<=", ">>=", "==", "!=", "<=", ">=", "&&",
                                                        "||",  "+=",  "-=",  "*=", "/=", "^=", ".=", "->",
                                                        "::",  "++",  "--",  "##", "<<", ">>"};
            t.kind = Token::Punctuation;
            size_t length = 1;
            for (std::string_view p : Long)
                if (m_text.substr(m_pos, p.size()) == p) {
                    length = p.size();
                    break;
                }
            m_pos += length;
            t.text = m_text.substr(begin, length);
        }
    }

    void number(Token& t) {
        const size_t begin = m_pos;
        t.kind = Token::Number;
        if (at() == '0' && (at(1) == 'x' || at(1) == 'X')) {
            m_pos += 2;
            unsigned long long value = 0;
            while (std::isxdigit(static_cast<unsigned char>(at())))
                value = value * 16 + (is_digit(at()) ? at() - '0' : (at() | 32) - 'a' + 10), m_pos++;
            t.number = float(value);
        } else {
            while (is_digit(at()))
                m_pos++;
            if (at() == '.') {
                m_pos++;
                while (is_digit(at()))
                    m_pos++;
            }
            if ((at() == 'e' || at() == 'E') &&
                (is_digit(at(1)) || ((at(1) == '+' || at(1) == '-') && is_digit(at(2))))) {
                m_pos += 2;
                while (is_digit(at()))
                    m_pos++;
            }
            double value = 0;
            const char* first = m_text.data() + begin;
            std::from_chars(first, m_text.data() + m_pos, value);
            t.number = float(value);
            if (at() == 'f' || at() == 'F')
                m_pos++;
        }
        t.text = m_text.substr(begin, m_pos - begin);
        if (is_name_start(at()))
            t.wrong = "is not a number";
    }

    void string(Token& t) {
        t.kind = Token::String;
        std::string value;
        bool escaped = false;
        const size_t begin = ++m_pos;
        while (m_pos < m_text.size() && at() != '"' && at() != '\n') {
            char c = at();
            if (c == '\\' && m_pos + 1 < m_text.size()) {
                if (!escaped)
                    value.assign(m_text.substr(begin, m_pos - begin));
                escaped = true;
                m_pos++;
                c = at();
                if (c == '\n') { // continued string
                    m_pos++;
                    newline();
                    continue;
                }
                c = c == 'n' ? '\n' : c == 't' ? '\t' : c == 'r' ? '\r' : c;
            }
            if (escaped)
                value += c;
            m_pos++;
        }
        t.text = escaped ? m_sources.keep(std::move(value)) : m_text.substr(begin, m_pos - begin);
        if (at() == '"')
            m_pos++;
        else
            t.wrong = "this string has no end: expected '\"' before the end of the line";
    }

    Sources& m_sources;
    Diagnostics& m_diagnostics;
    uint32_t m_file;
    std::string_view m_text;
    size_t m_pos = 0, m_line_start = 0;
    uint32_t m_line = 1;
    bool m_fresh_line = false; // since the last token: a line that no comment or backslash continues
};

} // namespace

void complain(const Token& t, Diagnostics& diagnostics) {
    if (t.wrong)
        diagnostics.error(t.loc, t.kind == Token::Number ? "\"" + std::string(t.text) + "…\" " + t.wrong
                                                         : std::string(t.wrong));
}

std::vector<Token> lex(Sources& sources, uint32_t file, Diagnostics& diagnostics) {
    return Lexer(sources, file, diagnostics).run();
}

} // namespace kanuka::sl
