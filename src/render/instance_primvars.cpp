#include "render/instance_primvars.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <utility>

#include "base/tasks.h"
#include "render/de_instance.h"
#include "render/instance_values.h"

namespace kanuka::render {

namespace {

std::string quoted(const std::vector<std::string>& names) {
    std::string all;
    for (const std::string& name : names)
        all += (all.empty() ? "\"" : ", \"") + name + "\"";
    return all;
}

} // namespace

InstancePrimvars::InstancePrimvars(const scene::Scene& scene, size_t first, shade::ShadingSystem& shading,
                                   size_t most, Journal& journal)
    : m_scene(scene), m_first(first), m_most(most), m_shading(shading), m_journal(journal) {
    find_readers();
    if (m_readers.empty())
        return;
    join_all();
    for (Family& family : m_families)
        choose(family);
}

std::span<const scene::ValueList> InstancePrimvars::variants_of(size_t group) const {
    const auto found = m_readers.find(group);
    if (found == m_readers.end() || found->second.family < 0)
        return {};
    return m_families[size_t(found->second.family)].variants;
}

const scene::Variation& InstancePrimvars::shown(const scene::Group::Instances& in) const {
    const auto found = m_shown.find(&in);
    return found == m_shown.end() ? in.variation : found->second;
}

// Whatever instances say reaches the groups in theirs whose instances say nothing. Of what is unique, the
// shapes themselves take it as it is.
void InstancePrimvars::visit(const scene::Group::Instances& in, bool in_world, std::vector<bool>& seen,
                             std::vector<size_t>& found) const {
    if (size_t(in.group) < m_first) // built before
        return;
    const size_t g = size_t(in.group) - m_first;
    const bool apart = in_world && are_unique(in);
    if (!apart) {
        if (seen[g])
            return;
        seen[g] = true;
        found.push_back(g);
    }
    for (const scene::Group::Instances& inner : m_scene.groups[g].instances)
        if (inner.variation.empty())
            visit(inner, apart, seen, found);
}

std::vector<size_t> InstancePrimvars::readers_of(const scene::Group::Instances& in, bool in_world) const {
    std::vector<bool> seen(m_scene.groups.size());
    std::vector<size_t> found;
    visit(in, in_world, seen, found);
    std::erase_if(found, [&](size_t g) { return !m_readers.contains(g); });
    return found;
}

// ---- who reads what

void InstancePrimvars::find_readers() {
    std::set<std::string> spoken;
    const auto listen = [&](const std::vector<scene::Group::Instances>& all) {
        for (const scene::Group::Instances& in : all)
            for (const scene::Value& value : in.variation.primvars.values)
                spoken.insert(value.name);
    };
    listen(m_scene.instances);
    for (const scene::Group& group : m_scene.groups)
        listen(group.instances);
    if (spoken.empty())
        return;
    const std::vector<std::string> names(spoken.begin(), spoken.end());
    // Shaders are compiled as they are asked: side by side, and once for all that share their attributes.
    std::map<const scene::Attributes*, size_t> number;
    std::vector<const scene::Primitive*> asked;
    for (const scene::Group& group : m_scene.groups)
        for (const scene::Primitive& p : group.primitives)
            if (number.try_emplace(p.attributes.get(), asked.size()).second)
                asked.push_back(&p);
    std::vector<std::vector<char>> reads(asked.size(), std::vector<char>(names.size()));
    tasks::parallel_for(asked.size(), [&](size_t k) {
        for (size_t n = 0; n < names.size(); n++)
            reads[k][n] = m_shading.surface_reads(*asked[k], names[n]);
    });
    std::vector<char> read(names.size());
    for (size_t g = 0; g < m_scene.groups.size(); g++) {
        std::vector<char> here(names.size());
        Reader reader;
        for (const scene::Primitive& p : m_scene.groups[g].primitives) {
            reader.has_variants |= p.attributes && p.attributes->variants > 1;
            const std::vector<char>& does = reads[number.at(p.attributes.get())];
            for (size_t n = 0; n < names.size(); n++)
                here[n] |= does[n] && !p.primvars.find(names[n]);
        }
        for (size_t n = 0; n < names.size(); n++)
            if (here[n])
                reader.names.push_back(names[n]), read[n] = true;
        if (!reader.names.empty() || reader.has_variants)
            m_readers.emplace(g, std::move(reader));
    }
    std::vector<std::string> unread;
    for (size_t n = 0; n < names.size(); n++)
        if (!read[n])
            unread.push_back(names[n]);
    tell_unread(unread);
}

void InstancePrimvars::tell_unread(const std::vector<std::string>& names) const {
    if (!names.empty())
        m_journal.report(Severity::Info, {m_scene.file},
                         "variables of instances that no surface shader of a group reads, or that its shapes "
                         "have themselves, change nothing: " +
                             quoted(names));
}

// ---- what is numbered together

void InstancePrimvars::join(const std::vector<size_t>& readers) {
    int& family = m_readers.at(readers[0]).family;
    if (family < 0) {
        family = int(m_families.size());
        m_families.push_back({.groups = {readers[0]}});
    }
    for (const size_t g : readers) {
        const int other = m_readers.at(g).family;
        if (other == family)
            continue;
        std::vector<size_t> joining = {g};
        if (other >= 0)
            joining = std::exchange(m_families[size_t(other)].groups, {});
        for (const size_t each : joining) {
            m_readers.at(each).family = family;
            m_families[size_t(family)].groups.push_back(each);
        }
    }
}

void InstancePrimvars::join_all() {
    const auto each_list = [&](const auto& visit_list) {
        for (const scene::Group::Instances& in : m_scene.instances)
            visit_list(in, true);
        for (const scene::Group& group : m_scene.groups)
            for (const scene::Group::Instances& in : group.instances)
                visit_list(in, false);
    };
    each_list([&](const scene::Group::Instances& in, bool in_world) {
        if (in.variation.empty())
            return;
        if (const std::vector<size_t> readers = readers_of(in, in_world); !readers.empty())
            join(readers);
    });
    each_list([&](const scene::Group::Instances& in, bool in_world) {
        if (in.variation.empty() && !in_world) // they say what is around them
            return;
        for (const size_t g : readers_of(in, in_world)) {
            const int number = m_readers.at(g).family;
            if (number < 0) // nobody says anything to it
                continue;
            Family& family = m_families[size_t(number)];
            if (in.variation.empty()) {
                family.plain = true;
                continue;
            }
            family.lists.push_back(&in);
            break; // all of them are of one family
        }
    });
}

// ---- what they are shaded with

std::vector<InstanceVariable> InstancePrimvars::variables_of(const Family& family) const {
    std::vector<InstanceVariable> variables;
    std::set<std::string> read;
    bool has_variants = false;
    for (const size_t g : family.groups) {
        read.insert(m_readers.at(g).names.begin(), m_readers.at(g).names.end());
        has_variants |= m_readers.at(g).has_variants;
    }
    for (const std::string& name : read) {
        const InstanceVariable* known = nullptr;
        for (const List list : family.lists) {
            const scene::Value* value = list->variation.primvars.find(name);
            if (!value)
                continue;
            if (!known) {
                variables.push_back({name, value->type, value->array_size, value->where});
                known = &variables.back();
            } else if (value->type != known->type || value->array_size != known->array_size) {
                m_journal.warning({m_scene.file}, "instances say the variable \"" + name +
                                                      "\" as values of two types: none of them counts");
                variables.pop_back();
                break;
            }
        }
    }
    const bool says_variant =
        std::ranges::any_of(family.lists, [](List list) { return !list->variation.variant.empty(); });
    if (!variables.empty() && has_variants && says_variant)
        variables.push_back({VariantVariable});
    return variables;
}

void InstancePrimvars::choose(Family& family) {
    std::vector<InstanceVariable> variables = variables_of(family);
    if (variables.empty())
        return;
    const InstanceValues values(family.lists, std::move(variables));
    const auto row_of = values.row_of();
    const bool plain = family.plain || std::ranges::find(row_of, -1) != row_of.end();
    const size_t room = std::max<size_t>(m_most, 1 + plain) - plain;
    std::vector<uint32_t> which, weights;
    const Rows rows = distinct_rows(values.rows(), which, weights);
    const size_t distinct = rows.count();
    const Approximation made = approximated(values, rows, weights, room);
    if (distinct > room)
        tell_approximated(family, values, distinct, made);
    if (plain)
        family.variants.emplace_back();
    for (size_t k = 0; k < made.rows.count(); k++)
        family.variants.push_back(values.values_of(made.rows[k]));
    size_t next = 0;
    for (const List list : family.lists) {
        std::vector<float> shown;
        for (size_t i = 0; i < list->count(); i++, next++)
            shown.push_back(row_of[next] < 0 ? 0 : made.number[which[size_t(row_of[next])]] + float(plain));
        scene::Variation variation = list->variation;
        variation.variant = std::move(shown);
        m_shown.emplace(list, std::move(variation));
    }
}

void InstancePrimvars::tell_approximated(const Family& family, const InstanceValues& values, size_t distinct,
                                         const Approximation& made) const {
    std::vector<std::string> names;
    for (const InstanceVariable& variable : values.variables())
        names.push_back(variable.name);
    std::string shown = made.blended ? ": instances are blended from the two next to theirs"
                                     : ": each instance shows the nearest";
    if (made.replaced > 0)
        shown = ": those of the most frequent texts and matrices. " + std::to_string(made.replaced) +
                " instances of " +
                std::to_string(std::ranges::count_if(values.row_of(), [](int32_t row) { return row >= 0; })) +
                " have others, and show the nearest of these";
    m_journal.report(
        Severity::Info, {m_scene.file},
        "instances of group \"" + m_scene.groups[family.groups[0]].name + "\" have " +
            std::to_string(distinct) + " values of " + quoted(names) + ", and its surfaces are shaded with " +
            std::to_string(made.rows.count()) + shown +
            ". The option instance_variants shades more (up to 64), and what is unique shows its own");
}

} // namespace kanuka::render
