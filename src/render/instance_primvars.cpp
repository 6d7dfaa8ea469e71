#include "render/instance_primvars.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <utility>

#include "base/tasks.h"
#include "render/de_instance.h"
#include "render/value_clusters.h"

namespace kanuka::render {

namespace {

constexpr const char* Variant = "variant";

// What instance `i` says of a variable; empty = nothing.
std::span<const float> said(const scene::Variation& variation, const std::string& name, size_t i) {
    if (name == Variant) {
        const auto& v = variation.variant;
        return v.empty() ? std::span<const float>() : std::span(v.data() + (v.size() == 1 ? 0 : i), 1);
    }
    const scene::Value* value = variation.primvars.find(name);
    if (!value)
        return {};
    const size_t width = size_t(scene::components(value->type)) * size_t(value->array_size);
    return {value->floats.data() + (value->floats.size() == width ? 0 : i * width), width};
}

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

std::vector<InstancePrimvars::Variable> InstancePrimvars::variables_of(const Family& family) const {
    std::vector<Variable> variables;
    std::set<std::string> read;
    bool has_variants = false;
    for (const size_t g : family.groups) {
        read.insert(m_readers.at(g).names.begin(), m_readers.at(g).names.end());
        has_variants |= m_readers.at(g).has_variants;
    }
    for (const std::string& name : read) {
        const Variable* known = nullptr;
        for (const List list : family.lists) {
            const scene::Value* value = list->variation.primvars.find(name);
            if (!value)
                continue;
            if (!known) {
                variables.push_back({name, value->type, value->array_size});
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
        variables.push_back({Variant});
    return variables;
}

namespace {

// A row has the values of all variables, and behind them which of these an instance says.
struct Table {
    Rows rows;
    std::vector<int32_t> row_of; // each instance's, of all lists; -1 = it says none
};

scene::ValueList values_of(std::span<const float> row, const auto& variables) {
    scene::ValueList list;
    size_t at = 0, flag = row.size() - variables.size();
    for (const auto& variable : variables) {
        if (row[flag++] > 0.5f) {
            scene::Value value{.name = variable.name,
                               .type = variable.type,
                               .detail = scene::Detail::Constant,
                               .array_size = variable.array_size};
            value.floats = std::vector<float>(row.begin() + ptrdiff_t(at),
                                              row.begin() + ptrdiff_t(at + variable.width()));
            list.set(std::move(value));
        }
        at += variable.width();
    }
    return list;
}

Table table_of(const auto& lists, const auto& variables) {
    Table table;
    table.rows.width = variables.size();
    for (const auto& variable : variables)
        table.rows.width += variable.width();
    std::vector<float> row(table.rows.width);
    for (const scene::Group::Instances* list : lists)
        for (size_t i = 0; i < list->count(); i++) {
            std::ranges::fill(row, 0.0f);
            size_t at = 0, flag = row.size() - variables.size();
            bool any = false;
            for (const auto& variable : variables) {
                if (const auto values = said(list->variation, variable.name, i); !values.empty()) {
                    for (size_t c = 0; c < values.size(); c++)
                        row[at + c] = values[c] + 0.0f; // one zero
                    row[flag] = 1, any = true;
                }
                at += variable.width(), flag++;
            }
            table.row_of.push_back(any ? int32_t(table.rows.count()) : -1);
            if (any)
                table.rows.values.insert(table.rows.values.end(), row.begin(), row.end());
        }
    return table;
}

// Numbers of a variable are measured by the widest range of its components; and what some do not say is
// farther off than any.
std::vector<float> scales_of(const Rows& rows, const auto& variables) {
    std::vector<float> scales;
    for (const auto& variable : variables) {
        const size_t first = scales.size();
        float range = 0;
        for (size_t c = first; c < first + variable.width(); c++) {
            float lo = INFINITY, hi = -INFINITY;
            for (size_t i = 0; i < rows.count(); i++)
                lo = std::min(lo, rows[i][c]), hi = std::max(hi, rows[i][c]);
            range = std::max(range, hi - lo);
        }
        scales.insert(scales.end(), variable.width(), range > 0 ? range : 1);
    }
    scales.resize(rows.width, 1e-3f);
    return scales;
}

} // namespace

void InstancePrimvars::choose(Family& family) {
    const std::vector<Variable> variables = variables_of(family);
    if (variables.empty())
        return;
    const Table table = table_of(family.lists, variables);
    const bool plain = family.plain || std::ranges::find(table.row_of, -1) != table.row_of.end();
    const size_t room = std::max<size_t>(m_most, 1 + plain) - plain;
    std::vector<uint32_t> which, weights;
    Rows made = distinct_rows(table.rows, which, weights);
    const size_t distinct = made.count();
    const bool blended = distinct > room && variables.size() == 1 && variables[0].width() == 1 && room > 1;
    std::vector<float> number(distinct); // of each that differs, among the variants
    std::iota(number.begin(), number.end(), 0.0f);
    if (blended) {
        const float lo = made[0][0], hi = made[distinct - 1][0], last = float(room - 1);
        for (size_t i = 0; i < distinct; i++)
            number[i] = (made[i][0] - lo) / (hi - lo) * last;
        Rows even{made.width, {}};
        for (size_t k = 0; k < room; k++) {
            const float x = float(k) / last;
            even.values.insert(even.values.end(), {(1 - x) * lo + x * hi, 1.0f});
        }
        made = std::move(even);
    } else if (distinct > room) {
        std::vector<uint32_t> nearest;
        made = cluster(made, weights, scales_of(made, variables), room, nearest);
        std::ranges::copy(nearest, number.begin());
    }
    if (distinct > room)
        tell_approximated(family, variables, distinct, made.count(), blended);
    if (plain)
        family.variants.emplace_back();
    for (size_t k = 0; k < made.count(); k++)
        family.variants.push_back(values_of(made[k], variables));
    size_t next = 0;
    for (const List list : family.lists) {
        std::vector<float> shown;
        for (size_t i = 0; i < list->count(); i++, next++) {
            const int32_t row = table.row_of[next];
            shown.push_back(row < 0 ? 0 : number[which[size_t(row)]] + float(plain));
        }
        scene::Variation variation = list->variation;
        variation.variant = std::move(shown);
        m_shown.emplace(list, std::move(variation));
    }
}

void InstancePrimvars::tell_approximated(const Family& family, const std::vector<Variable>& variables,
                                         size_t distinct, size_t count, bool blended) const {
    std::vector<std::string> names;
    for (const Variable& variable : variables)
        names.push_back(variable.name);
    m_journal.report(
        Severity::Info, {m_scene.file},
        "instances of group \"" + m_scene.groups[family.groups[0]].name + "\" have " +
            std::to_string(distinct) + " values of " + quoted(names) + ", and its surfaces are shaded with " +
            std::to_string(count) +
            (blended ? ": instances are blended from the two next to theirs"
                     : ": each instance shows the nearest") +
            ". The option instance_variants shades more (up to 64), and what is unique shows its own");
}

} // namespace kanuka::render
