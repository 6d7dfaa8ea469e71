#include "render/world_askers.h"

#include <algorithm>

namespace kanuka::render {

void WorldAskers::note(size_t group, const Location& where, bool asks, uint64_t vertices, uint64_t bytes) {
    Noted& noted = m_groups[group];
    noted.vertices += vertices, noted.bytes += bytes, noted.primitives++;
    if (asks)
        noted.asks.push_back(where);
}

// All lists between the world and a group whose instances stand still: what is in a moving one moves.
std::set<WorldAskers::List> WorldAskers::on_the_way_to(size_t group) const {
    std::vector<bool> holds(m_groups.size());
    holds[group] = true;
    std::set<List> lists;
    const auto look_at = [&](const std::vector<scene::Group::Instances>& all) {
        bool any = false;
        for (const scene::Group::Instances& in : all)
            if (!in.moves() && size_t(in.group) >= m_first && holds[size_t(in.group) - m_first]) {
                lists.insert(&in);
                any = true;
            }
        return any;
    };
    for (size_t g = group + 1; g < m_groups.size(); g++) // groups come after those that they hold
        if (look_at(m_scene.groups[g].instances))
            holds[g] = true;
    look_at(m_scene.instances);
    return lists;
}

void WorldAskers::add_cost(const std::vector<scene::Group::Instances>& all, uint64_t times,
                           const std::set<List>& apart, Cost& cost) const {
    for (const scene::Group::Instances& in : all) {
        const bool chosen = apart.contains(&in);
        if (in.moves() || size_t(in.group) < m_first || !(chosen || in.unique))
            continue;
        const size_t g = size_t(in.group) - m_first;
        // Beyond what any scene has there are no more, for the sums to stay numbers.
        const uint64_t here = std::min<uint64_t>(times * std::min<uint64_t>(in.count(), 1u << 31), 1u << 31);
        if (chosen && !in.unique) {
            cost.places += here;
            cost.vertices += here * m_groups[g].vertices;
            cost.bytes += here * m_groups[g].bytes;
            cost.primitives += here * m_groups[g].primitives;
        }
        add_cost(m_scene.groups[g].instances, here, apart, cost);
    }
}

WorldAskers::Cost WorldAskers::cost_of(const std::set<List>& apart) const {
    Cost cost;
    add_cost(m_scene.instances, 1, apart, cost);
    return cost;
}

void WorldAskers::choose(const std::function<bool(size_t)>& seen_in_many, Journal& journal) {
    struct Asking {
        size_t group;
        std::set<List> lists;
        Cost cost;
    };
    std::vector<Asking> all;
    for (size_t g = 0; g < m_groups.size(); g++)
        if (!m_groups[g].asks.empty()) {
            const std::set<List> lists = on_the_way_to(g);
            all.push_back({g, lists, cost_of(lists)});
        }
    std::ranges::stable_sort(all, {}, [](const Asking& a) { return a.cost.vertices; });
    uint64_t made = 0;
    for (const Asking& each : all) {
        std::set<List> together = m_apart;
        together.insert(each.lists.begin(), each.lists.end());
        const Cost cost = cost_of(together);
        if (each.cost.places > 0 && cost.vertices <= m_most) {
            tell_apart(each.group, each.cost, journal);
            m_apart = std::move(together);
            made = cost.primitives;
        } else if (seen_in_many(each.group)) {
            tell_alike(each.group, each.cost, journal);
        }
    }
    m_primitives = made;
}

namespace {

std::string size_in_words(uint64_t vertices, uint64_t bytes) {
    return std::to_string(vertices) + " vertices, " + std::to_string((bytes >> 20) + 1) + " MB at most";
}

} // namespace

void WorldAskers::tell_apart(size_t group, const Cost& cost, Journal& journal) const {
    for (const Location& where : m_groups[group].asks)
        journal.report(
            Severity::Info, where,
            "its shader asks where in the world it is: its instances are shaded where they stand, as "
            "things of their own (" +
                std::to_string(cost.places) + " with what they lie in; " +
                size_in_words(cost.vertices, cost.bytes) + "). The option unique_up_to, 0, keeps them alike");
}

void WorldAskers::tell_alike(size_t group, const Cost& cost, Journal& journal) const {
    const std::string why = cost.vertices > m_most && m_most > 0
                                ? ". They would be " + size_in_words(cost.vertices, cost.bytes) +
                                      ", more than the option unique_up_to has by itself (" +
                                      std::to_string(m_most) + " in all)"
                                : "";
    for (const Location& where : m_groups[group].asks)
        journal.report(
            Severity::Info, where,
            "its shader asks where in the world it is, and its instances share one shading: they look "
            "alike. Attribute \"instance\" \"int unique\" [1], or add_instances(unique=True), shades "
            "each where it stands" +
                why);
}

} // namespace kanuka::render
