#include "transport/path_expression.h"

#include <algorithm>
#include <map>

#include "base/error.h"
#include "transport/path_expression_syntax.h"

namespace kanuka::transport {

namespace {

constexpr int Steps = int(PathStep::Count);
constexpr size_t MostClasses = size_t(64 - Steps);

// Symbols: the steps, then classes of lights. Sets of them are bits.
using Symbols = uint64_t;

constexpr Symbols StepSymbols = (Symbols(1) << Steps) - 1, Object = Symbols(1) << Steps, // class 0
    Lights = ~(Object | StepSymbols);
static_assert(kind_of(PathStep::Camera) == 1 && ObjectKind == Object); // kinds are symbols, but for lights

Symbols symbols_of(const EventSet::Part& part, std::span<const LightNames> classes) {
    const Symbols of_kinds =
        (part.kinds & (ObjectKind | (ObjectKind - 1))) | (part.kinds & LightKind ? Lights : 0);
    if (!part.name)
        return of_kinds;
    Symbols named = 0;
    for (size_t c = 0; c < classes.size(); c++)
        if (std::ranges::find(classes[c], *part.name) != classes[c].end())
            named |= Symbols(1) << (size_t(Steps) + c);
    return of_kinds & named;
}

Symbols symbols_of(const EventSet& events, std::span<const LightNames> classes) {
    Symbols all = 0;
    for (const EventSet::Part& part : events.parts)
        all |= symbols_of(part, classes);
    return events.complement ? ~all : all;
}

// Glushkov 1961, The Abstract Theory of Automata: each letter of the expression is a place, and the automaton
// is in the places that it may have read last. Bit 63 of no set is used; place 0 is before the first letter.
using Places = uint64_t;
constexpr int MostPlaces = 64;
static_assert(MostPlacesOfExpression < MostPlaces - 1);

class Positions {
  public:
    struct Part {
        bool empty; // it may be
        Places first, last;
    };
    Positions(const PathSyntax& syntax, std::span<const LightNames> classes)
        : m_classes(classes), m_all(part_of(syntax)) {}

    const Part& all() const { return m_all; }
    int count() const { return int(m_follow.size()); }
    Places follow(int place) const { return m_follow[size_t(place)]; }
    Symbols letter(int place) const { return m_letters[size_t(place)]; }

  private:
    Part part_of(const PathSyntax& syntax) {
        if (syntax.places == 0) // nothing, however often
            return {true, 0, 0};
        switch (syntax.kind) {
        case PathSyntax::Kind::Events: {
            const Places here = Places(1) << m_letters.size();
            m_letters.push_back(symbols_of(syntax.events, m_classes));
            m_follow.push_back(0);
            return {false, here, here};
        }
        case PathSyntax::Kind::Choice: {
            Part all{false, 0, 0};
            for (const PathSyntax& child : syntax.children) {
                const Part other = part_of(child);
                all = {all.empty || other.empty, all.first | other.first, all.last | other.last};
            }
            return all;
        }
        case PathSyntax::Kind::Repeat:
            return repeated(syntax);
        default: {
            Part all{true, 0, 0};
            for (const PathSyntax& child : syntax.children)
                all = joined(all, part_of(child));
            return all;
        }
        }
    }
    // Each time has places of its own.
    Part repeated(const PathSyntax& repeat) {
        Part all{true, 0, 0};
        for (int k = 0; k < repeat.most; k++) {
            Part one = part_of(repeat.children[0]);
            if (repeat.endless && k == repeat.most - 1)
                link(one.last, one.first);
            if (k >= repeat.least)
                one.empty = true;
            all = joined(all, one);
        }
        return all;
    }
    Part joined(const Part& a, const Part& b) {
        link(a.last, b.first);
        return {a.empty && b.empty, a.empty ? a.first | b.first : a.first,
                b.empty ? a.last | b.last : b.last};
    }
    void link(Places from, Places to) {
        for (size_t k = 0; k < m_follow.size(); k++)
            if (from >> k & 1)
                m_follow[k] |= to;
    }

    std::span<const LightNames> m_classes;
    std::vector<Symbols> m_letters{0}; // by place
    std::vector<Places> m_follow{0};
    Part m_all; // made last: it fills those above
};

// States of the automaton are sets of places.
class Builder {
  public:
    Builder(const Positions& positions, size_t classes) : m_positions(positions), m_classes(classes) {}
    PathAutomaton build() {
        const Places camera = among(m_positions.all().first, Symbols(kind_of(PathStep::Camera)));
        state_of(camera);
        for (size_t k = 0; k < m_sets.size(); k++) { // grows meanwhile
            const Places next = followers(m_sets[k]);
            for (int step = 1; step < Steps; step++) {
                const uint8_t to = state_of(among(next, Symbols(1) << step));
                m_automaton.states[k].next[size_t(step)] = to;
            }
            for (size_t c = 0; c < m_classes; c++)
                if (among(next, Symbols(1) << (size_t(Steps) + c)) & m_positions.all().last)
                    m_automaton.states[k].accepts |= uint64_t(1) << c;
        }
        bury_dead();
        return std::move(m_automaton);
    }

  private:
    Places followers(Places of) const {
        Places all = 0;
        for (int k = 0; k < m_positions.count(); k++)
            if (of >> k & 1)
                all |= m_positions.follow(k);
        return all;
    }
    Places among(Places places, Symbols symbol) const {
        Places all = 0;
        for (int k = 0; k < m_positions.count(); k++)
            if (places >> k & 1 && m_positions.letter(k) & symbol)
                all |= Places(1) << k;
        return all;
    }
    uint8_t state_of(Places places) {
        if (places == 0 && !m_sets.empty())
            return PathAutomaton::Dead;
        const auto [at, added] = m_numbers.try_emplace(places, uint8_t(m_sets.size()));
        if (added) {
            if (m_sets.size() >= PathAutomaton::MostStates)
                throw Error("it is too complicated: it takes more than 64 states", ExitCode::Usage);
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

    const Positions& m_positions;
    size_t m_classes;
    std::vector<Places> m_sets;
    std::map<Places, uint8_t> m_numbers;
    PathAutomaton m_automaton;
};

} // namespace

PathAutomaton compile_path_expression(std::string_view text, std::span<const LightNames> classes) {
    if (classes.size() > MostClasses)
        throw Error("the expressions tell more than 56 sets of lights apart", ExitCode::Usage);
    const Positions positions(parse_path_expression(text), classes);
    return Builder(positions, classes.size()).build();
}

static void gather_names(const PathSyntax& syntax, std::vector<std::string>& names) {
    for (const EventSet::Part& part : syntax.events.parts)
        if (part.name)
            names.push_back(*part.name);
    for (const PathSyntax& child : syntax.children)
        gather_names(child, names);
}

std::vector<std::string> names_in_path_expression(std::string_view text) {
    std::vector<std::string> names;
    gather_names(parse_path_expression(text), names);
    return names;
}

} // namespace kanuka::transport
