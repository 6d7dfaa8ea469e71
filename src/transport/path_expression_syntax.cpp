#include "transport/path_expression_syntax.h"

#include <algorithm>
#include <charconv>

#include "base/error.h"

namespace kanuka::transport {

namespace {

constexpr int MostRepeats = 64, MostDepth = 200, MostParentheses = 100;

constexpr EventKinds Reflections =
    kind_of(PathStep::ReflectDiffuse) | kind_of(PathStep::ReflectGlossy) | kind_of(PathStep::ReflectSingular);
constexpr EventKinds Transmissions = kind_of(PathStep::TransmitDiffuse) | kind_of(PathStep::TransmitGlossy) |
                                     kind_of(PathStep::TransmitSingular);
constexpr EventKinds Diffuse = kind_of(PathStep::ReflectDiffuse) | kind_of(PathStep::TransmitDiffuse);
constexpr EventKinds Glossy = kind_of(PathStep::ReflectGlossy) | kind_of(PathStep::TransmitGlossy);
constexpr EventKinds Singular = kind_of(PathStep::ReflectSingular) | kind_of(PathStep::TransmitSingular);

constexpr std::string_view EventLetters = "CRTDGSVLO.", TypeLetters = "CRTVLO.", ScatteringLetters = "DGS.";

EventKinds kinds_of(char letter) {
    switch (letter) {
    case 'C':
        return kind_of(PathStep::Camera);
    case 'R':
        return Reflections;
    case 'T':
        return Transmissions;
    case 'D':
        return Diffuse;
    case 'G':
        return Glossy;
    case 'S':
        return Singular;
    case 'V':
        return kind_of(PathStep::Volume);
    case 'L':
        return LightKind;
    case 'O':
        return ObjectKind;
    default: // the dot
        return AllKinds;
    }
}

std::string listed(std::string_view letters, std::string_view more = {}) {
    std::string all = "one of";
    for (const char c : letters)
        all += std::string(" ") + c;
    return all + std::string(more);
}

// Bytes of UTF-8 that begin a character; columns count those.
bool begins_character(char c) {
    return (uint8_t(c) & 0xc0) != 0x80;
}

class Parser {
  public:
    explicit Parser(std::string_view text) : m_text(text) {}

    PathSyntax parse() {
        if (m_text.empty()) // it would match no path, and make a black layer
            fail(listed(EventLetters, " or <, [, ("), 0);
        PathSyntax all = alternatives();
        if (!at_end()) // what alternatives() leaves
            fail("the end of the expression, or ( before", m_at);
        return all;
    }

  private:
    // ---- messages
    [[noreturn]] void fail(const std::string& expected, size_t at) const {
        at = std::min(at, m_text.size());
        size_t after = at + 1;
        while (after < m_text.size() && !begins_character(m_text[after]))
            after++;
        const std::string found = at < m_text.size() ? "'" + std::string(m_text.substr(at, after - at)) + "'"
                                                     : std::string("the end of the expression");
        const auto column = std::ranges::count_if(m_text.substr(0, at), begins_character);
        throw Error("column " + std::to_string(column + 1) + ": there is " + found + ", expected " +
                        expected + excerpt(at, size_t(column)),
                    ExitCode::Usage);
    }
    // The text with a caret below `at`; of long ones, what is around it.
    std::string excerpt(size_t at, size_t column) const {
        constexpr size_t Width = 160;
        size_t first = at > Width / 2 ? at - Width / 2 : 0;
        while (first < at && !begins_character(m_text[first]))
            first++;
        column -= size_t(std::ranges::count_if(m_text.substr(0, first), begins_character));
        std::string_view shown = m_text.substr(first, Width);
        while (first + shown.size() < m_text.size() && !begins_character(m_text[first + shown.size()]))
            shown.remove_suffix(1);
        std::string line(shown);
        std::ranges::replace_if(line, [](char c) { return c == '\n' || c == '\t' || c == '\r'; }, ' ');
        return "\n" + line + "\n" + std::string(column, ' ') + "^";
    }

    // ---- letters
    bool at_end() const { return m_at >= m_text.size(); }
    bool at(char c) const { return !at_end() && m_text[m_at] == c; }
    bool take(char c) {
        if (!at(c))
            return false;
        m_at++;
        return true;
    }
    void need(char c, const char* closes) {
        if (!take(c))
            fail(std::string(1, c) + ", which " + closes, m_at);
    }

    // ---- the grammar
    PathSyntax alternatives() {
        PathSyntax all = sequence();
        if (!at('|'))
            return all;
        PathSyntax choice{.kind = PathSyntax::Kind::Choice};
        add(choice, std::move(all));
        while (take('|'))
            add(choice, sequence());
        return choice;
    }
    PathSyntax sequence() {
        PathSyntax all;
        while (!at_end() && !at('|') && !at(')'))
            add(all, repeated());
        if (all.children.size() == 1)
            return PathSyntax(std::move(all.children[0]));
        return all;
    }
    void add(PathSyntax& parent, PathSyntax child) {
        parent.places += child.places;
        parent.depth = std::max(parent.depth, child.depth + 1);
        check_size(parent, m_at);
        parent.children.push_back(std::move(child));
    }
    void check_size(const PathSyntax& part, size_t at) const {
        if (part.places > MostPlacesOfExpression)
            fail("fewer events: an expression has at most " + std::to_string(MostPlacesOfExpression) +
                     ", with repeated ones written out",
                 at);
        if (part.depth > MostDepth)
            fail("less nesting", at);
    }
    PathSyntax repeated() {
        PathSyntax part = atom();
        for (;;) {
            const size_t begin = m_at;
            PathSyntax repeat{.kind = PathSyntax::Kind::Repeat};
            if (take('*'))
                repeat.least = 0, repeat.endless = true;
            else if (take('+'))
                repeat.endless = true;
            else if (take('?'))
                repeat.least = 0;
            else if (take('{'))
                read_counts(repeat);
            else
                return part;
            repeat.places = part.places * repeat.most; // at most 62 * 64
            repeat.depth = part.depth + 1;
            check_size(repeat, begin);
            repeat.children.push_back(std::move(part));
            part = std::move(repeat);
        }
    }
    // {n}, {n,}, {n,m}
    void read_counts(PathSyntax& repeat) {
        repeat.least = repeat.most = number(0);
        if (take(',')) {
            repeat.endless = at('}');
            if (repeat.endless)
                repeat.most = std::max(repeat.least, 1);
            else
                repeat.most = number(repeat.least);
        }
        need('}', "ends the count that { begins");
    }
    int number(int least) {
        int n = 0;
        const size_t begin = m_at;
        const char* const from = m_text.data() + m_at;
        const auto read = std::from_chars(from, m_text.data() + m_text.size(), n);
        if (read.ec != std::errc() || n < least || n > MostRepeats)
            fail("a number from " + std::to_string(least) + " to " + std::to_string(MostRepeats), begin);
        m_at += size_t(read.ptr - from);
        return n;
    }
    PathSyntax atom() {
        const size_t begin = m_at;
        if (take('(')) {
            if (++m_parentheses > MostParentheses)
                fail("less nesting", begin);
            PathSyntax part = alternatives();
            need(')', "closes a (");
            m_parentheses--;
            return part;
        }
        PathSyntax part{.kind = PathSyntax::Kind::Events};
        part.places = 1;
        if (take('['))
            read_set(part.events);
        else
            part.events.parts.push_back(event(" or <, [, ("));
        return part;
    }
    void read_set(EventSet& events) {
        events.complement = take('^');
        while (!take(']')) {
            if (at_end())
                fail("], which closes a [", m_at);
            events.parts.push_back(event(" or <, ]"));
        }
    }
    EventSet::Part event(std::string_view more) {
        if (take('<'))
            return bracketed();
        return {of_letter(EventLetters, more), {}};
    }
    // <type scattering 'name'>, with . for any; sets in brackets.
    EventSet::Part bracketed() {
        EventSet::Part part{set_of(TypeLetters), {}};
        if (!at_end() && !at('>') && !at('\''))
            part.kinds &= set_of(ScatteringLetters, " or [, >, 'name'");
        if (at('\''))
            part.name = name();
        need('>', "closes a <");
        return part;
    }
    EventKinds set_of(std::string_view letters, std::string_view more = " or [") {
        if (!take('['))
            return of_letter(letters, more);
        const bool complement = take('^');
        EventKinds all = 0;
        while (!take(']'))
            all |= of_letter(letters, " or ]");
        return complement ? ~all & AllKinds : all;
    }
    EventKinds of_letter(std::string_view known, std::string_view more) {
        if (at_end() || known.find(m_text[m_at]) == std::string_view::npos)
            fail(listed(known, more), m_at);
        return kinds_of(m_text[m_at++]);
    }
    std::string name() {
        const size_t begin = m_at + 1, end = m_text.find('\'', begin);
        if (end == std::string_view::npos)
            fail("a name that another ' ends", m_at);
        m_at = end + 1;
        return std::string(m_text.substr(begin, end - begin));
    }

    std::string_view m_text;
    size_t m_at = 0;
    int m_parentheses = 0;
};

} // namespace

PathSyntax parse_path_expression(std::string_view text) {
    return Parser(text).parse();
}

} // namespace kanuka::transport
