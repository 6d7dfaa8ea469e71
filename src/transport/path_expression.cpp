#include "transport/path_expression.h"

#include <algorithm>
#include <charconv>
#include <map>

#include "base/error.h"

namespace kanuka::transport {

namespace {

constexpr int Steps = int(PathStep::Count);
constexpr size_t MostClasses = size_t(64 - Steps), MostPlaces = 64;

// Symbols: the steps, then classes of lights. Sets of them are bits.
using Symbols = uint64_t;

constexpr Symbols bit(PathStep step) {
    return Symbols(1) << int(step);
}
constexpr Symbols Reflections =
    bit(PathStep::ReflectDiffuse) | bit(PathStep::ReflectGlossy) | bit(PathStep::ReflectSingular);
constexpr Symbols Transmissions =
    bit(PathStep::TransmitDiffuse) | bit(PathStep::TransmitGlossy) | bit(PathStep::TransmitSingular);
constexpr Symbols Diffuse = bit(PathStep::ReflectDiffuse) | bit(PathStep::TransmitDiffuse);
constexpr Symbols Glossy = bit(PathStep::ReflectGlossy) | bit(PathStep::TransmitGlossy);
constexpr Symbols Singular = bit(PathStep::ReflectSingular) | bit(PathStep::TransmitSingular);
constexpr Symbols Object = Symbols(1) << Steps; // class 0
constexpr Symbols Lights = ~(Object | (Object - 1));

// Glushkov 1961, The Abstract Theory of Automata: each letter of the expression is a place, and the automaton
// is in the places that it may have read last. Bit 63 of no set is used; place 0 is before the first letter.
using Places = uint64_t;

class Parser {
  public:
    Parser(std::string_view text, std::span<const LightNames> classes) : m_text(text), m_classes(classes) {}

    struct Part {
        bool empty; // it may be
        Places first, last;
    };
    Part parse() {
        const Part all = alternatives();
        if (m_at < m_text.size())
            fail("the end, or another event");
        return all;
    }
    Places follow(int place) const { return m_follow[size_t(place)]; }
    Symbols letter(int place) const { return m_letters[size_t(place)]; }
    const std::vector<std::string>& names() const { return m_names; }

  private:
    [[noreturn]] void fail(const std::string& expected) const {
        const std::string found =
            m_at < m_text.size() ? "'" + std::string(1, m_text[m_at]) + "'" : std::string("the end");
        throw Error("\"" + std::string(m_text) + "\": at character " + std::to_string(m_at + 1) +
                        " there is " + found + ", expected " + expected,
                    ExitCode::Usage);
    }
    bool take(char c) {
        if (m_at >= m_text.size() || m_text[m_at] != c)
            return false;
        m_at++;
        return true;
    }
    void need(char c) {
        if (!take(c))
            fail(std::string("'") + c + "'");
    }

    // ---- the grammar
    Part alternatives() {
        if (++m_depth > 100)
            fail("fewer parentheses");
        Part all = sequence();
        while (take('|')) {
            const Part other = sequence();
            all = {all.empty || other.empty, all.first | other.first, all.last | other.last};
        }
        m_depth--;
        return all;
    }
    Part sequence() {
        Part all{true, 0, 0};
        while (m_at < m_text.size() && m_text[m_at] != '|' && m_text[m_at] != ')')
            all = joined(all, repeated());
        return all;
    }
    Part repeated() {
        const size_t begin = m_at;
        Part part = atom();
        for (;;) {
            if (take('*'))
                part = {true, loop(part).first, part.last};
            else if (take('+'))
                part = loop(part);
            else if (take('?'))
                part.empty = true;
            else if (take('{'))
                part = counted(begin, part);
            else
                return part;
        }
    }
    // {n}, {n,}, {n,m}: what stands from `begin` to the brace is read again as often.
    Part counted(size_t begin, const Part& once) {
        const size_t brace = m_at - 1;
        const int least = number();
        int most = least;
        bool endless = false;
        if (take(',')) {
            endless = m_at < m_text.size() && m_text[m_at] == '}';
            most = endless ? least : number();
        }
        need('}');
        const size_t end = m_at;
        if (most < least || most > int(MostPlaces) || ++m_counts > 256)
            fail("at least as many times as before, and at most 64");
        Part all{true, 0, 0};
        for (int k = 0; k < std::max(most, endless ? 1 : 0); k++) {
            Part one = once;
            if (k > 0) {
                const std::string_view whole = m_text;
                m_text = whole.substr(0, brace);
                m_at = begin;
                one = repeated();
                m_text = whole;
            }
            if (endless && k == std::max(least, 1) - 1)
                one = loop(one);
            if (k >= least)
                one.empty = true;
            all = joined(all, one);
        }
        m_at = end;
        return all;
    }
    int number() {
        int n = 0;
        const char* begin = m_text.data() + m_at;
        const auto read = std::from_chars(begin, m_text.data() + m_text.size(), n);
        if (read.ec != std::errc() || n < 0)
            fail("a number");
        m_at += size_t(read.ptr - begin);
        return n;
    }
    Part atom() {
        if (take('(')) {
            const Part part = alternatives();
            need(')');
            return part;
        }
        if (m_letters.size() >= MostPlaces - 1)
            fail("the end: an expression has at most 62 events");
        const Places here = Places(1) << m_letters.size();
        const Symbols letter = take('[') ? any_of() : event();
        m_letters.push_back(letter);
        m_follow.push_back(0);
        return {false, here, here};
    }
    Symbols any_of() {
        const bool but = take('^');
        Symbols all = 0;
        while (!take(']'))
            all |= event();
        return but ? ~all : all;
    }
    Symbols event() {
        if (take('<'))
            return bracketed();
        return of_letter("CRTDGSVLO.");
    }
    // <type scattering 'name'>, with . for any; sets in brackets.
    Symbols bracketed() {
        Symbols all = set_of("CRTVLO.");
        if (m_at < m_text.size() && m_text[m_at] != '>' && m_text[m_at] != '\'')
            all &= set_of("DGS.");
        if (take('\''))
            all &= named();
        need('>');
        return all;
    }
    Symbols set_of(const char* letters) {
        if (!take('['))
            return of_letter(letters);
        const bool but = take('^');
        Symbols all = 0;
        while (!take(']'))
            all |= of_letter(letters);
        return but ? ~all : all;
    }
    Symbols of_letter(std::string_view known) {
        const char c = m_at < m_text.size() ? m_text[m_at] : '\0';
        if (c == '\0' || known.find(c) == std::string_view::npos)
            fail("one of " + std::string(known));
        m_at++;
        switch (c) {
        case 'C':
            return bit(PathStep::Camera);
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
            return bit(PathStep::Volume);
        case 'L':
            return Lights;
        case 'O':
            return Object;
        default:
            return ~Symbols(0);
        }
    }
    Symbols named() {
        const size_t end = m_text.find('\'', m_at);
        if (end == std::string_view::npos)
            fail("a name that ends with '");
        const std::string name(m_text.substr(m_at, end - m_at));
        m_at = end + 1;
        m_names.push_back(name);
        Symbols all = 0;
        for (size_t c = 0; c < m_classes.size(); c++)
            if (std::ranges::find(m_classes[c], name) != m_classes[c].end())
                all |= Symbols(1) << (size_t(Steps) + c);
        return all;
    }

    // ---- places
    Part joined(const Part& a, const Part& b) {
        link(a.last, b.first);
        return {a.empty && b.empty, a.empty ? a.first | b.first : a.first,
                b.empty ? a.last | b.last : b.last};
    }
    Part loop(const Part& a) {
        link(a.last, a.first);
        return a;
    }
    void link(Places from, Places to) {
        for (size_t k = 0; k < m_follow.size(); k++)
            if (from >> k & 1)
                m_follow[k] |= to;
    }

    std::string_view m_text;
    size_t m_at = 0;
    int m_depth = 0, m_counts = 0;
    std::span<const LightNames> m_classes;
    std::vector<std::string> m_names;
    std::vector<Symbols> m_letters{0}; // by place
    std::vector<Places> m_follow{0};
};

// States of the automaton are sets of places.
class Builder {
  public:
    Builder(Parser& parser, size_t classes) : m_parser(parser), m_classes(classes) {
        const Parser::Part all = parser.parse();
        m_last = all.last;
        m_first = all.first;
    }
    PathAutomaton build() {
        const Places camera = among(m_first, bit(PathStep::Camera));
        state_of(camera);
        for (size_t k = 0; k < m_sets.size(); k++) { // grows meanwhile
            const Places next = followers(m_sets[k]);
            for (int step = 1; step < Steps; step++) {
                const uint8_t to = state_of(among(next, Symbols(1) << step));
                m_automaton.states[k].next[size_t(step)] = to;
            }
            for (size_t c = 0; c < m_classes; c++)
                if (among(next, Symbols(1) << (size_t(Steps) + c)) & m_last)
                    m_automaton.states[k].accepts |= uint64_t(1) << c;
        }
        bury_dead();
        return std::move(m_automaton);
    }

  private:
    Places followers(Places of) const {
        Places all = 0;
        for (int k = 0; k < int(MostPlaces); k++)
            if (of >> k & 1)
                all |= m_parser.follow(k);
        return all;
    }
    Places among(Places places, Symbols symbol) const {
        Places all = 0;
        for (int k = 0; k < int(MostPlaces); k++)
            if (places >> k & 1 && m_parser.letter(k) & symbol)
                all |= Places(1) << k;
        return all;
    }
    uint8_t state_of(Places places) {
        if (places == 0 && !m_sets.empty())
            return PathAutomaton::Dead;
        const auto [at, added] = m_numbers.try_emplace(places, uint8_t(m_sets.size()));
        if (added) {
            if (m_sets.size() >= PathAutomaton::MostStates)
                throw Error("the expression is too complicated: it takes more than 64 states",
                            ExitCode::Usage);
            m_sets.push_back(places);
            PathAutomaton::State state{{}, 0};
            state.next.fill(PathAutomaton::Dead);
            m_automaton.states.push_back(state);
        }
        return at->second;
    }
    // What leads to no light takes no room in paths.
    void bury_dead() {
        std::vector<PathAutomaton::State>& states = m_automaton.states;
        std::vector<bool> alive(states.size());
        for (bool more = true; more;) {
            more = false;
            for (size_t k = 0; k < states.size(); k++) {
                if (alive[k])
                    continue;
                alive[k] = states[k].accepts != 0;
                for (const uint8_t to : states[k].next)
                    alive[k] = alive[k] || (to != PathAutomaton::Dead && alive[to]);
                more |= bool(alive[k]);
            }
        }
        std::vector<uint8_t> number(states.size(), PathAutomaton::Dead);
        std::vector<PathAutomaton::State> kept;
        for (size_t k = 0; k < states.size(); k++)
            if (alive[k] || k == 0) {
                number[k] = uint8_t(kept.size());
                kept.push_back(states[k]);
            }
        for (PathAutomaton::State& state : kept)
            for (uint8_t& to : state.next)
                to = to != PathAutomaton::Dead ? number[to] : to;
        states = std::move(kept);
    }

    Parser& m_parser;
    size_t m_classes;
    Places m_first, m_last;
    std::vector<Places> m_sets;
    std::map<Places, uint8_t> m_numbers;
    PathAutomaton m_automaton;
};

} // namespace

PathAutomaton compile_path_expression(std::string_view text, std::span<const LightNames> classes) {
    if (classes.size() > MostClasses)
        throw Error("the expressions tell more than 56 sets of lights apart", ExitCode::Usage);
    Parser parser(text, classes);
    return Builder(parser, classes.size()).build();
}

std::vector<std::string> names_in_path_expression(std::string_view text) {
    Parser parser(text, {});
    parser.parse();
    return parser.names();
}

} // namespace kanuka::transport
